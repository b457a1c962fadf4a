//! Random streams. Each mission has one seed, and everything that draws random numbers has its own stream.

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// Returns the stream `name` of a mission. It depends only on the seed and the name, so it is independent of
/// all other random draws.
pub fn stream(mission_seed: u64, name: &str) -> Pcg64Mcg {
    let mixed = crate::message::fingerprint(name) ^ mission_seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    Pcg64Mcg::seed_from_u64(mixed)
}
