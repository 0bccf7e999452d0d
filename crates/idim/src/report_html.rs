//! `report.html`: the result of a run for people, in one file that needs nothing else.
//!
//! Style, script and numbers are inside; a policy in its head forbids the page to fetch anything. Names from robot files
//! and logs enter through an escaping template, or as JSON that cannot close its element, so they stay text whatever
//! they contain.

mod blocks;
mod charts;
mod data;
mod fill;
mod friction;
mod parameters;
mod sections;
mod spectrum;
mod torque;
mod verdict;

pub use data::{CutoffCurve, LogSummary, ReportData, ReportedFinding, Spectrum};
pub(crate) use fill::{file_settings, page_of_logs, page_of_paper, shell_line, summaries};

use askama::Template;
use blocks::{Block, Chapter};
pub(crate) use verdict::verdict_line;
use verdict::{PlainVerdict, verdict};

const STYLE: &str = include_str!("report_html/report.css");
const SCRIPT: &str = include_str!("report_html/report.js");

#[derive(Template)]
#[template(path = "report.html")]
struct Page<'a> {
    robot: &'a str,
    version: &'a str,
    subtitle: String,
    style: &'a str,
    script: &'a str,
    verdict: PlainVerdict,
    warnings: &'a [String],
    chapters: Vec<Chapter>,
}

/// The whole page. A function of the data alone: same input, same bytes.
pub fn report_html(data: &ReportData) -> String {
    let page = Page {
        robot: &data.result.robot,
        version: data.result.version,
        subtitle: subtitle(data),
        style: STYLE,
        script: SCRIPT,
        verdict: verdict(data),
        warnings: &data.result.warnings,
        chapters: chapters(data),
    };
    let text = page.render().expect("a string takes any text");
    // Control characters have no place in a page; a name may hold them.
    let plain = |c: char| {
        if c.is_control() && c != '\n' {
            '\u{fffd}'
        } else {
            c
        }
    };
    text.chars().map(plain).collect()
}

fn chapters(data: &ReportData) -> Vec<Chapter> {
    let all = [
        ("paper", "Beside the paper", sections::paper(data)),
        ("torque", "Measured against predicted", torque::torque(data)),
        ("parameters", "Parameters", parameters::parameters(data)),
        (
            "identifiable",
            "What the motors can feel",
            parameters::identifiable(data),
        ),
        ("friction", "Friction", friction::friction(data)),
        (
            "condition",
            "How well the motion shows the parameters",
            sections::condition(data),
        ),
        ("data", "Data", sections::data(data)),
        (
            "doctor",
            "Findings of the log doctor",
            sections::doctor(data),
        ),
        ("figures", "Motions", sections::figures(data)),
        ("robot", "Robot", sections::robot(data)),
        ("again", "To run it again", sections::again(data)),
    ];
    all.into_iter()
        .filter(|(.., blocks)| !blocks.is_empty())
        .map(|(id, title, blocks)| Chapter { id, title, blocks })
        .collect()
}

fn subtitle(data: &ReportData) -> String {
    let joints = data.robot.n_joints();
    let seconds: f64 = data.logs.iter().map(|l| l.duration).sum();
    let logs = match data.logs.len() {
        0 => String::new(),
        1 => format!(" · one log of {seconds:.1} s"),
        n => format!(" · {n} logs of {seconds:.1} s together"),
    };
    format!("{joints} joints{logs} · idim {}", data.result.version)
}
