//! Measures the cost of a hop between two processes: the world sends a scan and the planner responds with a
//! command, as in lockstep. Prints the time of a hop (half a round trip) and how much of `/dev/shm` the
//! system uses. For comparison, the same payloads are then sent through plain iceoryx2 with a WaitSet, and
//! through a Unix socket.
//!
//! `cargo run --release -p sketchnav-runtime --example ping`

use std::error::Error;
use std::io::{Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::process::{Child, Command};
use std::rc::Rc;
use std::time::{Duration, Instant};

use iceoryx2::port::{listener::Listener, notifier::Notifier, publisher::Publisher, subscriber::Subscriber};
use iceoryx2::prelude::{
    CallbackProgression, LogLevel, NodeBuilder, WaitSet, WaitSetBuilder, ipc, set_log_level_from_env_or,
};
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use sketchnav_runtime::{Channels, Node, System, Wake};
use sketchnav_schemas::channels::{COMMAND, SCAN};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::message::{LaserScan, VelocityCommand};

const ROUNDS: usize = 20_000;
const WARM_UP: usize = 1_000;
const LIMIT: Duration = Duration::from_secs(5);
/// Sizes of the messages in the comparisons, in each of the two directions, in bytes.
const THERE: usize = size_of::<LaserScan>();
const BACK: usize = size_of::<VelocityCommand>();

type Fallible<T = ()> = Result<T, Box<dyn Error>>;

fn main() -> Fallible {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["waitset"] => measure_waitset(),
        ["waitset", name] => answer_waitset(name),
        ["socket", path] => answer_socket(path),
        [system] => answer(system),
        _ => {
            measure()?;
            // This needs a separate process, because a system's settings are global to a process.
            other(&["waitset"])?.wait()?;
            measure_socket()
        }
    }
}

/// Starts the process that responds.
fn other(arguments: &[&str]) -> Fallible<Child> {
    Ok(Command::new(std::env::current_exe()?).args(arguments).spawn()?)
}

fn print(what: &str, mut hops: Vec<Duration>) {
    let mut hops = hops.split_off(WARM_UP);
    hops.sort_unstable();
    let at = |share: f64| hops[(hops.len() as f64 * share) as usize].as_nanos() as f64 / 1000.0;
    println!("{what:<24} p50 {:6.1} µs, p99 {:6.1} µs a hop, {ROUNDS} rounds", at(0.5), at(0.99));
}

fn measure() -> Fallible {
    let mut run: sketchnav_schemas::run::RunConfig = serde_json::from_str(include_str!("../tests/run.json"))?;
    run.system = format!("ping-{}", std::process::id());
    let system = Rc::new(System::create(&run)?);
    let supervisor = Node::join(system.clone(), Process::Supervisor)?;
    let channels = Channels::create(&supervisor)?;
    let mut planner = other(&[&run.system])?;
    let result = send(&run.system, &mut planner);
    planner.kill()?;
    planner.wait()?;
    drop((channels, supervisor));
    Rc::into_inner(system).ok_or("the system is still in use")?.remove()?;
    result
}

/// Acts as the world.
fn send(system: &str, planner: &mut Child) -> Fallible {
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
    print("sketchnav", hops);
    println!("/dev/shm: {} KiB", shared_memory_kib(system)?);
    Ok(())
}

/// Acts as the planner.
fn answer(system: &str) -> Fallible {
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

/// Returns the memory that the system's files use, as opposed to their maximum size.
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

/// The channels of plain iceoryx2 in both directions: messages, and events that announce them.
struct Raw {
    service: PortFactory<ipc::Service, [u8], ()>,
    publisher: Publisher<ipc::Service, [u8], ()>,
    notifier: Notifier<ipc::Service>,
    subscriber: Subscriber<ipc::Service, [u8], ()>,
    listener: Listener<ipc::Service>,
}

impl Raw {
    fn open(name: &str, sends: &str, hears: &str) -> Fallible<Self> {
        set_log_level_from_env_or(LogLevel::Fatal);
        let node = NodeBuilder::new().create::<ipc::Service>()?;
        let messages = |way: &str| -> Fallible<_> {
            let name = format!("{name}-{way}");
            Ok(node
                .service_builder(&name.as_str().try_into()?)
                .publish_subscribe::<[u8]>()
                .open_or_create()?)
        };
        let events = |way: &str| -> Fallible<_> {
            let name = format!("{name}-{way}-event");
            Ok(node.service_builder(&name.as_str().try_into()?).event().open_or_create()?)
        };
        let service = messages(sends)?;
        Ok(Self {
            publisher: service.publisher_builder().initial_max_slice_len(THERE).create()?,
            service,
            notifier: events(sends)?.notifier_builder().create()?,
            subscriber: messages(hears)?.subscriber_builder().create()?,
            listener: events(hears)?.listener_builder().create()?,
        })
    }

    fn send(&self, bytes: &[u8]) -> Fallible {
        self.publisher.loan_slice_uninit(bytes.len())?.write_from_slice(bytes).send()?;
        self.notifier.notify()?;
        Ok(())
    }
}

impl Raw {
    /// Sleeps until there is an event, and takes all events.
    fn wait(&self, waitset: &WaitSet<ipc::Service>) -> Fallible {
        waitset.wait_and_process_once(|_| CallbackProgression::Continue)?;
        self.listener.try_wait(|_| {})?;
        Ok(())
    }
}

fn answer_waitset(name: &str) -> Fallible {
    let raw = Raw::open(name, "back", "there")?;
    let waitset = WaitSetBuilder::new().create::<ipc::Service>()?;
    let _guard = waitset.attach_notification(&raw.listener)?;
    loop {
        while let Some(message) = raw.subscriber.receive()? {
            if message.payload()[0] == 0 {
                return Ok(());
            }
            raw.send(&[1; BACK])?;
        }
        raw.wait(&waitset)?;
    }
}

fn measure_waitset() -> Fallible {
    let name = format!("sketchnav-ping-{}", std::process::id());
    let raw = Raw::open(&name, "there", "back")?;
    let mut other = other(&["waitset", &name])?;
    let waitset = WaitSetBuilder::new().create::<ipc::Service>()?;
    let _guard = waitset.attach_notification(&raw.listener)?;
    let (bytes, mut hops) = ([1; THERE], Vec::with_capacity(ROUNDS));
    // The other process must have joined before the first message, including its events, which it opens last.
    while raw.notifier.notify()? == 0 || raw.service.dynamic_config().number_of_subscribers() == 0 {}
    for _ in 0..ROUNDS {
        let began = Instant::now();
        raw.send(&bytes)?;
        while raw.subscriber.receive()?.is_none() {
            raw.wait(&waitset)?;
        }
        hops.push(began.elapsed() / 2);
    }
    raw.send(&[0; THERE])?;
    other.wait()?;
    print("iceoryx2, WaitSet", hops);
    Ok(())
}

fn measure_socket() -> Fallible {
    let folder = std::env::temp_dir().join(format!("sketchnav-ping-{}", std::process::id()));
    let listener = UnixListener::bind(&folder)?;
    let mut other = other(&["socket", folder.to_str().ok_or("a path of UTF-8")?])?;
    let (mut stream, _) = listener.accept()?;
    let (there, mut back) = ([1; THERE], [0; BACK]);
    let mut hops = Vec::with_capacity(ROUNDS);
    for _ in 0..ROUNDS {
        let began = Instant::now();
        stream.write_all(&there)?;
        stream.read_exact(&mut back)?;
        hops.push(began.elapsed() / 2);
    }
    drop(stream);
    other.wait()?;
    std::fs::remove_file(folder)?;
    print("Unix socket, a copy", hops);
    Ok(())
}

fn answer_socket(path: &str) -> Fallible {
    let mut stream = UnixStream::connect(path)?;
    let (mut there, back) = ([0; THERE], [1; BACK]);
    while stream.read_exact(&mut there).is_ok() {
        stream.write_all(&back)?;
    }
    Ok(())
}
