//! How the command line names a log: one file or several side by side, and a range of their samples.

use std::ops::Range;
use std::path::{Path, PathBuf};

/// `FILE`, `FILE+FILE` (columns side by side), either with `@A..B`: samples A to B (without B), counted from 0.
#[derive(Debug, Clone, PartialEq)]
pub struct LogSpec {
    /// The files, side by side.
    pub files: Vec<PathBuf>,
    /// The samples wanted; all where `None`.
    pub samples: Option<Range<usize>>,
    /// Parts of the whole log that are left out.
    pub left_out: Vec<Span>,
}

/// A part of a log.
#[derive(Debug, Clone, PartialEq)]
pub enum Span {
    /// Samples, counted from 0, the last not included.
    Samples(Range<usize>),
    /// On the log's clock, s, both ends included.
    Time([f64; 2]),
}

/// What stands behind `--exclude`: a part of one log, or of the only one.
#[derive(Debug, Clone, PartialEq)]
pub struct Exclusion {
    /// The log, as `--log` names it or by the name of its file.
    pub log: Option<String>,
    /// The part.
    pub span: Span,
}

impl Exclusion {
    /// Reads `[LOG:]A..B`: samples A to B (without B) counted from 0, or with units `12.5s..14s` on the log's clock.
    ///
    /// # Errors
    /// What is neither, and a part that holds nothing.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (log, range) = match text.rsplit_once(':') {
            Some((log, range)) if !log.is_empty() => (Some(log.to_owned()), range),
            Some((_, range)) => (None, range),
            None => (None, text),
        };
        let shape = || {
            format!(
                "`{range}` is no part of a log; write A..B in samples from 0, or 12.5s..14s on its clock"
            )
        };
        let (start, end) = range.split_once("..").ok_or_else(shape)?;
        let span = match (start.strip_suffix('s'), end.strip_suffix('s')) {
            (Some(start), Some(end)) => {
                let seconds = |t: &str| t.parse().ok().filter(|t: &f64| t.is_finite());
                let [from, to] = [seconds(start), seconds(end)].map(|t| t.ok_or_else(shape));
                let (from, to) = (from?, to?);
                if from > to {
                    return Err(format!("`{range}` ends before it begins"));
                }
                Span::Time([from, to])
            }
            (None, None) => Span::Samples(parse_range(range)?),
            _ => return Err(shape()),
        };
        Ok(Self { log, span })
    }

    /// Whether it is of this log.
    pub(crate) fn names(&self, spec: &LogSpec) -> bool {
        let Some(log) = &self.log else { return true };
        let files = || spec.files.iter();
        let whole = files().map(|f| f.display().to_string()).collect::<Vec<_>>();
        let own = |f: &PathBuf| {
            f.file_name()
                .is_some_and(|n| n.display().to_string() == *log)
        };
        spec.name() == *log || whole.join("+") == *log || whole.contains(log) || files().any(own)
    }
}

impl LogSpec {
    /// Reads what stands behind `--log` or `--validate`.
    ///
    /// A path that exists as it is written is that file, whatever signs are in its name.
    ///
    /// # Errors
    /// A range that holds no sample, an empty name.
    pub fn parse(text: &str) -> Result<Self, String> {
        if Path::new(text).exists() {
            return Ok(Self {
                files: vec![text.into()],
                samples: None,
                left_out: Vec::new(),
            });
        }
        let (names, samples) = match text.rsplit_once('@') {
            Some((names, range)) if range.contains("..") => (names, Some(parse_range(range)?)),
            _ => (text, None),
        };
        let files: Vec<PathBuf> = if Path::new(names).exists() {
            vec![names.into()]
        } else {
            names.split('+').map(PathBuf::from).collect()
        };
        if files.iter().any(|f| f.as_os_str().is_empty()) {
            return Err("a file without a name; write FILE, FILE+FILE or FILE@A..B".into());
        }
        Ok(Self {
            files,
            samples,
            left_out: Vec::new(),
        })
    }

    /// As written on the command line.
    pub fn name(&self) -> String {
        let names: Vec<String> = self.files.iter().map(|f| f.display().to_string()).collect();
        let range = self.samples.as_ref().map_or_else(String::new, |r| {
            let end = if r.end == usize::MAX {
                String::new()
            } else {
                r.end.to_string()
            };
            format!("@{}..{end}", r.start)
        });
        names.join("+") + &range
    }

    /// Whether it is a ROS 2 bag.
    pub fn is_bag(&self) -> bool {
        let ending = |f: &PathBuf| f.extension().map(|e| e.to_string_lossy().to_lowercase());
        let bag = |f: &PathBuf| {
            ["db3", "mcap"]
                .map(String::from)
                .map(Some)
                .contains(&ending(f))
        };
        self.files.iter().any(|f| f.is_dir() || bag(f))
    }

    /// Whether two logs share a sample of a file, by whatever path it is named.
    pub fn overlaps(&self, other: &Self) -> bool {
        let range = |s: &Self| s.samples.clone().unwrap_or(0..usize::MAX);
        let (a, b) = (range(self), range(other));
        let shared = |f: &PathBuf| other.files.iter().any(|g| same_file(f, g));
        a.start < b.end && b.start < a.end && self.files.iter().any(shared)
    }
}

/// Whether two paths lead to one file.
pub(crate) fn same_file(a: &Path, b: &Path) -> bool {
    let real = |p: &Path| std::fs::canonicalize(p).ok();
    a == b || real(a).is_some_and(|a| real(b) == Some(a))
}

fn parse_range(text: &str) -> Result<Range<usize>, String> {
    let (start, end) = text.split_once("..").unwrap_or((text, ""));
    let number = |t: &str, otherwise: usize| {
        if t.is_empty() {
            return Ok(otherwise);
        }
        t.parse::<usize>()
            .map_err(|_| format!("`{t}` is not a sample number; write A..B, counted from 0"))
    };
    let range = number(start, 0)?..number(end, usize::MAX)?;
    if range.is_empty() {
        return Err(format!(
            "`{text}` holds no sample; write A..B with A below B"
        ));
    }
    Ok(range)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::{Exclusion, LogSpec, Span};

    #[test]
    fn identity_a_log_is_named_as_it_was_written() {
        for text in [
            "a.csv",
            "a.csv+b.csv",
            "a.csv@10..200",
            "a.csv+b.csv@..5",
            "run@home.csv",
        ] {
            let spec = LogSpec::parse(text).unwrap();
            assert_eq!(spec.name().replace("@0..", "@.."), text);
        }
        assert!(
            LogSpec::parse("a.csv@5..5")
                .unwrap_err()
                .contains("no sample")
        );
        assert!(LogSpec::parse("a.csv@x..5").unwrap_err().contains("`x`"));
        assert!(LogSpec::parse("a.csv+").is_err());
    }

    #[test]
    fn identity_a_part_is_of_samples_or_of_the_clock() {
        let of = |text: &str| Exclusion::parse(text).unwrap();
        assert_eq!(of("5..9").span, Span::Samples(5..9));
        assert_eq!(of("a.csv:5..").span, Span::Samples(5..usize::MAX));
        assert_eq!(of("c:/a.csv:1.5s..2s").span, Span::Time([1.5, 2.0]));
        assert_eq!(of("c:/a.csv:1.5s..2s").log.as_deref(), Some("c:/a.csv"));
        for wrong in ["5", "1s..2", "2s..1s", "5..5", "xs..2s", "a:infs..2s"] {
            assert!(Exclusion::parse(wrong).is_err(), "{wrong}");
        }
        let spec = LogSpec::parse("runs/a.csv+runs/b.csv@..9").unwrap();
        for name in [
            "runs/a.csv+runs/b.csv",
            "b.csv",
            "runs/a.csv",
            "runs/a.csv+runs/b.csv@0..9",
        ] {
            assert!(of(&format!("{name}:1..2")).names(&spec), "{name}");
        }
        assert!(!of("c.csv:1..2").names(&spec) && of("1..2").names(&spec));
    }

    #[test]
    fn identity_overlap_needs_a_file_and_a_sample_in_common() {
        let overlap = |a: &str, b: &str| {
            LogSpec::parse(a)
                .unwrap()
                .overlaps(&LogSpec::parse(b).unwrap())
        };
        assert!(overlap("a", "a") && overlap("a@..10", "a@9..") && overlap("a+b", "b"));
        assert!(!overlap("a@..10", "a@10..") && !overlap("a", "b"));
    }
}
