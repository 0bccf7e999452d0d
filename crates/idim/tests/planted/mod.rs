//! Logs to plant faults in, and what `idim check` says of them.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used)]

use clap::Parser;
use std::fmt::Write as _;
use std::path::Path;

#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    command: idim::cli::Command,
}

/// A log and the robot it is said to be of.
#[derive(Clone)]
pub struct Case {
    pub header: Vec<String>,
    pub rows: Vec<Vec<f64>>,
    pub robot: String,
    /// A cell that is not a number: row, column, text.
    pub odd: Option<(usize, usize, &'static str)>,
}

impl Case {
    /// A recorded CSV, every `thin`-th line; headers without units.
    pub fn read(csv: &str, robot: &str, thin: usize) -> Self {
        let mut lines = csv.lines();
        let header = lines.next().unwrap().split(',');
        let plain = |h: &str| {
            let (name, unit) = h.split_once('_').unwrap_or((h, ""));
            if unit.is_empty() {
                h.to_owned()
            } else {
                name.to_owned()
            }
        };
        let cells = |l: &str| l.split(',').map(|c| c.parse().unwrap()).collect();
        Self {
            header: header.map(plain).collect(),
            rows: lines.step_by(thin).map(cells).collect(),
            robot: robot.to_owned(),
            odd: None,
        }
    }

    pub fn at(&self, column: &str) -> usize {
        self.header.iter().position(|h| h == column).unwrap()
    }

    /// Multiplies columns.
    pub fn times(&mut self, columns: &[&str], factor: f64) {
        for name in columns {
            let c = self.at(name);
            self.rows.iter_mut().for_each(|r| r[c] *= factor);
        }
    }

    /// All columns of a symbol, `tau` for instance, times its own factor.
    pub fn each(&mut self, symbol: &str, factor: impl Fn(usize) -> f64) {
        for j in 0..6 {
            self.times(&[&format!("{symbol}{}", j + 1)], factor(j));
        }
    }

    pub fn exchange(&mut self, a: &str, b: &str) {
        let (a, b) = (self.at(a), self.at(b));
        self.rows.iter_mut().for_each(|r| r.swap(a, b));
    }

    /// Delays the columns of a symbol by samples.
    pub fn late(&mut self, symbol: &str, samples: usize) {
        for j in 1..=6 {
            let c = self.at(&format!("{symbol}{j}"));
            for k in (samples..self.rows.len()).rev() {
                self.rows[k][c] = self.rows[k - samples][c];
            }
        }
    }

    pub fn clip(&mut self, column: &str, share: f64) {
        let c = self.at(column);
        let largest = self.rows.iter().fold(0.0f64, |m, r| m.max(r[c].abs()));
        let top = share * largest;
        self.rows
            .iter_mut()
            .for_each(|r| r[c] = r[c].clamp(-top, top));
    }

    pub fn without(&mut self, columns: &str) {
        for j in 1..=6 {
            let c = self.at(&format!("{columns}{j}"));
            self.header[c] = format!("other{j}");
        }
    }

    pub fn replace(&mut self, from: &str, to: &str) {
        assert!(self.robot.contains(from), "{from}");
        self.robot = self.robot.replacen(from, to, 1);
    }

    pub fn text(&self) -> String {
        let mut text = self.header.join(",") + "\n";
        for (k, row) in self.rows.iter().enumerate() {
            for (c, x) in row.iter().enumerate() {
                let comma = if c == 0 { "" } else { "," };
                match self.odd {
                    Some((r, at, odd)) if (r, at) == (k, c) => {
                        let _ = write!(text, "{comma}{odd}");
                    }
                    _ => {
                        let _ = write!(text, "{comma}{x}");
                    }
                }
            }
            text.push('\n');
        }
        text
    }
}

/// What `idim check` finds in logs of one robot, all of them together.
pub fn findings(cases: &[Case]) -> Vec<serde_json::Value> {
    let dir = tempfile::tempdir().unwrap();
    let robot = &cases[0].robot;
    let ending = if robot.trim_start().starts_with('<') {
        "urdf"
    } else {
        "ron"
    };
    let arm = dir.path().join(format!("arm.{ending}"));
    std::fs::write(&arm, robot).unwrap();
    let mut logs = Vec::new();
    for (k, case) in cases.iter().enumerate() {
        let path = dir.path().join(format!("log{k}.csv"));
        std::fs::write(&path, case.text()).unwrap();
        logs.push(path.display().to_string());
    }
    let result = check(&arm, &logs);
    let logs = result["logs"].as_array().unwrap().iter();
    logs.flat_map(|l| l["findings"].as_array().unwrap().clone())
        .collect()
}

fn check(robot: &Path, logs: &[String]) -> serde_json::Value {
    let arguments = [
        "idim",
        "check",
        "--json",
        "--robot",
        robot.to_str().unwrap(),
        "--log",
    ];
    let logs = logs.iter().map(String::as_str);
    let arguments = arguments.into_iter().chain(logs);
    let parsed = Arguments::try_parse_from(arguments).unwrap();
    let mut out = Vec::new();
    // Findings that spoil a result are an error after the JSON is out.
    let _ = idim::cli::run(&parsed.command, &mut out);
    serde_json::from_slice(&out).unwrap()
}

pub type Plant = Box<dyn Fn(&mut Case)>;

/// A fault: what it is, how it is planted, the code, the joint and the value it must be named with.
pub struct Fault {
    pub what: &'static str,
    pub plant: Plant,
    pub code: &'static str,
    pub joint: Option<usize>,
    pub value: Option<f64>,
}

pub fn fault(
    what: &'static str,
    code: &'static str,
    joint: Option<usize>,
    value: Option<f64>,
    plant: impl Fn(&mut Case) + 'static,
) -> Fault {
    Fault {
        what,
        plant: Box::new(plant),
        code,
        joint,
        value,
    }
}

/// How far a factor may be off.
const FACTOR: f64 = 0.15;

impl Fault {
    pub fn named(&self, found: &[serde_json::Value], joints: &[&str]) -> bool {
        found.iter().any(|f| {
            let joint = self.joint.is_none_or(|j| f["place"]["joint"] == joints[j]);
            let near = |x: f64| {
                let value = f["value"].as_f64().unwrap_or(f64::NAN);
                (value / x - 1.0).abs() < FACTOR
            };
            f["code"] == self.code
                && f["severity"] != "note"
                && joint
                && self.value.is_none_or(near)
        })
    }
}
