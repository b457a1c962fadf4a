//! Prints messages: as JSON or as a table with commas, whole or some fields.

use std::path::Path;

use anyhow::anyhow;
use sketchnav_recordings::Recording;
use sketchnav_recordings::reader::{RawMessage, Selection};
use sketchnav_recordings::writer::topic_name;
use sketchnav_runtime::{Node, RawSample};
use sketchnav_schemas::channels::{self, ChannelSpec};
use sketchnav_schemas::erased;
use sketchnav_schemas::message::Header;

use super::field::Field;
use super::{Amount, Listener, follow, known};
use crate::args::{EchoOptions, Tap};
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::{live, say};
use crate::recordings::whole::Whole;

/// Prints each message as a JSON object: its number, time and cause, and its ROS 2 form; or as a line of a table.
pub fn echo(options: &EchoOptions) -> Result<Outcome, Failure> {
    let fields = options.fields.iter().map(|text| Field::parse(text)).collect::<Result<Vec<_>, _>>();
    let fields = fields.or_input()?;
    let amount = if options.once { Amount::Newest } else { Amount::of(options.tap.count) };
    let names_channels = options.tap.regex.is_some();
    let mut echo =
        Echo { fields, csv: options.csv, names_channels, has_heading: false, tells_history: !options.once };
    match &options.file {
        Some(file) => of_recording(file, &options.tap, amount, &mut echo),
        None => follow(&options.tap, amount, &mut echo),
    }
}

/// Prints the messages of a recording.
fn of_recording(file: &Path, tap: &Tap, amount: Amount, echo: &mut Echo) -> Result<Outcome, Failure> {
    let whole = Whole::of(file)?;
    let recording = Recording::open(whole.path()).or_input()?;
    let specs = recorded(&recording, tap)?;
    let mut left = match amount {
        Amount::Messages(count) => count,
        Amount::Newest => u64::MAX,
    };
    let mut newest = None;
    for raw in
        recording.timeline(Selection::of_topics(specs.iter().map(|spec| topic_name(spec.name)))).or_input()?
    {
        if left == 0 {
            return Ok(Outcome::Success);
        }
        let raw = raw.or_input()?;
        if amount == Amount::Newest {
            newest = Some(raw);
        } else {
            echo.recorded(&raw)?;
            left -= 1;
        }
    }
    newest.iter().try_for_each(|raw| echo.recorded(raw))?;
    Ok(Outcome::Success)
}

/// The channels that are meant, of those that a recording has.
fn recorded(recording: &Recording, tap: &Tap) -> Result<Vec<&'static ChannelSpec>, Failure> {
    let named = tap.channel.as_deref().map(known).transpose()?;
    let topics = recording.topics().or_input()?;
    let has: Vec<_> = topics.iter().filter_map(|topic| channels::of_topic(&topic.name)).collect();
    let matches = |name: &str| tap.regex.as_ref().is_some_and(|regex| regex.is_match(name));
    let specs: Vec<_> =
        has.iter().copied().filter(|&spec| named == Some(spec) || matches(spec.name)).collect();
    if !specs.is_empty() {
        return Ok(specs);
    }
    let file = recording.path().display();
    let names: Vec<_> = has.iter().map(|spec| spec.name).collect();
    let found = tap.channel.as_deref().map_or("no match of --regex".to_owned(), |name| format!("{name:?}"));
    Err(Failure::Input(anyhow!("{file}: expected one of {}, found {found}", names.join(", "))))
}

struct Echo {
    fields: Vec<Field>,
    csv: bool,
    names_channels: bool,
    has_heading: bool,
    tells_history: bool,
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

    fn hear(&mut self, spec: &'static ChannelSpec, sample: &RawSample) -> Result<(), Failure> {
        self.print(spec, sample.message(), sample.cells())
    }

    fn tick(&mut self, _: &'static ChannelSpec, _: u64) -> Result<(), Failure> {
        Ok(())
    }
}

impl Echo {
    fn recorded(&mut self, raw: &RawMessage) -> Result<(), Failure> {
        let Some(spec) = channels::of_topic(&raw.topic.name) else { return Ok(()) };
        let message = raw.decode(spec).or_input()?;
        self.print(spec, message.bytes(), message.cells())
    }

    fn print(&mut self, spec: &'static ChannelSpec, message: &[u8], cells: &[u8]) -> Result<(), Failure> {
        let form = spec.message.json(message, cells).map_err(anyhow::Error::from_boxed)?;
        let header = erased::header(message);
        if self.csv { self.row(header, &form) } else { self.object(spec, header, form) }
    }

    fn object(&self, spec: &ChannelSpec, header: &Header, form: serde_json::Value) -> Result<(), Failure> {
        let mut line = serde_json::json!({
            "seq": header.seq, "stamp_ns": header.stamp_ns, "source_seq": header.source_seq,
        });
        if self.names_channels {
            line["channel"] = spec.name.into();
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

    fn row(&mut self, header: &Header, form: &serde_json::Value) -> Result<(), Failure> {
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
        let numbers = [header.seq, header.stamp_ns, header.source_seq].map(|number| number.to_string());
        Ok(live!("{}", numbers.into_iter().chain(cells.or_input()?).collect::<Vec<_>>().join(","))?)
    }
}

/// A cell as RFC 4180 has it.
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
