//! Separates ink from paper, which determines which pixels of a picture are walls.
//!
//! An occupancy *map*, as `map_saver` and SLAM save it, is recognized by its three tones, which are those of occupied, unknown and
//! free cells. All cells that are not free are solid, as in the world that is built from such a map.
//!
//! All other pictures come in two kinds. A *clean* picture has two tones that are far apart and little else, and is
//! separated by Otsu's threshold. Anything else is treated as a *photograph* of strokes on paper under uneven
//! light. Each of its pixels is divided by the brightness of the paper around it (a box mean over an integral
//! image, leaving out the strokes), and Otsu's threshold then finds the strokes in the levelled picture.
//!
//! A clean picture is either a *line drawing*, whose strokes are walls, or *filled*, with free space in one
//! tone, and the outside and everything solid in the other. The tone along the border is paper in a line
//! drawing and solid in a filled one. The other tone distinguishes the two: strokes are thin, whereas much of
//! the free space in a filled drawing is far from its edges.
//!
//! Transparent paper counts as white, as on a screen, or as black if the ink would vanish on white.
//!
//! Sources: Otsu 1979 (threshold); Bradley and Roth 2007 (adaptive threshold by integral image).

use crate::mission::WallTone;
use image::{GrayImage, Luma};

use super::bits::{Bits, disc};
use super::pen;
use super::raster::Tones;
use super::walls::Kind;

/// The tones of occupied, unknown and free cells in a map saved in `trinary` mode (`map_saver_cli` of nav2).
const MAP_TONES: [usize; 3] = [0, 205, 254];
/// Threshold between unknown and free cells, which leaves room for the tones between them in a map that was scaled down.
const FREE_TONE: u8 = 230;
/// Half the width, in levels, of the band around a tone of a clean picture.
const TONE_BAND: usize = 8;
/// Minimum share of a clean picture's pixels that lie in the bands of its two tones.
const CLEAN_SHARE: f64 = 0.9;
/// Minimum number of levels between the two tones of a clean picture, and between ink and paper in any picture.
const CLEAN_CONTRAST: usize = 64;
const LEAST_CONTRAST: f64 = 24.0;
/// Depth, as a share of the diagonal, beyond which a pixel lies too far from the edge of its area to be part of a stroke.
const DEEP_SHARE: f64 = 0.02;
/// Maximum share of a tone's area that may be deeper than [`DEEP_SHARE`] for the tone to count as strokes. With more, it is free
/// space. Some pillars and tables may be filled in, but not most of a drawing.
const DEEP_AREA_SHARE: f64 = 0.3;
/// Width of the window whose mean is the paper's brightness, as a share of the longer side.
const PAPER_WINDOW_SHARE: f64 = 0.125;
/// The level of bare paper in a levelled picture.
const PAPER_LEVEL: f64 = 200.0;
/// Distance from a wall, in pixels, within which the tones of its edge reach.
const EDGE_PX: f64 = 2.0;
/// Strokes differ from the mean around them by at least this share.
const STROKE_SHARE: f64 = 0.08;

/// The walls that were found.
pub(crate) struct Ink {
    /// 255 where there is a wall, 0 elsewhere.
    pub walls: GrayImage,
    /// Kind of the picture.
    pub kind: Kind,
    /// Share of a line drawing's strokes that are too faint compared with the walls.
    pub faint: f64,
}

/// Finds the walls of a picture, or returns `None` if the page is of one tone.
pub(crate) fn find(tones: &Tones, tone: WallTone) -> Option<Ink> {
    let on_black = || find_on(&tones.ink, tone);
    let on_white = || find_on(&tones.on_white(), tone);
    match &tones.cover {
        None => on_black(),
        Some(cover) if !is_light_pen(&tones.ink, cover) => on_white().or_else(on_black),
        // The mission specifies dark walls, so they are drawn on light paper.
        Some(_) if tone == WallTone::Dark => on_white(),
        Some(_) => on_black(),
    }
}

/// Returns true if the ink consists of strokes and most of it would vanish on white paper.
fn is_light_pen(ink: &GrayImage, cover: &GrayImage) -> bool {
    let [on_white, ..] = vanishing(ink, cover);
    on_white > 0.5 && is_strokes(&covered(cover))
}

/// Returns the share of the strokes on transparent paper that vanish on the paper chosen by [`find`] but would be visible on
/// the other. This is 0 if the ink does not consist of strokes, as with white rooms between black walls.
pub(crate) fn lost_share(tones: &Tones, tone: WallTone) -> f64 {
    let Some(cover) = &tones.cover else { return 0.0 };
    let [on_white, on_black, on_both] = vanishing(&tones.ink, cover);
    let lost = if on_white > 0.5 && tone != WallTone::Dark { on_black } else { on_white };
    let lost = lost - on_both;
    if lost > 0.0 && is_strokes(&covered(cover)) { lost } else { 0.0 }
}

/// Returns the shares of the ink that vanish on white paper, on black paper, and on both. Ink that vanishes on both is as thin
/// as haze.
fn vanishing(ink: &GrayImage, cover: &GrayImage) -> [f64; 3] {
    let (mut lost, mut all) = ([0_u64; 3], 0_u64);
    for (&ink, &cover) in ink.iter().zip(cover.iter()) {
        all += u64::from(cover);
        // On white paper, a pixel has its tone on black paper plus whatever shows of the paper.
        let [on_white, on_black] = [cover - ink.min(cover), ink];
        for (lost, contrast) in lost.iter_mut().zip([on_white, on_black, on_white.max(on_black)]) {
            *lost += if f64::from(contrast) < LEAST_CONTRAST { u64::from(cover) } else { 0 };
        }
    }
    lost.map(|lost| lost as f64 / all.max(1) as f64)
}

fn covered(cover: &GrayImage) -> GrayImage {
    map(cover, |cover| if cover < 128 { 0 } else { 255 })
}

/// Returns the largest difference between two tones of the picture, in levels of 255.
pub(crate) fn contrast(picture: &GrayImage) -> u8 {
    let (low, high) = picture.iter().fold((255, 0), |(low, high), &tone| (tone.min(low), tone.max(high)));
    high.saturating_sub(low)
}

fn find_on(picture: &GrayImage, tone: WallTone) -> Option<Ink> {
    let counts = histogram(picture);
    if tone != WallTone::Light && is_map(&counts) {
        return Some(Ink { walls: below(picture, FREE_TONE), kind: Kind::Surveyed, faint: 0.0 });
    }
    if is_clean(&counts) { clean(picture, &counts, tone) } else { photograph(picture, tone) }
}

/// Returns a mask that is 255 where the picture is darker than `threshold`, and 0 elsewhere.
pub(crate) fn below(picture: &GrayImage, threshold: u8) -> GrayImage {
    map(picture, |tone| if tone < threshold { 255 } else { 0 })
}

fn map(picture: &GrayImage, f: impl Fn(u8) -> u8) -> GrayImage {
    let mut mapped = picture.clone();
    mapped.iter_mut().for_each(|tone| *tone = f(*tone));
    mapped
}

/// Counts the pixels of each tone. Most pixels are bare paper, so eight equal ones are counted at once.
fn histogram(picture: &GrayImage) -> [u64; 256] {
    let mut counts = [0; 256];
    let (eights, rest) = picture.as_raw().as_chunks::<8>();
    for eight in eights {
        if *eight == [eight[0]; 8] {
            counts[usize::from(eight[0])] += 8;
        } else {
            eight.iter().for_each(|&tone| counts[usize::from(tone)] += 1);
        }
    }
    rest.iter().for_each(|&tone| counts[usize::from(tone)] += 1);
    counts
}

/// Returns true if the picture has all of the tones of a map, and hardly any others.
fn is_map(counts: &[u64; 256]) -> bool {
    let counted = MAP_TONES.map(|tone| counts[tone]);
    let share = counted.iter().sum::<u64>() as f64 / counts.iter().sum::<u64>().max(1) as f64;
    counted.iter().all(|&count| count > 0) && share >= CLEAN_SHARE
}

/// Returns true if nearly all pixels are of two tones that are far apart.
fn is_clean(counts: &[u64; 256]) -> bool {
    let band = |tone: usize| -> u64 {
        counts[tone.saturating_sub(TONE_BAND)..=(tone + TONE_BAND).min(255)].iter().sum()
    };
    let first = (0..256).max_by_key(|&tone| band(tone)).unwrap_or(0);
    let far = |tone: &usize| tone.abs_diff(first) >= CLEAN_CONTRAST;
    let second = (0..256).filter(far).map(band).max().unwrap_or(0);
    (band(first) + second) as f64 >= CLEAN_SHARE * counts.iter().sum::<u64>() as f64
}

/// Returns Otsu's threshold, or `None` if the means of the classes are closer than [`LEAST_CONTRAST`].
///
/// The threshold divides the pixels into two classes whose means lie farthest apart, weighted by the sizes of the classes. If a
/// range of thresholds divides them equally well, its middle is taken.
fn otsu(counts: &[u64; 256]) -> Option<u8> {
    let total: u64 = counts.iter().sum();
    let moment: u64 = counts.iter().zip(0..).map(|(n, tone)| n * tone).sum();
    let (mut below, mut below_moment) = (0_u64, 0_u64);
    let (mut best, mut first, mut last, mut contrast) = (0.0, 0, 0, 0.0);
    for threshold in 1..256_usize {
        below += counts[threshold - 1];
        below_moment += counts[threshold - 1] * (threshold as u64 - 1);
        let above = total - below;
        if below == 0 || above == 0 {
            continue;
        }
        let gap = (moment - below_moment) as f64 / above as f64 - below_moment as f64 / below as f64;
        let between = below as f64 * above as f64 * gap * gap;
        if between > best {
            (best, first, contrast) = (between, threshold, gap);
        }
        if between >= best {
            last = threshold;
        }
    }
    (contrast >= LEAST_CONTRAST).then_some(first.midpoint(last) as u8)
}

fn clean(picture: &GrayImage, counts: &[u64; 256], tone: WallTone) -> Option<Ink> {
    let dark = below(picture, otsu(counts)?);
    let walls = match tone {
        WallTone::Dark => dark,
        WallTone::Light => inverted(&dark),
        WallTone::Auto => {
            let other = if border_is(&dark) { inverted(&dark) } else { dark };
            if is_strokes(&other) { other } else { inverted(&other) }
        }
    };
    let kind = if border_is(&walls) { Kind::Filled } else { Kind::Lines };
    let faint = if kind == Kind::Lines { faint_share(picture, counts, &walls) } else { 0.0 };
    Some(Ink { walls, kind, faint })
}

/// Returns the share of the strokes that stand out from the paper but are not walls. This is 0 if they are areas rather than
/// strokes, such as tinted rooms.
fn faint_share(picture: &GrayImage, counts: &[u64; 256], walls: &GrayImage) -> f64 {
    let paper = (0..=255_u8).max_by_key(|&tone| counts[usize::from(tone)]).unwrap_or(255);
    // A wall's edge has all tones between the wall's and the paper's.
    let around = Bits::of(walls).dilated(&disc(EDGE_PX)).into_mask();
    let mut faint = picture.clone();
    for (tone, around) in faint.iter_mut().zip(around.iter()) {
        let stands_out = *around == 0 && f64::from(tone.abs_diff(paper)) >= LEAST_CONTRAST;
        *tone = if stands_out { 255 } else { 0 };
    }
    let count = |mask: &GrayImage| mask.iter().filter(|&&value| value > 0).count() as f64;
    let (lost, kept) = (count(&faint), count(walls));
    if lost > 0.0 && is_strokes(&faint) { lost / (lost + kept) } else { 0.0 }
}

fn inverted(mask: &GrayImage) -> GrayImage {
    map(mask, |v| 255 - v)
}

/// Returns true if most of the border belongs to the mask.
fn border_is(mask: &GrayImage) -> bool {
    let (width, height) = mask.dimensions();
    let rows = (0..width).flat_map(|x| [(x, 0), (x, height - 1)]);
    let columns = (0..height).flat_map(|y| [(0, y), (width - 1, y)]);
    let (mut inside, mut all) = (0, 0);
    for (x, y) in rows.chain(columns) {
        inside += u64::from(mask.get_pixel(x, y).0[0] > 0);
        all += 1;
    }
    2 * inside > all
}

/// Returns true if the mask consists of strokes, that is, if little of it lies deep inside.
fn is_strokes(mask: &GrayImage) -> bool {
    let diagonal = f64::from(mask.width()).hypot(mask.height().into());
    pen::share_deeper(mask, (DEEP_SHARE * diagonal).max(2.0)) < DEEP_AREA_SHARE
}

fn photograph(picture: &GrayImage, tone: WallTone) -> Option<Ink> {
    let smooth = box_mean(picture, 1, |_| true);
    let radius = (PAPER_WINDOW_SHARE / 2.0 * f64::from(picture.width().max(picture.height()))).max(2.0);
    let around = box_mean(&smooth, radius as u32, |_| true);
    let dark = match tone {
        WallTone::Dark => true,
        WallTone::Light => false,
        WallTone::Auto => strokes_are_dark(&smooth, &around),
    };
    let level = levelled(&smooth, &around, radius as u32, dark);
    let threshold = otsu(&histogram(&level))?;
    let speckled = below(&level, threshold);
    let walls = pen::without_speckles(speckled);
    Some(Ink { walls, kind: Kind::Photograph, faint: 0.0 })
}

/// Returns true if the strokes are darker than the paper. Strokes are few and stand out from their surroundings, whereas paper is
/// plentiful and hardly does. The skew of the differences therefore shows on which side the strokes are.
fn strokes_are_dark(picture: &GrayImage, around: &GrayImage) -> bool {
    let pairs = picture.iter().zip(around.iter()).map(|(&v, &m)| (f64::from(v), f64::from(m).max(1.0)));
    pairs.map(|(v, m)| ((v - m) / m).powi(3)).sum::<f64>() <= 0.0
}

/// Returns the picture with the paper at the same level everywhere and the strokes below it.
fn levelled(picture: &GrayImage, around: &GrayImage, radius: u32, dark: bool) -> GrayImage {
    let bare = |i: usize| {
        let (tone, mean) = (f64::from(picture.as_raw()[i]), f64::from(around.as_raw()[i]));
        if dark { tone >= (1.0 - STROKE_SHARE) * mean } else { tone <= (1.0 + STROKE_SHARE) * mean }
    };
    let paper = box_mean(picture, radius, bare);
    let mut level = picture.clone();
    for (tone, &paper) in level.iter_mut().zip(paper.iter()) {
        let (ink, paper) = (f64::from(*tone).max(1.0), f64::from(paper).max(1.0));
        let ratio = if dark { ink / paper } else { paper / ink };
        *tone = (PAPER_LEVEL * ratio).min(PAPER_LEVEL * 1.1) as u8;
    }
    level
}

/// Returns, for each pixel, the mean of those pixels within `radius` for whose index `counts` is true. If there are none, the
/// pixel stays as it is. The means are computed from integral images.
fn box_mean(picture: &GrayImage, radius: u32, counts: impl Fn(usize) -> bool) -> GrayImage {
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let stride = width + 1;
    let mut integral = vec![[0_u32; 2]; stride * (height + 1)];
    for y in 0..height {
        let mut row = [0, 0];
        for x in 0..width {
            let i = y * width + x;
            if counts(i) {
                row = [row[0] + u32::from(picture.as_raw()[i]), row[1] + 1];
            }
            let above = integral[y * stride + x + 1];
            integral[(y + 1) * stride + x + 1] = [above[0] + row[0], above[1] + row[1]];
        }
    }
    let radius = radius as usize;
    GrayImage::from_fn(picture.width(), picture.height(), |x, y| {
        let (x, y) = (x as usize, y as usize);
        let (left, right) = (x.saturating_sub(radius), (x + radius + 1).min(width));
        let (low, high) = (y.saturating_sub(radius), (y + radius + 1).min(height));
        let at = |x: usize, y: usize, part: usize| u64::from(integral[y * stride + x][part]);
        let sum =
            |part| at(right, high, part) + at(left, low, part) - at(left, high, part) - at(right, low, part);
        let mean = sum(0).checked_div(sum(1));
        Luma([mean.map_or(picture.as_raw()[y * width + x], |mean| mean as u8)])
    })
}
