//! Refits equations 1 and 2, and prints the coefficients, which are the constants of `reliability`, with their residuals.

use sketchnav_directions::fit::{Effort, landmarks, trajectories};

fn main() -> Result<(), sketchnav_directions::Error> {
    let seed = std::env::args().nth(1).and_then(|word| word.parse().ok()).unwrap_or(1995);
    let (one, two) = (landmarks(Effort::FULL, seed)?, trajectories(Effort::FULL, seed)?);
    println!("equation 1: {:?}", one.model.coefficients);
    println!(
        "  {} samples, residuals: rms {:.4}, largest {:.4}",
        one.samples, one.rms_residual, one.max_residual
    );
    println!("equation 2: {:?}", two.model.coefficients);
    println!(
        "  {} samples, relative: rms {:.4}, largest {:.4}",
        two.samples, two.rms_residual, two.max_residual
    );
    Ok(())
}
