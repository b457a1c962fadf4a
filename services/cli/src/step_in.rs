//! Steps in by hand: starts a process of a running system anew, gives an order.
//!
//! Both stand on `faults`, so the recording has what a person did.

use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow};
use nix::sys::signal::Signal;
use sketchnav_landmarks::mission::KIND as LANDMARKS;
use sketchnav_runtime::{Node, SendTimes, System, Wake};
use sketchnav_schemas::channels::MISSION;
use sketchnav_schemas::codes::{Order, Process};

use crate::args::{RestartOptions, SendOptions};
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::out;
use crate::systems;

/// How often to look.
const LOOK_EVERY: Duration = Duration::from_millis(2);

/// Ends a process and waits for its successor.
pub fn restart(options: &RestartOptions) -> Result<Outcome, Failure> {
    let system = systems::find(options.system.as_deref())?;
    let process = options.process;
    let (name, run) = (system.name().to_owned(), system.run_config().or_input()?);
    if run.without.contains(&process) {
        let words = "is run by hand (--without); its supervisor does not start it again";
        return Err(Failure::Input(anyhow!("{process} of {name:?} {words}")));
    }
    let missing =
        || anyhow!("{process}: expected a process that runs in {name:?}, found none; see sketchnav ps");
    let before = pid_of(&system, process)?.with_context(|| missing().to_string()).or_input()?;
    let signal = if options.kill { Signal::SIGKILL } else { Signal::SIGTERM };
    let began = Instant::now();
    system.inject(process, before, signal, "restart").context("ending it")?;
    let after = successor(&system, process, before, options.timeout)?;
    let took_ms = began.elapsed().as_secs_f64() * 1e3;
    if options.json {
        let object = serde_json::json!({
            "system": name, "process": process, "signal": signal.as_str(), "pid_before": before, "pid": after,
            "took_ms": took_ms,
        });
        out!("{object}")?;
    } else {
        out!("{process} of {name}: {before} ended by {signal}, {after} has joined after {took_ms:.0} ms")?;
    }
    Ok(Outcome::Success)
}

fn pid_of(system: &System, process: Process) -> anyhow::Result<Option<u32>> {
    let processes = system.processes().context("the system's processes")?;
    Ok(processes.into_iter().find(|(name, _)| name == process.word()).map(|(_, pid)| pid))
}

/// The one that has taken the place of the process `before`.
fn successor(system: &System, process: Process, before: u32, patience: Duration) -> anyhow::Result<u32> {
    let limit = Instant::now() + patience;
    loop {
        System::open(system.name()).context("waiting for the successor")?;
        if let Some(pid) = pid_of(system, process)?.filter(|&pid| pid != before) {
            return Ok(pid);
        }
        if Instant::now() > limit {
            let seconds = patience.as_secs_f64();
            return Err(anyhow!(
                "{process}: expected a successor of process {before} within {seconds} s, found none"
            ));
        }
        sleep(LOOK_EVERY);
    }
}

/// Has the supervisor give an order, and waits until it is on its channel.
pub fn send(options: &SendOptions) -> Result<Outcome, Failure> {
    let system = systems::find(options.system.as_deref())?;
    let (name, run) = (system.name().to_owned(), system.run_config().or_input()?);
    let (order, tasks) = (options.order, run.mission.task.len() as u32);
    // An order to resume has the number of a state in the place of a task's.
    let task = options.state.unwrap_or(options.task - 1);
    if options.state.is_some() && (order != Order::Resume || run.mission.navigator_kind() != LANDMARKS) {
        let expected = format!("--state: expected `resume` of a mission of kind {LANDMARKS:?}");
        let found = format!("found `{order}` of kind {:?}", run.mission.navigator_kind());
        return Err(Failure::Input(anyhow!("{expected}, {found}")));
    }
    if options.state.is_none() && task >= tasks.max(1) {
        let found = options.task;
        return Err(Failure::Input(anyhow!(
            "--task: expected 1 to {tasks}, for {name:?} has {tasks} tasks, found {found}"
        )));
    }
    let node = Node::join(system, Process::Observer).with_context(|| format!("joining {name}"))?;
    let mut orders = node.reader(MISSION).context("the channel of orders")?;
    // What was ordered before comes first.
    let mut last = newest(&node)?;
    node.system().order(order, task, "send").context("ordering")?;
    let limit = Instant::now() + options.timeout;
    loop {
        while let Some(given) = orders.receive().context("the channel of orders")? {
            let is_ours = given.header.seq > last && given.order == order.code() && given.task == task;
            last = last.max(given.header.seq);
            if is_ours {
                return told(options.json, &name, options, last, given.header.stamp_ns);
            }
        }
        if Instant::now() > limit || System::open(&name).is_err() {
            let seconds = options.timeout.as_secs_f64();
            let expected =
                format!("expected {order:?} on channel {:?} within {seconds} s", MISSION.spec.name);
            return Err(Failure::Other(anyhow!(
                "{expected}, found nothing: the supervisor did not forward it"
            )));
        }
        if node.nap(LOOK_EVERY) == Wake::Terminate {
            return Err(Failure::Other(anyhow!("interrupted before {order} was on its channel")));
        }
    }
}

/// The number of the last order so far.
fn newest(node: &Node) -> anyhow::Result<u64> {
    let sent = SendTimes::open(node, MISSION.spec).context("the channel of orders")?;
    Ok(sent.newest())
}

fn told(
    json: bool,
    system: &str,
    options: &SendOptions,
    seq: u64,
    stamp_ns: u64,
) -> Result<Outcome, Failure> {
    let order = options.order;
    if json {
        let object = serde_json::json!({
            "system": system, "order": order, "task": options.task, "seq": seq, "stamp_ns": stamp_ns,
        });
        out!("{object}")?;
    } else {
        out!("{system}: {order} is order {seq} on channel {:?}", MISSION.spec.name)?;
    }
    Ok(Outcome::Success)
}
