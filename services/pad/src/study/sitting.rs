//! The participant at the page: how far they have come, what they may do next, and what is recorded about it.

use serde::{Deserialize, Serialize};

use super::record::{
    Answers, Drive, MAX_SUGGESTIONS, Measures, Orientation, Participant, Record, RecordError, SCALE,
    STATEMENTS, Statement,
};
use super::{Folder, StudyError};
use crate::machine::Memory;
use crate::protocol::{Refusal, Step};

/// Names of the series of files from a participant.
const DRAWINGS: &str = "drawing";
const PATHS: &str = "path";

/// The progress of a participant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stage {
    /// No participant has begun.
    Welcome,
    /// The participant draws.
    Draw,
    /// The drive has begun.
    Driven,
    /// The answers are given.
    Done,
}

/// What a participant sends to the study: `{"begin":{…}}`, `{"measures":{…}}` or `{"answers":{…}}`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Told {
    /// Who takes part.
    Begin(Begin),
    /// The page's measurements, which are required before the drive.
    Measures(Measures),
    /// The answers, after the drive.
    Answers(Answers),
}

/// Who takes part.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Begin {
    /// As in [`Participant`].
    pub code: String,
    /// As in [`Participant`].
    #[serde(default)]
    pub age: Option<u8>,
}

/// The part of the study shown on a page.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct View {
    /// The progress of the participant.
    pub stage: Stage,
    /// The participant's code, starting with [`Stage::Draw`].
    pub code: Option<String>,
    /// The orientation of the participant's sheet.
    pub sheet: Option<Orientation>,
    /// Whether `/api/place.svg` shows the floor.
    pub place: bool,
    /// What participants rate.
    pub statements: [Statement; STATEMENTS.len()],
    /// The words for 1 to 5.
    pub scale: [&'static str; SCALE.len()],
    /// Maximum length of the suggestions, in characters.
    pub suggestions: usize,
}

#[derive(Debug)]
struct Now {
    participant: Participant,
    stage: Stage,
    measures: Option<Measures>,
}

/// A study with one participant at a time at the page.
#[derive(Debug)]
pub struct Sitting {
    folder: Folder,
    now: Option<Now>,
}

impl Sitting {
    /// Waits for a participant.
    pub fn new(folder: Folder) -> Self {
        Self { folder, now: None }
    }

    /// The study's folder.
    pub fn folder(&self) -> &Folder {
        &self.folder
    }

    /// The code of the participant.
    pub fn code(&self) -> Option<&str> {
        self.now.as_ref().map(|now| now.participant.code.as_str())
    }

    fn stage(&self) -> Stage {
        self.now.as_ref().map_or(Stage::Welcome, |now| now.stage)
    }

    /// The content of a page.
    pub fn view(&self) -> View {
        View {
            stage: self.stage(),
            code: self.code().map(str::to_owned),
            sheet: self.now.as_ref().map(|now| now.participant.sheet),
            place: self.folder.facts().shows_floor,
            statements: STATEMENTS,
            scale: SCALE,
            suggestions: MAX_SUGGESTIONS,
        }
    }

    /// Resumes with a participant who has already begun.
    ///
    /// # Errors
    /// [`StudyError`] if the participant's files cannot be read.
    pub fn resume(&mut self, code: &str) -> Result<(), StudyError> {
        let Some(participant) = self.folder.read::<Participant>(code)? else { return Ok(()) };
        let is_done = self.folder.read::<Answers>(code)?.is_some();
        let is_driven = self.folder.read::<Drive>(code)?.is_some();
        let stage = match (is_done, is_driven) {
            (true, _) => Stage::Done,
            (_, true) => Stage::Driven,
            _ => Stage::Draw,
        };
        self.now = Some(Now { participant, stage, measures: None });
        Ok(())
    }

    /// Begins with a new participant, or resumes with one who was interrupted.
    ///
    /// # Errors
    /// An error if the code is invalid, if its participant has already finished, or if another participant
    /// has not.
    pub fn begin(&mut self, Begin { code, age }: Begin) -> Result<(), Refusal> {
        let code = code.trim().to_lowercase();
        if let Some(other) = self.code().filter(|other| *other != code) {
            return Err(Refusal::NotNow(format!("expected no participant yet, found {other}")));
        }
        let participant = Participant { code: code.clone(), age, sheet: Orientation::Landscape };
        participant.check().map_err(malformed)?;
        if self.folder.read::<Participant>(&code).map_err(failed)?.is_none() {
            let sheet = self.folder.next_sheet().map_err(failed)?;
            self.folder.begin(&Participant { sheet, ..participant }).map_err(failed)?;
        }
        let before = self.now.take();
        self.resume(&code).map_err(failed)?;
        if self.stage() == Stage::Done {
            self.now = before;
            return Err(Refusal::NotNow(format!("{code} has finished already: take another code")));
        }
        Ok(())
    }

    /// Stores the page's measurements.
    ///
    /// # Errors
    /// [`Refusal`] unless the participant is drawing.
    pub fn measure(&mut self, measures: Measures) -> Result<(), Refusal> {
        measures.check().map_err(malformed)?;
        match &mut self.now {
            Some(now) if now.stage == Stage::Draw => {
                now.measures = Some(measures);
                Ok(())
            }
            _ => Err(self.not_now("a participant draws")),
        }
    }

    /// Returns true if the study allows a step. A study begins with a participant, and only one drawing is
    /// driven, once.
    ///
    /// # Errors
    /// [`Refusal`], which states the requirement.
    pub fn check(&self, step: Step) -> Result<(), Refusal> {
        let holds = match step {
            Step::Sketch | Step::Path => self.stage() == Stage::Draw,
            // A successor of a pad that died may not have sent the order yet.
            Step::Execute => matches!(self.stage(), Stage::Draw | Stage::Driven),
            Step::Again | Step::Accept | Step::Reject => false,
            Step::Abort | Step::Restore | Step::Here => true,
        };
        if holds { Ok(()) } else { Err(self.not_now("a participant draws, and the robot drives once")) }
    }

    /// Stores the drawing that the sketcher has just accepted, or the path in it.
    ///
    /// # Errors
    /// [`Refusal::File`].
    pub fn keep(&self, memory: &Memory) -> Result<(), Refusal> {
        let Some(code) = self.code() else { return Ok(()) };
        let kept = match (&memory.path, &memory.sketch) {
            (Some(path), _) => self.folder.write_next(code, PATHS, "json", path.body.as_bytes()),
            (None, Some(drawn)) => {
                self.folder.write_next(code, DRAWINGS, drawn.kind.extension(), &drawn.bytes)
            }
            (None, None) => Ok(()),
        };
        kept.map_err(failed)
    }

    /// Records that the drive begins.
    ///
    /// # Errors
    /// An error if the drawing time or the drive is not known, and [`Refusal::File`].
    pub fn drive(&mut self, recording: &str) -> Result<(), Refusal> {
        let Some(now) = self.now.as_mut().filter(|now| now.stage == Stage::Draw) else { return Ok(()) };
        let code = now.participant.code.as_str();
        let last = |series| Ok(self.folder.last(code, series).map_err(failed)?.map(|(_, name)| name));
        let (Some(measures), Some(drawing), Some(path)) = (now.measures, last(DRAWINGS)?, last(PATHS)?)
        else {
            let expected = "expected a drawing, a path in it and how long they took; found not all of them";
            return Err(Refusal::NotNow(expected.into()));
        };
        let own = std::path::Path::new(recording).strip_prefix(self.folder.path());
        let recording = own.map_or(recording.into(), |own| own.to_string_lossy().into_owned());
        self.folder.write(code, &Drive { drawing, path, recording, measures }).map_err(failed)?;
        now.stage = Stage::Driven;
        Ok(())
    }

    /// Takes the answers.
    ///
    /// # Errors
    /// An error unless the participant has driven and the answers are complete, and [`Refusal::File`].
    pub fn answer(&mut self, answers: &Answers) -> Result<(), Refusal> {
        answers.check().map_err(malformed)?;
        let not_now = self.not_now("the robot has driven");
        let now = self.now.as_mut().filter(|now| now.stage == Stage::Driven).ok_or(not_now)?;
        self.folder.write(&now.participant.code, answers).map_err(failed)?;
        now.stage = Stage::Done;
        Ok(())
    }

    fn not_now(&self, expected: &str) -> Refusal {
        let found = match self.stage() {
            Stage::Welcome => "no participant has begun",
            Stage::Draw => "the participant draws",
            Stage::Driven => "the drive has begun",
            Stage::Done => "the participant has finished",
        };
        Refusal::NotNow(format!("expected that {expected}; found that {found}"))
    }
}

fn malformed(error: RecordError) -> Refusal {
    Refusal::malformed("the study", error)
}

fn failed(error: StudyError) -> Refusal {
    Refusal::File(error.to_string())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::folder::tests::facts;
    use super::super::record::tests::{answers, measures};
    use super::*;
    use crate::machine::{AcceptedSketch, Path as DrawnPath};
    use crate::protocol::SketchType;

    fn sitting(folder: &Path) -> Sitting {
        Sitting::new(Folder::create(folder, &facts()).unwrap())
    }

    fn begin(code: &str) -> Begin {
        Begin { code: code.into(), age: None }
    }

    fn drawn() -> Memory {
        let sketch = AcceptedSketch {
            kind: SketchType::Strokes,
            bytes: b"{}".to_vec(),
            canvas: [9, 9],
            size_px: [9, 9],
            scale: 1.0,
        };
        Memory { sketch: Some(sketch), ..Memory::default() }
    }

    fn with_path(memory: Memory) -> Memory {
        let path = DrawnPath { body: "[]".into(), marks: Vec::new(), placing: Vec::new(), sketch_seq: 1 };
        Memory { path: Some(path), ..memory }
    }

    /// The steps that a study allows, among those that need a participant.
    fn allowed(sitting: &Sitting) -> Vec<Step> {
        let steps = [Step::Sketch, Step::Path, Step::Execute, Step::Again];
        steps.into_iter().filter(|&step| sitting.check(step).is_ok()).collect()
    }

    #[test]
    fn a_participant_draws_drives_once_and_answers() {
        let place = tempfile::tempdir().unwrap();
        let mut sitting = sitting(place.path());
        assert_eq!((sitting.stage(), allowed(&sitting)), (Stage::Welcome, vec![]));
        assert_eq!(sitting.measure(measures(1.0)).unwrap_err().status(), 409);
        sitting.begin(begin(" P-1 ")).unwrap();
        assert_eq!((sitting.code(), sitting.view().sheet), (Some("p-1"), Some(Orientation::Landscape)));
        assert_eq!(allowed(&sitting), [Step::Sketch, Step::Path, Step::Execute]);
        sitting.keep(&drawn()).unwrap();
        sitting.keep(&with_path(drawn())).unwrap();
        assert_eq!(sitting.drive("r.mcap").unwrap_err().status(), 409, "not measured yet");
        sitting.measure(measures(61.0)).unwrap();
        assert_eq!(sitting.answer(&answers(4, "")).unwrap_err().status(), 409, "not driven yet");
        let recording = place.path().join("recordings/court-001/court.mcap");
        sitting.drive(recording.to_str().unwrap()).unwrap();
        assert_eq!(allowed(&sitting), [Step::Execute], "the order may still be on its way");
        assert!(sitting.check(Step::Abort).is_ok() && sitting.check(Step::Restore).is_ok());
        let drive = sitting.folder().read::<Drive>("p-1").unwrap().unwrap();
        assert_eq!((drive.drawing.as_str(), drive.path.as_str()), ("drawing-1.json", "path-1.json"));
        assert_eq!(
            (drive.recording.as_str(), drive.measures),
            ("recordings/court-001/court.mcap", measures(61.0))
        );
        let mut half = answers(4, "more colours");
        half.ratings.remove("steps");
        assert_eq!(sitting.answer(&half).unwrap_err().status(), 400);
        sitting.answer(&answers(4, "more colours")).unwrap();
        assert_eq!((sitting.stage(), allowed(&sitting)), (Stage::Done, vec![]));
        assert_eq!(sitting.folder().read("p-1").unwrap(), Some(answers(4, "more colours")));
    }

    #[test]
    fn a_participant_who_was_interrupted_goes_on() {
        let place = tempfile::tempdir().unwrap();
        let mut first = sitting(place.path());
        first.begin(begin("p-1")).unwrap();
        first.keep(&drawn()).unwrap();
        first.begin(begin("p-1")).unwrap();
        assert_eq!(first.begin(begin("p-2")).unwrap_err().status(), 409, "one at a time");

        let mut second = sitting(place.path());
        second.begin(begin("p-1")).unwrap();
        assert_eq!(second.stage(), Stage::Draw);
        second.keep(&drawn()).unwrap();
        second.keep(&with_path(drawn())).unwrap();
        second.measure(measures(5.0)).unwrap();
        second.drive("/elsewhere/r.mcap").unwrap();
        let drive = second.folder().read::<Drive>("p-1").unwrap().unwrap();
        assert_eq!(
            (drive.drawing.as_str(), drive.recording.as_str()),
            ("drawing-2.json", "/elsewhere/r.mcap")
        );

        let mut third = sitting(place.path());
        third.resume("p-1").unwrap();
        assert_eq!(third.stage(), Stage::Driven, "only the answers are missing");
        third.answer(&answers(2, "")).unwrap();
        let mut fourth = sitting(place.path());
        assert_eq!(fourth.begin(begin("p-1")).unwrap_err().status(), 409);
        assert_eq!(fourth.stage(), Stage::Welcome);
        fourth.begin(begin("p-2")).unwrap();
        assert_eq!(fourth.view().sheet, Some(Orientation::Portrait));
    }

    #[test]
    fn what_a_page_tells_is_one_of_three_things() {
        let told = |text: &str| serde_json::from_str::<Told>(text).map_err(|error| error.to_string());
        assert_eq!(
            told(r#"{"begin":{"code":"a","age":30}}"#),
            Ok(Told::Begin(Begin { code: "a".into(), age: Some(30) }))
        );
        let text = format!("{{\"measures\":{}}}", serde_json::to_string(&measures(2.0)).unwrap());
        assert_eq!(told(&text), Ok(Told::Measures(measures(2.0))));
        let text = format!("{{\"answers\":{}}}", answers(3, "x").text());
        assert_eq!(told(&text), Ok(Told::Answers(answers(3, "x"))));
        assert!(told(r#"{"begin":{"code":"a","name":"Anna"}}"#).unwrap_err().contains("name"));
        assert!(told("{}").is_err() && told(r#"{"other":1}"#).is_err());
    }
}
