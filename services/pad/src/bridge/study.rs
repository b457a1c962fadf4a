//! The bridge's part in a study: what its participant may do, and what is recorded.

use std::time::Duration;

use serde_json::json;

use super::Bridge;
use crate::board::Answer;
use crate::machine::State;
use crate::protocol::{Refusal, Step};
use crate::study::sitting::{Stage, Told};

impl Bridge<'_> {
    /// Puts the floor that participants see on the board.
    pub(super) fn show_place(&self) -> anyhow::Result<()> {
        let place = self.study.as_ref().map(|study| study.folder().place()).transpose()?.flatten();
        if let Some(svg) = place {
            // It is put there once.
            let _ = self.caller.board.place.set(svg.into());
        }
        Ok(())
    }

    /// Checks whether the study, if there is one, allows a step. A drive is recorded before its order is sent.
    pub(super) fn allow_by_study(&mut self, step: Step, drives: bool, now: Duration) -> Result<(), Refusal> {
        let Some(study) = &mut self.study else { return Ok(()) };
        study.check(step)?;
        if step == Step::Execute {
            self.machine.check(step, drives, now)?;
            study.drive(self.run.recording.as_deref().unwrap_or_default())?;
        }
        Ok(())
    }

    /// The steps that a page may take; `drives`: whether it has the wheel.
    pub(super) fn allowed(&self, drives: bool, now: Duration) -> Vec<Step> {
        let by_study = |step: &Step| self.study.as_ref().is_none_or(|study| study.check(*step).is_ok());
        self.machine.allowed(drives, now).into_iter().filter(by_study).collect()
    }

    /// Keeps what the sketcher has just accepted.
    pub(super) fn keep_for_study(&self) -> Result<(), Refusal> {
        self.study.as_ref().map_or(Ok(()), |study| study.keep(self.machine.memory()))
    }

    /// Processes a message about the participant.
    pub(super) fn hear_participant(&mut self, told: Told) -> Answer {
        let is_moving = matches!(self.machine.state(), State::Driving | State::Paused);
        let Some(study) = &mut self.study else {
            return Err(Refusal::NotNow("expected the page of a study, found one without".into()));
        };
        match told {
            Told::Begin(begin) => study.begin(begin)?,
            Told::Measures(measures) => study.measure(measures)?,
            Told::Answers(_) if is_moving && study.view().stage == Stage::Driven => {
                return Err(Refusal::NotNow(
                    "expected that the robot has stopped; found that it drives".into(),
                ));
            }
            Told::Answers(answers) => study.answer(&answers)?,
        }
        Ok(json!({}))
    }
}
