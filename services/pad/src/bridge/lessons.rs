//! What the robot has learned on drives from the page. It is offered to a person once the robot has stopped, until the person
//! accepts or rejects it or lets the robot drive again.

use std::time::Duration;

use serde_json::json;
use sketchnav_stage::drawn::Lessons as Ways;

use super::Bridge;
use crate::board::{Answer, Call, Image, put_image};
use crate::learning::{Learned, WRITTEN_WITHIN};
use crate::machine::State;
use crate::protocol::{LearnedView, SketchType};
use crate::walls;

/// What was learned, and when to learn more.
#[derive(Default)]
pub(super) struct Lessons {
    /// Whether the robot was driving at the last check.
    drove: bool,
    /// When the end of the last drive will have been recorded.
    due: Option<Duration>,
    /// Number of changes that invalidate the current lesson.
    changes: u64,
    offered: Option<Learned>,
    /// The learned map that the robot drives in.
    pub(super) accepted: Option<Learned>,
    /// Number of the picture on the board.
    picture: u64,
}

impl Lessons {
    /// Returns the information for pages, or `None` if nothing was learned.
    pub(super) fn view(&self) -> Option<LearnedView> {
        let is_accepted = self.accepted.is_some();
        let is_shown = is_accepted || self.offered.is_some();
        is_shown.then_some(LearnedView { picture: self.picture, accepted: is_accepted })
    }
}

impl Bridge<'_> {
    /// Returns how the navigator learns. Participants of a study draw for the first drive, and nothing else.
    fn ways(&self) -> Option<Ways> {
        let lessons = self.drawn.and_then(|drawn| drawn.lessons);
        lessons.filter(|_| self.run.pad.draws() && self.study.is_none())
    }

    /// Restores the learned map that the robot drove in before the restart.
    pub(super) fn resume_lessons(&mut self) {
        self.lessons.drove = self.machine.memory().ordered;
        self.lessons.accepted = self.remembered();
        if self.lessons.accepted.is_some() {
            self.show_learned();
        }
    }

    /// Reads the learned map that the robot drives in from the machine's memory, which survives restarts of the pad.
    fn remembered(&self) -> Option<Learned> {
        let memory = self.machine.memory();
        let (ways, sketch, file) = (self.ways()?, memory.sketch.as_ref()?, memory.learned.as_ref()?);
        Learned::of_file(self.run, ways, (&sketch.bytes, file.clone())).ok()
    }

    /// Learns from the last drive if that is due, in a separate thread.
    pub(super) fn learn(&mut self, now: Duration) {
        let Some(ways) = self.ways() else { return };
        let drives = self.machine.state() == State::Driving;
        if drives && self.lessons.offered.is_some() {
            self.lessons.offered = None;
            self.show_learned();
        }
        if drives != self.lessons.drove {
            self.lessons.drove = drives;
            self.lessons.changes += 1;
            self.lessons.due = (!drives).then_some(now + WRITTEN_WITHIN);
        }
        let Some(sketch) = self.machine.memory().sketch.as_ref() else { return };
        if self.lessons.due.take_if(|due| *due <= now).is_none() {
            return;
        }
        let (caller, number) = (self.caller.clone(), self.lessons.changes);
        let (run, drawing) = (self.run.clone(), sketch.bytes.clone());
        std::thread::spawn(move || match Learned::of_run(&run, ways, &drawing) {
            // If the pad is ending, it is no longer needed.
            Ok(learned) => drop(caller.call(Call::Learned(number, Box::new(learned)))),
            Err(error) => sketchnav_schemas::say!("nothing was learned on this drive: {error:#}"),
        });
    }

    /// Offers the learned map, unless something has happened since.
    pub(super) fn offer(&mut self, number: u64, learned: Learned) {
        if number == self.lessons.changes {
            self.lessons.offered = Some(learned);
            self.show_learned();
        }
    }

    /// Lets the robot drive in the learned map from now on. The sketcher has to answer.
    pub(super) fn accept(&mut self, drives: bool, now: Duration) -> anyhow::Result<Option<Answer>> {
        let file = self.lessons.offered.as_ref().map(|learned| learned.file.clone());
        match self.machine.accept(file.unwrap_or_default(), drives, now) {
            Ok(_) => self.submit(None),
            Err(refusal) => Ok(Some(Err(refusal))),
        }
    }

    /// Discards what is offered, or else the learned map that the robot drives in, in which case the sketcher has to answer.
    pub(super) fn reject(&mut self, drives: bool, now: Duration) -> anyhow::Result<Option<Answer>> {
        match self.machine.reject(drives, now) {
            Ok(true) => self.submit(None),
            Ok(false) => {
                self.lessons.offered = None;
                self.show_learned();
                Ok(Some(Ok(json!({}))))
            }
            Err(refusal) => Ok(Some(Err(refusal))),
        }
    }

    /// Keeps what the sketcher has accepted, and discards what belongs to another drawing.
    pub(super) fn settle_lessons(&mut self) {
        let memory = self.machine.memory();
        match &memory.learned {
            Some(file) if self.lessons.accepted.as_ref().is_none_or(|before| before.file != *file) => {
                let offered = self.lessons.offered.take_if(|offered| offered.file == *file);
                // The pad that offered it may have died before the sketcher answered.
                self.lessons.accepted = offered.or_else(|| self.remembered());
            }
            None if memory.path.is_none() => {
                (self.lessons.accepted, self.lessons.offered, self.lessons.due) = (None, None, None);
                self.lessons.changes += 1;
            }
            _ => return,
        }
        self.show_learned();
    }

    fn show_learned(&mut self) {
        self.machine.offer(self.lessons.offered.is_some());
        let shown = self.lessons.offered.as_ref().or(self.lessons.accepted.as_ref());
        let picture = shown.and_then(|learned| walls::seen_png(&learned.lesson.seen));
        let image = picture.map(|picture| Image { kind: SketchType::Png, bytes: picture.into() });
        put_image(&self.caller.board.learned, image);
        self.lessons.picture += 1;
        self.welcome();
    }
}
