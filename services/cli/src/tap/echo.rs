//! Prints messages: as JSON or as a table with commas, whole or some fields.

use sketchnav_runtime::{Node, RawSample};
use sketchnav_schemas::channels::ChannelSpec;

use super::field::Field;
use super::{Amount, Listener, follow};
use crate::args::EchoOptions;
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::{live, say};

/// Prints each message as a JSON object: its number, time and cause, and its ROS 2 form; or as a line of a table.
pub fn echo(options: &EchoOptions) -> Result<Outcome, Failure> {
    let fields = options.fields.iter().map(|text| Field::parse(text)).collect::<Result<Vec<_>, _>>();
    let fields = fields.or_input()?;
    let amount = if options.once { Amount::Newest } else { Amount::of(options.tap.count) };
    let names_channels = options.tap.regex.is_some();
    let mut echo =
        Echo { fields, csv: options.csv, names_channels, has_heading: false, tells_history: !options.once };
    follow(&options.tap, amount, &mut echo)
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
        let json = spec.message.json(sample.message(), sample.cells());
        let form = json.map_err(anyhow::Error::from_boxed)?;
        if self.csv { self.row(sample, &form) } else { self.object(spec, sample, form) }
    }

    fn tick(&mut self, _: &'static ChannelSpec, _: u64) -> Result<(), Failure> {
        Ok(())
    }
}

impl Echo {
    fn object(&self, spec: &ChannelSpec, sample: &RawSample, form: serde_json::Value) -> Result<(), Failure> {
        let header = sample.header();
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

    fn row(&mut self, sample: &RawSample, form: &serde_json::Value) -> Result<(), Failure> {
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
        let header = sample.header();
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
