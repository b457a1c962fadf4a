//! Shared by the tests of the recorder: a run, a separate system with all channels, and the world's headers.

use std::path::Path;
use std::rc::Rc;

use sketchnav_runtime::{Channels, Node, System};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::Header;
use sketchnav_schemas::run::RunConfig;

/// Returns a run in the system `name` that is recorded into `recording`.
pub fn run(name: &str, recording: &Path) -> RunConfig {
    let mut run: RunConfig = serde_json::from_str(include_str!("../run.json")).unwrap();
    run.system = format!("{name}-{}", std::process::id());
    run.recording = Some(recording.to_str().unwrap().to_owned());
    run
}

/// Returns the header of the scan `seq`.
pub fn header(seq: u64) -> Header {
    Header { seq: 0, stamp_ns: seq * 100_000_000, source_seq: seq }
}

/// A system with all its channels, whose processes are all nodes of the test.
pub struct TestSystem {
    system: Rc<System>,
    supervisor: Node,
    channels: Channels,
}

impl TestSystem {
    /// Creates the system of a run.
    pub fn create(run: &RunConfig) -> Self {
        sketchnav_navigators::register(&[]).unwrap();
        let system = Rc::new(System::create(run).unwrap());
        let supervisor = Node::join(system.clone(), Process::Supervisor).unwrap();
        let channels = Channels::create(&supervisor).unwrap();
        Self { system, supervisor, channels }
    }

    /// Joins the system as a process.
    pub fn join(&self, process: Process) -> Node {
        Node::join(System::open(self.system.name()).unwrap(), process).unwrap()
    }

    /// Removes the system. Its processes, and with them their ends of channels, must be gone.
    pub fn remove(self) {
        drop((self.channels, self.supervisor));
        Rc::into_inner(self.system).unwrap().remove().unwrap();
    }
}
