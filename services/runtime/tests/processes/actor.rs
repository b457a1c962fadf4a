//! The actor: this same test binary, started again as a process that obeys orders.

use std::time::Duration;

use nix::sys::signal::{SigSet, Signal, raise};
use sketchnav_runtime::*;
use sketchnav_schemas::channels::{COMMAND, ODOMETRY, SCAN, TICK, TRUTH};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::{GroundTruth, Header, LaserScan, Odometry, Tick, VelocityCommand};
use sketchnav_schemas::run::RunConfig;
use sketchnav_sketch::messages::{ESTIMATE, PoseEstimate, SKETCH, SketchMap};
use sketchnav_stage::Hosted;

use crate::hosted::{Counter, Curious, fill_estimate};

const LONG: Duration = Duration::from_secs(600);
/// Number of times that an actor checks for an answer before it reports that none came, and the time to sleep in between.
const LOOKS: u32 = 6000;
const LOOK: Duration = Duration::from_millis(5);
const CLEARING: Duration = Duration::from_millis(500);

/// The node, readers and writers that an actor has opened.
#[derive(Default)]
struct Actor {
    channels: Option<Channels>,
    scan_writer: Option<Writer<LaserScan>>,
    scan_reader: Option<Reader<LaserScan>>,
    sketch_writer: Option<Writer<SketchMap>>,
    sketch_reader: Option<Reader<SketchMap>>,
    odometry_reader: Option<Reader<Odometry>>,
    truth_reader: Option<Reader<GroundTruth>>,
    tick_writer: Option<Writer<Tick>>,
    estimate_writer: Option<Writer<PoseEstimate>>,
    estimate_reader: Option<Reader<PoseEstimate>>,
    command_reader: Option<Reader<VelocityCommand>>,
    held: Vec<Sample<LaserScan>>,
    node: Option<Node>,
    system: Option<System>,
}

#[test]
#[ignore = "a process of the other tests, which start it themselves"]
fn actor() {
    sketchnav_navigators::register(&[]).unwrap();
    let mut actor = Actor::default();
    for line in std::io::stdin().lines() {
        let line = line.unwrap();
        let words: Vec<_> = line.split(' ').collect();
        let answer = actor.obey(&words).unwrap_or_else(|error| format!("error {error}"));
        println!("\n> {answer}");
    }
}

impl Actor {
    fn obey(&mut self, words: &[&str]) -> Result<String> {
        match *words {
            ["create", name] => self.create(name)?,
            ["create-without-joining", name] => self.system = Some(System::create(&run_config(name))?),
            ["remove"] => self.remove()?,
            ["clear-dead"] => self.node().clear_dead(CLEARING),
            ["join", name, process] => {
                self.node = Some(Node::join(System::open(name)?, process.parse().unwrap())?);
            }
            ["be-asked-to-end"] => {
                // A process that the supervisor starts also receives the signal only once it listens for it.
                SigSet::from(Signal::SIGTERM).thread_block().unwrap();
                raise(Signal::SIGTERM).unwrap();
            }
            ["leave"] => *self = Self { system: self.system.take(), ..Self::default() },
            ["open", what] => self.open(what)?,
            ["send", count] => return self.send(count.parse().unwrap()),
            ["receive"] => return self.receive(),
            ["complaint"] => return Ok(self.complaint()),
            ["wait"] => return Ok(format!("{:?}", self.node().wait(LONG))),
            ["refresh"] => return Ok(format!("{:?}", self.node().wait(Duration::ZERO))),
            ["until", seq] => return self.receive_until(seq.parse().unwrap()),
            ["loan"] => return self.loan(),
            ["hold"] => return self.hold(),
            ["host"] => return self.host(&mut Counter::new(self.node().process(), false)),
            ["host-refusing"] => return self.host(&mut Counter::new(self.node().process(), true)),
            ["host-curious"] => return self.host(&mut Curious),
            ["tick", count] => return self.tick(count.parse().unwrap()),
            ["estimate", tick] => self.estimate(tick.parse().unwrap())?,
            ["estimates", tick] => return self.answers(tick.parse().unwrap(), Self::next_estimate),
            ["commands", tick] => return self.answers(tick.parse().unwrap(), Self::next_command),
            ["sketch"] => return self.send_sketch(),
            ["hold-sketch"] => return self.hold_sketch(),
            ["count-sending"] => return self.count_sending(),
            ["count-receiving"] => return self.count_receiving(),
            ["list"] => {
                let names: Vec<_> = System::list()?.iter().map(|s| s.name().to_string()).collect();
                return Ok(names.join(" "));
            }
            ["sweep"] => return Ok(System::sweep_dead()?.join(" ")),
            _ => panic!("no such order: {words:?}"),
        }
        Ok("done".into())
    }

    fn create(&mut self, name: &str) -> Result<()> {
        let system = System::create(&run_config(name))?;
        let node = Node::join(System::open(name)?, Process::Supervisor)?;
        self.channels = Some(Channels::create(&node)?);
        (self.node, self.system) = (Some(node), Some(system));
        Ok(())
    }

    fn remove(&mut self) -> Result<()> {
        let system = self.system.take();
        *self = Self::default();
        system.unwrap().remove()
    }

    fn node(&self) -> &Node {
        self.node.as_ref().unwrap()
    }

    fn open(&mut self, what: &str) -> Result<()> {
        match what {
            "scan-writer" => self.scan_writer = Some(self.node().writer(SCAN)?),
            "second-scan-writer" => drop(self.node().writer(SCAN)?),
            "scan-reader" => self.scan_reader = Some(self.node().reader(SCAN)?),
            "sketch-writer" => self.sketch_writer = Some(self.node().writer(SKETCH)?),
            "sketch-reader" => self.sketch_reader = Some(self.node().reader(SKETCH)?),
            "odometry-reader" => self.odometry_reader = Some(self.node().reader(ODOMETRY)?),
            "tick-writer" => self.tick_writer = Some(self.node().writer(TICK)?),
            "estimate-writer" => self.estimate_writer = Some(self.node().writer(ESTIMATE)?),
            "estimate-reader" => self.estimate_reader = Some(self.node().reader(ESTIMATE)?),
            "command-reader" => self.command_reader = Some(self.node().reader(COMMAND)?),
            "truth-reader" => self.truth_reader = Some(self.node().reader(TRUTH)?),
            _ => panic!("no such end: {what}"),
        }
        Ok(())
    }

    fn send(&mut self, count: u64) -> Result<String> {
        let writer = self.scan_writer.as_mut().unwrap();
        for _ in 0..count {
            writer.send(fill)?;
        }
        Ok(writer.last_seq().to_string())
    }

    /// Receives everything that has arrived, and returns the first and the last number, and how many messages arrived and were
    /// lost.
    fn receive(&mut self) -> Result<String> {
        let reader = self.scan_reader.as_mut().unwrap();
        let mut numbers = Vec::new();
        while let Some(scan) = reader.receive()? {
            assert_eq!(scan.ranges_m[100], 2.5);
            numbers.push(scan.header.seq);
        }
        let (first, last) = (numbers.first().unwrap_or(&0), numbers.last().unwrap_or(&0));
        Ok(format!("{first}..{last} {} lost {}", numbers.len(), reader.lost()))
    }

    fn receive_until(&mut self, seq: u64) -> Result<String> {
        loop {
            let reader = self.scan_reader.as_mut().unwrap();
            while let Some(scan) = reader.receive()? {
                if scan.header.seq >= seq {
                    return Ok(scan.header.seq.to_string());
                }
            }
            assert_eq!(self.node().wait(LONG), Wake::Message);
        }
    }

    fn host(&self, stage: &mut dyn Hosted) -> Result<String> {
        match host(self.node(), stage) {
            Err(HostError::Runtime(error)) => Err(error),
            Err(HostError::Stage(error)) => Ok(format!("stage: {error}")),
            ended => panic!("{ended:?}"),
        }
    }

    fn tick(&mut self, count: u64) -> Result<String> {
        let writer = self.tick_writer.as_mut().unwrap();
        for _ in 0..count {
            writer.send(|tick| tick.header.stamp_ns = 100)?;
        }
        Ok(writer.last_seq().to_string())
    }

    /// Sends an estimate caused by this tick.
    fn estimate(&mut self, tick: u64) -> Result<()> {
        let writer = self.estimate_writer.as_mut().unwrap();
        writer.send(|estimate| {
            fill_estimate(estimate, Header { seq: 0, stamp_ns: 100, source_seq: tick }, 0)
        })?;
        Ok(())
    }

    fn next_estimate(&mut self) -> Result<Option<(Header, u32)>> {
        let sample = self.estimate_reader.as_mut().unwrap().receive()?;
        Ok(sample.map(|estimate| (estimate.header, estimate.particle_count)))
    }

    fn next_command(&mut self) -> Result<Option<(Header, u32)>> {
        let sample = self.command_reader.as_mut().unwrap().receive()?;
        Ok(sample.map(|command| (command.header, command.last)))
    }

    /// Returns the stage's answers to all ticks up to `tick`: their ticks, their numbers, and the stage's counts.
    fn answers(
        &mut self,
        tick: u64,
        next: impl Fn(&mut Self) -> Result<Option<(Header, u32)>>,
    ) -> Result<String> {
        let mut told = Vec::new();
        for _ in 0..LOOKS {
            while let Some((header, count)) = next(self)? {
                told.push(format!("{}:{}:{count}", header.source_seq, header.seq));
                if header.source_seq >= tick {
                    return Ok(told.join(" "));
                }
            }
            self.node().nap(LOOK);
        }
        Ok(format!("no answer to tick {tick} after {}", told.join(" ")))
    }

    /// Returns the supervisor's complaint about the files of the system.
    fn complaint(&self) -> String {
        for _ in 0..LOOKS {
            if let Err(error) = self.node().check_shared_memory() {
                return error.to_string();
            }
            self.node().nap(LOOK);
        }
        "none".into()
    }

    fn loan(&mut self) -> Result<String> {
        let writer = self.scan_writer.as_mut().unwrap();
        let mut loan = writer.loan()?;
        assert!(loan.ranges_m.iter().all(|&range| range == 0.0));
        fill(&mut loan);
        let place = place_in_file(&raw const *loan);
        loan.send()?;
        Ok(place)
    }

    fn hold(&mut self) -> Result<String> {
        let scan = self.scan_reader.as_mut().unwrap().receive()?.unwrap();
        let place = place_in_file(&raw const *scan);
        self.held.push(scan);
        Ok(place)
    }

    fn send_sketch(&mut self) -> Result<String> {
        let mut loan = self.sketch_writer.as_mut().unwrap().loan_with(2540 * 1252)?;
        loan.width_px = 2540;
        let (_, cells) = loan.parts_mut();
        cells[2540 * 1252 - 1] = 100;
        let place = place_in_file(cells.as_ptr());
        loan.send()?;
        Ok(place)
    }

    fn hold_sketch(&mut self) -> Result<String> {
        let sketch = self.sketch_reader.as_mut().unwrap().receive()?.unwrap();
        assert_eq!((sketch.width_px, sketch.cells().len()), (2540, 2540 * 1252));
        assert_eq!((sketch.cells()[0], sketch.cells()[2540 * 1252 - 1]), (0, 100));
        Ok(place_in_file(sketch.cells().as_ptr()))
    }

    /// Counts the allocations of this thread while it sends a thousand messages and reports its health.
    fn count_sending(&mut self) -> Result<String> {
        let (writer, node) = (self.scan_writer.as_mut().unwrap(), self.node.as_ref().unwrap());
        let mut health = HealthReporter::new(node)?;
        health.report(0)?;
        let (before, handles) = (allocations_of_this_thread(), loan_handles_of_this_thread());
        for stamp_ns in 0..1000 {
            let step = Step::begin();
            writer.send(fill)?;
            node.wait(Duration::ZERO);
            health.end(step);
            health.report(stamp_ns)?;
        }
        let handles = loan_handles_of_this_thread() - handles;
        Ok(format!("{} and {handles} handles", allocations_since(before)))
    }

    /// Counts the allocations of this thread while it receives messages up to number 1000.
    fn count_receiving(&mut self) -> Result<String> {
        let (reader, node) = (self.scan_reader.as_mut().unwrap(), self.node.as_ref().unwrap());
        let before = allocations_of_this_thread();
        loop {
            while let Some(scan) = reader.receive()? {
                if scan.header.seq == 1000 {
                    return Ok(allocations_since(before));
                }
            }
            node.wait(LONG);
        }
    }
}

fn allocations_since(before: u64) -> String {
    let counted = allocations_of_this_thread() - before;
    drop(std::hint::black_box(Box::new(0)));
    assert!(allocations_of_this_thread() > before + counted, "the counter does not count");
    counted.to_string()
}

fn fill(scan: &mut LaserScan) {
    scan.beam_count = 683;
    scan.ranges_m[100] = 2.5;
}

/// Returns the mapping of an address: the file's device, inode and path, and the offset in it.
fn place_in_file<T>(address: *const T) -> String {
    let address = address as usize;
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
    for line in maps.lines() {
        let words: Vec<_> = line.split_whitespace().collect();
        let (from, to) = words[0].split_once('-').unwrap();
        let hex = |text: &str| usize::from_str_radix(text, 16).unwrap();
        if (hex(from)..hex(to)).contains(&address) {
            let offset = hex(words[2]) + address - hex(from);
            return format!("{} {} {} {offset}", words[3], words[4], words[5]);
        }
    }
    panic!("{address:#x} is not mapped");
}

fn run_config(name: &str) -> RunConfig {
    let mut run: RunConfig = serde_json::from_str(include_str!("../run.json")).unwrap();
    run.system = name.into();
    run
}
