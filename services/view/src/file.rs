//! Plays a recording to viewers, which can pause it, seek in it and change its rate.

use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use foxglove::{ChannelId, Context, Schema, SinkId};
use sketchnav_recordings::reader::{RawMessage, Selection, Topic as RecordedTopic};
use sketchnav_recordings::rejected::Rejections;
use sketchnav_recordings::{Recording, RecordingError};
use sketchnav_schemas::channels::{self, ChannelSpec};
use sketchnav_schemas::ros2::derived::Derived;

use crate::live::End;
use crate::playback::{Playback, State};
use crate::server::{Event, Port, Served, Server, SharedPlayback, locked};
use crate::topics::Topic;
use crate::{Result, ViewError};

/// Maximum wait between two checks for viewers' requests.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Maximum number of messages shown between two checks for viewers' requests.
const MESSAGES_A_LOOK: usize = 64;

/// The options for playing a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Playback rate, in recorded seconds per second.
    pub rate: f64,
    /// Whether playback starts again at the end.
    pub again: bool,
    /// Whether playback waits until a viewer starts it.
    pub is_paused: bool,
}

/// Plays a recording until the process is asked to end. Calls `ready` when viewers can connect.
///
/// # Errors
/// [`ViewError`] if the recording is empty or cannot be read, or if the server fails. A message that cannot
/// be decoded is not an error. It is skipped, and all such messages are counted and reported at the end.
pub fn play(recording: &Recording, port: Port, options: Options, ready: impl FnOnce()) -> Result<End> {
    let path = recording.path();
    let span = recording.index()?.span_ns().ok_or_else(|| ViewError::Empty { path: named(path) })?;
    let state = if options.is_paused { State::Paused } else { State::Playing };
    let playback: SharedPlayback =
        Arc::new(Mutex::new(Playback::new(span, options.rate, state, Instant::now())));
    let name = format!("sketchnav: {}", path.file_name().unwrap_or_default().to_string_lossy());
    let server = Server::start(port, Served { name, playback: Some((span, Arc::clone(&playback))) })?;
    server.handle_signals()?;
    let shown = Shown::new(server.context(), &recording.topics()?)?;
    ready();
    Player { recording, options, first_ns: span.0, server, playback, shown }.play()
}

fn named(path: &Path) -> String {
    path.display().to_string()
}

/// The reason why the playback of a stretch ended.
enum Turn {
    /// The stretch is over.
    Played,
    /// Playback continues at another time, in nanoseconds.
    Seek(u64),
    /// The process is asked to end.
    End,
}

struct Player<'a> {
    recording: &'a Recording,
    options: Options,
    first_ns: u64,
    server: Server,
    playback: SharedPlayback,
    shown: Shown,
}

impl Player<'_> {
    fn play(&mut self) -> Result<End> {
        let mut from_ns = self.first_ns;
        loop {
            let turn = self.play_from(from_ns)?;
            self.shown.tell_skipped();
            from_ns = match turn {
                Turn::Seek(to_ns) => to_ns,
                Turn::End => return Ok(End::Asked),
                Turn::Played => match self.rest()? {
                    Turn::Seek(to_ns) => to_ns,
                    _ => return Ok(End::Asked),
                },
            };
        }
    }

    /// Shows the messages from a time onwards, in nanoseconds, preceded by the messages that were latched before it.
    fn play_from(&mut self, from_ns: u64) -> Result<Turn> {
        self.shown.forget();
        for message in self.recording.latched_before(from_ns)? {
            self.shown.show(&RawMessage { stamp_ns: from_ns, ..message });
        }
        let mut since_look = 0;
        for message in self.recording.timeline(Selection::default().between(from_ns..u64::MAX))? {
            let message = message?;
            loop {
                let until = locked(&self.playback).until(message.stamp_ns, Instant::now());
                let is_due = until == Some(Duration::ZERO);
                if is_due && since_look < MESSAGES_A_LOOK {
                    break;
                }
                since_look = 0;
                if let Some(turn) = self.look(until.unwrap_or(LOOK_EVERY).min(LOOK_EVERY)) {
                    return Ok(turn);
                }
                if is_due {
                    break;
                }
            }
            since_look += 1;
            self.shown.show(&message);
            self.server.send_time(message.stamp_ns);
        }
        Ok(Turn::Played)
    }

    /// Waits at the end of the recording until a viewer moves the playback position, or starts again if the options request it.
    fn rest(&mut self) -> Result<Turn> {
        let now = Instant::now();
        if self.options.again {
            let mut playback = locked(&self.playback);
            playback.end(now);
            let rate = playback.rate();
            let again = crate::playback::Request { plays: true, rate, seek_ns: Some(self.first_ns) };
            playback.ask(again, now);
            drop(playback);
            self.server.send_playback(&self.playback, true);
            return Ok(Turn::Seek(self.first_ns));
        }
        locked(&self.playback).end(now);
        self.server.send_playback(&self.playback, false);
        loop {
            if let Some(turn) = self.look(LOOK_EVERY) {
                return Ok(turn);
            }
        }
    }

    /// Handles viewers' requests, for at most `timeout`.
    fn look(&mut self, timeout: Duration) -> Option<Turn> {
        let mut event = self.server.wait_for_event(timeout);
        let mut turn = None;
        while let Some(found) = event {
            match found {
                Event::Subscribed(channel, sink) => self.shown.show_last(channel, sink),
                Event::Sought(to_ns) => turn = Some(Turn::Seek(to_ns)),
                Event::End => return Some(Turn::End),
                Event::Changed => {}
            }
            event = self.server.next_event();
        }
        let is_watched = self.shown.is_watched();
        locked(&self.playback).watch(is_watched, Instant::now());
        turn
    }
}

/// The topics of a recording that are shown, together with the topics derived from them.
struct Shown {
    topics: Vec<ShownTopic>,
    /// The messages of this stretch that could not be decoded. `reported` contains those that have already been reported.
    skipped: Rejections,
    reported: Rejections,
}

struct ShownTopic {
    name: String,
    own: Topic,
    spec: Option<&'static ChannelSpec>,
    derived: Vec<(&'static Derived, Topic)>,
    cdr: Vec<u8>,
}

impl Shown {
    fn new(context: &Arc<Context>, recorded: &[Arc<RecordedTopic>]) -> Result<Self> {
        let topics = recorded.iter().map(|topic| ShownTopic::new(context, topic)).collect::<Result<_>>()?;
        Ok(Self { topics, skipped: Rejections::default(), reported: Rejections::default() })
    }

    fn is_watched(&self) -> bool {
        self.topics.iter().flat_map(ShownTopic::all).any(Topic::is_watched)
    }

    fn show(&mut self, message: &RawMessage) {
        if let Some(topic) = self.topics.iter_mut().find(|topic| topic.name == message.topic.name) {
            topic.show(message, &mut self.skipped);
        }
    }

    /// Reports the skipped messages, unless the same ones were reported for an earlier stretch.
    fn tell_skipped(&mut self) {
        if self.skipped != self.reported {
            self.skipped
                .list()
                .iter()
                .for_each(|skipped| sketchnav_schemas::say!("notice: skipped {skipped}"));
            self.reported = self.skipped.clone();
        }
    }

    fn show_last(&self, channel: ChannelId, sink: SinkId) {
        let topics = self.topics.iter().flat_map(ShownTopic::all);
        topics.filter(|topic| topic.is(channel)).for_each(|topic| topic.show_last(sink));
    }

    fn forget(&mut self) {
        self.skipped = Rejections::default();
        for topic in &mut self.topics {
            topic.own.forget();
            topic.derived.iter_mut().for_each(|(_, topic)| topic.forget());
        }
    }
}

impl ShownTopic {
    fn new(context: &Arc<Context>, recorded: &RecordedTopic) -> Result<Self> {
        let RecordedTopic { name, encoding, schema, .. } = recorded;
        let has_schema = !schema.name.is_empty();
        let announced = has_schema
            .then(|| Schema::new(schema.name.clone(), schema.encoding.clone(), schema.data.clone()));
        let own = Topic::foreign(context, name, encoding, announced, recorded.is_latched())?;
        // In a recording from elsewhere, a topic with the name of a channel may have another type.
        let spec = channels::of_topic(name).filter(|spec| spec.message.ros2 == recorded.ros2_type);
        let derived = spec.into_iter().flat_map(sketchnav_navigators::derived);
        let derived = derived.map(|derived| Ok((derived, Topic::derived(context, derived)?)));
        let derived = derived.collect::<Result<_>>()?;
        Ok(Self { name: name.clone(), own, spec, derived, cdr: Vec::new() })
    }

    fn all(&self) -> impl Iterator<Item = &Topic> {
        std::iter::once(&self.own).chain(self.derived.iter().map(|(_, topic)| topic))
    }

    /// Shows a message and the messages derived from it. A damaged message is not shown, and nothing is derived from one that
    /// cannot be decoded.
    fn show(&mut self, message: &RawMessage, skipped: &mut Rejections) {
        if message.is_damaged() {
            return skipped.count_damaged(message);
        }
        self.own.show(message.stamp_ns, &message.cdr);
        if let Err(error) = self.derive(message) {
            skipped.count_undecoded(message, &error);
        }
    }

    fn derive(&mut self, message: &RawMessage) -> Result<(), RecordingError> {
        let Some(spec) = self.spec else { return Ok(()) };
        let is_wanted = |topic: &Topic| topic.is_watched() || topic.is_latched();
        if !self.derived.iter().any(|(_, topic)| is_wanted(topic)) {
            return Ok(());
        }
        let decoded = message.decode(spec)?;
        for (derived, topic) in self.derived.iter_mut().filter(|(_, topic)| is_wanted(topic)) {
            self.cdr.clear();
            derived.encode(decoded.bytes(), decoded.cells(), &mut self.cdr).map_err(|source| {
                let (topic, seq) = (self.name.clone(), message.sequence.into());
                RecordingError::Message { topic, seq, source }
            })?;
            topic.show(message.stamp_ns, &self.cdr);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression test: a single message that could not be decoded was reported, but thousands of them were reported as one. A
    /// message that could not be unpacked was shown as it was.
    #[test]
    fn undecodable_messages_are_skipped_and_counted() {
        sketchnav_navigators::register(&[]).unwrap();
        let spec = channels::find("sketch").unwrap();
        let topic = Arc::new(RecordedTopic {
            name: "/sketch".to_owned(),
            ros2_type: spec.message.ros2.to_owned(),
            encoding: "cdr".to_owned(),
            schema: Arc::default(),
            metadata: Default::default(),
        });
        let mut shown = Shown::new(&Context::new(), &[Arc::clone(&topic)]).unwrap();
        for (sequence, cdr) in (1..).zip([&[0; 3][..], &[0; 7], b"\x28\xb5\x2f\xfd no frame"]) {
            let topic = Arc::clone(&topic);
            shown.show(&RawMessage { topic, sequence, stamp_ns: 5, publish_ns: 5, cdr: cdr.to_vec() });
        }
        let words: Vec<_> = shown.skipped.list().iter().map(ToString::to_string).collect();
        let [undecoded, damaged] = &words[..] else { panic!("{words:?}") };
        assert!(
            undecoded.starts_with("2 messages of /sketch: expected a message of the topic's type"),
            "{undecoded}"
        );
        assert!(
            damaged.starts_with("1 message of /sketch: expected a message that zstd can unpack"),
            "{damaged}"
        );
        shown.forget();
        assert!(shown.skipped.is_empty());
    }
}
