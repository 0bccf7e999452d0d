"use strict";
// Draws the charts of the page from the JSON beside them. Text enters by textContent alone, so names stay names.
(() => {
  const NS = "http://www.w3.org/2000/svg";
  const W = 920, LEFT = 78, RIGHT = 10, TOP = 10, FOOT = 44, GAP = 16;
  const PLOT = W - LEFT - RIGHT;
  const all = [];

  function make(parent, tag, attributes, text) {
    const e = document.createElementNS(NS, tag);
    for (const k in attributes) e.setAttribute(k, attributes[k]);
    if (text !== undefined) e.textContent = text;
    parent.append(e);
    return e;
  }

  // Numbers travel as whole steps from one to the next.
  function decode(c) {
    const out = new Float64Array(c.d.length);
    let k = 0;
    c.d.forEach((d, i) => { k += d; out[i] = c.from + c.step * k; });
    return out;
  }

  function ticks(low, high, wanted) {
    const raw = (high - low) / wanted, size = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].find(m => m * size >= raw) * size;
    const out = [];
    for (let k = Math.ceil(low / step); k * step <= high * (1 + 1e-12) + 1e-300; k++) out.push(k * step);
    if (out.length < 3 && wanted < 20) return ticks(low, high, 1.6 * wanted);
    return { at: out, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
  }

  function label(v, digits) {
    if (v === 0) return "0";
    return Math.abs(v) >= 1e5 || digits > 5 ? v.toExponential(1) : v.toFixed(digits);
  }

  // Tenths, ones, tens and what lies between, on a logarithmic axis; two and five only where there is room.
  function logTicks(low, high) {
    const at = [], between = high - low < 3 ? [1, 2, 5] : [1], powers = low < -3 || high > 3;
    for (let k = Math.floor(low); k <= high; k++) {
      for (const m of between) {
        const v = k + Math.log10(m);
        if (v >= low - 1e-9 && v <= high + 1e-9) at.push({ at: v, text: powers ? (m === 1 ? "" : m + "·") + "10" + superscript(k) : String(Number((m * 10 ** k).toPrecision(1))) });
      }
    }
    const every = Math.ceil(at.length / 9);
    return at.filter((_, i) => i % every === 0);
  }

  const superscript = n => [...String(n)].map(c => c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]).join("");

  // First index whose x is not below the value.
  function lower(x, value) {
    let a = 0, b = x.length;
    while (a < b) { const m = (a + b) >> 1; if (x[m] < value) a = m + 1; else b = m; }
    return a;
  }

  function visible(s, [low, high]) {
    if (s.mode === "dots") return [0, s.x.length];
    return [Math.max(0, lower(s.x, low) - 1), Math.min(s.x.length, lower(s.x, high) + 1)];
  }

  function heights(panel, range) {
    let low = Infinity, high = -Infinity;
    for (const s of panel.series) {
      const [a, b] = visible(s, range);
      for (let i = a; i < b; i++) {
        if (s.x[i] < range[0] || s.x[i] > range[1]) continue;
        if (s.y[i] < low) low = s.y[i];
        if (s.y[i] > high) high = s.y[i];
      }
    }
    if (low > high) return [-1, 1];
    const width = high - low || Math.abs(high) || 1;
    return [low - 0.06 * width, high + 0.06 * width];
  }

  // A line keeps first, lowest, highest and last point of every half pixel.
  function linePath(s, range, px, py) {
    const [a, b] = visible(s, range);
    let d = "", i = a;
    while (i < b) {
      const column = Math.floor(2 * px(s.x[i]));
      let j = i, low = i, high = i;
      while (j < b && Math.floor(2 * px(s.x[j])) === column) {
        if (s.y[j] < s.y[low]) low = j;
        if (s.y[j] > s.y[high]) high = j;
        j++;
      }
      const keep = [...new Set([i, Math.min(low, high), Math.max(low, high), j - 1])];
      for (const k of keep) d += (d ? "L" : "M") + px(s.x[k]).toFixed(1) + " " + py(s.y[k]).toFixed(1);
      i = j;
    }
    return d;
  }

  function dotPath(s, [low, high], px, py) {
    let d = "";
    for (let i = 0; i < s.x.length; i++) {
      if (s.x[i] >= low && s.x[i] <= high) d += "M" + px(s.x[i]).toFixed(1) + " " + py(s.y[i]).toFixed(1) + "h0";
    }
    return d;
  }

  function drawPanel(chart, panel, top, last, id) {
    const { svg, range } = chart, bottom = top + panel.height;
    const [low, high] = panel.shown = heights(panel, range);
    const px = x => LEFT + (x - range[0]) / (range[1] - range[0]) * PLOT;
    const py = y => bottom - (y - low) / (high - low) * panel.height;
    panel.top = top;
    for (const span of panel.spans) {
      const a = Math.max(px(span.from), LEFT), b = Math.min(px(span.to), LEFT + PLOT);
      if (b <= a) continue;
      if (span.shaded) make(svg, "rect", { class: "band", x: a, y: top, width: b - a, height: panel.height });
      if (a > LEFT) make(svg, "path", { class: "edge", d: `M${a} ${top}v${panel.height}` });
      if (b > a + 60 && top === TOP) make(svg, "text", { class: "note", x: a + 6, y: top + 15 }, span.label);
    }
    const marked = (low, high, log, wanted) => {
      if (log) return logTicks(low, high);
      const t = ticks(low, high, wanted);
      return t.at.map(v => ({ at: v, text: label(v, t.digits) }));
    };
    for (const t of marked(low, high, panel.log, panel.height / 45)) {
      make(svg, "path", { class: "grid", d: `M${LEFT} ${py(t.at)}h${PLOT}` });
      make(svg, "text", { class: "tick", x: LEFT - 6, y: py(t.at) + 4, "text-anchor": "end" }, t.text);
    }
    for (const t of marked(range[0], range[1], chart.spec.x_log, 8)) {
      make(svg, "path", { class: "grid", d: `M${px(t.at)} ${top}v${panel.height}` });
      if (last) make(svg, "text", { class: "tick", x: px(t.at), y: bottom + 17, "text-anchor": "middle" }, t.text);
    }
    make(svg, "text", { class: "axis", transform: `translate(16 ${top + panel.height / 2}) rotate(-90)`, "text-anchor": "middle" }, panel.y_label);
    const clip = make(svg, "clipPath", { id });
    make(clip, "rect", { x: LEFT, y: top, width: PLOT, height: panel.height });
    const inside = make(svg, "g", { "clip-path": `url(#${id})` });
    for (const s of panel.series) {
      if (s.mode !== "dots") make(inside, "path", { class: "line " + s.class, d: linePath(s, range, px, py) });
      if (s.mode !== "line") make(inside, "path", { class: "dots " + s.class, d: dotPath(s, range, px, py) });
    }
    for (const m of panel.marks) {
      make(inside, "path", { class: "mark", d: `M${px(m.x)} ${top}v${panel.height}` });
      const right = px(m.x) > LEFT + PLOT - 60;
      make(inside, "text", { class: "note", x: px(m.x) + (right ? -5 : 5), y: top + 15, "text-anchor": right ? "end" : "start" }, m.label);
    }
    make(svg, "rect", { class: "frame", x: LEFT, y: top, width: PLOT, height: panel.height });
  }

  function draw(chart) {
    const { svg, spec } = chart;
    svg.replaceChildren();
    let top = TOP;
    spec.panels.forEach((panel, k) => {
      drawPanel(chart, panel, top, k === spec.panels.length - 1, `${chart.id}-clip-${k}`);
      top += panel.height + GAP;
    });
    make(svg, "text", { class: "axis", x: LEFT + PLOT / 2, y: top - GAP + 37, "text-anchor": "middle" }, spec.x_label);
    chart.cursor = make(svg, "path", { class: "cursor" });
    chart.brush = make(svg, "rect", { class: "brush", y: TOP, height: top - GAP - TOP, width: 0, x: 0 });
  }

  // Charts of one link are zoomed together.
  function zoom(chart, low, high) {
    const [a, b] = chart.full, width = Math.max(high - low, 1e-5 * (b - a));
    low = Math.max(a, Math.min(low, b - width));
    for (const c of all) {
      if (c === chart || (chart.spec.link && c.spec.link === chart.spec.link)) {
        c.range = [low, Math.min(b, low + width)];
        draw(c);
      }
    }
  }

  function scale(chart, factor) {
    const [a, b] = chart.range, half = (b - a) / 2 * factor;
    zoom(chart, (a + b) / 2 - half, (a + b) / 2 + half);
  }

  function shift(chart, share) {
    const [a, b] = chart.range, by = share * (b - a);
    zoom(chart, a + by, b + by);
  }

  const reset = chart => zoom(chart, ...chart.full);
  const significant = v => Number(v.toPrecision(4)).toString();

  function readOut(chart, x) {
    const words = [];
    let at = null;
    for (const panel of chart.spec.panels) {
      for (const s of panel.series) {
        if (s.mode === "dots" || !s.x.length || x < s.x[0] || x > s.x[s.x.length - 1]) continue;
        let i = Math.min(lower(s.x, x), s.x.length - 1);
        if (i > 0 && x - s.x[i - 1] < s.x[i] - x) i--;
        at = s.x[i];
        words.push(`${s.name} ${significant(panel.log ? 10 ** s.y[i] : s.y[i])}`);
      }
    }
    chart.output.textContent = at === null ? "" : `${chart.spec.x_label}: ${significant(chart.spec.x_log ? 10 ** at : at)}; ${words.join(", ")}`;
  }

  function listen(chart) {
    const { svg } = chart;
    let from = null;
    const xOf = event => {
      const box = svg.getBoundingClientRect();
      const share = ((event.clientX - box.left) / box.width * W - LEFT) / PLOT;
      return chart.range[0] + Math.max(0, Math.min(1, share)) * (chart.range[1] - chart.range[0]);
    };
    const px = x => LEFT + (x - chart.range[0]) / (chart.range[1] - chart.range[0]) * PLOT;
    svg.addEventListener("pointerdown", e => { from = xOf(e); svg.setPointerCapture(e.pointerId); });
    svg.addEventListener("pointermove", e => {
      const x = xOf(e);
      readOut(chart, x);
      chart.cursor.setAttribute("d", `M${px(x)} ${TOP}v${chart.height - TOP - FOOT}`);
      if (from === null) return;
      chart.brush.setAttribute("x", Math.min(px(from), px(x)));
      chart.brush.setAttribute("width", Math.abs(px(from) - px(x)));
    });
    svg.addEventListener("pointerup", e => {
      const x = xOf(e), start = from;
      from = null;
      if (start !== null && Math.abs(px(start) - px(x)) > 6) zoom(chart, Math.min(start, x), Math.max(start, x));
    });
    svg.addEventListener("pointercancel", () => { from = null; draw(chart); });
    svg.addEventListener("dblclick", () => reset(chart));
    svg.addEventListener("keydown", e => {
      const keys = { "+": () => scale(chart, 0.5), "-": () => scale(chart, 2), "0": () => reset(chart), ArrowLeft: () => shift(chart, -0.2), ArrowRight: () => shift(chart, 0.2) };
      if (keys[e.key] && !e.ctrlKey && !e.metaKey && !e.altKey) { keys[e.key](); e.preventDefault(); }
    });
    for (const [text, name, act] of [["+", "Zoom in", () => scale(chart, 0.5)], ["−", "Zoom out", () => scale(chart, 2)], ["Reset", "Show all", () => reset(chart)]]) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = text;
      button.setAttribute("aria-label", `${name}: ${chart.title}`);
      button.addEventListener("click", act);
      chart.buttons.append(button);
    }
  }

  for (const figure of document.querySelectorAll("figure.chart")) {
    const spec = JSON.parse(figure.querySelector("script").textContent);
    const xs = spec.x.map(decode);
    let low = Infinity, high = -Infinity, height = TOP + FOOT - GAP;
    for (const panel of spec.panels) {
      height += panel.height + GAP;
      for (const s of panel.series) { s.x = xs[s.x]; s.y = decode(s.y); }
    }
    for (const x of xs) for (const v of x) { if (v < low) low = v; if (v > high) high = v; }
    if (!(low < high)) { low -= 0.5; high += 0.5; }
    const pad = spec.pad * (high - low);
    const full = [low - pad, high + pad];
    const title = figure.dataset.title;
    const svg = make(figure.querySelector(".canvas"), "svg", { viewBox: `0 0 ${W} ${height}`, role: "img", tabindex: 0, "aria-label": title });
    const chart = { id: figure.id, title, spec, svg, full, height, range: full, output: figure.querySelector("output"), buttons: figure.querySelector(".buttons") };
    all.push(chart);
    draw(chart);
    listen(chart);
  }
  document.documentElement.dataset.drawn = String(all.length);
})();
