//! What the doctor says.

use crate::error::{Error, Place};
use serde::Serialize;
use std::fmt;

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// A fact worth knowing.
    Note,
    /// The result is worse for it.
    Warning,
    /// The result would be wrong.
    Error,
}

/// One thing the doctor found in a log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Short stable name, `torque-sign`; a finding is waived by it.
    pub code: &'static str,
    /// How bad it is.
    pub severity: Severity,
    /// File, line or time, joint.
    pub place: Place,
    /// The number measured: a factor, a share, a lag in s; none where there is no number.
    pub value: Option<f64>,
    /// What was met, in words.
    pub met: String,
    /// The rule it breaks.
    pub rule: String,
    /// What to do.
    pub next_step: String,
}

impl Finding {
    pub(crate) fn new(
        code: &'static str,
        severity: Severity,
        place: Place,
        value: f64,
        met: impl Into<String>,
        rule: impl Into<String>,
        next_step: impl Into<String>,
    ) -> Self {
        Self {
            code,
            severity,
            place,
            value: value.is_finite().then_some(value),
            met: met.into(),
            rule: rule.into(),
            next_step: next_step.into(),
        }
    }
}

impl From<&Error> for Finding {
    /// A log that cannot be read is a finding too.
    fn from(error: &Error) -> Self {
        let (place, met, rule) = match error {
            Error::Log {
                place, met, rule, ..
            } => ((**place).clone(), met.clone(), rule.as_str()),
            Error::Setting {
                setting,
                value,
                rule,
            } => (
                Place::default(),
                format!("{setting} {value}"),
                rule.as_str(),
            ),
        };
        // Messages read `rule; what to do`.
        let (rule, next) = rule.split_once("; ").unwrap_or(("", rule));
        Self::new(
            error.code(),
            Severity::Error,
            place,
            f64::NAN,
            met,
            rule,
            next,
        )
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let severity = match self.severity {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        write!(f, "{severity} [{}] {}: {}", self.code, self.place, self.met)?;
        for part in [&self.rule, &self.next_step] {
            if !part.is_empty() {
                write!(f, "; {part}")?;
            }
        }
        Ok(())
    }
}
