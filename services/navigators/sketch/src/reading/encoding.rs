//! Unpacks compressed files and decodes text of any encoding.

use std::borrow::Cow;
use std::io::Read;

use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE};
use flate2::read::MultiGzDecoder;

use super::error::{Broken, SketchError};

/// Maximum size of a file after unpacking, in bytes.
const MAX_UNPACKED: usize = 32 << 20;
/// Number of bytes within which the declaration of an XML file must end.
const MOST_DECLARATION: usize = 256;

/// Unpacks a gzip file (`.svgz`, `.json.gz`). Any other file is returned as it is.
pub(crate) fn unpacked<'a>(bytes: &'a [u8], broken: &Broken) -> Result<Cow<'a, [u8]>, SketchError> {
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(bytes.into());
    }
    let mut inside = Vec::new();
    let decoder = MultiGzDecoder::new(bytes);
    let read = decoder.take(MAX_UNPACKED as u64 + 1).read_to_end(&mut inside);
    read.map_err(|error| broken.decode("gzip", error))?;
    if inside.len() > MAX_UNPACKED {
        return Err(broken.too_large(format!("{MAX_UNPACKED} bytes unpacked"), "more".into()));
    }
    Ok(inside.into())
}

/// Decodes the text in a file. Its encoding is determined by the byte order mark, by a first character of two
/// bytes, or by the XML declaration. Otherwise, UTF-8 is assumed.
pub(crate) fn text<'a>(bytes: &'a [u8], broken: &Broken) -> Result<Cow<'a, str>, SketchError> {
    let encoding = match (Encoding::for_bom(bytes), wide(bytes), declared(bytes)) {
        (Some((encoding, _)), ..) => encoding,
        (None, Some(encoding), _) => encoding,
        (None, None, Some(label)) => Encoding::for_label(label.as_bytes()).ok_or_else(|| {
            broken.decode("text", format!("its encoding {label:?} is not known; save it as UTF-8"))
        })?,
        (None, None, None) => UTF_8,
    };
    // A declaration that is readable as ASCII is not UTF-16, even if it claims to be: some programs declare UTF-16 and then write
    // UTF-8.
    let is_ascii = [UTF_16LE, UTF_16BE].contains(&encoding) && bytes.starts_with(b"<?xml");
    let encoding = if is_ascii { UTF_8 } else { encoding };
    let (text, encoding, is_garbled) = encoding.decode(bytes);
    if is_garbled {
        let name = encoding.name();
        let reason =
            format!("its bytes are not {name}; save it as UTF-8, or state the encoding in its first line");
        return Err(broken.decode("text", reason));
    }
    Ok(text)
}

/// Recognizes UTF-16 without a byte order mark by its first character, which takes two bytes.
pub(crate) fn wide(bytes: &[u8]) -> Option<&'static Encoding> {
    match bytes {
        [b'<' | b'{', 0, ..] => Some(UTF_16LE),
        [0, b'<' | b'{', ..] => Some(UTF_16BE),
        _ => None,
    }
}

/// Returns the encoding that an XML declaration names, if any.
fn declared(bytes: &[u8]) -> Option<String> {
    let head = &bytes[..bytes.len().min(MOST_DECLARATION)];
    let head: String = head.iter().map(|&byte| char::from(byte)).collect();
    let declaration = head.trim_start().strip_prefix("<?xml")?.split("?>").next()?;
    let after = declaration.split_once("encoding")?.1.trim_start().strip_prefix('=')?.trim_start();
    let quote = after.chars().next().filter(|c| matches!(c, '"' | '\''))?;
    after[1..].split(quote).next().map(str::to_owned)
}
