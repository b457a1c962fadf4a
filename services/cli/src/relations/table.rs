//! Reads a table of positions with a row per object and time, and named columns in any order.
//!
//! The separator is the one that splits the first line into columns with known names. Numbers have a decimal
//! point, or a decimal comma if that is not the separator. Additions by spreadsheets are ignored: byte order
//! marks, the line that specifies the separator, and rows and last columns without a value.

use std::borrow::Cow;
use std::fmt::Display;
use std::path::Path;

use anyhow::{Context, anyhow, bail, ensure};

use sketchnav_recordings::foreign::Foreign;

use super::{Body, Track};

/// The required columns.
const NEEDED: [&str; 4] = ["time_s", "object", "x_m", "y_m"];
/// The optional columns.
const OPTIONAL: [&str; 3] = ["heading_deg", "length_m", "width_m"];
/// Number of bytes that are examined to identify a file that is not a table.
const LOOKED_AT: usize = 512;
/// Farthest position, in metres, since squares of larger numbers lose precision.
const FAR_M: f64 = 1e7;

/// Reads a table. The objects are in the order of their first rows.
///
/// # Errors
/// If the table is invalid. The error names the file, the line, the column, and what was expected there.
pub fn read(file: &Path) -> anyhow::Result<Vec<Track>> {
    let bytes = sketchnav_files::read(file, sketchnav_files::POSITIONS)
        .with_context(|| file.display().to_string())?;
    parse(&bytes).with_context(|| file.display().to_string())
}

/// The separators that columns may have.
const SEPARATORS: [u8; 4] = [b',', b';', b'\t', b'|'];

/// The indices of the columns.
#[derive(Debug)]
struct Columns {
    needed: [usize; 4],
    optional: [Option<usize>; 3],
    /// The number of columns.
    count: usize,
}

impl Columns {
    fn of(header: &csv::StringRecord, line: u64) -> anyhow::Result<Self> {
        let count = used(header);
        let names: Vec<&str> = header.iter().take(count).collect();
        let found = || names.join(", ");
        let known = || [&NEEDED[..], &OPTIONAL].concat().join(", ");
        let place = |name: &str| names.iter().position(|column| *column == name);
        if let Some(unknown) = names.iter().find(|name| !is_known(name)) {
            bail!(
                "line {line}: expected columns of {}, separated by , ; | or tabs, found {unknown:?}",
                known()
            );
        }
        let is_twice = |(i, name): &(usize, &&str)| names[..*i].contains(name);
        if let Some((_, twice)) = names.iter().enumerate().find(is_twice) {
            bail!("line {line}: expected each column once, found {twice:?} twice");
        }
        let mut needed = [0; 4];
        for (slot, name) in needed.iter_mut().zip(NEEDED) {
            *slot = place(name)
                .with_context(|| format!("line {line}: expected a column {name:?}, found {}", found()))?;
        }
        let optional = OPTIONAL.map(place);
        ensure!(
            optional[1].is_some() == optional[2].is_some(),
            "line {line}: expected both length_m and width_m or neither, found {}",
            found()
        );
        Ok(Self { needed, optional, count })
    }
}

fn is_known(name: &str) -> bool {
    NEEDED.contains(&name) || OPTIONAL.contains(&name)
}

/// Returns the number of columns, without the empty ones that spreadsheets add at the end.
fn used(record: &csv::StringRecord) -> usize {
    (0..record.len()).rev().find(|&last| !record[last].is_empty()).map_or(0, |last| last + 1)
}

/// A table as text, without a byte order mark or the line in which Excel names the separator.
struct Text<'a> {
    separator: u8,
    rows: &'a [u8],
    /// The number of lines before `rows`.
    lines_before: u64,
}

impl<'a> Text<'a> {
    fn of(bytes: &'a [u8]) -> Self {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let end = bytes.iter().position(|&byte| byte == b'\n').map_or(bytes.len(), |end| end + 1);
        let (first, rest) = bytes.split_at(end);
        match first.trim_ascii_end().strip_prefix(b"sep=") {
            Some(&[separator]) => Self { separator, rows: rest, lines_before: 1 },
            Some([]) => Self { separator: b'\t', rows: rest, lines_before: 1 },
            _ => Self { separator: separator(first), rows: bytes, lines_before: 0 },
        }
    }

    fn reader(&self) -> csv::Reader<&'a [u8]> {
        reader(self.separator, self.rows)
    }
}

fn reader(separator: u8, rows: &[u8]) -> csv::Reader<&[u8]> {
    csv::ReaderBuilder::new().delimiter(separator).flexible(true).trim(csv::Trim::All).from_reader(rows)
}

/// Returns the separator that yields most known columns in the first line, or the first such separator if there are
/// several.
fn separator(header: &[u8]) -> u8 {
    let columns = |separator: &u8| {
        let mut reader = reader(*separator, header);
        reader.headers().map_or(0, |header| header.iter().filter(|name| is_known(name)).count())
    };
    SEPARATORS.into_iter().rev().max_by_key(columns).unwrap_or(b',')
}

/// Parses the numbers of a table, which must all have a decimal point or all have a decimal comma.
struct Numbers {
    /// The decimal mark that occurred first.
    mark: Option<char>,
    separator: u8,
}

impl Numbers {
    fn parse(&mut self, text: &str) -> Result<f64, &'static str> {
        let mark = text.chars().find(|mark| matches!(mark, '.' | ','));
        match (mark, self.mark) {
            (Some(','), _) if self.separator == b',' => {
                return Err("; decimal commas need a separator other than commas: ; or tabs");
            }
            (Some(','), Some('.')) => return Err("; the preceding numbers have decimal points"),
            (Some('.'), Some(',')) => return Err("; the preceding numbers have decimal commas"),
            _ => {}
        }
        self.mark = self.mark.or(mark);
        let text = if mark == Some(',') { text.replacen(',', ".", 1) } else { text.to_owned() };
        text.parse().map_err(|_| "")
    }
}

/// Returns the bytes as UTF-8, since spreadsheets save "Unicode text" as UTF-16.
fn decoded(bytes: &[u8]) -> anyhow::Result<Cow<'_, [u8]>> {
    let unit: fn([u8; 2]) -> u16 = match bytes {
        [0xff, 0xfe, ..] => u16::from_le_bytes,
        [0xfe, 0xff, ..] => u16::from_be_bytes,
        _ => {
            let found = Foreign::of(&bytes[..bytes.len().min(LOOKED_AT)]);
            ensure!(
                matches!(found, Foreign::Text | Foreign::Unknown),
                "expected a table as text, found {found}"
            );
            let is_text = std::str::from_utf8(bytes).is_ok();
            ensure!(
                is_text,
                "expected UTF-8 or UTF-16, found other bytes; save a spreadsheet as CSV in UTF-8"
            );
            return Ok(Cow::Borrowed(bytes));
        }
    };
    let units: Vec<u16> = bytes[2..].chunks_exact(2).map(|pair| unit([pair[0], pair[1]])).collect();
    let text = String::from_utf16(&units).context("expected UTF-8 or UTF-16")?;
    Ok(Cow::Owned(text.into_bytes()))
}

fn parse(bytes: &[u8]) -> anyhow::Result<Vec<Track>> {
    let bytes = decoded(bytes)?;
    let text = Text::of(&bytes);
    let mut reader = text.reader();
    let columns = Columns::of(reader.headers().context("line 1")?, text.lines_before + 1)?;
    let mut numbers = Numbers { mark: None, separator: text.separator };
    let mut tracks: Vec<Track> = Vec::new();
    for record in reader.records() {
        let record = record.context("expected rows in UTF-8")?;
        if used(&record) == 0 {
            continue;
        }
        let line = text.lines_before + record.position().map_or(0, csv::Position::line);
        let sample = sample(&record, &columns, &mut numbers).with_context(|| format!("line {line}"))?;
        take(&mut tracks, sample).with_context(|| format!("line {line}"))?;
    }
    ensure!(!tracks.is_empty(), "expected a line for each object and time, found none");
    Ok(tracks)
}

/// Adds a sample to the track of its object.
fn take(tracks: &mut Vec<Track>, (name, time_s, body): (String, f64, Body)) -> anyhow::Result<()> {
    let known = tracks.iter().position(|track| track.name == name);
    let index = known.unwrap_or(tracks.len());
    if known.is_none() {
        tracks.push(Track { name, samples: Vec::new() });
    }
    let samples = &mut tracks[index].samples;
    if let Some((last_s, _)) = samples.last().filter(|(last_s, _)| *last_s >= time_s) {
        bail!("time_s: expected a time after {last_s} s of the same object, found {time_s}");
    }
    samples.push((time_s, body));
    Ok(())
}

fn sample(
    record: &csv::StringRecord,
    columns: &Columns,
    numbers: &mut Numbers,
) -> anyhow::Result<(String, f64, Body)> {
    let (found, expected) = (used(record), columns.count);
    if found > expected {
        let comma = numbers.separator == b',' && found > expected + 1;
        let hint = if comma { "; decimal commas need a separator other than commas: ; or tabs" } else { "" };
        bail!("expected {expected} columns, found {found}{hint}");
    }
    let text = |column: usize| record.get(column).unwrap_or_default();
    let [time, object, x, y] = columns.needed;
    let name = text(object);
    ensure!(!name.is_empty(), "object: expected a name, found none");
    let mut finite =
        |what: &str, column: usize, most: f64| number(what, text(column), (-most, most), numbers);
    let time_s = finite("time_s", time, 1e12)?;
    let at = [finite("x_m", x, FAR_M)?, finite("y_m", y, FAR_M)?];
    let [heading, length, width] = columns.optional;
    let given = |column: Option<usize>| column.filter(|&column| !text(column).is_empty());
    let heading_rad = given(heading).map(|column| finite("heading_deg", column, 1e6)).transpose()?;
    let mut side = |what, column| number(what, text(column), (f64::MIN_POSITIVE, FAR_M), numbers);
    let size_m = match (given(length), given(width)) {
        (Some(length), Some(width)) => Some([side("length_m", length)?, side("width_m", width)?]),
        (None, None) => None,
        _ => bail!("length_m, width_m: expected both numbers or neither, found one"),
    };
    let body = Body { at, heading_rad: heading_rad.map(f64::to_radians), size_m };
    Ok((name.to_owned(), time_s, body))
}

fn number(
    what: impl Display,
    text: &str,
    (least, most): (f64, f64),
    numbers: &mut Numbers,
) -> anyhow::Result<f64> {
    let sign = if least > 0.0 { "a number above 0, at most" } else { "a number within ±" };
    let wrong = |hint: &str| anyhow!("{what}: expected {sign} {most:e}, found {text:?}{hint}");
    let value = numbers.parse(text).map_err(wrong)?;
    if (least..=most).contains(&value) { Ok(value) } else { Err(wrong("")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_may_be_in_any_order_and_objects_at_any_times() {
        let text = "object, x_m, y_m, time_s\nrobot, 0, 0, 0.0\nperson, 1, 2, 0.1\nrobot, 0.5, 0, 0.2\n";
        let tracks = parse(text.as_bytes()).unwrap();
        let found: Vec<_> = tracks.iter().map(|track| (track.name.as_str(), track.samples.len())).collect();
        assert_eq!(found, [("robot", 2), ("person", 1)]);
        assert_eq!(tracks[0].samples[1], (0.2, Body { at: [0.5, 0.0], heading_rad: None, size_m: None }));
    }

    /// Regression test: tables saved by spreadsheets in Europe were once rejected with "found "time_s;object…"".
    #[test]
    fn separators_and_decimal_commas_are_detected() {
        let plain = "time_s,object,x_m,y_m\n0.000,robot,0.5,-1\n0.500,robot,1.25,-1\n0.5,human,3,4\n";
        let expected = parse(plain.as_bytes()).unwrap();
        assert_eq!(expected[0].samples[1].1.at, [1.25, -1.0]);
        let semicolons = plain.replace(',', ";");
        let utf16: Vec<u8> =
            "\u{feff}".encode_utf16().chain(semicolons.encode_utf16()).flat_map(u16::to_le_bytes).collect();
        for table in [
            semicolons.clone(),
            semicolons.replace('.', ","),
            plain.replace(',', "\t"),
            plain.replace(',', "\t").replace('.', ","),
            plain.replace(',', " | "),
            format!("sep=;\r\n{}", semicolons.replace('.', ",")),
            format!("\u{feff}{plain}"),
            format!("{}\r\n", plain.replace('\n', "\r\n")),
            // The same table as Excel writes it, with columns and rows without a value.
            plain.replace('\n', ",,\r\n") + ",,,,,\r\n\r\n,,,,,\r\n",
        ] {
            assert_eq!(parse(table.as_bytes()).unwrap(), expected, "{table}");
        }
        assert_eq!(parse(&utf16).unwrap(), expected);
    }

    #[test]
    fn errors_name_the_line_and_the_column() {
        let good = "time_s,object,x_m,y_m\n0,a,1,2\n";
        for (text, message) in [
            ("time_s,object,x_m\n0,a,1\n", "line 1: expected a column \"y_m\", found time_s, object, x_m"),
            ("time_s,object,x_m,y_m,x_m\n", "line 1: expected each column once, found \"x_m\" twice"),
            ("PK\u{3}\u{4} a spreadsheet", "expected a table as text, found a ZIP archive"),
            ("time_s,object,x_m,y_m,z_m\n", "line 1: expected columns of time_s, object, x_m, y_m"),
            ("time_s object x_m y_m\n", "separated by , ; | or tabs, found \"time_s object x_m y_m\""),
            (
                "time_s,object,x_m,y_m\n0,000,a,1,5,2,5\n",
                "line 2: expected 4 columns, found 7; decimal commas need a separator other than commas",
            ),
            (
                &format!("{good}\"0,5\",a,1,2\n"),
                "line 3: time_s: expected a number within ± 1e12, found \"0,5\"; decimal",
            ),
            (
                "time_s;object;x_m;y_m\n0,5;a;1;2\n1.5;a;1;2\n",
                "line 3: time_s: expected a number within ± 1e12, found \"1.5\"; the preceding numbers have decimal commas",
            ),
            (
                "sep=;\ntime_s;object;x_m;y_m\n0,5;a;1.234,5;2\n",
                "line 3: x_m: expected a number within ± 1e7, found \"1.234,5\"; the preceding numbers have decimal commas",
            ),
            ("time_s,object,x_m,y_m,width_m\n", "line 1: expected both length_m and width_m"),
            (&format!("{good}0.1,a,nan,2\n"), "line 3: x_m: expected a number within ± 1e7, found \"nan\""),
            (&format!("{good}0.1,a,1,inf\n"), "line 3: y_m: expected a number within ± 1e7, found \"inf\""),
            (&format!("{good}0.1,a,1,\n"), "line 3: y_m: expected a number within ± 1e7, found \"\""),
            (&format!("{good}0.1,,1,2\n"), "line 3: object: expected a name"),
            (
                &format!("{good}0,a,1,2\n"),
                "line 3: time_s: expected a time after 0 s of the same object, found 0",
            ),
            (&format!("{good}0.1,a,1\n"), "line 3: y_m: expected a number within ± 1e7, found \"\""),
            (&format!("{good}0.1,a,1,2,3\n"), "line 3: expected 4 columns, found 5"),
            ("time_s,object,x_m,y_m\n", "expected a line for each object and time, found none"),
        ] {
            let error = format!("{:#}", parse(text.as_bytes()).unwrap_err());
            assert!(error.contains(message), "{error}");
        }
        let latin = format!("{:#}", parse(b"time_s,object,x_m,y_m\n0,K\xfcche,1,2\n").unwrap_err());
        assert!(latin.contains("found other bytes; save a spreadsheet as CSV in UTF-8"), "{latin}");
    }

    mod any {
        use proptest::prelude::*;
        use proptest::test_runner::RngSeed;

        proptest! {
            #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() })]

            #[test]
            fn no_table_makes_it_panic_and_all_numbers_are_finite(
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
