//! Parsers for values that several commands take.

use regex_lite::Regex;
use sketchnav_deform::MOST_DEGREE;
use sketchnav_schemas::channels::{EXTRAS, SERVICES, words};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::run::Pace;

/// Parses the name of a service.
pub fn parse_service(word: &str) -> Result<Process, String> {
    match word.parse() {
        Ok(process) if SERVICES.contains(&process) => Ok(process),
        _ => Err(format!("expected one of {}", words(SERVICES))),
    }
}

/// Parses the name of a service that can be rerun on a recording, which is any but the recorder.
pub fn parse_rerun(word: &str) -> Result<Process, String> {
    let again = || SERVICES.into_iter().filter(|process| *process != Process::Recorder);
    again()
        .find(|process| process.word() == word)
        .ok_or_else(|| format!("expected one of {}", words(again())))
}

/// Parses the name of a process that can be run by hand.
pub fn parse_served(word: &str) -> Result<Process, String> {
    match EXTRAS.into_iter().find(|extra| extra.word() == word) {
        Some(extra) => Ok(extra),
        None => parse_service(word),
    }
}

/// Parses a regular expression that has to match a whole name.
pub fn parse_pattern(text: &str) -> Result<Regex, String> {
    Regex::new(&format!("^(?:{text})$")).map_err(|error| format!("expected a regular expression: {error}"))
}

/// A position on a floor, in metres, and optionally a heading, in degrees counter-clockwise from the x axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FloorPlace {
    pub at_m: [f64; 2],
    pub heading_deg: Option<f64>,
}

/// Parses a position on a floor as `X,Y` or `X,Y,DEG`.
pub fn parse_floor_place(text: &str) -> Result<FloorPlace, String> {
    match parse_numbers(text).as_deref() {
        Some(&[x, y]) => Ok(FloorPlace { at_m: [x, y], heading_deg: None }),
        Some(&[x, y, heading]) => Ok(FloorPlace { at_m: [x, y], heading_deg: Some(heading) }),
        _ => Err("expected X,Y in metres, or X,Y,DEG".to_owned()),
    }
}

/// Parses a position in a drawing as `X,Y`.
pub fn parse_drawn_place(text: &str) -> Result<[f64; 2], String> {
    let place = parse_numbers(text).and_then(|numbers| numbers.try_into().ok());
    place.ok_or_else(|| "expected two numbers with a comma between them, such as 520,90".to_owned())
}

/// Parses a degree of distortion of a drawing.
pub fn parse_degree(text: &str) -> Result<f64, String> {
    let degree = text.parse().ok().filter(|degree: &f64| (0.0..=MOST_DEGREE).contains(degree));
    degree.ok_or_else(|| format!("expected a number from 0 to {MOST_DEGREE}"))
}

/// Parses finite numbers separated by commas.
fn parse_numbers(text: &str) -> Option<Vec<f64>> {
    let number = |word: &str| word.trim().parse().ok().filter(|number: &f64| number.is_finite());
    text.split(',').map(number).collect()
}

/// Maximum speed, in simulated seconds per second, which is more than any machine can keep up with. With
/// `max`, the simulation runs as fast as the machine can.
pub const MAX_SPEED: f64 = 100.0;

/// Parses `max`, or a number of simulated seconds per second.
pub fn parse_speed(text: &str) -> Result<Pace, String> {
    if text == "max" {
        return Ok(Pace::Lockstep);
    }
    match text.parse::<f64>() {
        Ok(speed) if speed > 0.0 && speed <= MAX_SPEED => Ok(Pace::RealTime { speed }),
        _ => Err(format!("expected `max`, or a number above 0 and up to {MAX_SPEED}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pattern_matches_whole_names() {
        let pattern = parse_pattern("scan|odo.*").unwrap();
        assert!(pattern.is_match("scan") && pattern.is_match("odometry"));
        assert!(!pattern.is_match("scanner") && !pattern.is_match("a-scan"));
        assert!(parse_pattern("(").unwrap_err().contains("expected a regular expression"));
    }

    #[test]
    fn a_pose_has_two_or_three_numbers() {
        let place = |heading_deg| Ok(FloorPlace { at_m: [-1.5, 2.0], heading_deg });
        assert_eq!(parse_floor_place("-1.5,2"), place(None));
        assert_eq!(parse_floor_place("-1.5, 2, 90"), place(Some(90.0)));
        for wrong in ["", "1", "1,2,3,4", "1,x", "nan,1"] {
            assert!(parse_floor_place(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_drawn_place_has_two_numbers() {
        assert_eq!(parse_drawn_place("520, 90.5"), Ok([520.0, 90.5]));
        for wrong in ["", "520", "520,", "a,b", "1,2,3", "nan,1", "1,inf"] {
            assert!(parse_drawn_place(wrong).unwrap_err().contains("expected two numbers"), "{wrong}");
        }
    }

    /// Regression test: the error for a misspelt process once offered the recorder, which was then refused.
    #[test]
    fn every_process_that_the_error_offers_for_rerun_is_accepted() {
        let error = parse_rerun("planer").unwrap_err();
        let offered = error.strip_prefix("expected one of ").unwrap();
        assert_eq!(offered, "world, sketcher, localizer, planner");
        assert!(
            offered.split(", ").all(|word| parse_rerun(word).is_ok()) && parse_rerun("recorder").is_err()
        );
    }

    #[test]
    fn a_degree_of_distortion_is_at_most_three() {
        assert_eq!((parse_degree("0"), parse_degree("0.5"), parse_degree("3")), (Ok(0.0), Ok(0.5), Ok(3.0)));
        for wrong in ["-0.1", "3.1", "nan", "inf", "much", ""] {
            assert_eq!(parse_degree(wrong), Err("expected a number from 0 to 3".to_owned()), "{wrong}");
        }
    }

    #[test]
    fn speed_is_max_or_a_positive_number() {
        assert_eq!(parse_speed("max"), Ok(Pace::Lockstep));
        assert_eq!(parse_speed("2"), Ok(Pace::RealTime { speed: 2.0 }));
        for wrong in ["0", "-1", "nan", "inf", "1e6", "fast", ""] {
            assert!(parse_speed(wrong).is_err(), "{wrong}");
        }
    }
}
