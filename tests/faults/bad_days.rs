//! Tests where nothing is killed but everything else goes wrong: a full disk, full shared memory, a folder that is removed,
//! interference by other users.
//!
//! Some tests need root for a separate disk, and print a notice if they are not root.

use std::fs;
use std::path::{Path, PathBuf};

use nix::sys::signal::Signal;
use serde_json::Value;
use sketchnav_schemas::channels::STATUS;
use support::{Ended, Place, Running, building, kill_if_alive, wait_until};

/// A small separate disk, which is unmounted and removed when this is dropped.
struct SmallDisk(PathBuf);

impl SmallDisk {
    /// Mounts a disk. If this user is not allowed to, prints a notice and returns `None`.
    fn mount(at: PathBuf, size: &str) -> Option<Self> {
        fs::create_dir(&at).unwrap();
        let option = format!("size={size}");
        if !needs::has(&["mount", "umount"]) {
            return None;
        }
        let mut mount = needs::program("mount")?;
        let mounted = mount.args(["-t", "tmpfs", "-o", &option, "tmpfs"]).arg(&at).output();
        if !mounted.is_ok_and(|output| output.status.success()) {
            needs::skipped("root", "no file system can be mounted");
            return None;
        }
        Some(Self(at))
    }

    fn grow(&self, size: &str) {
        let option = format!("remount,size={size}");
        let mut mount = needs::program("mount").expect("mount, which was there before");
        assert!(mount.args(["-o", &option]).arg(&self.0).status().unwrap().success());
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = needs::program("umount").map(|mut umount| umount.arg(&self.0).status());
    }
}

fn drive(place: &Place, options: &str) -> Running {
    begin(place, "demo", options)
}

/// Starts a drive in real time that has enough time to reach all its goals, however busy the machine is.
fn drive_patiently(place: &Place, options: &str) -> Running {
    building::write_patient(place.files());
    begin(place, &format!("run {}", building::PATIENT), options)
}

fn begin(place: &Place, mission: &str, options: &str) -> Running {
    let mut running = place.start(&format!("{mission} --json --system day {options}"));
    place.wait_until_driving(&mut running, "day");
    running
}

/// Lets the robot drive for more steps than the histories contain. A reader first receives the messages of the history, so this
/// waits for more messages than that.
fn drive_on(place: &Place) {
    let steps = 2 * STATUS.spec.history() + 50;
    let echoed = place.run(&format!("echo status --count {steps} --system day"));
    assert_eq!(echoed.code, Some(0), "{echoed}");
    assert!(echoed.err.contains("the history of status"), "{echoed}");
}

/// Waits until this many faults have been reported.
fn wait_for_faults(place: &Place, count: usize) {
    let echoed = place.run(&format!("echo faults --count {count} --system day"));
    assert_eq!(echoed.code, Some(0), "{echoed}");
}

fn info(place: &Place, recording: &Path) -> Value {
    let info = place.run(&format!("info {} --json", recording.display()));
    assert_eq!(info.code, Some(0), "{info}");
    info.json()
}

fn kinds(info: &Value) -> Vec<&str> {
    info["faults"].as_array().unwrap().iter().map(|fault| fault["kind"].as_str().unwrap()).collect()
}

/// Writes a mission with one task, which leads from one end of the building to the other at half the speed. It takes
/// long enough for a gap of about thirty seconds.
fn write_long_drive(place: &Place) {
    building::write(&place.files().join("long.toml"), |mission| {
        let mut task = mission["task"][5].clone();
        assert_eq!(task["name"].as_str(), Some("4 → 5"));
        task["name"] = "0 → 5".into();
        task["time_limit_s"] = 400.0.into();
        mission["task"] = vec![task].into();
        let planner = toml::Table::from_iter([("speed_share".into(), 0.5.into())]);
        let parameters = toml::Table::from_iter([("planner".into(), planner.into())]);
        mission.insert("parameters".into(), parameters.into());
    });
}

/// The robot keeps driving. Once there is space again, messages that are still in the histories are written after all.
#[test]
fn a_full_disk_is_reported_and_recording_resumes_once_there_is_space() {
    let place = Place::new();
    let Some(disk) = SmallDisk::mount(place.files().join("disk"), "600k") else { return };
    write_long_drive(&place);
    let mut running = place.start("run long.toml --json --system day --out disk --speed 5");
    place.wait_until_driving(&mut running, "day");
    wait_for_faults(&place, 1);
    // The recorder also dies in the meantime, for an unrelated reason.
    place.serving("day", "recorder").into_iter().for_each(kill_if_alive);
    drive_on(&place);
    disk.grow("64m");
    let ended = running.end();
    assert_eq!(ended.code, Some(4), "{ended}");
    let report = ended.json();
    assert_eq!(report["success"], true, "{report:#}");
    assert!(report["incomplete"].as_str().is_some_and(|words| words.contains("No space left")), "{report:#}");
    place.assert_nothing_left("day");
    let recording = Path::new(report["recording"].as_str().unwrap());
    let info = info(&place, recording);
    let kinds = kinds(&info);
    assert!(kinds.contains(&"recording resumed"), "{info:#}");
    // The missing messages are counted, because more messages were sent than the histories contain.
    let lacks = info["missing"].as_u64().unwrap();
    assert!(lacks > 0 && report["lost_messages"].as_u64().unwrap() >= lacks, "{info:#}");
}

/// Runs a shell script with a separate `/dev/shm` of the given size, which also contains the folders of systems. `$0` is
/// `sketchnav`. If this user is not allowed to mount it, prints a notice and returns `None`.
fn with_shared_memory(place: &Place, size: &str, script: &str) -> Option<Ended> {
    let script = format!("mount -t tmpfs -o size={size} tmpfs /dev/shm || exit 99\n{script}");
    if !needs::has(&["unshare", "mount", "sed", "sh"]) {
        return None;
    }
    let mut command = needs::program("unshare")?;
    command.args(["--mount", "sh", "-c", &script]).arg(support::program());
    place.settle(&mut command);
    command.env_remove("XDG_RUNTIME_DIR");
    let ended = command.spawn().ok().map(|child| Running::of(child).end());
    let ended = ended.filter(|ended| ended.code != Some(99) && !ended.err.contains("unshare"));
    if ended.is_none() {
        needs::skipped("root", "no separate /dev/shm can be mounted");
    }
    ended
}

/// The command used to end silently, after a loop in which processes were killed by SIGBUS, including the supervisor.
#[test]
fn full_shared_memory_is_refused_with_an_explanation() {
    let place = Place::new();
    let Some(ended) = with_shared_memory(&place, "4m", "exec $0 demo --system day") else { return };
    assert_eq!(ended.code, Some(3), "{ended}");
    // The folder of all systems takes up a page.
    assert!(ended.err.contains("/dev/shm: expected room for 24 MiB, found 3 MiB"), "{ended}");
    place.assert_nothing_left("day");
}

/// A process that dies does not find enough space to restart, so the supervisor gives up on it. The supervisor then removes
/// everything.
#[test]
fn shared_memory_that_fills_up_ends_the_mission_with_an_explanation() {
    let place = Place::new();
    let script = r#"
        $0 demo --system day --speed 5 --out out & run=$!
        until $0 echo status --count 3 --system day > /dev/null 2>&1; do :; done
        dd if=/dev/zero of=/dev/shm/fill bs=64k 2> /dev/null
        planner=$($0 ps --json | tr '{' '\n' | sed -n 's/.*"planner","pid":\([0-9]*\).*/\1/p')
        kill -9 $planner
        wait $run; code=$?
        rm /dev/shm/fill; ls /dev/shm/*; exit $code"#;
    let Some(ended) = with_shared_memory(&place, "30m", script) else { return };
    assert_eq!((ended.code, ended.out.as_str()), (Some(3), ""), "{ended}");
    assert!(ended.err.contains("given up"), "{ended}");
    // The log of the process is in shared memory, too, but has space reserved for the last lines of the process.
    let words = ["shared memory is full", "No space left on device", "/dev/shm was full for a moment"];
    assert!(words.iter().any(|words| ended.err.contains(words)), "{ended}");
    place.assert_nothing_left("day");
}

/// Runs `sketchnav` with the size of files limited to this many blocks of 512 bytes.
fn with_file_limit(place: &Place, blocks: u32, arguments: &str) -> Option<Ended> {
    let script = format!("ulimit -f {blocks} && exec \"$0\" {arguments}");
    let mut command = needs::program("sh")?;
    command.args(["-c", &script]).arg(support::program());
    place.settle(&mut command);
    Some(Running::of(command.spawn().unwrap()).end())
}

/// When a file grows beyond the limit, the kernel sends SIGXFSZ. This signal used to end the supervisor silently, and the next
/// system had to remove its files.
#[test]
fn a_limit_on_file_size_is_reported() {
    let place = Place::new();
    let demo = "demo --json --system day --out out";
    for (blocks, code, words) in [
        (0, 2, "File too large"),
        (1000, 3, "expected a limit on the size of files of 256 MiB or more for the channels, found 0 MiB"),
        (100_000, 3, "found 48 MiB: ulimit -f unlimited"),
    ] {
        let Some(ended) = with_file_limit(&place, blocks, demo) else { return };
        assert_eq!(ended.code, Some(code), "{blocks}: {ended}");
        assert!(ended.err.contains(words), "{blocks}: {ended}");
        place.assert_nothing_left("day");
    }
}

/// To the recorder, a limit that is reached while the robot drives is like a full disk. It does not affect the
/// supervisor.
#[test]
fn a_limit_on_file_size_ends_no_process() {
    let place = Place::new();
    write_long_drive(&place);
    let mut running = place.start("run long.toml --json --system day --out out --speed 5");
    place.wait_until_driving(&mut running, "day");
    let limit = |pid: u32, soft: &str| {
        let arguments = [format!("--pid={pid}"), format!("--fsize={soft}:unlimited")];
        let status = needs::program("prlimit").map(|mut prlimit| prlimit.args(arguments).status());
        status.is_some_and(|status| status.is_ok_and(|status| status.success()))
    };
    let recorders = place.serving("day", "recorder");
    let pids: Vec<_> = recorders.iter().copied().chain([running.pid()]).collect();
    if !pids.iter().all(|pid| limit(*pid, "4096")) {
        return needs::skipped("prlimit", "the limits of another process cannot be set");
    }
    wait_for_faults(&place, 1);
    drive_on(&place);
    assert_eq!(place.serving("day", "recorder"), recorders, "it lives");
    assert!(pids.iter().all(|pid| limit(*pid, "unlimited")));
    let ended = running.end();
    // More messages may have been sent than the histories contain.
    let lost = ended.json()["lost_messages"].as_u64().unwrap();
    assert_eq!(ended.code, Some(if lost == 0 { 0 } else { 4 }), "{ended}");
    assert_eq!(ended.json()["success"], true, "{ended}");
    place.assert_nothing_left("day");
}

/// The results folder is removed while the robot drives. The recording is gone, and with it the judge's verdict. The
/// states of the tasks that the planner had reported were once lost, too.
#[test]
fn a_mission_whose_results_are_removed_still_reports_its_tasks() {
    let place = Place::new();
    let running = drive_patiently(&place, "--out out --speed 20");
    fs::remove_dir_all(place.files().join("out")).unwrap();
    let ended = running.end();
    assert_eq!(ended.code, Some(3), "{ended}");
    let object = ended.json();
    let tasks = object["tasks"].as_array().unwrap();
    assert!(!tasks.is_empty() && tasks.iter().all(|task| task["state"] == "reached"), "{ended}");
    assert!(
        object["error"].as_str().is_some_and(|error| !error.is_empty()) && object["exit"] == 3,
        "{ended}"
    );
    place.assert_nothing_left("day");
}

/// The system's folder is removed. The running processes already have open what they need, and leave nothing behind.
#[test]
fn removing_the_systems_folder_stops_no_process() {
    let place = Place::new();
    let running = drive_patiently(&place, "--out out --speed 10");
    fs::remove_dir_all(place.root()).unwrap();
    let ended = running.end();
    assert_eq!(ended.code, Some(0), "{ended}");
    let report = ended.json();
    let processes = report["processes"].as_array().unwrap();
    assert!(processes.len() > 4 && processes.iter().all(|process| process["restarts"] == 0), "{report:#}");
    place.assert_nothing_left("day");
}

/// Without its folder, the system cannot restart any process. The mission fails, and the error says why.
#[test]
fn without_its_folder_a_system_ends_at_the_first_death() {
    let place = Place::new();
    let running = drive(&place, "--out out --speed 10");
    let planner = place.serving("day", "planner");
    fs::remove_dir_all(place.root()).unwrap();
    planner.into_iter().for_each(kill_if_alive);
    let ended = running.end();
    assert_eq!(ended.code, Some(3), "{ended}");
    assert!(ended.err.contains("planner: starting"), "{ended}");
    wait_until("the end of all processes", || place.living().is_empty());
    place.assert_nothing_left("day");
}

/// A cleanup program had removed the folder of a killed system, but not its shared memory. The next run with the same name
/// continued with the tasks of the other mission, and counted 4,446 messages as lost.
#[test]
fn leftovers_of_a_killed_system_without_a_folder_enter_no_other() {
    let place = Place::new();
    let running = drive(&place, "--out out --speed 20");
    running.signal(Signal::SIGKILL);
    running.end();
    wait_until("the end of all processes", || place.living().is_empty());
    fs::remove_dir_all(place.root()).unwrap();
    let left = place.files_of("day");
    assert!(left.iter().any(|file| file.contains("history_")), "{left:?}");
    let ended = place.run("demo --json --system day --out again");
    assert_eq!(ended.code, Some(0), "{ended}");
    let report = ended.json();
    assert_eq!((&report["success"], &report["lost_messages"]), (&true.into(), &0.into()), "{report:#}");
    place.assert_nothing_left("day");
}

#[test]
fn clean_removes_dead_systems_and_leaves_running_ones() {
    let place = Place::new();
    let mut living = place.start("demo --json --system living --speed 5");
    place.wait_until_driving(&mut living, "living");
    let dead = drive(&place, "--speed 5");
    dead.signal(Signal::SIGKILL);
    dead.end();
    let cleaned = place.run("clean --json");
    assert_eq!(cleaned.code, Some(0), "{cleaned}");
    assert!(cleaned.json()["removed"].as_array().unwrap().contains(&"day".into()), "{cleaned}");
    place.assert_no_system_left("day");
    assert!(place.processes("living").len() > 4);
    living.signal(Signal::SIGINT);
    living.end();
    place.assert_nothing_left("living");
}

/// Another user of the machine can list `/dev/shm`, and can create files there with the prefix of a system's files.
#[test]
fn another_users_file_among_those_of_a_system_ends_the_mission() {
    let place = Place::new();
    let running = drive(&place, "--out out --speed 5");
    let owner = place.files_of("day").into_iter().find(|file| file.ends_with("_owner")).unwrap();
    let foreign = owner.replace("_owner", "_history_of_my_own");
    fs::write(&foreign, "").unwrap();
    if std::os::unix::fs::chown(&foreign, Some(65534), Some(65534)).is_err() {
        // If this user cannot act as another user, a link is made instead of the file.
        fs::remove_file(&foreign).unwrap();
        std::os::unix::fs::symlink("/etc/hostname", &foreign).unwrap();
    }
    let ended = running.end();
    assert_eq!(ended.code, Some(3), "{ended}");
    assert!(ended.err.contains(&format!("{foreign}: expected a regular file owned by user")), "{ended}");
    // Programs used to get only the error, and had to find out from standard error which files were kept.
    let report = ended.json();
    let is_kept = |key: &str| report[key].as_str().is_some_and(|path| place.files().join(path).exists());
    assert!(report["exit"] == 3 && is_kept("recording") && is_kept("logs"), "{report:#}");
    assert_eq!(place.living(), []);
    // Root can remove the file, but other users cannot. Nothing else is left.
    place.files_of("day").into_iter().for_each(|file| assert_eq!(file, foreign));
    let _ = fs::remove_file(&foreign);
}

/// Another user of the machine can see that there is a system, but nothing more. That user can neither read nor write
/// its channels and files, nor join it.
#[test]
fn another_user_is_kept_out() {
    let place = Place::new();
    let running = drive(&place, "--out out --speed 5");
    let program = support::program();
    let as_nobody = |script: &str| {
        let mut command = needs::program("setpriv")?;
        command.args(["--reuid=65534", "--regid=65534", "--clear-groups", "sh", "-c", script]);
        place.settle(&mut command);
        command.current_dir("/").output().ok()
    };
    let is_nobody =
        needs::has(&["sh"]) && as_nobody("id -u").is_some_and(|output| output.stdout == b"65534\n");
    if is_nobody {
        let mut files = place.files_of("day");
        assert!(files.len() > 20, "{files:?}");
        files.push(place.root().display().to_string());
        // An observer's file may have been removed in the meantime, and must not be created again.
        let write = "dd if=/dev/null conv=notrunc,nocreat oflag=append status=none";
        let open = |file: &str| {
            format!(
                "cat {file} > /dev/null 2>&1 && echo read {file}; {write} of={file} 2> /dev/null && echo wrote {file};"
            )
        };
        let script: String = files.iter().map(|file| open(file)).collect();
        let output = as_nobody(&script).unwrap();
        assert_eq!(String::from_utf8_lossy(&output.stdout), "");
        // The other user runs a copy of the program, because the folder of the original is not accessible to other
        // users.
        let copy = std::env::temp_dir().join(format!("sketchnav-{}", std::process::id()));
        fs::copy(program, &copy).unwrap();
        for words in ["echo scan --system day", "serve world --system day", "top --json --system day"] {
            let output = as_nobody(&format!("{} {words}", copy.display())).unwrap();
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(
                !output.status.success() && output.stdout.is_empty() || said.contains("error"),
                "{words}: {said}"
            );
            assert!(
                said.contains("Permission denied") || said.contains("expected a folder of user"),
                "{words}: {said}"
            );
        }
        fs::remove_file(copy).unwrap();
    } else {
        needs::skipped("root", "no other user to be");
    }
    running.signal(Signal::SIGINT);
    running.end();
    place.assert_nothing_left("day");
}
