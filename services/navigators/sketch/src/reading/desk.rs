//! Accepts or rejects the drawings that arrive from the pad.
//!
//! A drawing is either a sketch or a set of marks in the sketch. The first marks after a sketch place the
//! robot: it starts where the route starts and faces along it (Boniardi et al. 2016, IV). Later marks leave
//! the robot where it is, unless they contain a start. If the first marks are goals without a start, the robot may be anywhere, and
//! the first route places it. A rejected drawing changes nothing.
//!
//! A sketch may be followed by a map learned on drives with it. Marks are then placed in the learned map, although they refer to
//! the sketch as before, and the robot may be anywhere. Sending the same sketch again ends this.
//!
//! Drawings are parsed and checked just like files. This module does not open channels or files.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::codes::DrawingKind;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::StageError;

use super::Marks;
use super::doubts::{self, Doubt};
use super::drawn_map::DrawnMap;
use super::error::{Broken, SketchError};
use super::file::read;
use super::places::{Intent, Places, flood};
use super::settings::Options;
use crate::learned::{DrawingFile, Learned, Learner};
use crate::mission::SketchMission;
use crate::task::PERSON_TIME_LIMIT_S;

/// Name that error messages use for a drawing that does not come from a file.
pub const NAME: &str = "the drawing";
/// The same for a learned map.
const LEARNED_NAME: &str = "what was learned";

/// The accepted drawings, byte for byte, which are sufficient to restore another [`Desk`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct State {
    sketch: Vec<u8>,
    /// The map learned with the sketch.
    learned: Vec<u8>,
    /// The marks that placed the robot.
    placing: Vec<u8>,
    /// The marks in force.
    marks: Vec<u8>,
}

/// The change that a drawing makes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Change {
    /// There is a new sketch, which has no marks yet.
    Sketch,
    /// There are new tasks, and the robot is placed again.
    Start,
    /// There are new tasks, and the robot stays where it is.
    Tasks,
}

/// The current sketch and its marks.
#[derive(Debug)]
pub struct Desk {
    options: Options,
    mission: SketchMission,
    drawing: Option<DrawnMap>,
    /// The map learned with the drawing and, once there are marks in it, the map as a sketch.
    learned: Option<(Learned, Option<DrawnMap>)>,
    places: Option<Places>,
    state: State,
    /// Range of the robot's laser in metres, if it has one.
    range_max_m: Option<f64>,
    /// The doubts about the drawing and its marks, in words.
    doubts: String,
}

impl Desk {
    /// Creates an empty desk.
    ///
    /// # Errors
    /// [`SketchError`], which names the invalid key of the run's mission or parameters.
    pub fn new(run: &RunConfig) -> Result<Self, SketchError> {
        let options = Options::of_mission(&run.mission, run.seed)?;
        let range_max_m = run.robot.laser.as_ref().map(|laser| laser.range_max_m);
        let (state, doubts) = (State::default(), String::new());
        let mission = SketchMission::of(&run.mission)?;
        Ok(Self { options, mission, drawing: None, learned: None, places: None, state, range_max_m, doubts })
    }

    /// Restores the state of another desk by processing its drawings again, in order.
    ///
    /// # Errors
    /// [`SketchError`] if a drawing is rejected, which does not happen with drawings that were accepted
    /// before.
    pub fn restore(&mut self, state: &State) -> Result<(), SketchError> {
        let parts = [
            (DrawingKind::Sketch, &state.sketch),
            (DrawingKind::Sketch, &state.learned),
            (DrawingKind::Route, &state.placing),
            (DrawingKind::Route, &state.marks),
        ];
        for (kind, bytes) in parts.into_iter().filter(|(_, bytes)| !bytes.is_empty()) {
            self.take(kind, bytes)?;
        }
        Ok(())
    }

    /// Processes a drawing and returns what it changes.
    ///
    /// # Errors
    /// [`SketchError`] with what was expected and what was found. In this case, nothing changes.
    pub fn take(&mut self, kind: DrawingKind, bytes: &[u8]) -> Result<Change, SketchError> {
        match kind {
            DrawingKind::Sketch if Learned::is_one(bytes) => self.take_learned(bytes),
            DrawingKind::Sketch => self.take_sketch(bytes),
            DrawingKind::Route => self.take_marks(bytes),
        }
    }

    /// Returns the sketch in force.
    pub fn drawing(&self) -> Option<&DrawnMap> {
        self.drawing.as_ref()
    }

    /// Returns the current sketch with its start and tasks, or `None` if there are none yet. For a learned map, this is the map.
    pub fn placed(&self) -> Option<(&DrawnMap, &Places)> {
        let sketch = match &self.learned {
            Some((_, map)) => map.as_ref(),
            None => self.drawing.as_ref(),
        };
        sketch.zip(self.places.as_ref())
    }

    /// Returns what was learned on a drive with the current sketch and its marks, together with the drawing.
    ///
    /// # Errors
    /// An error if there are no marks, or any error of [`Learner`].
    pub fn learned_by(&self, learner: &Learner) -> Result<(Learned, &DrawnMap), StageError> {
        let placed = self.drawing.as_ref().zip(self.places.as_ref());
        let (drawing, places) = placed.ok_or("expected a drawing with a route or goals in it, found none")?;
        let learned = match &self.learned {
            Some((before, _)) => {
                let marks: Marks = serde_json::from_slice(&self.state.marks)?;
                learner.merged(before, &Intent::of_marks(&marks), places)?
            }
            None => learner.learned(DrawingFile::of(NAME, &self.state.sketch), drawing, places)?,
        };
        Ok((learned, drawing))
    }

    /// Returns the doubts about the drawing and its marks in words, or an empty string if there are none.
    pub fn doubts(&self) -> &str {
        &self.doubts
    }

    /// Returns the accepted drawings, for a checkpoint.
    pub fn state(&self) -> &State {
        &self.state
    }

    fn take_sketch(&mut self, bytes: &[u8]) -> Result<Change, SketchError> {
        let drawing = read(bytes, NAME, &self.options)?;
        self.doubts = words(&doubts::of_drawing(&drawing));
        self.drawing = Some(drawing);
        (self.learned, self.places) = (None, None);
        self.state = State { sketch: bytes.to_vec(), ..State::default() };
        Ok(Change::Sketch)
    }

    fn take_learned(&mut self, bytes: &[u8]) -> Result<Change, SketchError> {
        let learned = Learned::parse(bytes)
            .map_err(|reason| SketchError::Learned { file: LEARNED_NAME.to_owned(), reason })?;
        if self.drawing.is_none() {
            return Err(SketchError::NoSketch);
        }
        if !learned.drawing.is_same(&DrawingFile::of(NAME, &self.state.sketch)) {
            let (file, of, drawing) = (LEARNED_NAME.to_owned(), learned.drawing.file, NAME.to_owned());
            return Err(SketchError::LearnedByAnother { file, of, drawing });
        }
        self.doubts.clear();
        (self.learned, self.places) = (Some((learned, None)), None);
        let sketch = std::mem::take(&mut self.state.sketch);
        self.state = State { sketch, learned: bytes.to_vec(), ..State::default() };
        Ok(Change::Sketch)
    }

    fn take_marks(&mut self, bytes: &[u8]) -> Result<Change, SketchError> {
        let broken = Broken { file: "the path" };
        let marks: Marks = serde_json::from_slice(bytes).map_err(|error| broken.decode("JSON", error))?;
        let drawing = self.drawing.as_ref().ok_or(SketchError::NoSketch)?;
        let is_drawn = self.learned.is_none();
        let stays = self.places.as_ref().filter(|before| {
            let is_lost = is_drawn && before.is_anywhere(drawing);
            marks.start.is_none() && (!is_lost || may_stay(drawing, before, &marks))
        });
        let may_start_anywhere = self.mission.method_in(drawing.kind.origin()).finds_start();
        let mut intent = Intent { may_start_anywhere, ..Intent::of_marks(&marks) };
        intent.tasks.iter_mut().for_each(|task| task.time_limit_s = PERSON_TIME_LIMIT_S);
        if let Some(before) = stays.filter(|before| !(is_drawn && before.is_anywhere(drawing))) {
            intent.start = Some(drawing.to_image(&before.start.position()));
            intent.heading_deg = Some(before.start.yaw_rad.to_degrees());
        }
        let places = match &mut self.learned {
            // Doubts about a hand drawing do not apply to a map made with a laser.
            Some((learned, map)) => {
                let (seen, places) = learned.place(LEARNED_NAME, &intent, &self.options)?;
                *map = Some(seen);
                places
            }
            None => {
                let places = intent.place(drawing, &self.options.settings)?;
                let found = doubts::doubts(drawing, &places, self.range_max_m);
                doubts::hopeless(drawing, &places, &found)?;
                self.doubts = words(&found);
                places
            }
        };
        let change = if stays.is_some() { Change::Tasks } else { Change::Start };
        // A robot that stays keeps its start bit for bit. Converting the start to image pixels and back would change the last
        // bits.
        self.places = Some(match stays {
            Some(before) => Places { tasks: places.tasks, ..before.clone() },
            None => places,
        });
        self.state.marks = bytes.to_vec();
        if change == Change::Start {
            self.state.placing = bytes.to_vec();
        }
        Ok(change)
    }
}

/// Returns true if a robot that nobody has placed in the drawing may still be wherever it was thought to be, given its next marks:
/// they neither begin with a route, which places it, nor lead to another part of the drawing.
fn may_stay(drawing: &DrawnMap, before: &Places, marks: &Marks) -> bool {
    let Some(goal) = marks.goals.first() else { return false };
    let index = drawing.index(&drawing.from_image(goal.at));
    index.is_some_and(|index| flood(drawing, &before.start.position())[index])
}

fn words(doubts: &[Doubt]) -> String {
    doubts.iter().map(Doubt::to_string).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use sketchnav_schemas::geometry::Pose;

    use super::*;
    use crate::messages::SketchMap;

    const ROOM: &[u8] = br#"{ "canvas": [600, 400], "pad": { "underlay": "photo.jpg" },
        "strokes": [ { "points": [[50,50],[550,50],[550,350],[50,350],[50,50]], "width_px": 6 } ] }"#;
    const HALL: &[u8] = br#"{ "canvas": [300, 200],
        "strokes": [ { "points": [[20,20],[280,20],[280,180],[20,180],[20,20]] } ] }"#;
    const ROUTE: &[u8] = br#"{"route": [[100,300],[101,299],[300,300],[500,100]]}"#;
    const GOALS: &[u8] = br#"{"goals": [{"name": "kitchen", "at": [500,300]}, {"at": [100,100]}]}"#;
    const PLACED: &[u8] = br#"{"start": {"at": [200,100], "heading_deg": 90}, "goals": [{"at": [500,300]}]}"#;

    fn desk() -> Desk {
        let mut run: RunConfig =
            serde_json::from_str(include_str!("../../../../runtime/tests/run.json")).unwrap();
        run.mission.parameters = sketchnav_schemas::mission::Parameters::default();
        Desk::new(&run).unwrap()
    }

    fn start(desk: &Desk) -> Pose<sketchnav_schemas::geometry::Sketch> {
        desk.placed().unwrap().1.start
    }

    #[test]
    fn the_first_route_places_the_robot_and_later_ones_leave_it() {
        let mut desk = desk();
        assert_eq!(desk.take(DrawingKind::Sketch, ROOM), Ok(Change::Sketch));
        assert!(desk.placed().is_none() && desk.drawing().is_some());
        assert_eq!(desk.take(DrawingKind::Route, ROUTE), Ok(Change::Start));
        let first = start(&desk);
        assert_eq!((first.x, first.y, first.yaw_rad), (100.0, 100.0, 0.0));
        assert_eq!(desk.take(DrawingKind::Route, GOALS), Ok(Change::Tasks));
        assert_eq!(start(&desk), first);
        let names: Vec<_> = desk.placed().unwrap().1.tasks.iter().map(|e| e.name.clone()).collect();
        assert_eq!(names, ["kitchen", "goal 2"]);
        assert_eq!(desk.take(DrawingKind::Route, PLACED), Ok(Change::Start));
        assert_eq!((start(&desk).x, start(&desk).y), (200.0, 300.0));
    }

    /// A robot that has to find out where it is goes on to further goals in the same part of the drawing. A route places it, and so
    /// does a start.
    #[test]
    fn goals_without_a_start_leave_open_where_the_robot_is() {
        let mut desk = desk();
        desk.take(DrawingKind::Sketch, ROOM).unwrap();
        let is_anywhere = |desk: &Desk| desk.placed().unwrap().1.is_anywhere(desk.drawing().unwrap());
        assert_eq!(desk.take(DrawingKind::Route, GOALS), Ok(Change::Start));
        let first = start(&desk);
        assert_eq!(desk.take(DrawingKind::Route, br#"{"goals": [{"at": [150,120]}]}"#), Ok(Change::Tasks));
        assert!(is_anywhere(&desk) && start(&desk) == first);
        let mut successor = self::desk();
        successor.restore(desk.state()).unwrap();
        assert_eq!(successor.placed(), desk.placed());
        assert_eq!(
            desk.take(DrawingKind::Route, br#"{"goals": [{"at": [20,20]}]}"#),
            Ok(Change::Start),
            "outside"
        );
        assert_eq!(desk.take(DrawingKind::Route, GOALS), Ok(Change::Start), "inside again");
        assert_eq!(desk.take(DrawingKind::Route, ROUTE), Ok(Change::Start));
        assert!(!is_anywhere(&desk));
        desk.take(DrawingKind::Sketch, ROOM).unwrap();
        desk.take(DrawingKind::Route, GOALS).unwrap();
        assert_eq!(desk.take(DrawingKind::Route, PLACED), Ok(Change::Start));
        assert!(!is_anywhere(&desk));
    }

    #[test]
    fn another_sketch_has_no_marks() {
        let mut desk = desk();
        desk.take(DrawingKind::Sketch, ROOM).unwrap();
        desk.take(DrawingKind::Route, ROUTE).unwrap();
        desk.take(DrawingKind::Sketch, HALL).unwrap();
        assert!(desk.placed().is_none());
        let error = desk.take(DrawingKind::Route, ROUTE).unwrap_err().to_string();
        assert!(error.contains("expected a place in the drawing, 300 x 200 px"), "{error}");
    }

    #[test]
    fn what_is_refused_changes_nothing() {
        let mut desk = desk();
        let early = desk.take(DrawingKind::Route, ROUTE).unwrap_err();
        assert_eq!(early, SketchError::NoSketch);
        desk.take(DrawingKind::Sketch, ROOM).unwrap();
        desk.take(DrawingKind::Route, ROUTE).unwrap();
        let before = desk.state().clone();
        let wrong: [(DrawingKind, &[u8], &str); 6] = [
            (DrawingKind::Sketch, b"{", "strokes"),
            (DrawingKind::Sketch, br#"{"canvas":[30,30],"strokes":[]}"#, "expected walls"),
            (DrawingKind::Route, b"[1", "the path"),
            (DrawingKind::Route, br#"{"route": [[100,300],[900,300]]}"#, "route point 2 at (900, 300)"),
            (DrawingKind::Route, br#"{"goals": []}"#, "expected 1 to 64, found 0"),
            (DrawingKind::Route, br#"{"walls": []}"#, "walls"),
        ];
        for (kind, bytes, words) in wrong {
            let error = desk.take(kind, bytes).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
            assert_eq!(desk.state(), &before);
        }
    }

    /// Only a corner of two walls is drawn. The first route stays far away from it, and the second crosses one of the walls.
    #[test]
    fn what_is_doubted_is_said_and_what_is_hopeless_is_refused() {
        const CORNER: &[u8] =
            br#"{ "canvas": [1000, 800], "strokes": [ { "points": [[100,100],[500,100],[500,300]] } ] }"#;
        let mut desk = desk();
        desk.take(DrawingKind::Sketch, CORNER).unwrap();
        assert_eq!(desk.doubts(), "");
        let away = br#"{"route": [[900,600],[960,700]]}"#;
        let error = desk.take(DrawingKind::Route, away).unwrap_err().to_string();
        assert!(error.starts_with("navigator.start at (900, 600) of the drawing: expected walls"), "{error}");
        desk.take(DrawingKind::Route, br#"{"route": [[450,150],[450,200],[600,200]]}"#).unwrap();
        assert!(
            desk.doubts().starts_with("the walls do not enclose the start at (450, 150)"),
            "{}",
            desk.doubts()
        );
        assert!(desk.doubts().contains("; route: the route crosses a wall at (49"), "{}", desk.doubts());
        desk.take(DrawingKind::Sketch, ROOM).unwrap();
        assert_eq!(desk.doubts(), "");
    }

    #[test]
    fn a_successor_comes_to_the_same() {
        let mut first = desk();
        first.take(DrawingKind::Sketch, ROOM).unwrap();
        first.take(DrawingKind::Route, ROUTE).unwrap();
        first.take(DrawingKind::Route, GOALS).unwrap();
        let mut second = desk();
        second.restore(first.state()).unwrap();
        assert_eq!(second.placed(), first.placed());
        assert_eq!(second.state(), first.state());
    }

    /// A map of a room of 3 m by 2 m in the middle of the drawing, at 50 px per metre.
    fn learned(sketch: &[u8]) -> Vec<u8> {
        let file = serde_json::to_value(DrawingFile::of(NAME, sketch)).unwrap();
        let row = |cells: &str| serde_json::Value::from(cells);
        let rows: Vec<_> = (0..42).map(|i| if i % 41 == 0 { row("62o") } else { row("1o60f1o") }).collect();
        serde_json::to_vec(&serde_json::json!({
            "learned": 1, "drawing": file, "start": { "at": [300.0, 200.0], "heading_deg": 0.0 }, "goals": [],
            "map": { "resolution_m": 0.05, "origin_m": [-1.55, -1.05], "width": 62, "rows": rows },
            "pairs": [[300.0, 200.0, 0.0, 0.0], [350.0, 200.0, 1.0, 0.0]],
        }))
        .unwrap()
    }

    #[test]
    fn what_was_learned_takes_the_place_of_its_drawing_until_that_is_sent_again() {
        let mut desk = desk();
        desk.take(DrawingKind::Sketch, ROOM).unwrap();
        desk.take(DrawingKind::Route, ROUTE).unwrap();
        let by_hall = desk.take(DrawingKind::Sketch, &learned(HALL)).unwrap_err().to_string();
        assert!(by_hall.contains("learned by"), "{by_hall}");
        assert_eq!(desk.take(DrawingKind::Sketch, &learned(ROOM)), Ok(Change::Sketch));
        assert!(desk.placed().is_none());
        let error = desk.take(DrawingKind::Route, br#"{"goals": [[500,300]]}"#);
        assert!(error.is_err(), "{error:?}");
        let error = desk.take(DrawingKind::Route, br#"{"goals": [{"at": [540,340]}]}"#).unwrap_err();
        assert!(matches!(error, SketchError::Unseen { .. }), "{error}");
        assert_eq!(desk.take(DrawingKind::Route, br#"{"goals": [{"at": [350,200]}]}"#), Ok(Change::Start));
        let (map, places) = desk.placed().unwrap();
        let goal = places.tasks[0].end();
        assert_eq!((map.width_px, map.height_px, map.pen_width_px), (62, 42, SketchMap::NO_PEN_PX));
        assert!((goal.x - 51.0).abs() <= 1.0 && (goal.y - 21.0).abs() <= 1.0, "{goal:?}");
        let mut successor = self::desk();
        successor.restore(desk.state()).unwrap();
        assert_eq!(successor.placed(), desk.placed());
        desk.take(DrawingKind::Sketch, ROOM).unwrap();
        desk.take(DrawingKind::Route, ROUTE).unwrap();
        assert_eq!(desk.placed().unwrap().0.width_px, 600);
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn whatever_comes_nothing_panics_and_what_holds_stays(
            drawings in prop::collection::vec((any::<bool>(), 0..6_usize, 0.0..1.0_f64, any::<u8>()), 1..8),
        ) {
            let mut desk = desk();
            for (is_sketch, which, at, value) in drawings {
                let kind = if is_sketch { DrawingKind::Sketch } else { DrawingKind::Route };
                let mut bytes = [ROOM, HALL, ROUTE, GOALS, PLACED, b"noise"][which].to_vec();
                let index = (at * bytes.len() as f64) as usize;
                bytes[index] = value;
                let before = desk.state().clone();
                if desk.take(kind, &bytes).is_err() {
                    prop_assert_eq!(desk.state(), &before);
                }
            }
        }

        #[test]
        fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let mut desk = desk();
            let _ = desk.take(DrawingKind::Sketch, &bytes);
            desk.take(DrawingKind::Sketch, ROOM).unwrap();
            let _ = desk.take(DrawingKind::Route, &bytes);
        }
    }
}
