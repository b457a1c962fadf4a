//! What the robot learns on drives. Pages show it as it grows, while the robot drives. If people draw, it is offered to them once the
//! robot has stopped, until somebody accepts or rejects it or lets the robot drive again.

use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

use serde_json::json;
use sketchnav_stage::drawn::Lessons as Ways;
use sketchnav_stage::lookout::Sheet;

use super::Bridge;
use crate::board::{Answer, Call, Caller, Image, put_image};
use crate::learning::{Follower, Learned, WRITTEN_WITHIN};
use crate::machine::State;
use crate::protocol::{LearnedView, SketchType};
use crate::walls;
use sketchnav_schemas::run::RunConfig;

/// Minimum time between two looks at the recording while the robot drives.
const LOOK_EVERY: Duration = Duration::from_secs(2);
/// Time to wait after a look, as a multiple of the time that it took.
const REST: u32 = 10;

/// What was learned, and when to learn more.
#[derive(Default)]
pub(super) struct Lessons {
    /// Whether the robot was driving at the last check.
    drove: bool,
    /// When to look at the recording next. After a drive, this is when its end will have been recorded.
    due: Option<Duration>,
    /// Number of changes that invalidate the current lesson.
    changes: u64,
    /// The thread that looks at the recording.
    follower: Option<Sender<Look>>,
    /// What was learned so far on a drive that is not over, or whose end is being learned from.
    growing: Option<Learned>,
    offered: Option<Learned>,
    /// The learned map that the robot drives in.
    pub(super) accepted: Option<Learned>,
    /// Number of the pictures on the board.
    picture: u64,
}

/// A request to look at the recording.
struct Look {
    /// The number of changes when it was made.
    number: u64,
    /// Whether the drive is over.
    is_last: bool,
}

/// What a look at the recording led to.
#[derive(Debug)]
pub struct Looked {
    /// The number of changes when it was requested.
    number: u64,
    /// `None` if nothing could be learned, which is normal at the beginning of a drive.
    learned: Option<Learned>,
    took: Duration,
}

impl Lessons {
    /// Returns the information for pages, or `None` if nothing was learned.
    pub(super) fn view(&self) -> Option<LearnedView> {
        let growing = self.growing.is_some() && self.drove;
        let is_shown = self.growing.is_some() || self.accepted.is_some() || self.offered.is_some();
        let accepted = self.accepted.is_some();
        is_shown.then_some(LearnedView { picture: self.picture, accepted, growing })
    }

    fn forget(&mut self) {
        (self.accepted, self.offered, self.growing, self.due) = (None, None, None, None);
        self.changes += 1;
    }
}

/// Looks at the recording of a run whenever it is asked to, in a thread that ends with its bridge.
fn follow(run: &RunConfig, ways: Ways, caller: Caller) -> Sender<Look> {
    let (sender, looks) = channel::<Look>();
    let mut follower = Follower::new(run, ways);
    std::thread::spawn(move || {
        for Look { number, is_last } in looks {
            let began = Instant::now();
            let learned = follower.look();
            if let Err(error) = learned.as_ref().map(drop).map_err(|error| format!("{error:#}"))
                && is_last
            {
                sketchnav_schemas::say!("nothing was learned on this drive: {error}");
            }
            let looked = Looked { number, learned: learned.ok(), took: began.elapsed() };
            // If the pad is ending, it is no longer needed.
            drop(caller.call(Call::Looked(Box::new(looked))));
        }
    });
    sender
}

impl Bridge<'_> {
    /// Returns how the navigator learns. Participants of a study draw for the first drive, and nothing else. On a mission that is
    /// only watched, nobody has asked to learn, so a run that is not recorded is no reason for a message.
    fn ways(&self) -> Option<Ways> {
        let can_learn = self.study.is_none() && (self.run.pad.draws() || self.run.recording.is_some());
        self.drawn.and_then(|drawn| drawn.lessons).filter(|_| can_learn)
    }

    /// Restores the learned map that the robot drove in before the restart.
    pub(super) fn resume_lessons(&mut self) {
        self.lessons.drove = self.machine.memory().ordered;
        self.lessons.due = self.lessons.drove.then_some(Duration::ZERO);
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

    /// Learns from the drive so far, or from the last drive, if that is due.
    pub(super) fn learn(&mut self, now: Duration) {
        let Some(ways) = self.ways() else { return };
        let drives = self.machine.state() == State::Driving;
        if drives && let Some(offered) = self.lessons.offered.take() {
            self.lessons.growing = Some(offered);
            self.show_learned();
        }
        if drives != self.lessons.drove {
            self.lessons.drove = drives;
            self.lessons.changes += 1;
            self.lessons.due = Some(now + if drives { LOOK_EVERY } else { WRITTEN_WITHIN });
        }
        if self.lessons.due.take_if(|due| *due <= now).is_none() {
            return;
        }
        let look = Look { number: self.lessons.changes, is_last: !drives };
        let (run, caller) = (self.run, &self.caller);
        let follower = self.lessons.follower.get_or_insert_with(|| follow(run, ways, caller.clone()));
        // The thread lives as long as its sender.
        let _ = follower.send(look);
    }

    /// Shows what was learned, unless something has happened since. After a drive, it is offered.
    pub(super) fn on_looked(&mut self, Looked { number, learned, took }: Looked, now: Duration) {
        if number != self.lessons.changes {
            return;
        }
        if self.lessons.drove {
            self.lessons.due = Some(now + LOOK_EVERY.max(REST * took));
        }
        match (learned, self.lessons.drove || !self.run.pad.draws()) {
            (None, true) => return,
            (Some(learned), true) => self.lessons.growing = Some(learned),
            (learned, false) => (self.lessons.growing, self.lessons.offered) = (None, learned),
        }
        self.show_learned();
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
                self.lessons.growing = None;
            }
            None if memory.path.is_none() => self.lessons.forget(),
            _ => return,
        }
        self.show_learned();
    }

    /// Puts what was learned on the board. During a drive, only the feed announces it, because the greeting contains the drawing.
    fn show_learned(&mut self) {
        self.machine.offer(self.lessons.offered.is_some());
        let Lessons { growing, offered, accepted, .. } = &self.lessons;
        let shown = offered.as_ref().or(growing.as_ref()).or(accepted.as_ref());
        // A mission in a learned map is shown on that map, which is not the drawing.
        let fits = |learned: &&Learned| match self.watch.sheet() {
            Sheet::Drawing(Some(size_px)) => self.run.pad.draws() || learned.lesson.seen.size_px == size_px,
            _ => self.run.pad.draws(),
        };
        let picture = shown.filter(fits).and_then(|learned| walls::seen_png(&learned.lesson.seen));
        let image = picture.map(|picture| Image { kind: SketchType::Png, bytes: picture.into() });
        put_image(&self.caller.board.learned, image);
        let corrected = shown.map(|learned| learned.lesson.corrected.clone().into());
        put_image(&self.caller.board.corrected, corrected);
        self.lessons.picture += 1;
        self.is_new = true;
        if self.lessons.growing.is_none() {
            self.welcome();
        }
    }
}
