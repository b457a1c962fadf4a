//! Tests every message of every navigator of this project, and the common ones: the round trip through ROS 2, JSON, the schema, and
//! the layout in memory. Any message that is declared is tested here.

use std::convert::Infallible;

use proptest::prelude::*;
use sketchnav_schemas::channels::{Channel, ChannelVisitor};
use sketchnav_schemas::erased;
use sketchnav_schemas::layout::{Layout, Role};
use sketchnav_schemas::ros2::{ENCAPSULATION, Ros2, definitions};
use sketchnav_schemas::samples::sample;
use sketchnav_schemas::seed::stream;

/// Does the same with the message type of every channel.
struct Every<F>(F);

trait Check {
    fn check<T: Ros2>(&self);
}

impl<F: Check> ChannelVisitor for Every<F> {
    type Error = Infallible;
    fn visit<T: Ros2>(&mut self, _: Channel<T>) -> Result<(), Infallible> {
        self.0.check::<T>();
        Ok(())
    }
}

fn every(check: impl Check) {
    let Ok(()) = sketchnav_navigators::visit(&mut Every(check));
}

fn cdr<T: Ros2>(message: &T, cells: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    message.to_cdr(cells, &mut out).unwrap_or_else(|e| panic!("{}: {e}", T::NAME));
    out
}

struct HasTheSizeOfItsStruct;
impl Check for HasTheSizeOfItsStruct {
    fn check<T: Ros2>(&self) {
        assert_eq!(Layout::of::<T>().size(), size_of::<T>(), "{}", T::NAME);
    }
}

#[test]
fn every_layout_has_the_size_of_its_struct() {
    every(HasTheSizeOfItsStruct);
}

struct ComesBack(u64);
impl Check for ComesBack {
    fn check<T: Ros2>(&self) {
        let seq = 1 + self.0 % 1_000_000;
        let (message, cells) = sample::<T>(&mut stream(self.0, T::NAME), seq);
        let (again, cells_again) = T::from_cdr(&cdr(&message, &cells), seq).unwrap();
        assert!(bytemuck::bytes_of(&message) == bytemuck::bytes_of(&again), "{} changed", T::NAME);
        assert_eq!(cells, cells_again, "{}", T::NAME);
    }
}

/// A form that is reused must not retain anything from the previous message.
struct FormsAreUsedAgain(u64);
impl Check for FormsAreUsedAgain {
    fn check<T: Ros2>(&self) {
        let random = &mut stream(self.0, T::NAME);
        let mut form = T::Form::default();
        for seq in 1..=4 {
            let (message, cells) = sample::<T>(random, seq);
            let mut out = Vec::new();
            message.to_cdr_by(&cells, &mut form, &mut out).unwrap();
            assert!(out == cdr(&message, &cells), "{}: message {seq} is not the same", T::NAME);
        }
    }
}

/// As JSON, a message has the fields of its `.msg`. The counts of lists and the padding used to appear as `null`.
struct JsonHasNoFieldWithoutAForm;
impl Check for JsonHasNoFieldWithoutAForm {
    fn check<T: Ros2>(&self) {
        let (message, cells) = sample::<T>(&mut stream(3, T::NAME), 1);
        let type_ = erased::MessageType::of::<T>();
        let json = type_.json(bytemuck::bytes_of(&message), &cells).unwrap();
        let layout = type_.layout();
        let untold = layout.fields.iter().filter(|field| matches!(field.role, Role::Count | Role::Zero));
        for field in untold {
            assert!(json.get(field.name).is_none(), "{}: {}: {json:#}", T::NAME, field.name);
        }
    }
}

#[test]
fn json_has_only_fields_of_the_form() {
    every(JsonHasNoFieldWithoutAForm);
}

struct SurvivesDamage {
    seed: u64,
    at: prop::sample::Index,
    byte: u8,
    cut: prop::sample::Index,
}
impl Check for SurvivesDamage {
    fn check<T: Ros2>(&self) {
        let (message, cells) = sample::<T>(&mut stream(self.seed, T::NAME), 7);
        let whole = cdr(&message, &cells);
        let cut = &whole[..self.cut.index(whole.len())];
        assert!(T::from_cdr(cut, 7).is_err(), "{}: cut to {} of {}", T::NAME, cut.len(), whole.len());
        let mut damaged = whole.clone();
        damaged[self.at.index(whole.len())] = self.byte;
        if let Ok((other, cells)) = T::from_cdr(&damaged, 7) {
            assert_eq!(cdr(&other, &cells), damaged, "{}: read as something else", T::NAME);
        }
    }
}

struct RefusesNoise<'a>(&'a [u8]);
impl Check for RefusesNoise<'_> {
    fn check<T: Ros2>(&self) {
        let mut bytes = ENCAPSULATION.to_vec();
        bytes.extend_from_slice(self.0);
        if let Ok((message, cells)) = T::from_cdr(&bytes, 1) {
            assert_eq!(cdr(&message, &cells), bytes, "{}", T::NAME);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_message_round_trips_bit_for_bit(seed: u64) {
        every(ComesBack(seed));
    }

    #[test]
    fn a_reused_form_equals_a_new_one(seed: u64) {
        every(FormsAreUsedAgain(seed));
    }

    #[test]
    fn damaged_messages_are_rejected_or_round_trip(
        seed: u64, at: prop::sample::Index, byte: u8, cut: prop::sample::Index,
    ) {
        every(SurvivesDamage { seed, at, byte, cut });
    }

    #[test]
    fn noise_never_panics(noise in prop::collection::vec(any::<u8>(), 0..400)) {
        every(RefusesNoise(&noise));
    }
}

/// A driver that did not set the cause drove correctly, but its recording was empty. Writers now set it according to the table of
/// channels, and the ROS 2 forms cannot store a different one.
#[test]
fn readings_are_their_own_cause() {
    struct Stray;
    impl ChannelVisitor for Stray {
        type Error = Infallible;
        fn visit<T: Ros2>(&mut self, channel: Channel<T>) -> Result<(), Infallible> {
            let (mut message, cells) = sample::<T>(&mut stream(1, T::NAME), 7);
            message.header_mut().source_seq = 6;
            let is_refused = message.to_cdr(&cells, &mut Vec::new()).is_err();
            // A message of our own can store a different one.
            assert!(!is_refused || channel.spec.is_sensed(), "{}", channel.spec.name);
            assert_eq!(is_refused, !T::TYPE.starts_with("sketchnav"), "{}", channel.spec.name);
            Ok(())
        }
    }
    let Ok(()) = sketchnav_navigators::visit(&mut Stray);
}

struct HasSchema;
impl Check for HasSchema {
    fn check<T: Ros2>(&self) {
        let schema = T::schema();
        assert!(schema.contains("std_msgs/Header header"), "{}: {schema}", T::NAME);
        for used in definitions::used_types(&schema) {
            assert!(schema.contains(&format!("MSG: {used}\n")), "{} uses {used}: {schema}", T::NAME);
        }
    }
}

#[test]
fn every_schema_contains_the_types_it_uses() {
    every(HasSchema);
}

/// Returns the number of times that the schema of `T` has a constant with this name and number.
fn constants<T: Ros2>(name: &str, code: u32) -> usize {
    let line = format!("uint32 {}={code} #", definitions::constant(name));
    T::schema().lines().filter(|found| found.starts_with(&line)).count()
}

struct SaysItsCodes;
impl Check for SaysItsCodes {
    fn check<T: Ros2>(&self) {
        let mut names = Vec::new();
        for field in T::layout().fields {
            let Role::Code(values) = field.role else { continue };
            for value in values {
                assert_eq!(constants::<T>(value.name, value.code), 1, "{}: {value:?}", T::NAME);
            }
            names.extend(values.iter().map(|value| value.name));
        }
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count, "{}: two constants have the same name: {names:?}", T::NAME);
    }
}

#[test]
fn the_values_of_a_code_are_constants_of_every_message_that_uses_it() {
    every(SaysItsCodes);
}
