//! What a navigator keeps and what it rejects.

use super::*;
use crate::generate::stream;
use crate::journey::{Helicopter, Noise, STEP_S};
use crate::testing::plane;

const MAP: &str = "(*, SW)\n(Isol, (2, -), SW)\n(Isol, Trajp, (0, -), -)";

fn navigator() -> Navigator {
    let window = Window::new(10.0, 1.5).unwrap();
    Navigator::new(Settings::new(window, 0.1), MAP.parse().unwrap()).unwrap()
}

#[test]
fn a_word_that_the_navigator_lacks_is_named() {
    let window = Window::new(10.0, 1.5).unwrap();
    let vocabulary = Vocabulary::of(&[Descriptor::Any, Descriptor::Isolated]);
    let settings = Settings { vocabulary, ..Settings::new(window, 0.1) };
    let with = |map: &str| Navigator::new(settings, map.parse().unwrap());
    assert!(with(MAP).is_ok());
    let error = with("(*, SW)\n(Isol, (2, SE, IsolPair), (3, -), SW)\n(Isol, -)").unwrap_err();
    assert_eq!(error, Error::Vocabulary { entry: 2, word: "IsolPair" });
}

#[test]
fn settings_out_of_range_are_rejected() {
    let window = Window::new(10.0, 1.5).unwrap();
    let good = Settings::new(window, 0.1);
    for bad in [
        Settings { speed: 0.0, ..good },
        Settings { gate: f64::NAN, ..good },
        Settings { weight: 1.5, ..good },
        Settings { looks: 0, ..good },
    ] {
        assert!(matches!(Navigator::new(bad, MAP.parse().unwrap()), Err(Error::Parameter { .. })), "{bad:?}");
    }
}

/// A kill between any two steps changes nothing: the successor restores the state and gives the same steps.
#[test]
fn a_state_survives_a_checkpoint_at_every_step() {
    let world = plane(&[(0.0, 0.0), (7.0, 6.0), (13.0, 14.0), (46.0, 58.0), (15.0, 8.0)]);
    let navigator = navigator();
    let mut helicopter = Helicopter { centre: Point::default(), heading_rad: 0.0 };
    let (mut state, mut rng, mut view) = (navigator.start(), stream(3, 0), Vec::new());
    let mut largest = 0;
    for step in 0..2000 {
        helicopter.look(&world, navigator.settings().window, Noise::of_sigma(0.1), &mut rng, &mut view);
        let bytes = postcard::to_allocvec(&state).unwrap();
        largest = largest.max(bytes.len());
        let mut restored: State = postcard::from_bytes(&bytes).unwrap();
        let output = navigator.step(&mut state, &view, if step == 0 { 0.0 } else { STEP_S });
        assert_eq!(navigator.step(&mut restored, &view, if step == 0 { 0.0 } else { STEP_S }), output);
        assert_eq!(restored, state);
        if let Some(outcome) = output.outcome {
            assert_eq!(outcome, Outcome::Arrived, "at step {step}");
            assert!(largest < 1000, "{largest}");
            assert!(size_of::<State>() < 6000, "{}", size_of::<State>());
            return;
        }
        helicopter.fly(output.velocity, STEP_S, Noise::NONE, &mut rng);
    }
    panic!("no end");
}
