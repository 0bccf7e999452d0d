//! Colours, text and one panel with axes: what every picture shares.

use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind, IntoDrawingArea};
use plotters::element::{PathElement, Text};
use plotters::prelude::{Cartesian2d, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{
    Color, FontStyle, IntoFont, RGBAColor, RGBColor, ShapeStyle, TextStyle, WHITE,
};

pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(super) type Chart<'a, 'b> =
    ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
pub(super) type DrawError = DrawingAreaErrorKind<std::io::Error>;
pub(super) type DrawResult = Result<(), DrawError>;

// Told apart in print and by the colour-blind: dark against bright, blue against orange.
pub(super) const MEASURED: RGBColor = RGBColor(0x6b, 0x9a, 0xc4);
pub(super) const PREDICTED: RGBColor = RGBColor(0xc8, 0x4b, 0x11);
pub(super) const RESIDUAL: RGBColor = RGBColor(0x4a, 0x4a, 0x4a);
pub(super) const LIMIT: RGBColor = RGBColor(0xb0, 0x20, 0x30);
pub(super) const GRAPHITE: RGBColor = RGBColor(0x33, 0x33, 0x33);
pub(super) const SHADE: RGBAColor = RGBAColor(0xf3, 0xec, 0xd8, 0.75);
const GRID: RGBColor = RGBColor(0xdd, 0xdd, 0xdd);

/// The backend rounds to whole units; two units a pixel keep curves smooth.
const SCALE: u32 = 2;

/// The picture `draw` makes on a white sheet of `width × height` pixels.
pub(super) fn render(width: u32, height: u32, draw: impl FnOnce(&Area) -> DrawResult) -> String {
    let mut svg = String::new();
    let (w, h) = (SCALE * width, SCALE * height);
    {
        let root = SVGBackend::with_string(&mut svg, (w, h)).into_drawing_area();
        root.fill(&WHITE)
            .and_then(|()| draw(&root))
            .and_then(|()| root.present())
            .expect("a string takes any drawing");
    }
    // The coordinates stay fine, the size on the page is the one asked for.
    svg.replacen(
        &format!("width=\"{w}\" height=\"{h}\""),
        &format!("width=\"{width}\" height=\"{height}\""),
        1,
    )
}

/// Text of `size` pixels.
pub(super) fn text_style(size: u32, colour: RGBColor) -> TextStyle<'static> {
    ("sans-serif", f64::from(size * SCALE) * EM)
        .into_font()
        .color(&colour)
}

/// The backend divides font sizes by this.
const EM: f64 = 1.24;

/// One curve in the legend.
pub(super) struct LegendEntry(pub(super) &'static str, pub(super) RGBColor);

/// Title to the left, legend to the right.
pub(super) fn header(area: &Area, title: &str, legend: &[LegendEntry]) -> DrawResult {
    let (width, height) = area.dim_in_pixel();
    let middle = height as i32 / 2;
    let at = |h| Pos::new(h, VPos::Center);
    let bold = ("sans-serif", f64::from(16 * SCALE) * EM, FontStyle::Bold);
    let style = bold.into_font().color(&GRAPHITE).pos(at(HPos::Left));
    area.draw(&Text::new(printable(title), (24, middle), style))?;

    // Without font metrics the widths are estimates, on the generous side.
    let em = 13 * SCALE as i32;
    let mut x = width as i32 - 24;
    for LegendEntry(name, colour) in legend.iter().rev() {
        x -= name.chars().count() as i32 * em * 11 / 20;
        let style = text_style(13, GRAPHITE).pos(at(HPos::Left));
        area.draw(&Text::new(*name, (x, middle), style))?;
        let stroke = vec![(x - 60, middle), (x - 12, middle)];
        area.draw(&PathElement::new(stroke, colour.stroke_width(5)))?;
        x -= 96;
    }
    Ok(())
}

/// Below the panels: what the x axis counts, under the middle of `n_columns` columns, and a remark to the right.
pub(super) fn footer(area: &Area, x_label: &str, n_columns: usize, remark: &str) -> DrawResult {
    let (width, height) = area.dim_in_pixel();
    let (width, middle) = (width as i32, height as i32 / 2);
    let style = |size, h| text_style(size, GRAPHITE).pos(Pos::new(h, VPos::Center));
    let column = width / n_columns as i32;
    for k in 0..n_columns as i32 {
        let centre = k * column + i32::midpoint(column, Y_LABELS as i32);
        area.draw(&Text::new(
            x_label,
            (centre, middle),
            style(13, HPos::Center),
        ))?;
    }
    area.draw(&Text::new(
        remark,
        (width - RIGHT_MARGIN as i32, middle),
        style(12, HPos::Right),
    ))
}

const Y_LABELS: u32 = 130;
const RIGHT_MARGIN: u32 = 24;

/// Two axes with their ranges; the label of x stands in the footer.
pub(super) struct Panel<'a> {
    pub(super) x: [f64; 2],
    pub(super) y: [f64; 2],
    pub(super) y_label: &'a str,
}

impl Panel<'_> {
    /// Draws what lies `behind` (given the range of y), then grid, axes and labels.
    pub(super) fn draw<'c, 'b>(
        &self,
        area: &'c Area<'b>,
        behind: impl FnOnce(&mut Chart<'c, 'b>, [f64; 2]) -> DrawResult,
    ) -> Result<Chart<'c, 'b>, DrawError> {
        let ([x0, x1], [y0, y1]) = (self.x, self.y);
        let mut chart = ChartBuilder::on(area)
            .margin_right(RIGHT_MARGIN)
            .margin_top(10)
            .margin_left(16)
            .x_label_area_size(40)
            .y_label_area_size(Y_LABELS)
            .build_cartesian_2d(x0..x1, y0..y1)?;
        behind(&mut chart, self.y)?;
        let (x_step, y_step) = ((x1 - x0) / 10.0, (y1 - y0) / 5.0);
        chart
            .configure_mesh()
            .x_labels(10)
            .y_labels(5)
            .y_desc(self.y_label)
            .x_label_formatter(&|v| tick(*v, x_step))
            .y_label_formatter(&|v| tick(*v, y_step))
            .light_line_style(ShapeStyle::from(&WHITE.mix(0.0)))
            .bold_line_style(GRID)
            .axis_style(GRAPHITE)
            .label_style(text_style(12, GRAPHITE))
            .axis_desc_style(text_style(13, GRAPHITE))
            .draw()?;
        Ok(chart)
    }
}

/// A tick's number with the digits its step needs.
fn tick(value: f64, step: f64) -> String {
    let digits = -step.log10().floor();
    if !(-6.0..=5.0).contains(&digits) {
        return format!("{value:.1e}");
    }
    let text = format!("{value:.*}", digits.max(0.0) as usize + 1);
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.replace('-', "−")
    }
}

/// Three significant digits.
pub(super) fn significant(value: f64) -> String {
    let digits = 2.0 - value.abs().log10().floor();
    if value == 0.0 {
        "0".into()
    } else if (0.0..=6.0).contains(&digits) {
        format!("{value:.*}", digits as usize)
    } else {
        format!("{value:.2e}")
    }
}

/// Text a picture can carry: characters XML refuses are replaced, a long name is cut.
///
/// Escaping `<`, `&` and quotes is the backend's work.
fn printable(text: &str) -> String {
    const LONGEST: usize = 40;
    let refused = |c: char| c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}');
    let mut short: String = text
        .chars()
        .take(LONGEST)
        .map(|c| if refused(c) { '\u{fffd}' } else { c })
        .collect();
    if text.chars().nth(LONGEST).is_some() {
        short.push('…');
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_numbers_carry_the_digits_they_need() {
        assert_eq!(tick(0.30000000000000004, 0.1), "0.3");
        assert_eq!(tick(-0.0, 0.1), "0");
        assert_eq!(tick(-1500.0, 500.0), "−1500");
        assert_eq!(tick(2.5e-7, 1e-7), "2.5e-7");
        assert_eq!(significant(0.51234), "0.512");
        assert_eq!(significant(123.4), "123");
        assert_eq!(significant(0.0), "0");
        assert_eq!(significant(4.5678e-9), "4.57e-9");
    }

    #[test]
    fn regress_text_that_xml_refuses_is_replaced() {
        assert_eq!(printable("a\u{1b}[31mb\0"), "a\u{fffd}[31mb\u{fffd}");
        assert_eq!(printable(&"x".repeat(500)).chars().count(), 41);
    }
}
