//! Identifies the kind of machine and the program. An outcome depends on these two, bit for bit, in addition
//! to its inputs.
//!
//! The motion of the particles uses sines and exponentials of the C library, which selects an implementation
//! by the processor's features. Machines of the same kind therefore have the same library and the same
//! relevant features.

use std::ffi::CStr;

use nix::libc;
use serde::{Deserialize, Serialize};

/// A kind of machine. Machines of the same kind produce the same outcomes, bit for bit.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Machine {
    /// The processor architecture, such as `x86_64` or `aarch64`.
    pub architecture: String,
    /// The name and version of the C library.
    pub library: String,
    /// The processor features that determine the C library's choice of implementations.
    pub features: Vec<String>,
}

impl Machine {
    /// Returns the kind of this machine.
    pub fn this() -> Self {
        let features = features().into_iter().filter(|(_, is_there)| *is_there);
        Self {
            architecture: std::env::consts::ARCH.to_owned(),
            library: library(),
            features: features.map(|(name, _)| name.to_owned()).collect(),
        }
    }
}

impl std::fmt::Display for Machine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { architecture, library, features } = self;
        write!(f, "{architecture}, {library}, {}", features.join(" "))
    }
}

#[cfg(target_arch = "x86_64")]
fn features() -> Vec<(&'static str, bool)> {
    vec![
        ("sse4.1", std::arch::is_x86_feature_detected!("sse4.1")),
        ("avx2", std::arch::is_x86_feature_detected!("avx2")),
        ("fma", std::arch::is_x86_feature_detected!("fma")),
        ("fma4", is_listed("fma4")),
    ]
}

#[cfg(not(target_arch = "x86_64"))]
fn features() -> Vec<(&'static str, bool)> {
    Vec::new()
}

/// Returns true if the kernel lists a feature of the processor. The standard library can only query some of them.
#[cfg(target_arch = "x86_64")]
fn is_listed(feature: &str) -> bool {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let flags = info.lines().find(|line| line.starts_with("flags")).unwrap_or_default();
    flags.split_whitespace().any(|flag| flag == feature)
}

#[cfg(target_env = "gnu")]
fn library() -> String {
    // SAFETY: the library returns a static string of its own.
    let version = unsafe { CStr::from_ptr(libc::gnu_get_libc_version()) };
    format!("glibc {}", version.to_string_lossy())
}

#[cfg(not(target_env = "gnu"))]
fn library() -> String {
    format!("{} C library", if cfg!(target_env = "musl") { "musl" } else { "another" })
}

/// Returns the version of this program with a checksum of its file, since two builds of one version may differ.
pub fn program() -> anyhow::Result<String> {
    Ok(format!("{} {}", env!("CARGO_PKG_VERSION"), checksum()?))
}

/// Returns the version, the commit if the build was given one in the environment variable `SKETCHNAV_COMMIT`, and the
/// checksum as a build number, for people.
pub fn build() -> anyhow::Result<String> {
    let commit = option_env!("SKETCHNAV_COMMIT").map_or(String::new(), |commit| format!("commit {commit}, "));
    Ok(format!("{} ({commit}build {})", env!("CARGO_PKG_VERSION"), checksum()?))
}

fn checksum() -> anyhow::Result<u32> {
    use anyhow::Context;
    let bytes = std::fs::read("/proc/self/exe").context("file of this program")?;
    Ok(crc32fast::hash(&bytes))
}
