//! Finds the samples of several objects that belong together, either those with equal times or those nearest
//! in time.

use sketchnav_schemas::statistics::median;

use super::Track;

/// Added to a tolerance, in seconds, since decimal fractions are not exact.
const ROUNDING_S: f64 = 1e-9;

/// Objects whose periods do not overlap were never seen together if their samples are farther apart than this, in
/// seconds.
const FAR_APART_S: f64 = 1.0;

/// The samples of several objects that belong to the same time.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The time of the scene, in seconds.
    pub at_s: f64,
    /// The index of each object's sample, or `None` if the object was not seen.
    pub samples: Vec<Option<usize>>,
}

impl Scene {
    /// Returns true if all objects were seen.
    pub fn is_whole(&self) -> bool {
        self.samples.iter().all(Option::is_some)
    }
}

/// Associates samples that belong together. Without a tolerance, these are samples with equal times, and there is a
/// scene for each time of any object. With a tolerance, there is a scene for each sample of the object with the fewest
/// samples. The nearest sample of each other object is used if it is within the tolerance and is not nearer to another
/// scene. The remaining samples are left out.
pub fn associate(tracks: &[&Track], tolerance_s: Option<f64>) -> Vec<Scene> {
    match tolerance_s {
        None => equal(tracks),
        Some(tolerance_s) => nearest(tracks, tolerance_s + ROUNDING_S),
    }
}

fn equal(tracks: &[&Track]) -> Vec<Scene> {
    let mut times: Vec<f64> =
        tracks.iter().flat_map(|track| track.samples.iter().map(|(at_s, _)| *at_s)).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let mut next = vec![0; tracks.len()];
    let mut scene = |at_s: f64| {
        let sample = |(track, next): (&&Track, &mut usize)| {
            let is_seen = track.samples.get(*next).is_some_and(|(own_s, _)| *own_s == at_s);
            *next += usize::from(is_seen);
            is_seen.then(|| *next - 1)
        };
        Scene { at_s, samples: tracks.iter().zip(&mut next).map(sample).collect() }
    };
    times.into_iter().map(&mut scene).collect()
}

fn nearest(tracks: &[&Track], tolerance_s: f64) -> Vec<Scene> {
    let Some(anchor) = anchor(tracks) else { return Vec::new() };
    let scene = |index: usize| {
        let at_s = anchor.samples[index].0;
        let sample = |track: &&Track| {
            if std::ptr::eq(*track, anchor) {
                return Some(index);
            }
            let found = nearest_sample(track, at_s)?;
            let found_s = track.samples[found].0;
            let is_mutual = nearest_sample(anchor, found_s) == Some(index);
            (is_mutual && (found_s - at_s).abs() <= tolerance_s).then_some(found)
        };
        Scene { at_s, samples: tracks.iter().map(sample).collect() }
    };
    (0..anchor.samples.len()).map(scene).collect()
}

/// Returns the object with the fewest samples, or the first of several.
fn anchor<'a>(tracks: &[&'a Track]) -> Option<&'a Track> {
    tracks.iter().copied().min_by_key(|track| track.samples.len())
}

/// Returns the index of the sample that is nearest in time, or of the earlier one of two.
fn nearest_sample(track: &Track, at_s: f64) -> Option<usize> {
    let after = track.samples.partition_point(|(own_s, _)| *own_s < at_s);
    let off = |index: &usize| (track.samples[*index].0 - at_s).abs();
    let candidates = [after.checked_sub(1), (after < track.samples.len()).then_some(after)];
    candidates.into_iter().flatten().min_by(|a, b| off(a).total_cmp(&off(b)))
}

/// Statistics of how often objects were seen together.
#[derive(Debug, Clone, PartialEq)]
pub struct Meetings {
    /// Number of scenes that show all objects.
    pub together: usize,
    /// The object with the fewest samples.
    pub rarest: String,
    /// Number of samples of the object `rarest`.
    pub samples: usize,
    /// Time differences between the samples of the object `rarest` and the nearest ones of the others, in seconds, in
    /// ascending order.
    misses_s: Vec<f64>,
    /// Whether there is a time that lies in the periods of all objects.
    overlap: bool,
}

impl Meetings {
    /// Counts how often the objects appear together in `scenes`, which were made from their samples.
    pub fn of(tracks: &[&Track], scenes: &[Scene]) -> Self {
        let anchor = anchor(tracks);
        let samples = anchor.map_or(&[][..], |anchor| anchor.samples.as_slice());
        let miss = |at_s: f64| {
            let off = |track: &&Track| {
                nearest_sample(track, at_s)
                    .map_or(f64::INFINITY, |index| (track.samples[index].0 - at_s).abs())
            };
            tracks.iter().map(off).fold(0.0, f64::max)
        };
        let mut misses_s: Vec<f64> = samples.iter().map(|(at_s, _)| miss(*at_s)).collect();
        misses_s.sort_by(f64::total_cmp);
        let first = |track: &&Track| track.samples.first().map_or(f64::INFINITY, |(at_s, _)| *at_s);
        let last = |track: &&Track| track.samples.last().map_or(f64::NEG_INFINITY, |(at_s, _)| *at_s);
        let begin_s = tracks.iter().map(first).fold(f64::NEG_INFINITY, f64::max);
        let end_s = tracks.iter().map(last).fold(f64::INFINITY, f64::min);
        Self {
            together: scenes.iter().filter(|scene| scene.is_whole()).count(),
            rarest: anchor.map_or_else(String::new, |anchor| anchor.name.clone()),
            samples: samples.len(),
            overlap: begin_s <= end_s,
            misses_s,
        }
    }

    /// Describes the differences between the timestamps, and what can be done about them.
    pub fn miss(&self) -> String {
        let Some(least_s) = self.misses_s.first() else { return "there are no samples".to_owned() };
        let median_s = median(&self.misses_s).unwrap_or(*least_s);
        if !self.overlap && median_s > FAR_APART_S {
            let least = figure(*least_s);
            return format!("their times do not overlap: the nearest stamps are {least} s apart");
        }
        let hint = figure(rounded_up(1.1 * median_s));
        let [least, median] = [*least_s, median_s].map(figure);
        format!(
            "the nearest stamps are {least} s apart (median {median} s); --tolerance {hint} treats stamps that close as \
             equal"
        )
    }
}

/// Formats seconds to the microsecond, without superfluous digits.
fn figure(seconds: f64) -> String {
    let text = format!("{seconds:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Rounds a value up to two significant digits.
fn rounded_up(value: f64) -> f64 {
    let unit = 10_f64.powf(value.max(1e-6).log10().floor() - 1.0);
    (value / unit).ceil() * unit
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::relations::Body;

    fn track(name: &str, times_s: &[f64]) -> Track {
        let body = Body { at: [0.0, 0.0], heading_rad: None, size_m: None };
        Track { name: name.to_owned(), samples: times_s.iter().map(|at_s| (*at_s, body)).collect() }
    }

    fn together(a: &[f64], b: &[f64], tolerance_s: Option<f64>) -> (Vec<(usize, usize)>, usize) {
        let (a, b) = (track("a", a), track("b", b));
        let scenes = associate(&[&a, &b], tolerance_s);
        let pairs = scenes.iter().filter_map(|scene| scene.samples[0].zip(scene.samples[1]));
        (pairs.collect(), scenes.len())
    }

    #[test]
    fn equal_times_are_associated_and_others_are_pauses() {
        assert_eq!(together(&[0.0, 0.5, 1.0], &[0.0, 1.0], None), (vec![(0, 0), (2, 1)], 3));
        assert_eq!(together(&[0.0, 1.0], &[0.013, 1.013], None), (vec![], 4));
    }

    #[test]
    fn a_tolerance_takes_the_nearest_sample_once() {
        assert_eq!(together(&[0.0, 1.0], &[0.013, 1.013], Some(0.013)), (vec![(0, 0), (1, 1)], 2));
        assert_eq!(together(&[0.0, 1.0], &[0.013, 1.013], Some(0.012)), (vec![], 2));
        // The object that is seen less often sets the times, so the other object's samples in between are not gaps.
        assert_eq!(together(&[0.0, 0.5, 1.0], &[0.01, 1.01], Some(0.1)), (vec![(0, 0), (2, 1)], 2));
        assert_eq!(together(&[0.0, 0.1], &[0.04, 7.0], Some(0.1)), (vec![(0, 0)], 2));
        assert_eq!(together(&[0.0, 0.5, 1.0], &[0.0, 1.0], Some(0.0)), (vec![(0, 0), (2, 1)], 2));
    }

    #[test]
    fn tracks_without_common_times_are_reported_with_a_remedy() {
        let miss = |a: &[f64], b: &[f64]| {
            let (a, b) = (track("a", a), track("b", b));
            let tracks = [&a, &b];
            Meetings::of(&tracks, &associate(&tracks, None)).miss()
        };
        let expected = "the nearest stamps are 0.013 s apart (median 0.013 s); --tolerance 0.015 treats";
        assert!(miss(&[0.0, 0.5, 5.0], &[0.013, 0.513, 5.013]).starts_with(expected));
        let expected = "their times do not overlap: the nearest stamps are 95 s apart";
        assert_eq!(miss(&[0.0, 5.0], &[100.0, 105.0]), expected);
    }

    proptest! {
        #[test]
        fn no_sample_is_taken_twice_or_too_far(
            a in prop::collection::btree_set(0_u32..400, 1..30),
            b in prop::collection::btree_set(0_u32..400, 1..30),
            tolerance in 0_u32..20,
        ) {
            let times = |set: &std::collections::BTreeSet<u32>| set.iter().map(|t| f64::from(*t)).collect::<Vec<_>>();
            let (a, b) = (times(&a), times(&b));
            let (pairs, _) = together(&a, &b, Some(tolerance.into()));
            prop_assert!(pairs.windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 < w[1].1));
            prop_assert!(pairs.iter().all(|(i, j)| (a[*i] - b[*j]).abs() <= f64::from(tolerance) + 1e-6));
            // Every sample that has a partner at exactly the same time is used.
            let equal = a.iter().filter(|at| b.contains(at)).count();
            prop_assert!(pairs.len() >= equal);
        }
    }
}
