//! What a chapter of the page is built from; the template knows how each looks.

use super::charts::Chart;
use super::verdict::INTERVAL;

/// A heading and what stands under it.
pub(super) struct Chapter {
    pub(super) id: &'static str,
    pub(super) title: &'static str,
    pub(super) blocks: Vec<Block>,
}

/// A piece of a chapter.
pub(super) enum Block {
    Text(String),
    /// A remark in a softer colour.
    Soft(String),
    /// How to use the page: not printed.
    Hint(&'static str),
    Heading(String),
    Code(String),
    List(Vec<String>),
    Relations(Vec<String>),
    Table(Table),
    Figure(Figure),
    /// Title and SVG text.
    Picture(String, String),
}

pub(super) struct Table {
    pub(super) caption: String,
    pub(super) header: Vec<Cell>,
    /// The first cell of a row names it.
    pub(super) rows: Vec<Vec<Cell>>,
}

/// A cell; numbers stand to the right.
#[derive(Default)]
pub(super) struct Cell {
    pub(super) text: String,
    pub(super) number: bool,
    /// To be read as a warning.
    pub(super) low: bool,
    pub(super) bar: Option<Bar>,
}

/// The 95 % interval of a value beside its size, zero at the left end.
pub(super) struct Bar {
    pub(super) path: String,
    /// Whether it reaches zero.
    pub(super) weak: bool,
}

/// A picture the script draws.
pub(super) struct Figure {
    pub(super) id: String,
    pub(super) title: String,
    pub(super) about: String,
    /// Class and name of each curve.
    pub(super) keys: &'static [(&'static str, &'static str)],
    pub(super) json: String,
}

pub(super) fn word(text: impl Into<String>) -> Cell {
    Cell {
        text: text.into(),
        ..Cell::default()
    }
}

pub(super) fn figures(text: impl Into<String>) -> Cell {
    Cell {
        text: text.into(),
        number: true,
        ..Cell::default()
    }
}

impl Block {
    pub(super) fn table(caption: &str, header: Vec<Cell>, rows: Vec<Vec<Cell>>) -> Self {
        Self::Table(Table {
            caption: caption.into(),
            header,
            rows,
        })
    }

    pub(super) fn figure(
        id: impl Into<String>,
        title: impl Into<String>,
        about: impl Into<String>,
        keys: &'static [(&'static str, &'static str)],
        chart: &Chart,
    ) -> Self {
        // No `<` in the JSON, so nothing in it can end the element it stands in.
        let json = serde_json::to_string(chart)
            .unwrap_or_default()
            .replace('<', "\\u003c");
        Self::Figure(Figure {
            id: id.into(),
            title: title.into(),
            about: about.into(),
            keys,
            json,
        })
    }
}

/// Width of a bar for ±100 % of the value, as in the template.
const WIDTH: f64 = 240.0;
/// The shortest whisker that is still seen.
const SHORTEST: f64 = 0.004;

/// Of a value whose standard deviation is this share of it.
pub(super) fn bar(relative_std: f64) -> Cell {
    let half = INTERVAL * relative_std;
    let weak = half >= 1.0;
    let reach = 0.5 * WIDTH * half.clamp(SHORTEST, 1.0);
    let (a, b) = (0.5 * WIDTH - reach, 0.5 * WIDTH + reach);
    // The ends of a whisker that runs out of the axis are left open.
    let ends = if weak {
        String::new()
    } else {
        format!("M{a:.1} 8V16M{b:.1} 8V16")
    };
    Cell {
        text: format!("plus or minus {:.0} %", 100.0 * half),
        bar: Some(Bar {
            path: format!("M{a:.1} 12H{b:.1}{ends}"),
            weak,
        }),
        ..Cell::default()
    }
}
