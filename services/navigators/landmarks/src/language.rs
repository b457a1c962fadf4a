//! Routes in words, which are written by hand or by [`print()`], and read by [`read()`].
//!
//! ```text
//! # Comments and blank lines are skipped. Sentences may go over several lines, and may be numbered.
//! At the start, move forward.
//! When an object is left and another is ahead, at most 2 m away, then turn right.
//! After 4.2 m, when the desk is ahead slightly left, 1 to 2.5 m away, with width 20 to 70, or ahead,
//!   and the trash is roughly behind-left, then move forward.
//! At the end, when the cabinet is right, then stop.
//! ```
//!
//! - Directions: `ahead`, `ahead-left`, `left`, `behind-left`, `behind`, `behind-right`, `right`, `ahead-right`. Between them
//!   are `ahead slightly left`, `left slightly ahead` and so on. `in direction 13` gives the number of a direction (0 is ahead,
//!   4 left). `roughly left` also allows either neighbour. `front` and `rear` are accepted, too.
//! - Surround relations: `around the robot`, `around the robot from left`, `around the robot but for right`.
//! - Distances: `at most 2 m away`, `at least 2 m away`, `1 to 2 m away`, `about 2 m away` (± 22 inches); `m`, `cm`, `in`,
//!   `ft`. `at proximity 135` is as in Chronis 2007, figure 4.10: in inches, ± 22.
//! - Widths: `with width 20 to 70`. `with width 47` means ± 30, and a width of 180 is all around.
//! - Commands: `move forward` (or `go straight`), `turn left`, `turn right`, `stop`.
//! - If the first sentence is not about the start, the robot moves forward until the first state. If the last
//!   sentence does not stop, the robot continues to the next object and stops there.
//!
//! Words are not case-sensitive. A name consists of all the words before `is`, or of anything in quotes.

pub mod print;
pub mod read;
mod words;

pub use print::{print, spoken, table};
pub use read::read;

#[cfg(test)]
mod tests;
