//! Pictures embedded in an SVG by `data:` URLs, in any format that a drawing may have. They are decoded here,
//! within the same bounds as other pictures, and passed to the renderer as PNG, because the renderer's own
//! decoders have no bounds and silently drop anything they cannot read.

use std::io::Cursor;
use std::sync::Arc;

use data_url::DataUrl;
use image::ImageEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};

use crate::reading::error::{Broken, SketchError};
use crate::reading::raster::{MAX_PIXELS, format_of, upright};

/// URL scheme for references from an `<image>` to a decoded picture.
const SCHEME: &str = "picture:";

/// The pictures of a drawing.
#[derive(Default)]
pub(super) struct Pictures {
    /// The pictures as PNG files.
    pub files: Vec<Arc<Vec<u8>>>,
    pixels: u64,
}

impl Pictures {
    /// Decodes the picture that `link` refers to, and returns the reference that the renderer should use instead. If `link` is
    /// not a picture embedded in the drawing, returns a description of it as the inner `Err`.
    ///
    /// # Errors
    /// [`SketchError`] if the picture is broken or too large.
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

/// Returns the picture for a reference returned by [`Pictures::add`].
pub(super) fn find<'a>(files: &'a [Arc<Vec<u8>>], reference: &str) -> Option<&'a Arc<Vec<u8>>> {
    files.get(reference.strip_prefix(SCHEME)?.parse::<usize>().ok()?)
}
