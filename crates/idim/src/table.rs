//! Tables for people: aligned, in the terminal's own characters.

use comfy_table::{CellAlignment, Table, presets};

/// An aligned table; the first column to the left, numbers to the right.
pub(crate) fn table<const N: usize>(
    header: [&str; N],
    rows: impl IntoIterator<Item = [String; N]>,
) -> String {
    aligned(header, rows, 1..N)
}

/// An aligned table with the columns of `right` to the right, the others to the left.
pub(crate) fn aligned<const N: usize>(
    header: [&str; N],
    rows: impl IntoIterator<Item = [String; N]>,
    right: impl IntoIterator<Item = usize>,
) -> String {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(header);
    for row in rows {
        table.add_row(row);
    }
    for k in right {
        if let Some(column) = table.column_mut(k) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let text = table.to_string();
    let lines: Vec<&str> = text.lines().map(str::trim_end).collect();
    lines.join("\n") + "\n"
}

/// Four significant digits, in the shorter of the two notations.
pub(crate) fn number(x: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    let size = x.abs();
    if !size.is_finite() {
        return if size.is_nan() {
            "-".into()
        } else {
            "inf".into()
        };
    }
    if (1e-3..1e5).contains(&size) {
        let decimals = (3 - size.log10().floor() as i32).max(0) as usize;
        format!("{x:.decimals$}")
    } else {
        format!("{x:.3e}")
    }
}

/// A number where there is one.
pub(crate) fn optional(x: Option<f64>) -> String {
    x.map_or_else(|| "-".into(), number)
}
