//! Finds navigators by the names that missions use in `[navigator] kind`.
//!
//! The navigators of this project are registered on first use of this crate. A program with other navigators
//! must add them with [`register`] before anything else.

pub mod goal;

use std::sync::{LazyLock, PoisonError, RwLock};

use sketchnav_files::{DRAWING, Disk, Files};
use sketchnav_schemas::channels::{self, ChannelSpec, ChannelVisitor, RegisterError};
use sketchnav_schemas::mission::Mission;
use sketchnav_schemas::ros2::derived::{self, Derived};
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::Navigator;

/// The navigators of this project. Each is a crate with a `messages` module and a `NAVIGATOR`.
macro_rules! residents {
    ($($kind:ident),*) => {
        const NAVIGATORS: &[Navigator] = &[$($kind::NAVIGATOR),*];

        /// Visits the message type of every channel that is common to all navigators or belongs to one of
        /// this project's. Stops at the first error.
        ///
        /// # Errors
        /// The visitor's error.
        pub fn visit<V: ChannelVisitor>(visitor: &mut V) -> Result<(), V::Error> {
            channels::visit(visitor)?;
            $($kind::messages::visit(visitor)?;)*
            Ok(())
        }
    };
}

residents! { sketchnav_sketch, sketchnav_corridor, sketchnav_landmarks, sketchnav_directions }

/// The navigators of this project and those that were added.
struct Known {
    navigators: RwLock<Vec<&'static Navigator>>,
    /// Result of adding the channels of this project's navigators to the table of channels.
    residents: Result<(), RegisterError>,
}

static KNOWN: LazyLock<Known> = LazyLock::new(|| Known {
    navigators: RwLock::new(NAVIGATORS.iter().collect()),
    residents: NAVIGATORS
        .iter()
        .try_for_each(|navigator| channels::register(navigator.kind, navigator.channels)),
});

/// No navigator has that name.
#[derive(Debug, thiserror::Error)]
#[error(
    "navigator.kind: expected one of {known}, found {found:?}; if that is a navigator of your own, run the mission with the program that contains it: `sketchnav help write-a-navigator`"
)]
pub struct UnknownNavigator {
    /// The known names, separated by commas.
    pub known: String,
    /// The name in the mission.
    pub found: String,
}

/// Adds navigators of other projects, with their channels.
///
/// # Errors
/// [`RegisterError`] if the name of a navigator is already taken, or if one of its channels cannot be added
/// to the table.
pub fn register(navigators: &'static [Navigator]) -> Result<(), RegisterError> {
    KNOWN.residents.clone()?;
    let mut known = KNOWN.navigators.write().unwrap_or_else(PoisonError::into_inner);
    for navigator in navigators {
        let kind = navigator.kind;
        if known.iter().any(|known| known.kind == kind) {
            return Err(RegisterError::Kind { kind });
        }
        channels::register(kind, navigator.channels)?;
        known.push(navigator);
    }
    Ok(())
}

/// Returns every navigator. Those added with [`register`] come last.
pub fn all() -> impl Iterator<Item = &'static Navigator> {
    KNOWN.navigators.read().unwrap_or_else(PoisonError::into_inner).clone().into_iter()
}

/// Returns the navigator that a mission names.
///
/// # Errors
/// [`UnknownNavigator`] if no navigator has that name.
pub fn of(mission: &Mission) -> Result<&'static Navigator, UnknownNavigator> {
    let found = mission.navigator_kind();
    let known = || all().map(|navigator| navigator.kind).collect::<Vec<_>>().join(", ");
    let unknown = || UnknownNavigator { known: known(), found: found.to_owned() };
    all().find(|navigator| navigator.kind == found).ok_or_else(unknown)
}

/// Returns the method of a mission: the one that it names, or else the first of its navigator. If the navigator has no methods,
/// this is the navigator's own name.
pub fn method(mission: &Mission) -> &str {
    let named = mission.navigator.given.get("method").and_then(toml::Value::as_str);
    let first = || of(mission).ok()?.methods.first().copied();
    named.or_else(first).unwrap_or(mission.navigator_kind())
}

/// Returns the method of a run. If none was resolved when the run was launched, this is the method of its mission.
pub fn method_of(run: &RunConfig) -> &str {
    if run.method.is_empty() { method(&run.mission) } else { &run.method }
}

/// Returns the topics that are derived from a channel for viewers, no matter which navigator the channel
/// belongs to.
pub fn derived(spec: &ChannelSpec) -> impl Iterator<Item = &'static Derived> {
    let of_navigators = all().flat_map(|navigator| navigator.derived);
    derived::COMMON.iter().chain(of_navigators).filter(move |derived| derived.of == spec)
}

/// Reads a file on disk by the name that a mission gives it. Stages receive this function when they start.
///
/// # Errors
/// Any error of [`sketchnav_files::read`]. A file that is too large is refused before it is read.
pub fn read_file(path: &str) -> std::io::Result<Vec<u8>> {
    read_from(&Disk)(path)
}

/// Like [`read_file`], but for files in a store, such as the files of a recording.
pub fn read_from(files: &dyn Files) -> impl Fn(&str) -> std::io::Result<Vec<u8>> {
    |name| files.read(name.as_ref(), DRAWING)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_channels_of_all_navigators_fit_the_table() {
        for navigator in all() {
            assert_eq!(channels::register(navigator.kind, navigator.channels), Ok(()), "{}", navigator.kind);
        }
    }

    #[test]
    fn every_derived_topic_has_a_schema_and_a_name_below_its_channel() {
        register(&[]).unwrap();
        let all: Vec<_> = channels::all().flat_map(derived).collect();
        assert!(all.len() > derived::COMMON.len());
        for derived in all {
            assert!(!derived.schema().is_empty(), "{}", derived.ros2);
            assert!(derived.topic.starts_with(&format!("/{}/", derived.of.name)), "{}", derived.topic);
            let mut cdr = Vec::new();
            let mut message = vec![0_u64; derived.of.message.size / 8];
            message[0] = 1;
            let encoded = derived.encode(bytemuck::cast_slice(&message), &[], &mut cdr);
            assert!(encoded.is_ok(), "{}: {encoded:?}", derived.topic);
        }
    }

    #[test]
    fn a_navigator_derives_topics_of_its_own_channels() {
        for navigator in all() {
            let foreign = navigator.derived.iter().find(|derived| derived.of.kind != Some(navigator.kind));
            assert!(foreign.is_none(), "{}: {}", navigator.kind, foreign.unwrap().topic);
        }
    }
}
