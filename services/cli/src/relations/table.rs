//! A table of positions: a line for each object and time, with named columns in any order.

use std::fmt::Display;
use std::path::Path;

use anyhow::{Context, anyhow, bail, ensure};

use super::{Body, Track};

/// Columns that a table must have.
const NEEDED: [&str; 4] = ["time_s", "object", "x_m", "y_m"];
/// Columns that it may have.
const OPTIONAL: [&str; 3] = ["heading_deg", "length_m", "width_m"];
/// Farthest position: beyond it squares lose their precision.
const FAR_M: f64 = 1e7;

/// Reads a table; objects come in the order in which the table names them first.
///
/// # Errors
/// The file, the line, the column, and what was expected there.
pub fn read(file: &Path) -> anyhow::Result<Vec<Track>> {
    let bytes = sketchnav_files::read(file, sketchnav_files::POSITIONS)
        .with_context(|| file.display().to_string())?;
    parse(&bytes).with_context(|| file.display().to_string())
}

/// Where the columns stand.
struct Columns {
    needed: [usize; 4],
    optional: [Option<usize>; 3],
}

impl Columns {
    fn of(header: &csv::StringRecord) -> anyhow::Result<Self> {
        let found = || header.iter().collect::<Vec<_>>().join(", ");
        let known = || [&NEEDED[..], &OPTIONAL].concat().join(", ");
        let place = |name: &str| header.iter().position(|column| column == name);
        if let Some(unknown) = header.iter().find(|name| !NEEDED.contains(name) && !OPTIONAL.contains(name)) {
            bail!("line 1: expected columns of {}, found {unknown:?}", known());
        }
        let mut needed = [0; 4];
        for (slot, name) in needed.iter_mut().zip(NEEDED) {
            *slot = place(name)
                .with_context(|| format!("line 1: expected a column {name:?}, found {}", found()))?;
        }
        let optional = OPTIONAL.map(place);
        ensure!(
            optional[1].is_some() == optional[2].is_some(),
            "line 1: expected both of length_m and width_m or none, found {}",
            found()
        );
        Ok(Self { needed, optional })
    }
}

fn parse(bytes: &[u8]) -> anyhow::Result<Vec<Track>> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
    let columns = Columns::of(reader.headers().context("line 1")?)?;
    let mut tracks: Vec<Track> = Vec::new();
    for record in reader.records() {
        let record = record.context("expected comma-separated values")?;
        let line = record.position().map_or(0, csv::Position::line);
        let (name, time_s, body) = sample(&record, &columns).with_context(|| format!("line {line}"))?;
        let known = tracks.iter().position(|track| track.name == name);
        let index = known.unwrap_or(tracks.len());
        if known.is_none() {
            tracks.push(Track { name, samples: Vec::new() });
        }
        let samples = &mut tracks[index].samples;
        if let Some((last_s, _)) = samples.last().filter(|(last_s, _)| *last_s >= time_s) {
            bail!("line {line}, time_s: expected a time after {last_s} s of the same object, found {time_s}");
        }
        samples.push((time_s, body));
    }
    ensure!(!tracks.is_empty(), "expected a line for each object and time, found none");
    Ok(tracks)
}

fn sample(record: &csv::StringRecord, columns: &Columns) -> anyhow::Result<(String, f64, Body)> {
    let text = |column: usize| record.get(column).unwrap_or_default();
    let [time, object, x, y] = columns.needed;
    let name = text(object);
    ensure!(!name.is_empty(), "object: expected a name, found none");
    let finite = |what: &str, column: usize, most: f64| number(what, text(column), -most, most);
    let at = [finite("x_m", x, FAR_M)?, finite("y_m", y, FAR_M)?];
    let [heading, length, width] = columns.optional;
    let given = |column: Option<usize>| column.filter(|&column| !text(column).is_empty());
    let heading_rad = given(heading).map(|column| finite("heading_deg", column, 1e6)).transpose()?;
    let side = |what, column| number(what, text(column), f64::MIN_POSITIVE, FAR_M);
    let size_m = match (given(length), given(width)) {
        (Some(length), Some(width)) => Some([side("length_m", length)?, side("width_m", width)?]),
        (None, None) => None,
        _ => bail!("length_m, width_m: expected both numbers or none, found one"),
    };
    let body = Body { at, heading_rad: heading_rad.map(f64::to_radians), size_m };
    Ok((name.to_owned(), finite("time_s", time, 1e12)?, body))
}

fn number(what: impl Display, text: &str, least: f64, most: f64) -> anyhow::Result<f64> {
    let found = text.parse().ok().filter(|value| (least..=most).contains(value));
    let sign = if least > 0.0 { "a number above 0, at most" } else { "a number within ±" };
    found.ok_or_else(|| anyhow!("{what}: expected {sign} {most:e}, found {text:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_come_in_any_order_and_objects_at_any_times() {
        let text = "object, x_m, y_m, time_s\nrobot, 0, 0, 0.0\nperson, 1, 2, 0.1\nrobot, 0.5, 0, 0.2\n";
        let tracks = parse(text.as_bytes()).unwrap();
        let found: Vec<_> = tracks.iter().map(|track| (track.name.as_str(), track.samples.len())).collect();
        assert_eq!(found, [("robot", 2), ("person", 1)]);
        assert_eq!(tracks[0].samples[1], (0.2, Body { at: [0.5, 0.0], heading_rad: None, size_m: None }));
    }

    #[test]
    fn errors_name_the_line_and_the_column() {
        let good = "time_s,object,x_m,y_m\n0,a,1,2\n";
        for (text, message) in [
            ("time_s,object,x_m\n0,a,1\n", "line 1: expected a column \"y_m\", found time_s, object, x_m"),
            ("time_s,object,x_m,y_m,z_m\n", "line 1: expected columns of time_s, object, x_m, y_m"),
            ("time_s,object,x_m,y_m,width_m\n", "line 1: expected both of length_m and width_m"),
            (&format!("{good}0.1,a,nan,2\n"), "line 3: x_m: expected a number within ± 1e7, found \"nan\""),
            (&format!("{good}0.1,a,1,inf\n"), "line 3: y_m: expected a number within ± 1e7, found \"inf\""),
            (&format!("{good}0.1,a,1,\n"), "line 3: y_m: expected a number within ± 1e7, found \"\""),
            (&format!("{good}0.1,,1,2\n"), "line 3: object: expected a name"),
            (
                &format!("{good}0,a,1,2\n"),
                "line 3, time_s: expected a time after 0 s of the same object, found 0",
            ),
            (&format!("{good}0.1,a,1\n"), "expected comma-separated values"),
            ("time_s,object,x_m,y_m\n", "expected a line for each object and time, found none"),
        ] {
            let error = format!("{:#}", parse(text.as_bytes()).unwrap_err());
            assert!(error.contains(message), "{error}");
        }
    }

    mod any {
        use proptest::prelude::*;
        use proptest::test_runner::RngSeed;

        proptest! {
            #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() })]

            #[test]
            fn no_table_makes_it_panic_and_what_it_reads_is_finite(
                head in prop_oneof![Just("time_s,object,x_m,y_m\n"), Just("object,time_s,x_m,y_m,length_m,width_m,heading_deg\n")],
                body in "[0-9a-c,.\n\"eE+-]{0,200}",
            ) {
                for track in super::parse(format!("{head}{body}").as_bytes()).into_iter().flatten() {
                    prop_assert!(track.samples.is_sorted_by(|a, b| a.0 < b.0));
                    prop_assert!(track.samples.iter().all(|(_, body)| body.at.iter().all(|v| v.is_finite())));
                }
            }
        }
    }
}
