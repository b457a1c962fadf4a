//! What a hop costs: the world sends a scan, the planner answers with a command, in two processes, as
//! in lockstep. Prints the time of a hop (half a round) and what the system takes of `/dev/shm`.
//!
//! `cargo run --release -p sketchnav-runtime --example ping`

use std::error::Error;
use std::process::{Child, Command};
use std::rc::Rc;
use std::time::{Duration, Instant};

use sketchnav_runtime::{Channels, Node, System, Wake};
use sketchnav_schemas::channels::{COMMAND, SCAN};
use sketchnav_schemas::codes::Process;

const ROUNDS: usize = 20_000;
const WARM_UP: usize = 1_000;
const LIMIT: Duration = Duration::from_secs(5);

fn main() -> Result<(), Box<dyn Error>> {
    match std::env::args().nth(1) {
        Some(system) => answer(&system),
        None => measure(),
    }
}

fn measure() -> Result<(), Box<dyn Error>> {
    let mut run: sketchnav_schemas::run::RunConfig = serde_json::from_str(include_str!("../tests/run.json"))?;
    run.system = format!("ping-{}", std::process::id());
    let system = Rc::new(System::create(&run)?);
    let supervisor = Node::join(system.clone(), Process::Supervisor)?;
    let channels = Channels::create(&supervisor)?;
    let mut planner = Command::new(std::env::current_exe()?).arg(&run.system).spawn()?;
    let result = send(&run.system, &mut planner);
    planner.kill()?;
    planner.wait()?;
    drop((channels, supervisor));
    Rc::into_inner(system).ok_or("the system is still in use")?.remove()?;
    result
}

/// The world's part.
fn send(system: &str, planner: &mut Child) -> Result<(), Box<dyn Error>> {
    let node = Node::join(System::open(system)?, Process::World)?;
    let mut scans = node.writer(SCAN)?;
    let mut commands = node.reader(COMMAND)?;
    let mut hops = Vec::with_capacity(ROUNDS);
    for _ in 0..ROUNDS {
        let began = Instant::now();
        let seq = scans.send(|scan| {
            scan.beam_count = 683;
            scan.ranges_m[..683].fill(2.5);
        })?;
        while commands.receive()?.is_none_or(|command| command.header.source_seq != seq) {
            if node.wait(LIMIT) == Wake::Timeout {
                return Err(format!("no answer to {seq}; the planner: {:?}", planner.try_wait()?).into());
            }
        }
        hops.push(began.elapsed() / 2);
    }
    let mut hops = hops.split_off(WARM_UP);
    hops.sort_unstable();
    let at = |share: f64| hops[(hops.len() as f64 * share) as usize].as_nanos() as f64 / 1000.0;
    println!("hop of a LaserScan: p50 {:.1} µs, p99 {:.1} µs, {ROUNDS} rounds", at(0.5), at(0.99));
    println!("/dev/shm: {} KiB", shared_memory_kib(system)?);
    Ok(())
}

/// The planner's part.
fn answer(system: &str) -> Result<(), Box<dyn Error>> {
    let node = Node::join(System::open(system)?, Process::Planner)?;
    let mut scans = node.reader(SCAN)?;
    let mut commands = node.writer(COMMAND)?;
    while node.wait(LIMIT) == Wake::Message {
        while let Some(scan) = scans.receive()? {
            commands.send(|command| command.header.source_seq = scan.header.seq)?;
        }
    }
    Ok(())
}

/// What the system's files take, not what they could grow to.
fn shared_memory_kib(system: &str) -> std::io::Result<u64> {
    use std::os::unix::fs::MetadataExt;
    let mark = format!("sketchnav_{system}_");
    let mut blocks = 0;
    for entry in std::fs::read_dir("/dev/shm")? {
        let entry = entry?;
        if entry.file_name().to_string_lossy().starts_with(&mark) {
            blocks += entry.metadata()?.blocks();
        }
    }
    Ok(blocks / 2)
}
