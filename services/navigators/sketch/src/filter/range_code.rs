//! How the table of ranges stores a range: as its logarithm, in a byte.

/// Directions of the table, evenly spaced, the first along x.
pub const DIRECTIONS: usize = 64;
/// Entries per octave of range.
pub(super) const PER_OCTAVE: f32 = 16.0;
/// Binary logarithm of the shortest range in the table, cells.
pub(super) const SHORTEST_LOG2: f32 = -3.0;
/// The code of a wall that is never left.
pub(super) const NEVER: u8 = u8::MAX;

/// The code of a distance in cells.
pub(super) fn code(cells: f64) -> u8 {
    let log2 = cells.log2().max(f64::from(SHORTEST_LOG2));
    ((log2 - f64::from(SHORTEST_LOG2)) * f64::from(PER_OCTAVE)).round() as u8
}
