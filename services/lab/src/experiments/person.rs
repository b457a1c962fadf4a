//! A person who watches a drive with the drawing in hand, and answers when the robot asks where it is.
//!
//! The person sees the true pose of the robot, and points at the corresponding pose in the drawing as precisely as people mark a
//! start. If a robot that drives past landmarks offers positions to choose from, and one of them is approximately right, the person
//! chooses it. The person only answers questions of the robot, and gives up on the drive after a few answers.

use nalgebra::Complex;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64Mcg;
use sketchnav_landmarks::mission as landmarks;
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::codes::{FREE, Process};
use sketchnav_schemas::geometry::{Point, Pose, Sketch, World, wrap_angle};
use sketchnav_schemas::message::Here;
use sketchnav_schemas::run::RunConfig;
use sketchnav_schemas::seed;
use sketchnav_sketch::messages::{QUESTION, QuestionKind};
use sketchnav_sketch::reading::DrawnMap;
use sketchnav_stage::lookout::Lookout;
use sketchnav_stage::{Access, Incoming};

use crate::experiments::outcome::{Kind, TaskOutcome};
use crate::experiments::section::Section;
use crate::experiments::table::Table;
use crate::experiments::trial::StartError;

/// Maximum number of answers during a drive. If the robot asks again, the person gives up.
const MOST_ANSWERS: u32 = 4;
/// Minimum time between two answers, in nanoseconds of simulation time.
const PAUSE_NS: u64 = 5_000_000_000;
/// Maximum error of an offered position that counts as approximately right, as a share of the distance between the two matched
/// places that are farthest apart.
const ABOUT: f64 = 0.05;

/// What a person knows about how positions in the world correspond to positions in the drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct Person {
    /// Pairs of positions in the world, in metres, and in the drawing, in pixels of the frame `Sketch`.
    matched: Vec<[Complex<f64>; 2]>,
}

impl Person {
    /// Creates a person from positions on the floor and the corresponding positions in the drawing. At least one pair is needed. If
    /// there is only one, one metre counts as one pixel.
    pub fn new(matched: impl IntoIterator<Item = (Point<World>, Point<Sketch>)>) -> Self {
        let pair = |(world, sketch): (Point<World>, Point<Sketch>)| {
            [Complex::new(world.x, world.y), Complex::new(sketch.x, sketch.y)]
        };
        Self { matched: matched.into_iter().map(pair).collect() }
    }

    /// Returns the maximum distance between two matched places in the drawing, in pixels.
    fn extent_px(&self) -> f64 {
        let places = || self.matched.iter().map(|[_, sketch]| sketch);
        places().flat_map(|a| places().map(move |b| (a - b).norm())).fold(0.0, f64::max)
    }

    /// Returns the pose of the robot as the person would draw it. It is mapped by the similarity transform that best fits the
    /// matched places, with more weight on nearby ones (Schaefer, McPhail, Warren 2006, section 2.2).
    pub fn drawn(&self, robot: &Pose<World>) -> Pose<Sketch> {
        let at = Complex::new(robot.x, robot.y);
        let weighted = || {
            self.matched
                .iter()
                .map(move |[world, sketch]| (1.0 / (world - at).norm_sqr().max(1e-12), world, sketch))
        };
        let total: f64 = weighted().map(|(weight, ..)| weight).sum();
        let from = weighted().map(|(weight, world, _)| world * weight).sum::<Complex<f64>>() / total;
        let to = weighted().map(|(weight, _, sketch)| sketch * weight).sum::<Complex<f64>>() / total;
        let over: Complex<f64> = weighted().map(|(weight, p, q)| (q - to) * (p - from).conj() * weight).sum();
        let under: f64 = weighted().map(|(weight, p, _)| (p - from).norm_sqr() * weight).sum();
        let turn = if under > 0.0 { over / under } else { Complex::new(1.0, 0.0) };
        let drawn = turn * (at - from) + to;
        Pose::new(drawn.re, drawn.im, wrap_angle(robot.yaw_rad + turn.arg()))
    }
}

/// A person who watches a drive.
pub struct Bystander<'a> {
    person: &'a Person,
    /// The drawing, unless the robot drives past landmarks.
    paper: Option<&'a DrawnMap>,
    /// The page on which a robot that drives past landmarks asks its question.
    page: Option<(Access, Box<dyn Lookout>)>,
    rng: Pcg64Mcg,
    question: QuestionKind,
    asked_ns: Option<u64>,
    /// Number of times that the person was asked.
    asked: u32,
}

impl<'a> Bystander<'a> {
    /// Creates the person for a drive, either by the drawing `paper` or past landmarks. `seed` is that of the first run of the
    /// trial.
    pub fn new(person: &'a Person, paper: Option<&'a DrawnMap>, run: &RunConfig, seed: u64) -> Self {
        let rng = seed::stream(seed, "eval/person");
        let lookout = sketchnav_landmarks::NAVIGATOR.lookout.filter(|_| paper.is_none());
        let page = lookout.map(|lookout| (Access::new(Process::Pad, landmarks::KIND), lookout(run)));
        Self { person, paper, page, rng, question: QuestionKind::Nothing, asked_ns: None, asked: 0 }
    }

    /// Processes a message, which may be a question.
    pub fn receive(&mut self, spec: &'static ChannelSpec, message: &[u8], cells: &[u8]) {
        let asked =
            QUESTION.message(spec, message).and_then(|question| QuestionKind::from_code(question.kind));
        self.question = asked.unwrap_or(self.question);
        if let Some((access, page)) = &mut self.page {
            // The page ignores messages of channels that it does not read.
            let _ = page.receive(&Incoming::new(access, spec, message, cells));
            self.question = page.question().map_or(QuestionKind::Nothing, |_| QuestionKind::Where);
        }
    }

    /// Returns the number of answers so far.
    pub fn answers(&self) -> u32 {
        self.asked.min(MOST_ANSWERS)
    }

    /// Returns true if the robot has asked more often than the person is willing to answer.
    pub fn gives_up(&self) -> bool {
        self.asked > MOST_ANSWERS
    }

    /// Returns true if the person has given up and the robot is lost.
    pub fn leaves_it_lost(&self) -> bool {
        self.gives_up() && self.question == QuestionKind::Where
    }

    /// Returns an answer if the robot asks a question. The answer is repeated as long as the robot keeps asking. `robot` is its
    /// true pose at `stamp_ns`.
    pub fn answer(&mut self, robot: &Pose<World>, stamp_ns: u64) -> Option<Here> {
        let is_due = self.asked_ns.is_none_or(|asked_ns| stamp_ns >= asked_ns + PAUSE_NS);
        if self.question == QuestionKind::Nothing || !is_due {
            return None;
        }
        (self.asked_ns, self.asked) = (Some(stamp_ns), self.asked + 1);
        if self.gives_up() {
            return None;
        }
        if let Some(at) = self.offered(robot) {
            return Some(Here { at, yaw_rad: None });
        }
        let pose = self.point_at(robot);
        // Only `Where` asks for a heading, so the answer to `Which` has none.
        let yaw_rad = (self.question == QuestionKind::Where).then_some(pose.yaw_rad);
        Some(Here { at: pose.position(), yaw_rad })
    }

    /// Returns the position closest to the truth that the robot offers on the page, if it is approximately right.
    fn offered(&self, robot: &Pose<World>) -> Option<Point<Sketch>> {
        let (_, page) = self.page.as_ref()?;
        let truth = self.person.drawn(robot).position();
        let places = page.question()?.into_iter().map(Point::from);
        let nearest = places.min_by(|a, b| a.distance(&truth).total_cmp(&b.distance(&truth)))?;
        (nearest.distance(&truth) <= ABOUT * self.person.extent_px()).then_some(nearest)
    }

    /// Returns the pose that the person marks for the robot: the free position nearest to the drawn one, with the errors that
    /// people make.
    fn point_at(&mut self, robot: &Pose<World>) -> Pose<Sketch> {
        let drawn = self.person.drawn(robot);
        let error = StartError::OF_PEOPLE;
        let Ok(normal) = Normal::new(0.0, 1.0) else { return drawn };
        let mut draw = || normal.sample(&mut self.rng);
        let yaw_rad = wrap_angle(drawn.yaw_rad + (error.heading_deg * draw()).to_radians());
        let place = drawn.position();
        let Some(paper) = self.paper else {
            let spread_px = error.spread_share * self.person.extent_px();
            return Pose::new(place.x + spread_px * draw(), place.y + spread_px * draw(), yaw_rad);
        };
        let is_free = |cell: usize| paper.cells[cell] == FREE;
        let nearest = (paper.cell(&place) != Some(FREE)).then(|| nearest_cell(paper, &place, is_free));
        let free = nearest.flatten().unwrap_or(place);
        let at = error.mark(paper, &free, draw).unwrap_or(free);
        Pose::new(at.x, at.y, yaw_rad)
    }
}

/// Returns the centre of the cell nearest to a point of the drawing, among those accepted by `counts`, or `None` if there are none.
pub(super) fn nearest_cell(
    drawing: &DrawnMap,
    at: &Point<Sketch>,
    counts: impl Fn(usize) -> bool,
) -> Option<Point<Sketch>> {
    let width = drawing.width_px as usize;
    let middle = |i: usize| Point::<Sketch>::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
    let counted = (0..drawing.cells.len()).filter(|&i| counts(i)).map(middle);
    counted.min_by(|a, b| a.distance(at).total_cmp(&b.distance(at)))
}

/// Returns a section about how often the robot asked, and how the drives in which it asked ended.
pub fn sections(outcomes: &[TaskOutcome]) -> Vec<Section> {
    let mut lines: Vec<(&str, Option<&str>)> = Vec::new();
    for outcome in outcomes {
        let line = (outcome.method.as_str(), Some(outcome.drawing.as_str()));
        if !lines.contains(&line) {
            lines.push(line);
        }
    }
    let mut methods: Vec<_> = lines.iter().map(|(method, _)| (*method, None)).collect();
    methods.dedup();
    lines.extend(methods);
    let row = |(method, drawing): &(&str, Option<&str>)| {
        let is_of = |outcome: &&TaskOutcome| {
            outcome.method == *method && drawing.is_none_or(|drawing| outcome.drawing == drawing)
        };
        let all: Vec<_> = outcomes.iter().filter(is_of).collect();
        let asked: Vec<_> = all.iter().filter(|outcome| outcome.answers > 0).collect();
        let count = |kind: Kind| asked.iter().filter(|outcome| outcome.kind == kind).count();
        let answers: u32 = asked.iter().map(|outcome| outcome.answers).sum();
        let figures =
            [all.len(), asked.len(), answers as usize, count(Kind::Reached), count(Kind::WrongArrival)];
        let words = [*method, drawing.unwrap_or("all")].map(str::to_owned);
        words.into_iter().chain(figures.iter().map(usize::to_string)).collect()
    };
    let header = [
        "method",
        "drawing",
        "drives",
        "drives with a question",
        "answers",
        "then reached",
        "wrong arrivals afterwards",
    ];
    let words = format!(
        "The person answers truthfully and points as accurately as people mark a start. At the question after {MOST_ANSWERS} \
         answers they give the drive up."
    );
    vec![Section {
        title: "The robot's questions".to_owned(),
        table: Table { header: header.map(str::to_owned).to_vec(), rows: lines.iter().map(row).collect() },
        words: vec![words],
        plots: Vec::new(),
    }]
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use bytemuck::Zeroable;
    use sketchnav_sketch::messages::Question;
    use sketchnav_sketch::mission::WallTone;
    use sketchnav_sketch::reading::Options;
    use sketchnav_stage::Denied;
    use sketchnav_stage::lookout::Picture;

    use super::*;

    /// The drawing is rotated by a quarter turn at ten pixels per metre, and the last corner is drawn too far out.
    const CORNERS: [([f64; 2], [f64; 2]); 4] = [
        ([0.0, 0.0], [100.0, 0.0]),
        ([4.0, 0.0], [100.0, 40.0]),
        ([4.0, 3.0], [70.0, 40.0]),
        ([0.0, 3.0], [70.0, -15.0]),
    ];

    fn person(corners: &[([f64; 2], [f64; 2])]) -> Person {
        Person::new(corners.iter().map(|(at, px)| (Point::new(at[0], at[1]), Point::new(px[0], px[1]))))
    }

    #[test]
    fn matched_places_map_exactly_and_headings_turn_with_the_drawing() {
        let person = person(&CORNERS);
        for ([x, y], [column, row]) in CORNERS {
            let drawn = person.drawn(&Pose::new(x, y, 0.0));
            assert!((drawn.x - column).hypot(drawn.y - row) < 1e-3, "{drawn:?}");
        }
        let drawn = person.drawn(&Pose::new(4.0, 0.1, 0.0));
        assert!((drawn.yaw_rad.to_degrees() - 90.0).abs() < 10.0, "{drawn:?}");
    }

    /// Returns a sheet of 60 by 20 pixels with a wall in the middle.
    fn paper() -> DrawnMap {
        let svg = r##"<svg xmlns="http://www.w3.org/2000/svg" width="60" height="20">
            <rect width="60" height="20" fill="#ffffff"/><rect x="28" width="4" height="20" fill="#000000"/></svg>"##;
        let options = Options { walls: WallTone::Dark, ..Options::default() };
        sketchnav_sketch::reading::read(svg.as_bytes(), "room.svg", &options).unwrap()
    }

    fn run() -> RunConfig {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../sim/missions/landmarks/scene-a.toml");
        let (mission, robot) = sketchnav_sim::mission_file::load(&folder).unwrap();
        RunConfig::lockstep("person", mission, robot, 1)
    }

    fn asks(bystander: &mut Bystander<'_>, kind: QuestionKind) {
        let question = Question { kind: kind.code(), ..Question::zeroed() };
        bystander.receive(QUESTION.spec, bytemuck::bytes_of(&question), &[]);
    }

    /// Returns a person whose world coincides with the sheet, at a tenth of a metre per pixel.
    fn person_of(paper: &DrawnMap) -> Person {
        let at = |x: f64| (Point::new(x, 0.0), paper.from_image([10.0 * x, 20.0]));
        Person::new([at(0.0), at(6.0)])
    }

    #[test]
    fn repeated_questions_are_answered_after_a_pause_and_only_a_few_times() {
        let paper = paper();
        let person = person_of(&paper);
        let mut bystander = Bystander::new(&person, Some(&paper), &run(), 1);
        let robot = Pose::new(1.0, 1.0, 0.5);
        assert_eq!(bystander.answer(&robot, 0), None, "nobody has asked");
        asks(&mut bystander, QuestionKind::Which);
        let answer = bystander.answer(&robot, 0).unwrap();
        let [column, row] = paper.to_image(&answer.at);
        assert!(
            (column - 10.0).hypot(row - 10.0) < 3.0 && answer.yaw_rad.is_none(),
            "{column}, {row}: {answer:?}"
        );
        assert_eq!(bystander.answer(&robot, PAUSE_NS - 1), None);
        asks(&mut bystander, QuestionKind::Where);
        let answer = bystander.answer(&robot, PAUSE_NS).unwrap();
        assert!((answer.yaw_rad.unwrap() - 0.5).abs() < 0.5, "{answer:?}");
        let more = (2..).map(|k| bystander.answer(&robot, k * PAUSE_NS)).take_while(Option::is_some).count();
        assert_eq!((more, bystander.answers()), (2, MOST_ANSWERS));
        assert!(bystander.gives_up() && bystander.leaves_it_lost());
    }

    /// A page that offers the given positions.
    struct Offers(Vec<[f64; 2]>);

    impl Lookout for Offers {
        fn receive(&mut self, _: &Incoming<'_>) -> Result<(), Denied> {
            Ok(())
        }

        fn question(&self) -> Option<Vec<[f64; 2]>> {
            Some(self.0.clone())
        }

        fn draw(&mut self, _: &mut Picture) {}
    }

    #[test]
    fn an_offered_place_is_chosen_if_it_is_about_right() {
        let person = person(&CORNERS);
        let at_a_corner = Pose::new(0.0, 0.0, 0.3);
        let answer = |places: &[[f64; 2]]| {
            let page: Box<dyn Lookout> = Box::new(Offers(places.to_vec()));
            let page = Some((Access::new(Process::Pad, landmarks::KIND), page));
            let mut bystander = Bystander { page, ..Bystander::new(&person, None, &run(), 1) };
            bystander.receive(QUESTION.spec, bytemuck::bytes_of(&Question::zeroed()), &[]);
            bystander.answer(&at_a_corner, 0).unwrap()
        };
        let chosen = answer(&[[30.0, 30.0], [102.0, 1.0]]);
        assert_eq!(chosen, Here { at: Point::new(102.0, 1.0), yaw_rad: None });
        for places in [&[][..], &[[30.0, 30.0]]] {
            let pointed = answer(places);
            assert!(pointed.at.distance(&Point::new(100.0, 0.0)) < 4.0, "{pointed:?}");
            assert!(pointed.yaw_rad.is_some(), "{pointed:?}");
        }
    }

    #[test]
    fn answers_never_lie_in_a_wall_or_behind_it() {
        let paper = paper();
        let person = person_of(&paper);
        for seed in 0..200 {
            let at = Bystander::new(&person, Some(&paper), &run(), seed)
                .point_at(&Pose::new(2.85, 1.0, 0.0))
                .position();
            assert!(paper.cell(&at) == Some(FREE) && paper.to_image(&at)[0] < 30.0, "{at:?}");
        }
    }

    #[test]
    fn a_single_matched_place_is_enough_to_answer() {
        let drawn = person(&[([1.0, 1.0], [7.0, 8.0])]).drawn(&Pose::new(1.5, 1.0, 0.3));
        assert_eq!((drawn.x, drawn.y, drawn.yaw_rad), (7.5, 8.0, 0.3));
    }
}
