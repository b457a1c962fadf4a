//! Prints messages as JSON or comma-separated values, either whole or only some of their fields.

use sketchnav_recordings::dynamic::Decoder;
use sketchnav_recordings::reader::{RawMessage, Selection};
use sketchnav_recordings::rejected::Rejections;
use sketchnav_recordings::{Recording, RecordingError};
use sketchnav_runtime::{Node, RawSample};
use sketchnav_schemas::channels::{self, ChannelSpec};
use sketchnav_schemas::erased::{self, Owned};
use sketchnav_schemas::message::Header;

use super::field::Field;
use super::{Amount, Listener, follow};
use crate::args::{EchoOptions, Tap};
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::{live, say};
use crate::recordings::whole::Whole;
use crate::recordings::with;

/// Prints each message as a JSON object with its number, time, cause and ROS 2 form, or as a row of a table.
pub fn echo(options: &EchoOptions) -> Result<Outcome, Failure> {
    let fields = options.fields.iter().map(|text| Field::parse(text)).collect::<Result<Vec<_>, _>>();
    let fields = fields.or_input()?;
    let amount = if options.once { Amount::Newest } else { Amount::of(options.tap.count) };
    let names_channels = options.tap.regex.is_some();
    let tells_history = !options.once;
    let (csv, decoder) = (options.csv, Decoder::default());
    let mut echo = Echo { fields, csv, names_channels, has_heading: false, tells_history, decoder };
    match &options.file {
        Some(file) => with(file, |whole| of_recording(whole, &options.tap, amount, &mut echo)),
        None => follow(&options.tap, amount, &mut echo),
    }
}

/// Prints the messages of a recording. Messages that cannot be decoded are skipped, counted and named.
fn of_recording(whole: &Whole, tap: &Tap, amount: Amount, echo: &mut Echo) -> Result<Outcome, Failure> {
    let recording = Recording::open(whole.path()).or_input()?;
    let topics = super::recorded(&recording, tap)?;
    let mut left = match amount {
        Amount::Messages(count) => count,
        Amount::Newest => u64::MAX,
    };
    let (mut newest, mut skipped, mut has_any) = (None, Skipped::default(), false);
    for raw in recording.timeline(Selection::of_topics(topics)).or_input()? {
        if left == 0 {
            break;
        }
        let raw = raw.or_input()?;
        let Some(message) = skipped.unless(&raw, echo.decode(&raw)).or_input()? else { continue };
        has_any = true;
        if amount == Amount::Newest {
            newest = Some((raw, message));
        } else {
            echo.recorded(&raw, message)?;
            left -= 1;
        }
    }
    newest.into_iter().try_for_each(|(raw, message)| echo.recorded(&raw, message))?;
    skipped.report(has_any).or_input()?;
    Ok(Outcome::Success)
}

/// The messages that were skipped because they could not be decoded.
#[derive(Default)]
struct Skipped {
    rejections: Rejections,
    first: Option<RecordingError>,
}

impl Skipped {
    /// Returns the decoded message. If only this message could not be decoded, counts it and returns `None`.
    fn unless<T>(
        &mut self,
        raw: &RawMessage,
        decoded: Result<T, RecordingError>,
    ) -> Result<Option<T>, RecordingError> {
        match decoded {
            Err(error) if raw.is_damaged() || error.is_one_message() => {
                match raw.is_damaged() {
                    true => self.rejections.count_damaged(raw),
                    false => self.rejections.count_undecoded(raw, &error),
                }
                self.first.get_or_insert(error);
                Ok(None)
            }
            decoded => decoded.map(Some),
        }
    }

    /// Prints the skipped messages or, if no other message could be printed, returns the first error.
    fn report(self, has_others: bool) -> Result<(), RecordingError> {
        match self.first {
            Some(error) if !has_others => Err(error),
            _ => {
                self.rejections.list().iter().for_each(|skipped| say!("notice: skipped {skipped}"));
                Ok(())
            }
        }
    }
}

struct Echo {
    fields: Vec<Field>,
    csv: bool,
    names_channels: bool,
    has_heading: bool,
    tells_history: bool,
    /// Decodes messages whose types are not ours.
    decoder: Decoder,
}

/// A recorded message after decoding.
enum Decoded {
    Ours(&'static ChannelSpec, Owned),
    Form(serde_json::Value),
}

/// The values that are printed before a message.
struct Head<'a> {
    channel: &'a str,
    seq: u64,
    stamp_ns: u64,
    /// The number of the tick that caused the message, or `None` if there is no cause, as in recordings by
    /// other software.
    source_seq: Option<u64>,
}

impl<'a> Head<'a> {
    fn of(spec: &'a ChannelSpec, header: &Header) -> Self {
        let Header { seq, stamp_ns, source_seq } = *header;
        Self { channel: spec.name, seq, stamp_ns, source_seq: Some(source_seq) }
    }
}

impl Listener for Echo {
    const HISTORY: bool = true;

    fn begin(&mut self, _: &Node, specs: &[&'static ChannelSpec]) -> Result<(), Failure> {
        for spec in specs.iter().filter(|_| self.tells_history) {
            let (name, kept) = (spec.name, spec.history());
            say!("first the history of {name}: up to {kept} messages that were sent before");
        }
        Ok(())
    }

    fn receive(&mut self, spec: &'static ChannelSpec, sample: &RawSample) -> Result<(), Failure> {
        self.print(spec, sample.message(), sample.cells())
    }

    fn tick(&mut self, _: &'static ChannelSpec, _: u64) -> Result<(), Failure> {
        Ok(())
    }
}

impl Echo {
    /// Decodes a message of ours into its own type, and any other message according to the schema in the file.
    fn decode(&mut self, raw: &RawMessage) -> Result<Decoded, RecordingError> {
        let spec = channels::of_topic(&raw.topic.name);
        let ours = spec.filter(|spec| spec.message.ros2 == raw.topic.ros2_type);
        if let Some((spec, message)) = ours.and_then(|spec| Some((spec, raw.decode(spec).ok()?))) {
            return Ok(Decoded::Ours(spec, message));
        }
        self.decoder.decode(raw).map(Decoded::Form)
    }

    fn recorded(&mut self, raw: &RawMessage, decoded: Decoded) -> Result<(), Failure> {
        match decoded {
            Decoded::Ours(spec, message) => self.print(spec, message.bytes(), message.cells()),
            Decoded::Form(form) => {
                let channel = raw.topic.name.trim_start_matches('/');
                let (seq, stamp_ns) = (raw.sequence.into(), raw.stamp_ns);
                self.print_form(&Head { channel, seq, stamp_ns, source_seq: None }, form)
            }
        }
    }

    fn print(&mut self, spec: &'static ChannelSpec, message: &[u8], cells: &[u8]) -> Result<(), Failure> {
        let form = spec.message.json(message, cells).map_err(anyhow::Error::from_boxed)?;
        self.print_form(&Head::of(spec, erased::header(message)), form)
    }

    fn print_form(&mut self, head: &Head<'_>, form: serde_json::Value) -> Result<(), Failure> {
        if self.csv { self.row(head, &form) } else { self.object(head, form) }
    }

    fn object(&self, head: &Head<'_>, form: serde_json::Value) -> Result<(), Failure> {
        let mut line = serde_json::json!({ "seq": head.seq, "stamp_ns": head.stamp_ns });
        if let Some(source_seq) = head.source_seq {
            line["source_seq"] = source_seq.into();
        }
        if self.names_channels {
            line["channel"] = head.channel.into();
        }
        if self.fields.is_empty() {
            line["message"] = form;
        } else {
            let field = |field: &Field| Ok((field.text().to_owned(), field.of(&form)?.clone()));
            let fields: Result<serde_json::Map<_, _>, super::field::FieldError> =
                self.fields.iter().map(field).collect();
            line["fields"] = fields.or_input()?.into();
        }
        Ok(live!("{line}")?)
    }

    fn row(&mut self, head: &Head<'_>, form: &serde_json::Value) -> Result<(), Failure> {
        if !self.has_heading {
            self.has_heading = true;
            if self.fields.is_empty() {
                self.fields = Field::all_of(form);
            }
            let names = self.fields.iter().map(|field| quoted(field.text()));
            let names = ["seq", "stamp_ns", "source_seq"].map(str::to_owned).into_iter().chain(names);
            live!("{}", names.collect::<Vec<_>>().join(","))?;
        }
        let cells = self.fields.iter().map(|field| Ok(quoted(&field.cell(form)?)));
        let cells: Result<Vec<_>, super::field::FieldError> = cells.collect();
        let cause = head.source_seq.map_or_else(String::new, |source_seq| source_seq.to_string());
        let numbers = [head.seq.to_string(), head.stamp_ns.to_string(), cause];
        Ok(live!("{}", numbers.into_iter().chain(cells.or_input()?).collect::<Vec<_>>().join(","))?)
    }
}

/// Quotes a cell according to RFC 4180.
fn quoted(text: &str) -> String {
    let plain = !text.contains([',', '"', '\n', '\r']);
    if plain { text.to_owned() } else { format!("\"{}\"", text.replace('"', "\"\"")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_with_commas_or_quotes_is_quoted() {
        assert_eq!(quoted("plain"), "plain");
        assert_eq!(quoted("a, \"b\""), "\"a, \"\"b\"\"\"");
    }
}
