//! Pictures inside an SVG: those of all formats that drawings have, in `data:` URLs. They are decoded here, within the bounds of all pictures, and
//! handed to the renderer as PNG: its own decoders have no bounds, and what they cannot read they leave out without a word.

use std::io::Cursor;
use std::sync::Arc;

use data_url::DataUrl;
use image::ImageEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};

use crate::reading::error::{Broken, SketchError};
use crate::reading::raster::{MAX_PIXELS, format_of, upright};

/// What an `<image>` refers to a picture by.
const SCHEME: &str = "picture:";

/// The pictures of a drawing.
#[derive(Default)]
pub(super) struct Pictures {
    /// As PNG.
    pub files: Vec<Arc<Vec<u8>>>,
    pixels: u64,
}

impl Pictures {
    /// Takes in what a reference leads to and gives the reference that the renderer is to have; or else what it leads to,
    /// where that is no picture in the drawing.
    ///
    /// # Errors
    /// [`SketchError`]: a picture that is broken or too large.
    pub fn add(&mut self, link: &str, broken: &Broken) -> Result<Result<String, String>, SketchError> {
        let Ok(url) = DataUrl::process(link.trim()) else {
            return Ok(Err(format!("the file {:?}", link.chars().take(80).collect::<String>())));
        };
        let (bytes, _) = url.decode_to_vec().map_err(|error| broken.decode("data:", error))?;
        let Some(format) = format_of(&bytes) else {
            return Ok(Err(format!("a picture of type {}", url.mime_type())));
        };
        let picture = upright(&bytes, format, broken)?.into_luma_alpha8();
        let (width, height) = picture.dimensions();
        self.pixels += u64::from(width) * u64::from(height);
        if self.pixels > MAX_PIXELS {
            let limit = format!("{} megapixels in all pictures", MAX_PIXELS / 1_000_000);
            return Err(broken.too_large(limit, "more".into()));
        }
        let mut file = Cursor::new(Vec::new());
        PngEncoder::new_with_quality(&mut file, CompressionType::Fast, FilterType::NoFilter)
            .write_image(&picture, width, height, image::ExtendedColorType::La8)
            .map_err(|error| broken.decode("PNG", error))?;
        self.files.push(Arc::new(file.into_inner()));
        Ok(Ok(format!("{SCHEME}{}", self.files.len() - 1)))
    }
}

/// The picture that a reference of ours leads to.
pub(super) fn find<'a>(files: &'a [Arc<Vec<u8>>], reference: &str) -> Option<&'a Arc<Vec<u8>>> {
    files.get(reference.strip_prefix(SCHEME)?.parse::<usize>().ok()?)
}
