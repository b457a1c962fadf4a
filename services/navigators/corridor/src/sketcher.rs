//! The sketcher stage of `corridor`, which reads and checks the rules of a mission and sends them once.

use serde::Serialize;
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::{Files, Outbox, Stage, StageError};

use crate::error::CorridorError;
use crate::messages::RULES;
use crate::mission::{CorridorMission, Method};
use crate::rules::{self, Rules};

/// Publishes the rules of a run.
pub struct Sketcher {
    /// Text of the rule file. Empty for a method without rules.
    text: String,
    set_count: u32,
}

impl Sketcher {
    /// Reads and checks the rules.
    ///
    /// # Errors
    /// [`CorridorError`], which names the file, the set and the rule, if the rules cannot be read or are
    /// invalid.
    pub fn new(run: &RunConfig, files: &Files<'_>) -> Result<Self, CorridorError> {
        let text = text(&run.mission, files)?;
        let set_count =
            if text.is_empty() { 0 } else { Rules::parse(&text).map_err(in_file(&run.mission))?.len() };
        Ok(Self { text, set_count: set_count as u32 })
    }
}

/// Returns the text of a mission's rules, or an empty string if its method has none.
fn text(mission: &Mission, files: &Files<'_>) -> Result<String, CorridorError> {
    let CorridorMission { method, rules_file, .. } = CorridorMission::of(mission)?;
    if let Some(file) = rules_file {
        let wrong = |reason: String| CorridorError::File { file: file.clone(), reason };
        let bytes = files(&file).map_err(|error| wrong(error.to_string()))?;
        let most = RULES.spec.max_cells;
        if bytes.len() > most {
            return Err(wrong(format!("expected at most {most} bytes, found {}", bytes.len())));
        }
        return String::from_utf8(bytes).map_err(|_| wrong("expected UTF-8, found other bytes".into()));
    }
    let own = match method {
        Method::Corridor => "",
        Method::QtcB | Method::QtcBSteady => rules::QTC_B,
        Method::Argd => rules::ARGD,
        Method::Combined => rules::COMBINED,
    };
    Ok(own.to_owned())
}

fn in_file(mission: &Mission) -> impl Fn(crate::error::RulesError) -> CorridorError {
    let given = mission.navigator.given.get("rules_file").and_then(toml::Value::as_str);
    let file = given.unwrap_or("the method's own rules").to_owned();
    move |cause| CorridorError::Rules { file: file.clone(), cause }
}

impl Stage for Sketcher {
    const FORM: &'static str = "corridor sketcher 1";
    type State = ();

    fn announce(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        out.send_with(RULES, self.text.len(), |rules, cells| {
            rules.set_count = self.set_count;
            cells.copy_from_slice(self.text.as_bytes());
        })?;
        Ok(())
    }

    fn state(&self) -> impl Serialize {}

    fn restore(&mut self, (): ()) -> Result<(), StageError> {
        Ok(())
    }
}
