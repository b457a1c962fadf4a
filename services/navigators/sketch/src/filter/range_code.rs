//! The encoding of ranges in the table of ranges, as their logarithms in a byte.

/// Number of directions in the table. They are evenly spaced, and the first is along x.
pub const DIRECTIONS: usize = 64;
/// Number of codes per octave of range.
pub(super) const PER_OCTAVE: f32 = 16.0;
/// Binary logarithm of the minimum range in the table, in cells.
pub(super) const SHORTEST_LOG2: f32 = -3.0;
/// Code for a wall without a way out.
pub(super) const NEVER: u8 = u8::MAX;

/// Returns the code of a distance in cells.
pub(super) fn code(cells: f64) -> u8 {
    let log2 = cells.log2().max(f64::from(SHORTEST_LOG2));
    ((log2 - f64::from(SHORTEST_LOG2)) * f64::from(PER_OCTAVE)).round() as u8
}
