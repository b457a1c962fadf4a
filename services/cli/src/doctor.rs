//! `sketchnav doctor`: checks whether this machine can run a system, and explains how to fix it if it cannot.
//!
//! The checks change nothing except for files of their own, which they remove.

mod checks;

use anyhow::Context;
use serde::Serialize;

use crate::failure::{Failure, Outcome};
use crate::output::out;

/// The result of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Level {
    /// Everything is in order.
    Fine,
    /// A system runs, but not as well as it could.
    Warning,
    /// No system can run, or its measurements would be wrong.
    Error,
}

impl Level {
    fn word(self) -> &'static str {
        match self {
            Self::Fine => "fine",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// A finding of a check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What was checked.
    check: &'static str,
    level: Level,
    /// What was found.
    found: String,
    /// What to do about it, or `None` if everything is in order.
    #[serde(skip_serializing_if = "Option::is_none")]
    advice: Option<String>,
}

impl Finding {
    /// Creates a finding without a problem.
    pub fn fine(check: &'static str, found: impl Into<String>) -> Self {
        Self { check, level: Level::Fine, found: found.into(), advice: None }
    }

    /// Creates a finding of a problem, with advice on what to do about it.
    pub fn of(
        check: &'static str,
        level: Level,
        found: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        Self { check, level, found: found.into(), advice: Some(advice.into()) }
    }
}

/// Runs all checks and prints the findings. The exit code is 1 if any finding is an error.
pub fn doctor(json: bool) -> Result<Outcome, Failure> {
    let findings: Vec<_> = checks::all().collect();
    let worst = findings.iter().map(|finding| finding.level).max().unwrap_or(Level::Fine);
    if json {
        let object = serde_json::json!({ "worst": worst, "findings": findings });
        out!("{}", serde_json::to_string(&object).context("the findings as JSON")?)?;
    } else {
        findings.iter().try_for_each(print)?;
    }
    Ok(if worst == Level::Error { Outcome::Short } else { Outcome::Success })
}

fn print(finding: &Finding) -> anyhow::Result<()> {
    let Finding { check, level, found, advice } = finding;
    out!("{:<8} {check:<14} {found}", level.word())?;
    advice.iter().try_for_each(|advice| out!("{:<8} {:<14} → {advice}", "", ""))
}
