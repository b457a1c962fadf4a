//! The C++ header matches the table, and g++ agrees with it about every size and offset. The parts that need g++ are skipped if it
//! is not installed.

use std::path::PathBuf;
use std::process::Command;

use bytemuck::Zeroable;
use sketchnav_schemas::message::{Header, LaserScan};

fn path() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../cpp/sketchnav.hpp")
}

/// As with golden files, `SKETCHNAV_UPDATE_GOLDEN=1` updates it.
#[test]
fn the_header_is_up_to_date() {
    sketchnav_navigators::register(&[]).unwrap();
    let expected = sketchnav_schemas::cpp::header();
    if std::env::var_os("SKETCHNAV_UPDATE_GOLDEN").is_some() {
        std::fs::write(path(), &expected).unwrap();
    }
    let found = std::fs::read_to_string(path()).unwrap();
    assert!(found == expected, "{}: SKETCHNAV_UPDATE_GOLDEN=1 updates it", path().display());
}

/// Reads a scan from standard input.
const READER: &str = r#"
#include "sketchnav.hpp"

#include <cstdio>

int main() {
    sketchnav::LaserScan scan;
    if (std::fread(&scan, sizeof scan, 1, stdin) != 1) return 1;
    std::printf("%llu %u %.3f %.3f %zu\n", static_cast<unsigned long long>(scan.header.stamp_ns), scan.beam_count,
                static_cast<double>(scan.range_max_m), static_cast<double>(scan.ranges_m[scan.beam_count - 1]),
                sketchnav::CHANNELS.size());
}
"#;

#[test]
fn a_cpp_program_reads_a_message_in_place() {
    let Some(mut compiler) = needs::program("g++") else { return };
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let (source, program, bytes) =
        (folder.join("reader.cpp"), folder.join("reader"), folder.join("scan.bin"));
    std::fs::write(&source, READER).unwrap();
    compiler.args(["-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I"]);
    compiler.arg(path().parent().unwrap()).arg(&source).arg("-o").arg(&program);
    let compiled = compiler.output().unwrap();
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let mut scan = LaserScan {
        header: Header { seq: 3, stamp_ns: 1_234_567_890_123, source_seq: 3 },
        range_max_m: 5.5,
        beam_count: 700,
        ..LaserScan::zeroed()
    };
    scan.ranges_m[699] = 1.25;
    std::fs::write(&bytes, bytemuck::bytes_of(&scan)).unwrap();
    let read = Command::new(&program).stdin(std::fs::File::open(&bytes).unwrap()).output().unwrap();
    sketchnav_navigators::register(&[]).unwrap();
    let count = sketchnav_schemas::channels::all().count();
    assert_eq!(String::from_utf8_lossy(&read.stdout), format!("1234567890123 700 5.500 1.250 {count}\n"));
}
