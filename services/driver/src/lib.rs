//! Drives a robot, or another simulator, in place of the simulated world.
//!
//! A [`Driver`] joins a system that runs without a world. It implements what all drivers have in common:
//! numbering and checking readings, ending instants, continuing where an earlier driver stopped, and
//! returning the velocity at which to drive.
//!
//! ```text
//! let mut driver = Driver::join("lab", Clock::Robot)?;
//! loop {
//!     driver.odometry(driver.now_ns(), &pose, twist)?;
//!     driver.send(SCAN, driver.now_ns(), |scan| …)?;
//!     driver.tick(driver.now_ns())?;
//!     let Some(twist) = driver.command(Duration::from_millis(50))? else { break };
//! }
//! ```

// `say!` prints, and escapes text that could control a terminal.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod driver;
mod error;
mod orders;
mod outlet;

pub use driver::{Clock, Driver};
pub use error::DriverError;
pub use orders::STANDSTILL;
