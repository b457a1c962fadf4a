//! The reasons for a task's status, put into words without allocations.

use std::fmt;

use sketchnav_schemas::geometry::{Point, Sketch};

use super::explorer::{Aim, Evidence};

/// Status of the method `outline` on the way to a goal if the floor consists of rooms.
pub const ROOMS: &str = "among rooms: driving as by `beam`";

/// The reason for a task's status.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reason {
    /// No reason.
    None,
    /// The floor that was seen consists of rooms, so the robot does not drive by its outline.
    Rooms,
    /// The sketch is missing.
    NoSketch,
    /// The route is missing.
    NoRoute,
    /// The localizer has no pose yet.
    NoPose,
    /// The robot has arrived, with its distance from the goal in metres.
    Arrived(f64),
    /// The robot cannot get any closer to the goal, with its distance from the goal in metres.
    NearEnough(f64),
    /// The robot seems to have arrived, but is looking around to make sure.
    LookingAround,
    /// The robot seems to have arrived, but the estimate is not credible, with the number of its jumps and its fit.
    Doubted(u32, f64),
    /// The robot is making a detour around an obstacle that is not in the drawing.
    Detour,
    /// The robot is stuck and is trying to recover, with the number of attempts so far.
    Recovering(u32),
    /// The path is shut at this place, with the number of attempts to get past it.
    Shut(Point<Sketch>, u32),
    /// The path is shut, with the number of attempts to get past. Where this is in the drawing is not known.
    Stuck(u32),
    /// The drawing shows no path to the goal, and none was found.
    NoDrawnWay(Point<Sketch>),
    /// The scans do not fit anywhere near the estimate, with the duration in seconds.
    Lost(f64),
    /// The robot is finding out where it is in the learned map.
    Finding,
    /// Somebody has carried the robot.
    Kidnapped,
    /// The goal may be here or elsewhere: nobody has marked the start, and another alignment costs only this much more.
    Alike(f64),
    /// Several places of the learned map look alike, with the number of times that the robot has looked around.
    Ambiguous(u32),
    /// The robot turns on the spot to see everything around it.
    Surveying,
    /// The walls seen are being compared with the drawing.
    Comparing,
    /// The filter has failed in a task among rooms, so the robot continues by the outline of what it has seen.
    HandedOver,
    /// The robot follows a course set by the comparison.
    Exploring(Aim),
    /// The goal is here according to the walls seen, with the evidence.
    Matched(Evidence),
    /// The robot must have gone astray, with the time under way, in seconds, and the length of the drawn path, in metres.
    Astray(f64, f64),
    /// A person has to choose where the robot is from several places, with their number and the amount by which the second
    /// one's alignment costs more.
    Asks(usize, f64),
}

/// The reason why a robot is lost, preceded by advice for a person. Short enough to fit into a status.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Help(pub Reason);

impl fmt::Display for Help {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("tap where it is; ")?;
        match self.0 {
            Reason::Astray(on_way_s, drawn_m) => {
                write!(f, "{on_way_s:.0} s on a drawn path of {drawn_m:.0} m")
            }
            Reason::Doubted(jumps, fit) => write!(f, "the scans fit badly ({fit:.1}), {jumps} jumps"),
            Reason::Alike(_) => f.write_str("several places in the drawing look alike"),
            reason => write!(f, "{reason}"),
        }
    }
}

/// Returns the letter of a place in a question: A, B, C, …
fn letter(place: usize) -> char {
    char::from(b'A' + (place % 26) as u8)
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => Ok(()),
            Self::Rooms => f.write_str(ROOMS),
            Self::NoSketch => f.write_str("waiting for the sketch"),
            Self::NoRoute => f.write_str("waiting for the route"),
            Self::NoPose => f.write_str("waiting for the localizer"),
            Self::Arrived(m) => write!(f, "{m:.2} m from the goal"),
            Self::NearEnough(m) => write!(f, "{m:.2} m from the goal, no path leads closer"),
            Self::LookingAround => f.write_str("at the goal, it seems: looking around to be sure"),
            Self::Doubted(jumps, fit) => {
                f.write_str("at the goal, it seems, but the estimate ")?;
                match jumps {
                    0 => Ok(()),
                    1 => f.write_str("jumped once and "),
                    _ => write!(f, "jumped {jumps} times and "),
                }?;
                write!(f, "fits badly ({fit:.1})")
            }
            Self::Detour => f.write_str("going around something that is not in the drawing"),
            Self::Recovering(n) => write!(f, "no progress: backing up and looking around ({n})"),
            Self::Shut(p, n) => {
                write!(f, "no way past ({:.0}, {:.0}) px, {n} attempts: the laser sees it blocked", p.x, p.y)
            }
            Self::Stuck(n) => write!(f, "no way on, {n} attempts: the laser sees it blocked"),
            Self::NoDrawnWay(p) => {
                write!(f, "the drawing shows no path to ({:.0}, {:.0}) px, and none was found", p.x, p.y)
            }
            Self::Lost(s) => write!(f, "the scans have fitted nowhere nearby for {s:.0} s"),
            Self::Kidnapped => {
                f.write_str("somebody has carried it elsewhere: everything it sees has changed")
            }
            Self::Finding => f.write_str("looking for where it is in the learned map"),
            Self::Ambiguous(n) => write!(f, "several places look alike after looking around {n} times"),
            Self::Alike(margin) => {
                write!(f, "the goal may be here or where the drawing looks alike: margin {margin:.2}")
            }
            Self::Surveying => f.write_str("turning to look all around"),
            Self::HandedOver => f.write_str("the filter has lost its way: driving on by the walls seen"),
            Self::Comparing => f.write_str("comparing the walls seen with the drawing"),
            Self::Exploring(Aim::Goal) => f.write_str("driving to where the walls seen put the goal"),
            Self::Exploring(Aim::Gap) => f.write_str("driving to a gap that must lead to the goal"),
            Self::Exploring(Aim::Rival) => f.write_str("driving to where the goal may also be, to be sure"),
            Self::Matched(evidence) => write!(f, "the walls seen put the goal here: {evidence}"),
            Self::Astray(on_way_s, drawn_m) => {
                write!(
                    f,
                    "on the way for {on_way_s:.0} s although the drawing shows {drawn_m:.0} m: this must be elsewhere"
                )
            }
            Self::Asks(count, margin) => {
                f.write_str("is the robot at A")?;
                (1..*count).try_for_each(|place| {
                    let joint = if place + 1 == *count { " or" } else { "," };
                    write!(f, "{joint} {}", letter(place))
                })?;
                write!(f, "? margin {margin:.1}")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use sketchnav_schemas::message::Text;

    use super::*;

    #[test]
    fn a_doubt_tells_how_often_the_estimate_jumped_where_it_did() {
        let words = |jumps| Reason::Doubted(jumps, -2.04).to_string();
        assert_eq!(words(0), "at the goal, it seems, but the estimate fits badly (-2.0)");
        assert_eq!(words(1), "at the goal, it seems, but the estimate jumped once and fits badly (-2.0)");
        assert_eq!(words(7), "at the goal, it seems, but the estimate jumped 7 times and fits badly (-2.0)");
    }

    #[test]
    fn a_person_is_asked_by_letters() {
        assert_eq!(Reason::Asks(2, 1.2).to_string(), "is the robot at A or B? margin 1.2");
        assert_eq!(Reason::Asks(4, 0.0).to_string(), "is the robot at A, B, C or D? margin 0.0");
    }

    #[test]
    fn every_reason_fits_its_field() {
        let far = Point::new(-1234.0, 1234.0);
        for reason in [
            Reason::Rooms,
            Reason::Shut(far, 10),
            Reason::NoDrawnWay(far),
            Reason::Stuck(10),
            Reason::Recovering(10),
            Reason::LookingAround,
            Reason::Doubted(1234, -12.0),
            Reason::Astray(99_999.0, 999.0),
            Reason::Comparing,
            Reason::HandedOver,
            Reason::Exploring(Aim::Rival),
            Reason::Matched(Evidence { rival: Some((9999.0, 99.0)), misfit: 2.0, is_confirmed: true }),
            Reason::Matched(Evidence { rival: None, misfit: 2.0, is_confirmed: true }),
            Reason::Asks(4, 9999.0),
            Reason::Alike(99.0),
        ] {
            assert_eq!(Text::<96>::of(reason).as_str(), reason.to_string());
        }
        for reason in [
            Reason::Lost(9999.0),
            Reason::Astray(99_999.0, 999.0),
            Reason::Doubted(1234, -12.0),
            Reason::Alike(9.0),
        ] {
            let words = format!("lost, waiting for help: {}", Help(reason));
            assert_eq!(Text::<96>::new(&words).as_str(), words);
        }
    }
}
