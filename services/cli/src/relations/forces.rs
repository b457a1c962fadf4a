//! The histogram of forces as a calculus: the best direction of one box from another, and how well it describes where the box is.

use std::fmt;
use std::str::FromStr;

use sketchnav_qualitative::calculus::Before;
use sketchnav_qualitative::hof::{Force, Grade, Pair, Polygon, View, Workspace};
use sketchnav_qualitative::{Calculus, Error, Point, Rect, Relation};

/// Number of directions that the result distinguishes, at equal angles.
const NAMED: usize = 16;
/// Number of directions for which the forces are computed.
const HISTOGRAM: usize = 180;
const GRADES: [(Grade, &str); 3] = [
    (Grade::Satisfactory, "satisfactory"),
    (Grade::RatherSatisfactory, "rather satisfactory"),
    (Grade::Unsatisfactory, "unsatisfactory"),
];

/// A box whose object has a heading.
#[derive(Debug, Clone, Copy)]
pub struct Extended {
    /// The box.
    pub rect: Rect,
    /// The heading of the object, in radians.
    pub heading_rad: f64,
}

/// The direction of the first box as seen from the second one, and how well that direction describes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// One of 16 directions, counter-clockwise from the heading of the second one.
    direction: usize,
    /// The index of the grade.
    grade: usize,
}

impl Relation for Place {
    const CALCULUS: &'static str = "forces";
    const COUNT: usize = NAMED * GRADES.len();

    fn index(self) -> usize {
        self.direction * GRADES.len() + self.grade
    }

    fn from_index(index: usize) -> Option<Self> {
        let place = Self { direction: index / GRADES.len(), grade: index % GRADES.len() };
        (index < Self::COUNT).then_some(place)
    }

    /// Always false. The degrees are equal, or at the limit of a grade, only for an instant, and no relation stands for that
    /// instant.
    fn limits_to(self, _: Self) -> bool {
        false
    }

    fn is_neighbour(self, other: Self) -> bool {
        let turn = (self.direction + NAMED - other.direction) % NAMED;
        self != other && matches!(turn, 0 | 1 | 15) && self.grade.abs_diff(other.grade) <= 1
    }

    /// Returns `None`, because the best direction jumps between neighbouring directions.
    fn between(self, _: Self) -> Option<Self> {
        None
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.direction, GRADES[self.grade].1)
    }
}

impl FromStr for Place {
    type Err = Error;

    fn from_str(word: &str) -> Result<Self, Error> {
        let found = Self::all().find(|place| place.to_string() == word);
        found.ok_or_else(|| Error::UnknownRelation {
            calculus: Self::CALCULUS,
            expected: "a direction from 0 to 15 and a grade".to_owned(),
            found: word.to_owned(),
        })
    }
}

/// The calculus of [`Place`], with constant forces (a histogram with exponent 0).
#[derive(Debug, Clone, Copy)]
pub struct Forces;

fn polygon(rect: Rect) -> Result<Polygon, Error> {
    let (x, y) = (rect.x(), rect.y());
    let corners = [[x.low(), y.low()], [x.high(), y.low()], [x.high(), y.high()], [x.low(), y.high()]];
    let corners: Vec<_> = corners.into_iter().map(Point::try_from).collect::<Result<_, _>>()?;
    Polygon::new(corners)
}

impl Calculus for Forces {
    type Scene = [Extended; 2];
    type Relation = Place;
    const OF_MOTION: bool = false;

    fn relate(&self, _: Before<'_, Self::Scene>, [first, second]: &Self::Scene) -> Option<Place> {
        let (argument, referent) = (polygon(first.rect).ok()?, polygon(second.rect).ok()?);
        let mut forces = [Force::ZERO; HISTOGRAM];
        Pair::new(&argument, &referent)
            .histogram_into(0.0, &mut forces, &mut Workspace::default())
            .expect("a valid exponent");
        let found = View::new(&forces, second.heading_rad).assess(NAMED)?;
        let grade = GRADES.iter().position(|(grade, _)| *grade == found.grade())?;
        Some(Place { direction: found.direction, grade })
    }
}
