//! The sketcher stage while people draw. It receives objects and routes from the pad, and answers each of them.
//!
//! A page first sends the objects, then a route past them. The robot is assumed to stand at the beginning of the route, facing
//! along it. To continue from where the robot has stopped, a person sends a route that begins there, or first draws the objects
//! again. A rejected drawing changes nothing.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::channels::{DRAWING, UNDERSTOOD};
use sketchnav_schemas::codes::DrawingKind;
use sketchnav_schemas::message::Text;
use sketchnav_schemas::mission::{Mission, NavigatorChoice, Place, Task};
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::drawn::{Drawn, Kept, Marks, Placing};
use sketchnav_stage::lookout::Walls;
use sketchnav_stage::{Incoming, Outbox, Stage, StageError};

use crate::doubts;
use crate::error::{Error, LandmarksError};
use crate::file;
use crate::instructions::Instructions;
use crate::messages::LANDMARK_ROUTE;
use crate::mission::{LandmarksMission, Parameters};
use crate::sketch::check_objects;
use crate::sketcher::{Announced, extraction_of};

/// The functions that the pad calls to show and save drawings for this navigator.
pub const DRAWN: Drawn = Drawn { blank, placing: |_| Placing::Path, walls, keep, lessons: None };

/// File name in the mission that stands for a drawing sent by a person.
const NAME: &str = "the drawing";
/// Number of attempts after which a drawing that crashes the sketcher is refused.
const MAX_ATTEMPTS: u32 = 3;
/// Time limit of a route from the pad, in seconds of simulation time. A person is watching and can abort it.
const TIME_LIMIT_S: f64 = 1800.0;

/// Removes the sketch and the route from a mission, but keeps the scale of the canvas.
fn blank(mission: &mut Mission) -> Result<(), StageError> {
    LandmarksMission::of(mission)?;
    let NavigatorChoice { given, .. } = &mut mission.navigator;
    for key in ["route_file", "route"] {
        given.remove(key);
    }
    given.insert("drawing".into(), NAME.into());
    mission.task = vec![Task {
        name: "route".into(),
        there: Place::default(),
        time_limit_s: TIME_LIMIT_S,
        given: toml::Table::new(),
    }];
    Ok(())
}

/// Writes a drawing and its route into a mission.
fn keep(mission: &mut Mission, kept: &Kept<'_>) -> Result<(), StageError> {
    let points = kept.marks.route.iter().flatten();
    let points = points.map(|[column, row]| toml::Value::from(vec![*column, *row])).collect::<Vec<_>>();
    let given = &mut mission.navigator.given;
    given.insert("drawing".into(), kept.drawing.into());
    given.insert("route".into(), points.into());
    Ok(())
}

/// Returns the outlines of a valid drawing, as the sketcher understands them.
fn walls(_: &RunConfig, bytes: &[u8]) -> Option<Walls> {
    let drawing = file::read(bytes).ok()?;
    let outlines = check_objects(&drawing).ok()?;
    Some(crate::lookout::painted(&outlines, drawing.canvas))
}

/// Drawings that a person has sent.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
struct Sent {
    /// The file with the objects.
    objects: Vec<u8>,
    /// The marks that contain the route. Empty if no route has been drawn past the objects yet.
    route: Vec<u8>,
}

/// The answer to a drawing.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Answer {
    kind: u32,
    /// The doubts about the drawing, or why it was rejected.
    outcome: Result<String, String>,
}

/// State of the sketcher, for a checkpoint.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct State {
    sent: Sent,
    answer: Option<Answer>,
}

/// Sketcher that answers each drawing from the pad with one message, after sending the route that follows from the drawing.
pub struct LiveSketcher {
    mission: LandmarksMission,
    parameters: Parameters,
    robot: Robot,
    /// Width and height of the canvas, in pixels.
    canvas: [f64; 2],
    route: Option<Announced>,
    state: State,
}

impl LiveSketcher {
    /// Creates the sketcher for a run in which people draw.
    ///
    /// # Errors
    /// [`LandmarksError::Mission`] with an invalid key.
    pub fn new(run: &RunConfig) -> Result<Self, LandmarksError> {
        Ok(Self {
            mission: LandmarksMission::of(&run.mission)?,
            parameters: Parameters::of(&run.mission)?,
            robot: run.robot.clone(),
            canvas: [0.0; 2],
            route: None,
            state: State::default(),
        })
    }

    fn take(&mut self, kind: DrawingKind, bytes: &[u8]) -> Result<String, LandmarksError> {
        match kind {
            DrawingKind::Sketch => self.take_objects(bytes),
            DrawingKind::Route => self.take_route(bytes),
        }
    }

    fn take_objects(&mut self, bytes: &[u8]) -> Result<String, LandmarksError> {
        let wrong = |cause| LandmarksError::Input { file: NAME.into(), cause };
        let drawing = file::read(bytes).map_err(wrong)?;
        check_objects(&drawing).map_err(wrong)?;
        (self.canvas, self.route) = (drawing.canvas, None);
        self.state.sent = Sent { objects: bytes.to_vec(), route: Vec::new() };
        Ok(String::new())
    }

    fn take_route(&mut self, bytes: &[u8]) -> Result<String, LandmarksError> {
        let wrong = |cause| LandmarksError::Input { file: "the path".into(), cause };
        let marks: Marks =
            serde_json::from_slice(bytes).map_err(|error| wrong(Error::Json(error.to_string())))?;
        let objects = &self.state.sent.objects;
        if objects.is_empty() {
            return Err(wrong(Error::NoObjects));
        }
        let goals = marks.goals.len();
        let route = marks.route.ok_or_else(|| wrong(Error::Goals { found: goals }))?;
        let mission = LandmarksMission { route: Some(route), ..self.mission.clone() };
        let extraction = extraction_of(&self.parameters, &self.robot);
        let instructions = Instructions::of(&mission, objects, &extraction)
            .map_err(|cause| LandmarksError::Input { file: NAME.into(), cause })?;
        let found = doubts::of(&instructions, &mission, &self.parameters, &extraction);
        self.route = Some(Announced::of(&instructions)?);
        self.state.sent.route = bytes.to_vec();
        Ok(found.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))
    }
}

impl Stage for LiveSketcher {
    const FORM: &'static str = "landmarks live sketcher 1";
    type State = State;

    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), StageError> {
        let Some(about) = message.on(DRAWING)? else { return Ok(()) };
        let outcome = match DrawingKind::from_code(about.kind) {
            Some(_) if message.attempts >= MAX_ATTEMPTS => Err(format!(
                "expected a drawing that can be read, found one that stopped the sketcher {MAX_ATTEMPTS} times"
            )),
            Some(kind) => self.take(kind, message.cells()).map_err(|error| error.to_string()),
            None => Err(format!("expected objects or a path, found a drawing of kind {}", about.kind)),
        };
        self.state.answer = Some(Answer { kind: about.kind, outcome });
        Ok(())
    }

    fn announce(&mut self, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let Some(Answer { kind, outcome }) = &self.state.answer else { return Ok(()) };
        if let Some(route) = &self.route {
            let is_new = outcome.is_ok() && DrawingKind::from_code(*kind) == Some(DrawingKind::Route);
            if is_new {
                route.send(out)?;
            } else {
                route.repeat(out)?;
            }
        }
        let seq = out.last(LANDMARK_ROUTE)?;
        out.send(UNDERSTOOD, |answer| {
            (answer.kind, answer.accepted) = (*kind, outcome.is_ok().into());
            (answer.sketch_seq, answer.route_seq) = (seq, seq);
            [answer.sketch_width_px, answer.sketch_height_px] = self.canvas.map(|side| side as u32);
            (answer.scale, answer.wall_direction_rad) = (1.0, f64::NAN);
            let (Ok(words) | Err(words)) = outcome;
            answer.words = Text::new(words);
        })?;
        Ok(())
    }

    fn state(&self) -> impl Serialize {
        &self.state
    }

    fn restore(&mut self, state: State) -> Result<(), StageError> {
        let State { sent: Sent { objects, route }, answer } = state;
        if !objects.is_empty() {
            self.take_objects(&objects)?;
        }
        if !route.is_empty() {
            self.take_route(&route)?;
        }
        self.state.answer = answer;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OBJECTS: &[u8] = br#"{ "canvas": [1000, 500], "strokes": [],
        "obstacles": [{ "polygon": [[300, 100], [420, 100], [420, 200], [300, 200]], "label": "table" },
                      { "polygon": [[800, 200], [900, 200], [900, 300], [800, 300]], "label": "desk" }] }"#;
    const ROUTE: &[u8] = br#"{"route": [[50, 250], [400, 260], [770, 250]]}"#;

    fn sketcher() -> LiveSketcher {
        let mut run: RunConfig =
            serde_json::from_str(include_str!("../../../runtime/tests/run.json")).unwrap();
        run.mission.navigator = NavigatorChoice {
            kind: crate::mission::KIND.into(),
            given: toml::toml! { route_file = "words.txt" method = "chronis-2007" },
        };
        run.mission.parameters = Default::default();
        run.mission.task = vec![Task {
            name: "t".into(),
            there: Place::default(),
            time_limit_s: 9.0,
            given: toml::Table::new(),
        }];
        blank(&mut run.mission).unwrap();
        LiveSketcher::new(&run).unwrap()
    }

    fn refused(sketcher: &mut LiveSketcher, kind: DrawingKind, bytes: &[u8]) -> String {
        let before = sketcher.state.sent.clone();
        let error = sketcher.take(kind, bytes).unwrap_err().to_string();
        assert_eq!(sketcher.state.sent, before, "{error}");
        error
    }

    #[test]
    fn objects_and_then_a_route_make_instructions() {
        let mut sketcher = sketcher();
        sketcher.take(DrawingKind::Sketch, OBJECTS).unwrap();
        assert!(sketcher.route.is_none());
        sketcher.take(DrawingKind::Route, ROUTE).unwrap();
        let instructions = Instructions::read(&sketcher.route.as_ref().unwrap().cells).unwrap();
        let instructions_length = instructions.length().0;
        let sketch = instructions.sketch.unwrap();
        assert_eq!(sketch.landmarks.iter().map(|one| &one.name[..]).collect::<Vec<_>>(), ["table", "desk"]);
        let [first, last] =
            [sketch.route[0], sketch.route[sketch.route.len() - 1]].map(|at| sketch.pixel(at));
        assert!((first.x - 50.0).abs() + (first.y - 250.0).abs() < 1e-6, "{first:?}");
        assert!((last.x - 770.0).abs() < 1e-6, "{last:?}");
        // The person draws the rest of the route again from where the robot stands.
        sketcher.take(DrawingKind::Route, br#"{"route": [[420, 260], [600, 300], [770, 250]]}"#).unwrap();
        let rest = Instructions::read(&sketcher.route.as_ref().unwrap().cells).unwrap();
        assert!(rest.length().0 < 0.6 * instructions_length, "{:?}", rest.length());
    }

    #[test]
    fn what_is_refused_changes_nothing_and_says_what_was_expected() {
        let mut sketcher = sketcher();
        let early = refused(&mut sketcher, DrawingKind::Route, ROUTE);
        assert!(early.contains("expected at least one closed outline"), "{early}");
        let empty = refused(&mut sketcher, DrawingKind::Sketch, br#"{ "canvas": [9, 9], "strokes": [] }"#);
        assert!(empty.contains("expected at least one closed outline"), "{empty}");
        sketcher.take(DrawingKind::Sketch, OBJECTS).unwrap();
        sketcher.take(DrawingKind::Route, ROUTE).unwrap();
        for (bytes, words) in [
            (
                &br#"{"goals": [{"at": [1, 2]}]}"#[..],
                "expected a path past the objects, found none and 1 goals",
            ),
            (br#"{"route": [[50, 250], [360, 150], [770, 250]]}"#, "found one that enters table"),
            (b"{", "expected strokes in JSON"),
        ] {
            let error = refused(&mut sketcher, DrawingKind::Route, bytes);
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn a_successor_comes_to_the_same() {
        let mut first = sketcher();
        first.take(DrawingKind::Sketch, OBJECTS).unwrap();
        first.take(DrawingKind::Route, ROUTE).unwrap();
        let mut second = sketcher();
        second.restore(first.state.clone()).unwrap();
        assert_eq!(second.route.map(|route| route.cells), first.route.map(|route| route.cells));
        assert_eq!(second.state.sent, first.state.sent);
    }
}
