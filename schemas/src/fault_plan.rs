//! Fault plans, which specify the faults that are injected into messages. The files are written by people and by `sketchnav chaos`.
//!
//! ```toml
//! [[fault]]
//! channel = "estimate"   # whose writer or messages are affected
//! message = 120          # its number, from 1; or time_s = 11.9: the first one at or after that simulated time
//! do = "kill"            # kill, stop, term, starve, drop, duplicate, delay, reorder or corrupt-checkpoint
//! when = "before"        # or "after" it was sent: kill, stop, term and starve
//! ```
//! The time of a fault is relative to the mission rather than to the wall clock, so a plan has the same
//! effect each time.

use serde::{Deserialize, Serialize};

use crate::channels;
use crate::codes::Process;
use crate::time::nanoseconds;
use crate::toml_text::{self, TomlError};

/// Maximum number of faults in a plan.
pub const MAX_FAULTS: usize = 10_000;
/// Longest delay, in milliseconds.
pub const MAX_DELAY_MS: u64 = 60_000;
/// Longest starvation, in milliseconds.
pub const MAX_STARVATION_MS: u64 = 60_000;
/// Minimum and maximum fraction of processor time for a starved process.
pub const SHARES: [f64; 2] = [0.01, 0.9];

/// The kind of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Action {
    /// The writer gets SIGKILL.
    Kill,
    /// The writer gets SIGSTOP.
    Stop,
    /// The writer gets SIGTERM.
    Term,
    /// The writer gets only a fraction of the processor time for a while.
    Starve,
    /// The message is not sent.
    Drop,
    /// The message is sent twice.
    Duplicate,
    /// The writer waits before it sends.
    Delay,
    /// The message is sent after the next one of its channel.
    Reorder,
    /// The writer's latest valid checkpoint is damaged, and the writer gets SIGKILL.
    CorruptCheckpoint,
}

impl Action {
    /// Returns whether the fault ends, stops or starves the writer, rather than changing its messages.
    pub const fn hits_the_process(self) -> bool {
        matches!(self, Self::Kill | Self::Stop | Self::Term | Self::Starve | Self::CorruptCheckpoint)
    }

    /// Returns the name of this action, as used in files and in output.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Kill => "kill",
            Self::Stop => "stop",
            Self::Term => "term",
            Self::Starve => "starve",
            Self::Drop => "drop",
            Self::Duplicate => "duplicate",
            Self::Delay => "delay",
            Self::Reorder => "reorder",
            Self::CorruptCheckpoint => "corrupt-checkpoint",
        }
    }
}

/// When a fault affects a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum When {
    /// Before the message is sent.
    #[default]
    Before,
    /// After the message was sent.
    After,
}

impl When {
    fn is_before(&self) -> bool {
        *self == Self::Before
    }
}

/// Limited processor time of a process.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Starvation {
    /// Fraction of the time that the process may run, within [`SHARES`].
    pub share: f64,
    /// Duration in wall-clock time, in milliseconds.
    pub duration_ms: u64,
}

/// A fault in a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannedFault {
    /// The channel of the message.
    pub channel: String,
    /// The number of the message, from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<u64>,
    /// An alternative to `message`: the fault affects the first message at or after this simulated time, in
    /// seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// The kind of fault.
    #[serde(rename = "do")]
    pub action: Action,
    /// Whether the fault occurs before or after the process sends the message.
    #[serde(default, skip_serializing_if = "When::is_before")]
    pub when: When,
    /// Duration of a delay in wall-clock time, in milliseconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delay_ms: Option<u64>,
    /// Fraction of the time that a starved process may run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub share: Option<f64>,
    /// Duration of a starvation in wall-clock time, in milliseconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration_ms: Option<u64>,
}

impl PlannedFault {
    /// Creates a fault for message number `message` of a channel. A fault of the writer occurs before the message is sent.
    pub fn at_message(channel: &str, message: u64, action: Action) -> Self {
        Self {
            channel: channel.to_owned(),
            message: Some(message),
            time_s: None,
            action,
            when: When::Before,
            delay_ms: None,
            share: None,
            duration_ms: None,
        }
    }

    /// Returns the starvation of the writer, or `None` for any other fault.
    pub fn starvation(&self) -> Option<Starvation> {
        let (share, duration_ms) = (self.share?, self.duration_ms?);
        (self.action == Action::Starve).then_some(Starvation { share, duration_ms })
    }

    /// Describes the fault in words: `kill at estimate 120`, `kill after estimate 120`.
    pub fn words(&self) -> String {
        let Self { channel, message, time_s, action, when, .. } = self;
        let moment = match (message, time_s) {
            (Some(message), _) => format!("{channel} {message}"),
            (None, Some(time_s)) => format!("the first {channel} from {time_s} s on"),
            (None, None) => channel.clone(),
        };
        let place = if when.is_before() { "at" } else { "after" };
        format!("{} {place} {moment}", action.word())
    }

    /// Returns whether the fault is due at this message of its channel.
    pub fn is_due(&self, seq: u64, stamp_ns: u64) -> bool {
        let is_time = |time_s: f64| stamp_ns >= nanoseconds(time_s);
        self.message.is_none_or(|message| message == seq) && self.time_s.is_none_or(is_time)
    }
}

/// The faults in the order of the file. If several of them affect the writer at the same message, each one waits until the writer
/// has restarted.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FaultPlan {
    /// The faults.
    #[serde(default)]
    pub fault: Vec<PlannedFault>,
}

/// The reason why a fault plan is invalid.
#[derive(Debug, thiserror::Error)]
pub enum FaultPlanError {
    /// The text is not TOML, or has an unknown key or a value of the wrong type.
    #[error("{0}")]
    Toml(#[from] TomlError),
    /// An invalid value.
    #[error("fault {number}: {key}: expected {expected}, found {found}")]
    Value {
        /// Number of the fault, from 1.
        number: usize,
        /// The key.
        key: &'static str,
        /// What was expected.
        expected: String,
        /// What was found.
        found: String,
    },
    /// Too many faults.
    #[error("fault: expected at most {MAX_FAULTS}, found {0}")]
    TooMany(usize),
}

impl FaultPlan {
    /// Parses a plan for runs of this kind of navigator.
    ///
    /// # Errors
    /// [`FaultPlanError`], which names the fault, the key and what was expected.
    pub fn parse(text: &str, kind: &str) -> Result<Self, FaultPlanError> {
        let plan: Self = toml_text::read(text)?;
        if plan.fault.len() > MAX_FAULTS {
            return Err(FaultPlanError::TooMany(plan.fault.len()));
        }
        for (i, fault) in plan.fault.iter().enumerate() {
            fault.check(i + 1, kind)?;
        }
        Ok(plan)
    }
}

impl PlannedFault {
    fn check(&self, number: usize, kind: &str) -> Result<(), FaultPlanError> {
        let wrong = |key, expected: &str, found: String| {
            Err(FaultPlanError::Value { number, key, expected: expected.to_owned(), found })
        };
        // Faults of the supervisor are not supported, since it owns the other processes. On a channel with many writers, messages
        // have no unique number.
        let has_writer = |spec: &&channels::ChannelSpec| {
            spec.belongs_to(kind) && spec.writer.is_some_and(|writer| writer != Process::Supervisor)
        };
        let Some(spec) = channels::find(&self.channel).filter(has_writer) else {
            let known: Vec<_> = channels::all().filter(has_writer).map(|spec| spec.name).collect();
            return wrong("channel", &format!("one of {}", known.join(", ")), format!("{:?}", self.channel));
        };
        match (self.message, self.time_s) {
            (Some(0), None) => return wrong("message", "1 or more", "0".to_owned()),
            (None, Some(time_s)) if !(0.0..=1e9).contains(&time_s) => {
                return wrong("time_s", "seconds from 0 to 1e9", time_s.to_string());
            }
            (Some(_), None) | (None, Some(_)) => {}
            (Some(_), Some(_)) => return wrong("message", "message or time_s", "both".to_owned()),
            (None, None) => return wrong("message", "message or time_s", "neither".to_owned()),
        }
        let [least, most] = SHARES;
        let is_share = |share: f64| (least..=most).contains(&share);
        let numbers = [
            (
                "delay_ms",
                Action::Delay,
                self.delay_ms.map(|ms| (ms.to_string(), (1..=MAX_DELAY_MS).contains(&ms))),
                format!("1 to {MAX_DELAY_MS}"),
            ),
            (
                "share",
                Action::Starve,
                self.share.map(|share| (share.to_string(), is_share(share))),
                format!("{least} to {most}"),
            ),
            (
                "duration_ms",
                Action::Starve,
                self.duration_ms.map(|ms| (ms.to_string(), (1..=MAX_STARVATION_MS).contains(&ms))),
                format!("1 to {MAX_STARVATION_MS}"),
            ),
        ];
        for (key, action, found, range) in numbers {
            let belongs = self.action == action;
            match found {
                None if belongs => return wrong(key, &range, "none".to_owned()),
                Some((found, false)) if belongs => return wrong(key, &range, found),
                Some((found, _)) if !belongs => {
                    let expected = format!("none, because only {} has one", action.word());
                    return wrong(key, &expected, found);
                }
                _ => {}
            }
        }
        if self.when == When::After && !self.action.hits_the_process() {
            return wrong("when", "\"before\"", "\"after\"".to_owned());
        }
        if matches!(self.action, Action::Reorder | Action::Duplicate) && spec.max_cells > 0 {
            let found = format!("{:?}", self.action.word());
            return wrong("do", "another action for a channel of large messages", found);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::samples::example;

    fn parse(text: &str) -> Result<FaultPlan, FaultPlanError> {
        example::register();
        FaultPlan::parse(text, example::KIND)
    }

    const GOOD: &str = "[[fault]]\nchannel = \"example_place\"\nmessage = 120\ndo = \"kill\"\nwhen = \"after\"\n\
                        [[fault]]\nchannel = \"scan\"\ntime_s = 2.5\ndo = \"delay\"\ndelay_ms = 200\n";

    #[test]
    fn a_plan_is_read_and_written() {
        let plan = parse(GOOD).unwrap();
        assert_eq!((plan.fault.len(), plan.fault[0].action), (2, Action::Kill));
        assert!(plan.fault[0].is_due(120, 0) && !plan.fault[0].is_due(121, 0));
        assert!(plan.fault[1].is_due(7, 2_500_000_000) && !plan.fault[1].is_due(7, 2_499_999_999));
        let again = parse(&toml::to_string(&plan).unwrap()).unwrap();
        assert_eq!(again, plan);
    }

    #[test]
    fn errors_name_the_fault_and_the_key() {
        let error_of = |from: &str, to: &str| {
            assert!(GOOD.contains(from));
            parse(&GOOD.replacen(from, to, 1)).unwrap_err().to_string()
        };
        for (from, to, words) in [
            ("\"example_place\"", "\"mission\"", "fault 1: channel: expected one of"),
            ("\"example_place\"", "\"journey\"", "found \"journey\""),
            ("message = 120", "message = 0", "fault 1: message: expected 1 or more, found 0"),
            ("message = 120", "", "fault 1: message: expected message or time_s, found neither"),
            ("time_s = 2.5", "time_s = -1.0", "fault 2: time_s: expected seconds"),
            ("delay_ms = 200", "", "fault 2: delay_ms: expected 1 to 60000, found none"),
            ("delay_ms = 200", "when = \"after\"\ndelay_ms = 2", "fault 2: when: expected \"before\""),
            ("\"kill\"", "\"hug\"", "unknown variant"),
            ("\"kill\"", "\"starve\"", "fault 1: share: expected 0.01 to 0.9, found none"),
            ("\"kill\"", "\"starve\"\nshare = 1.0", "fault 1: share: expected 0.01 to 0.9, found 1"),
            ("\"kill\"", "\"starve\"\nshare = 0.1", "fault 1: duration_ms: expected 1 to 60000, found none"),
            (
                "\"kill\"",
                "\"kill\"\nshare = 0.1",
                "fault 1: share: expected none, because only starve has one",
            ),
            ("\"delay\"", "\"drop\"", "fault 2: delay_ms: expected none, because only delay has one"),
        ] {
            let error = error_of(from, to);
            assert!(error.contains(words), "{error}");
        }
    }

    proptest! {
        #[test]
        fn a_starvation_within_its_bounds_is_read_as_it_was_written(
            share in -0.1..1.1, duration_ms in 0..2 * MAX_STARVATION_MS, message in 1..u64::from(u32::MAX),
        ) {
            let starved = PlannedFault {
                share: Some(share),
                duration_ms: Some(duration_ms),
                ..PlannedFault::at_message("status", message, Action::Starve)
            };
            let plan = FaultPlan { fault: vec![starved] };
            let read = parse(&toml::to_string(&plan).unwrap());
            let is_good = (SHARES[0]..=SHARES[1]).contains(&share) && (1..=MAX_STARVATION_MS).contains(&duration_ms);
            prop_assert_eq!(read.is_ok(), is_good);
            if let Ok(read) = read {
                prop_assert_eq!(read.fault[0].starvation(), Some(Starvation { share, duration_ms }));
                prop_assert_eq!(read, plan);
            }
        }

        #[test]
        fn any_text_is_a_plan_or_an_error(text in "(\\[\\[fault\\]\\]\n)?(channel = \"scan\"\n)?(message = [0-9]{0,20}\n)?(do = \"(kill|delay|starve|x)\"\n)?(share = [0-9.]{0,4}\n)?.{0,20}") {
            let _ = parse(&text);
        }
    }
}
