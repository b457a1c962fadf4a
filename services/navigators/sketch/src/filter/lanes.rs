//! Mathematical functions for the filter's inner loops, on sixteen numbers at once.
//!
//! Only operations with exact rounding under IEEE 754 are used, and no fused multiply-adds, estimated reciprocals or library calls.
//! The order of operations is fixed as well, so results are identical to the bit on every set of vector instructions. The
//! coefficients are from Cody and Waite 1980 and from Cephes.

use fearless_simd::{f32x16, i32x16, prelude::*};

/// Number of particles processed together on any processor. Narrower vectors need several steps.
pub const LANES: usize = 16;

/// Loads sixteen elements of `column` from `first` on. Past the end, the last element is repeated.
#[inline(always)]
pub fn load<S: Simd>(simd: S, column: &[f32], first: usize) -> f32x16<S> {
    match column.get(first..first + LANES) {
        Some(all) => f32x16::from_slice(simd, all),
        None => f32x16::from_fn(simd, |lane| column[(first + lane).min(column.len() - 1)]),
    }
}

/// Loads sixteen elements of `column` from `first` on, and zeros past the end.
#[inline(always)]
pub fn load_or_zero<S: Simd>(simd: S, column: &[f32], first: usize) -> f32x16<S> {
    match column.get(first..first + LANES) {
        Some(all) => f32x16::from_slice(simd, all),
        None => f32x16::from_fn(simd, |lane| column.get(first + lane).copied().unwrap_or(0.0)),
    }
}

/// Looks up the elements of `table` at `index`. An index out of range gives the last element.
#[inline(always)]
pub fn gather<S: Simd>(simd: S, table: &[f32], index: i32x16<S>) -> f32x16<S> {
    let index: [i32; LANES] = index.into();
    let last = table.len() - 1;
    f32x16::from_fn(simd, |lane| table[(index[lane] as u32 as usize).min(last)])
}

/// Returns sine and cosine, to within 10⁻⁶ for angles of up to about ten turns.
#[inline(always)]
pub fn sin_cos<S: Simd>(angle_rad: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
    let quarter = (angle_rad * std::f32::consts::FRAC_2_PI).round_ties_even();
    let r = angle_rad - quarter * 1.570_312_5 - quarter * 4.837_513e-4 - quarter * 7.549_79e-8;
    let r2 = r * r;
    let sine = r + r * r2 * ((r2 * -1.951_529_6e-4 + 8.332_161e-3) * r2 - 1.666_665_5e-1);
    let tail = (r2 * 2.443_315_7e-5 - 1.388_731_6e-3) * r2 + 4.166_664_6e-2;
    let cosine = (r2 * -0.5 + 1.0) + r2 * r2 * tail;
    let quadrant: i32x16<S> = quarter.to_int();
    let odd = (quadrant & 1).simd_eq(1);
    let (s, c) = (odd.select(cosine, sine), odd.select(sine, cosine));
    (negated(s, quadrant & 2), negated(c, (quadrant + 1) & 2))
}

/// Returns −x if `two` is 2, and x if it is 0.
#[inline(always)]
fn negated<S: Simd>(x: f32x16<S>, two: i32x16<S>) -> f32x16<S> {
    (x.bitcast::<i32x16<S>>() ^ (two << 30)).bitcast()
}

/// Returns eˣ with a relative error of up to 2·10⁻⁷ for x from −87 to 88. Returns e⁸⁸ above that range, and 0 below it and for −∞
/// and NaN.
#[inline(always)]
pub fn exp<S: Simd>(x: f32x16<S>) -> f32x16<S> {
    let something = x.simd_ge(-87.0);
    let x = something.select(x, f32x16::splat(x.simd, -87.0)).min(88.0);
    let power = (x * std::f32::consts::LOG2_E).round_ties_even();
    let r = x - power * 0.693_359_4 + power * 2.121_944_4e-4;
    let p = (r * 1.987_569_1e-4 + 1.398_199_9e-3) * r + 8.333_452e-3;
    let p = ((p * r + 4.166_579_6e-2) * r + 1.666_666_5e-1) * r + 0.5;
    let mantissa = p * (r * r) + r + 1.0;
    let exponent: i32x16<S> = power.to_int();
    let value = mantissa * ((exponent + 127) << 23).bitcast::<f32x16<S>>();
    something.select(value, f32x16::splat(x.simd, 0.0))
}

/// Writes [`exp`] of all elements of `from` to `to`, which has the same length.
#[inline(always)]
pub fn exp_all<S: Simd>(simd: S, from: &[f32], to: &mut [f32]) {
    for (k, to) in to.chunks_mut(LANES).enumerate() {
        to.copy_from_slice(&exp(load(simd, from, k * LANES)).as_slice()[..to.len()]);
    }
}

/// Wraps angles to [−π, π), like [`super::metric::wrap`].
#[inline(always)]
pub fn wrap<S: Simd>(angle_rad: f32x16<S>) -> f32x16<S> {
    use std::f32::consts::{PI, TAU};
    angle_rad - ((angle_rad + PI) / TAU).floor() * TAU
}

/// Returns log₂ of positive, normal numbers to within 10⁻², as the exponent plus a parabola through the mantissa.
#[inline(always)]
pub fn fast_log2<S: Simd>(x: f32x16<S>) -> f32x16<S> {
    let bits: i32x16<S> = x.bitcast();
    let exponent: f32x16<S> = ((bits >> 23) - 127).to_float();
    let mantissa: f32x16<S> = ((bits & 0x007f_ffff) | 0x3f80_0000).bitcast();
    let above_one = mantissa - 1.0;
    exponent + above_one * (above_one * -0.346_555_3 + 1.346_555_3)
}

/// Maximum exponent for which [`fast_exp2`] is defined. The minimum is its negative.
pub const MOST_EXP2: f32 = 120.0;

/// Returns 2 to the power x·times and its inverse, both to within 0.3 %, for exponents from −120 to 120. The bits of a number are
/// nearly its logarithm (Schraudolph 1999). A parabola corrects the straight line between two powers of two, which is too high. It
/// is symmetric about its middle, so it serves for both results.
#[inline(always)]
pub fn fast_exp2<S: Simd>(x: f32x16<S>, times: f32) -> [f32x16<S>; 2] {
    const UNIT: f32 = (1 << 23) as f32;
    const BEND: f32 = 0.339_5 * UNIT;
    const ONE: f32 = 127.0 * UNIT;
    let log2 = x * times;
    let part = log2 - log2.floor();
    let one = part * (part * BEND - BEND) + ONE;
    let bits = |of: f32x16<S>| -> f32x16<S> { of.to_int::<i32x16<S>>().bitcast() };
    [bits(one + log2 * UNIT), bits(one - log2 * UNIT)]
}

/// Returns the direction of (x, y), from −½ to ½ of a turn, in units of which `per_turn` make a turn. The result is not rounded and
/// is accurate to 0.0001 turns. Within a quarter turn, it is the arc tangent of the offset from the quarter's middle (Hastings
/// 1955), which is mirrored into the other quarters.
#[inline(always)]
pub fn direction<S: Simd>(x: f32x16<S>, y: f32x16<S>, per_turn: f32) -> f32x16<S> {
    let (along, across) = (x.abs(), y.abs());
    let from_middle = (across - along) / (along + across).max(f32::MIN_POSITIVE);
    let square = from_middle * from_middle;
    let [a, b, c] = [0.995_354, -0.288_679, 0.079_331].map(|k: f32| k * per_turn / std::f32::consts::TAU);
    let quarter = from_middle * ((square * c + b) * square + a) + per_turn / 8.0;
    let half = x.simd_lt(0.0).select(-quarter + per_turn / 2.0, quarter);
    y.simd_lt(0.0).select(-half, half)
}

/// Returns the sets of vector instructions supported by this processor.
#[cfg(test)]
pub(super) fn levels() -> Vec<fearless_simd::Level> {
    let best = fearless_simd::Level::new();
    let mut levels = vec![fearless_simd::Level::baseline(), best];
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        levels.extend(best.as_sse4_2().map(|token| token.level()));
        levels.extend(best.as_avx2().map(|token| token.level()));
    }
    levels
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::{Level, dispatch};

    /// Applies `f` to `values`, sixteen at a time.
    macro_rules! over {
        ($values:expr, $simd:ident, $v:ident => $f:expr) => {{
            let mut out: Vec<f32> = Vec::new();
            for chunk in $values.chunks_exact(LANES) {
                dispatch!(Level::new(), $simd => {
                    let $v = load($simd, chunk, 0);
                    out.extend_from_slice(($f).as_slice());
                });
            }
            out
        }};
    }

    fn evenly(from: f32, to: f32) -> Vec<f32> {
        (0..16_000).map(|i| from + (to - from) * i as f32 / 16_000.0).collect()
    }

    #[test]
    fn sine_and_cosine_are_those_of_the_library() {
        let angles = evenly(-60.0, 60.0);
        let (sines, cosines) =
            (over!(angles, simd, v => sin_cos(v).0), over!(angles, simd, v => sin_cos(v).1));
        for ((angle, sine), cosine) in angles.iter().zip(sines).zip(cosines) {
            let (s, c) = f64::from(*angle).sin_cos();
            assert!((f64::from(sine) - s).abs() < 1e-6 && (f64::from(cosine) - c).abs() < 1e-6, "{angle}");
        }
    }

    #[test]
    fn the_exponential_is_that_of_the_library() {
        let values: Vec<f32> = evenly(-87.0, 88.0).into_iter().chain(evenly(-1.0, 1.0)).collect();
        for (x, found) in values.iter().zip(over!(values, simd, v => exp(v))) {
            assert!((f64::from(found) / f64::from(*x).exp() - 1.0).abs() < 2e-7, "{x}: {found}");
        }
    }

    #[test]
    fn every_processor_has_the_same_exponential() {
        let values = evenly(-90.0, 90.0);
        let bits = |level| {
            let mut found = vec![0.0; values.len()];
            dispatch!(level, simd => exp_all(simd, &values, &mut found));
            found.into_iter().map(f32::to_bits).collect::<Vec<_>>()
        };
        assert!(levels().into_iter().all(|level| bits(level) == bits(Level::new())));
    }

    #[test]
    fn the_exponential_of_almost_nothing_is_nothing() {
        let mut values = [-88.0, -1e30, f32::NEG_INFINITY, f32::NAN, 89.0, f32::INFINITY].to_vec();
        values.resize(LANES, 0.0);
        let found = over!(values, simd, v => exp(v));
        assert_eq!(found[..4], [0.0; 4]);
        assert!(found[4] == found[5] && (found[4].ln() - 88.0).abs() < 1e-4);
        assert!(found[6..].iter().all(|&one| one == 1.0));
    }

    #[test]
    fn the_fast_logarithm_is_close() {
        let values = evenly(1e-4, 90.0);
        for (x, found) in values.iter().zip(over!(values, simd, v => fast_log2(v))) {
            assert!((found - x.log2()).abs() < 1e-2, "{x}: {found}");
        }
    }

    #[test]
    fn a_fast_power_and_its_inverse_are_close() {
        let values = evenly(-MOST_EXP2 / 3.0, MOST_EXP2 / 3.0);
        let powers = over!(values, simd, v => fast_exp2(v, 3.0)[0]);
        let inverses = over!(values, simd, v => fast_exp2(v, 3.0)[1]);
        for ((x, power), inverse) in values.iter().zip(powers).zip(inverses) {
            let exact = (f64::from(*x) * 3.0).exp2();
            let off = [f64::from(power) / exact - 1.0, f64::from(inverse) * exact - 1.0];
            assert!(off.iter().all(|off| off.abs() < 3e-3), "{x}: {power}, {inverse}");
        }
    }

    #[test]
    fn directions_go_round_once() {
        let turns = evenly(0.0, 1.0);
        let found = over!(turns, simd, v => {
            let (sin, cos) = sin_cos(v * std::f32::consts::TAU);
            direction(cos * 20.0, sin * 20.0, 128.0)
        });
        for (turn, found) in turns.iter().zip(found) {
            let off = (found / 128.0 - turn).rem_euclid(1.0);
            assert!(off.min(1.0 - off) < 1.1e-4, "{turn}: {found}");
        }
    }
}
