//! Starts actors and talks to them.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use sketchnav_schemas::codes::Process;

/// A root of systems that only this test uses.
pub struct Stage {
    root: tempfile::TempDir,
}

/// A process on a stage.
pub struct Player {
    pub child: Child,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Stage {
    pub fn new() -> Self {
        Self { root: tempfile::tempdir_in("/dev/shm").unwrap() }
    }

    pub fn player(&self) -> Player {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["actor::actor", "--exact", "--ignored", "--nocapture"])
            .env("XDG_RUNTIME_DIR", self.root.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let orders = child.stdin.take().unwrap();
        let answers = BufReader::new(child.stdout.take().unwrap());
        Player { child, orders, answers }
    }

    /// Starts a supervisor of the system `name`.
    pub fn system(&self, name: &str) -> Player {
        let mut supervisor = self.player();
        supervisor.does(&format!("create {name}"));
        supervisor
    }

    pub fn join(&self, name: &str, process: Process, ends: &[&str]) -> Player {
        let mut player = self.player();
        player.does(&format!("join {name} {process}"));
        for end in ends {
            player.does(&format!("open {end}"));
        }
        player
    }

    pub fn folder(&self) -> PathBuf {
        self.root.path().join("sketchnav")
    }

    /// Returns the files of `system` in shared memory whose names end with `end`. Files of a system with the same name in
    /// another root are excluded, because an earlier test that was killed may have left them.
    pub fn shared_memory(&self, system: &str, end: &str) -> Vec<PathBuf> {
        let mark = format!("sketchnav_{system}_");
        let mut found = names(Path::new("/dev/shm"));
        found.retain(|name| name.starts_with(&mark) && name.ends_with(end) && !self.is_elsewhere(name));
        found.iter().map(|name| Path::new("/dev/shm").join(name)).collect()
    }

    /// Returns true if the owner file belonging to a file in shared memory names a folder outside this root.
    fn is_elsewhere(&self, name: &str) -> bool {
        let prefix = name.splitn(4, '_').take(3).collect::<Vec<_>>().join("_");
        let owner = std::fs::read_to_string(format!("/dev/shm/{prefix}_owner"));
        owner.is_ok_and(|folder| !Path::new(&folder).starts_with(self.root.path()))
    }

    /// Returns the content of the root, except for its guard, and the files in shared memory under the name of `system`.
    pub fn leftovers(&self, system: &str) -> Vec<String> {
        let mut found = names(&self.folder());
        found.retain(|name| name != ".guard");
        found.extend(self.shared_memory(system, "").iter().map(|path| path.display().to_string()));
        found
    }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect()
}

impl Drop for Stage {
    /// The supervisors of most tests are killed with their players.
    fn drop(&mut self) {
        let mut sweeper = self.player();
        sweeper.begin("sweep");
        let mut line = String::new();
        while sweeper.answers.read_line(&mut line).is_ok_and(|read| read > 0) && !line.starts_with("> ") {
            line.clear();
        }
    }
}

impl Player {
    pub fn tell(&mut self, order: &str) -> String {
        self.begin(order);
        self.answer()
    }

    pub fn begin(&mut self, order: &str) {
        writeln!(self.orders, "{order}").unwrap();
    }

    pub fn answer(&mut self) -> String {
        let mut line = String::new();
        while self.answers.read_line(&mut line).unwrap() > 0 {
            if let Some(answer) = line.trim_end_matches('\n').strip_prefix("> ") {
                return answer.to_string();
            }
            line.clear();
        }
        panic!("the actor has ended");
    }

    pub fn does(&mut self, order: &str) {
        self.does_as(order, "done");
    }

    pub fn does_as(&mut self, order: &str, answer: &str) {
        assert_eq!(self.tell(order), answer, "{order}");
    }

    /// Returns the player's exit code if it ends instead of answering.
    pub fn exit_code(&mut self) -> Option<i32> {
        let mut line = String::new();
        while self.answers.read_line(&mut line).unwrap() > 0 {
            assert!(!line.starts_with("> "), "expected an end, found the answer {line}");
            line.clear();
        }
        self.child.wait().unwrap().code()
    }

    pub fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

impl Drop for Player {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
