//! How the command line names a log: one file or several side by side, and a range of their samples.

use std::ops::Range;
use std::path::{Path, PathBuf};

/// `FILE`, `FILE+FILE` (columns side by side), either with `@A..B`: samples A to B (without B), counted from 0.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogSpec {
    /// The files, side by side.
    pub files: Vec<PathBuf>,
    /// The samples wanted; all where `None`.
    pub samples: Option<Range<usize>>,
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
        Ok(Self { files, samples })
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
            .map_err(|_| format!("`{t}` is not a sample number; write @A..B, counted from 0"))
    };
    let range = number(start, 0)?..number(end, usize::MAX)?;
    if range.is_empty() {
        return Err(format!(
            "`@{text}` holds no sample; write @A..B with A below B"
        ));
    }
    Ok(range)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::LogSpec;

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
