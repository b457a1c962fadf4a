use clap::Parser;
use sketchnav_recordings::samples::{self, SampleForm, recording};

use super::*;
use crate::args::Cli;
use crate::failure::Outcome;

#[test]
fn a_folder_with_one_recording_stands_for_it() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str| std::fs::write(folder.path().join(name), "").unwrap();
    assert!(only_one_in(folder.path()).unwrap_err().to_string().contains("found 0"));
    write("lab_0.mcap");
    write("lab_1.mcap");
    write("floor.svg");
    assert_eq!(only_one_in(folder.path()).unwrap(), folder.path().join("lab.mcap"));
    write("hall_b.mcap");
    assert!(only_one_in(folder.path()).unwrap_err().to_string().contains("found 2"));
}

/// Regression test: recordings from other systems and recordings packed by hand were once not found in a folder.
#[test]
fn a_recording_is_found_however_its_name_ends() {
    for (name, bytes) in [
        ("B.MCAP", points(12)),
        ("b.mcap.zst", samples::packed("zstd", &points(12))),
        ("b.mcap.zstd", samples::packed("zstd", &points(12))),
    ] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(name), bytes).unwrap();
        assert_eq!(count(&Whole::of(folder.path()).unwrap()), 12, "{name}");
    }
}

#[test]
fn a_file_name_that_ends_with_a_number_is_not_a_series() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("floor_2.mcap");
    std::fs::write(&file, "").unwrap();
    assert_eq!(Whole::of(&file).unwrap().path(), file);
    assert_eq!(Whole::of(folder.path()).unwrap().path(), file);
    let nowhere = folder.path().join("nowhere.mcap");
    assert_eq!(Whole::of(&nowhere).unwrap().path(), nowhere);
}

fn bag(folder: &Path, storage: &str, files: &[&str]) {
    let files: String = files.iter().map(|file| format!("    - {file}\n")).collect();
    let text = format!(
        "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: {storage}\n  relative_file_paths:\n{files}"
    );
    std::fs::write(folder.join(METADATA), text).unwrap();
}

fn points(count: u64) -> Vec<u8> {
    recording(SampleForm::default(), &[samples::points("/ball", count, false)])
}

fn count(whole: &Whole) -> u64 {
    sketchnav_recordings::info::info_of_messages(whole.path()).unwrap().messages
}

/// Regression test: `filter`, `relations` and other commands once expected a run.json in a folder with two files.
#[test]
fn a_foreign_bag_is_one_recording_and_missing_files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    bag(path, "mcap", &["b_0.mcap", "b_1.mcap", "b_2.mcap"]);
    std::fs::write(path.join("b_0.mcap"), points(12)).unwrap();
    std::fs::write(path.join("b_1.mcap"), points(20)).unwrap();
    let whole = Whole::of(path).unwrap();
    assert_eq!(count(&whole), 32);
    assert!(whole.sources().ends_with(&[path.join("b_1.mcap"), path.join(METADATA)]));
    let (files, missing) = listed_in(path).unwrap();
    assert_eq!(files.len(), 2);
    assert!(missing.len() == 1 && missing[0].contains("lists b_2.mcap, which is missing"), "{missing:?}");
    std::fs::remove_file(path.join("b_0.mcap")).unwrap();
    assert_eq!(count(&Whole::of(path).unwrap()), 20);
    std::fs::remove_file(path.join("b_1.mcap")).unwrap();
    let error = format!("{:?}", Whole::of(path).err().unwrap());
    assert!(error.contains("b_0.mcap, b_1.mcap, b_2.mcap"), "{error}");
}

/// Runs a command on a folder. `X` in `line` stands for the folder, and `X/…` for a file in it.
fn run(folder: &Path, line: &str) -> Result<Outcome, Failure> {
    let word = |word: &str| match word.strip_prefix('X') {
        Some(rest) => format!("{}{rest}", folder.display()),
        None => word.to_owned(),
    };
    crate::dispatch(Cli::parse_from(std::iter::once("sketchnav".to_owned()).chain(line.split(' ').map(word))))
}

const COPIES: [&str; 3] =
    ["filter X -o X/../y.mcap", "merge X X -o X/../y.mcap", "split X --rosbag2 -o X/../parts"];

/// Regression test: copying a bag whose second file was cut off copied only part of it, and the user was not warned.
#[test]
fn a_truncated_file_in_a_series_is_reported_as_a_loss() {
    let outer = tempfile::tempdir().unwrap();
    let path = outer.path().join("bag");
    std::fs::create_dir(&path).unwrap();
    bag(&path, "mcap", &["b_0.mcap", "b_1.mcap"]);
    std::fs::write(path.join("b_0.mcap"), points(12)).unwrap();
    std::fs::write(path.join("b_1.mcap"), points(20)).unwrap();
    for line in COPIES {
        assert_eq!(run(&path, line).unwrap(), Outcome::Success, "{line}");
        let _ = std::fs::remove_dir_all(outer.path().join("parts"));
    }
    let cut = points(20);
    std::fs::write(path.join("b_1.mcap"), &cut[..cut.len() / 2]).unwrap();
    // The second round is without metadata, so that the files are found as a series.
    for _ in 0..2 {
        let whole = Whole::of(&path).unwrap();
        assert_eq!(whole.lacks().cut_off, [path.join("b_1.mcap").display().to_string()]);
        for line in COPIES {
            assert_eq!(run(&path, line).unwrap(), Outcome::Loss, "{line}");
            let _ = std::fs::remove_dir_all(outer.path().join("parts"));
        }
        let _ = std::fs::remove_file(path.join(METADATA));
    }
}

/// Regression test: one file in the middle of a split recording was missing, and the user was not warned.
#[test]
fn a_missing_number_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for name in ["b_0.mcap", "b_2.mcap", "b_10.mcap"] {
        std::fs::write(path.join(name), points(12)).unwrap();
    }
    assert_eq!(count(&Whole::of(path).unwrap()), 36);
    let (_, missing) = listed_in(path).unwrap();
    let name = path.join("b.mcap").display().to_string();
    assert_eq!(
        missing,
        [format!("{name}: b_1.mcap is missing"), format!("{name}: b_3.mcap to b_9.mcap are missing")]
    );
}

#[test]
fn a_damaged_message_in_a_bag_counts_as_lost() {
    let outer = tempfile::tempdir().unwrap();
    let path = outer.path().join("bag");
    std::fs::create_dir(&path).unwrap();
    let mut ball = samples::points("/ball", 12, false);
    let message = &mut ball.messages[7].2;
    *message = samples::packed("zstd", message);
    message.truncate(message.len() - 5);
    std::fs::write(path.join("b_0.mcap"), recording(SampleForm::default(), &[ball])).unwrap();
    for files in [1, 2] {
        let whole = Whole::of(&path).unwrap();
        assert_eq!(whole.lacks().left_out.messages(), files - 1);
        assert_eq!(run(&path, "filter X -o X/../y.mcap").unwrap(), Outcome::Loss, "{files} files");
        std::fs::write(path.join("b_1.mcap"), points(12)).unwrap();
    }
}

/// Regression test: an error used to name a temporary file, which no longer existed when the error was read.
#[test]
fn errors_name_the_path_that_was_given() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let packed = samples::packed("zstd", &points(12));
    std::fs::write(path.join("b_0.mcap.zstd"), &packed).unwrap();
    std::fs::write(path.join("cut.zstd"), &packed[..20]).unwrap();
    bag(path, "mcap", &["b_0.mcap.zstd"]);
    let check = |line: &str, named: &Path| {
        let error = format!("{:?}", run(path, line).unwrap_err());
        // With RUST_BACKTRACE set, the error ends with a backtrace that names files of this crate.
        let error = error.split("Stack backtrace").next().unwrap_or_default();
        assert!(error.contains(&named.display().to_string()), "{line}: {error}");
        let elsewhere = error.replace(&path.display().to_string(), "");
        assert!(!elsewhere.contains("/.tmp") && !elsewhere.contains("/whole/"), "{line}: {error}");
    };
    check("replay X", path);
    check("judge X", path);
    check("diff X X", path);
    check("relations X --calculus qtc-b", path);
    check("echo cup --file X", path);
    check("hz cup --file X", path);
    check("recover X/cut.zstd -o X/y.mcap", &path.join("cut.zstd"));
    bag(path, "mcap", &["b_0.mcap.zstd", "b_1.mcap.zstd"]);
    std::fs::write(path.join("b_1.mcap.zstd"), &packed).unwrap();
    check("replay X", path);
}

#[test]
fn compressed_files_are_read_and_truncated_ones_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let packed = samples::packed("zstd", &points(12));
    bag(path, "mcap", &["b_0.mcap.zstd"]);
    let file = path.join("b_0.mcap.zstd");
    std::fs::write(&file, &packed).unwrap();
    for named in [path, &file] {
        let whole = Whole::of(named).unwrap();
        assert_eq!((count(&whole), whole.sources()[0].as_path()), (12, file.as_path()));
    }
    std::fs::remove_file(path.join(METADATA)).unwrap();
    assert_eq!(count(&Whole::of(path).unwrap()), 12);
    std::fs::write(&file, &packed[..packed.len() - 4]).unwrap();
    let error = format!("{:?}", Whole::of(&file).err().unwrap());
    assert!(error.contains("cut off or damaged") && error.contains("sketchnav recover"), "{error}");
    assert!(Whole::best_effort(&file).is_ok());
}

#[test]
fn other_storages_are_reported_with_a_converter() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("b_0.db3"), b"SQLite format 3\0 and so on").unwrap();
    let without = format!("{:?}", Whole::of(path).err().unwrap());
    bag(path, "sqlite3", &["b_0.db3"]);
    let with = format!("{:?}", Whole::of(path).err().unwrap());
    for error in [without, with, format!("{:?}", listed_in(path).unwrap_err())] {
        assert!(error.contains("b_0.db3") && error.contains("ros2 bag convert"), "{error}");
    }
}
