//! One seed per mission, and a random stream of its own for everything that needs one.

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// The stream `name` of a mission: the same for the same seed and name, whatever else draws random numbers.
pub fn stream(mission_seed: u64, name: &str) -> Pcg64Mcg {
    let mixed = crate::message::fingerprint(name) ^ mission_seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    Pcg64Mcg::seed_from_u64(mixed)
}
