//! Intervenes in a running system: restarts a process or gives an order.
//!
//! Both are reported on the channel `faults`, so that the recording shows the intervention.

use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow};
use nix::sys::signal::Signal;
use sketchnav_navigators::goal::{self, Goal};
use sketchnav_navigators::read_from;
use sketchnav_recordings::sources;
use sketchnav_runtime::{Node, Ordered, SendTimes, System, Wake};
use sketchnav_schemas::channels::{MISSION, UNDERSTOOD};
use sketchnav_schemas::codes::{Order, Process};
use sketchnav_schemas::geometry::Point;
use sketchnav_schemas::message::{Here, MissionCommand, Understood};
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::doubts::Canvas;

use crate::args::{RestartOptions, SendOptions};
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::out;
use crate::systems;

/// Interval at which to check whether the successor has joined or the order has appeared.
const LOOK_EVERY: Duration = Duration::from_millis(2);

/// Ends a process and waits for its replacement.
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

/// Waits for the process that replaces the one with the id `before`, and returns its id.
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

/// Asks the supervisor to give an order, and waits until the order appears on its channel.
pub fn send(options: &SendOptions) -> Result<Outcome, Failure> {
    let system = systems::find(options.system.as_deref())?;
    let (name, run) = (system.name().to_owned(), system.run_config().or_input()?);
    let (ordered, resolved) = ordered(options, &name, &run)?;
    if let Some(resolved) = resolved.as_ref().filter(|_| !options.json) {
        out!("{name}: {resolved}")?;
    }
    check_place(options, &run)?;
    let node = Node::join(system, Process::Observer).with_context(|| format!("joining {name}"))?;
    let here = options.at.map(|at| here(&node, &run, at, options.heading)).transpose()?;
    let ordered = Ordered { here, ..ordered };
    let mut orders = node.reader(MISSION).context("the channel of orders")?;
    // Earlier orders are skipped.
    let mut last = newest(&node)?;
    node.system().order(ordered, "send").context("ordering")?;
    let limit = Instant::now() + options.timeout;
    loop {
        while let Some(given) = orders.receive().context("the channel of orders")? {
            let is_ours = given.header.seq > last && is_order(&given, &ordered);
            last = last.max(given.header.seq);
            if is_ours {
                return report(options, &name, &given, resolved.as_deref());
            }
        }
        if Instant::now() > limit || System::open(&name).is_err() {
            let (order, seconds) = (options.order, options.timeout.as_secs_f64());
            let expected =
                format!("expected {order:?} on channel {:?} within {seconds} s", MISSION.spec.name);
            return Err(Failure::Other(anyhow!(
                "{expected}, found nothing: the supervisor did not forward it"
            )));
        }
        if node.nap(LOOK_EVERY) == Wake::Terminate {
            return Err(Failure::Other(anyhow!("interrupted before {} was on its channel", options.order)));
        }
    }
}

fn is_order(given: &MissionCommand, ordered: &Ordered) -> bool {
    (given.order, given.task) == (ordered.order.code(), ordered.task)
        && (given.here(), given.place()) == (ordered.here, ordered.place)
}

/// Joins the words of a goal. The shell has removed the quotes around names of several words, so they are put back.
fn in_words(words: &[String]) -> String {
    let quoted = |word: &String| match word.contains(char::is_whitespace) {
        true if words.len() > 1 && word.contains('"') => format!("'{word}'"),
        true if words.len() > 1 => format!("\"{word}\""),
        _ => word.clone(),
    };
    words.iter().map(quoted).collect::<Vec<_>>().join(" ")
}

/// Returns the order without the robot's position, and the place that it leads to if a person describes it.
fn ordered(
    options: &SendOptions,
    system: &str,
    run: &RunConfig,
) -> Result<(Ordered, Option<String>), Failure> {
    let name = (!options.name.is_empty()).then(|| in_words(&options.name));
    match (name, options.order) {
        (None, order) => Ok((Ordered::new(order, task_of(options, system, run)?), None)),
        (Some(name), Order::Goal) => named_goal(run, &name).or_input(),
        (Some(_), found) => Err(Failure::Input(anyhow!("NAME: expected the order `goal`, found `{found}`"))),
    }
}

/// Returns the order to go to the task or place that a person refers to, and which place that is if their words are not its name.
///
/// # Errors
/// If there is none or several, or if the run's files cannot be read.
pub fn named_goal(run: &RunConfig, name: &str) -> anyhow::Result<(Ordered, Option<String>)> {
    let files = sources::of_run(run)?;
    match goal::find(run, &read_from(&*files), name).map_err(|error| anyhow!("{error}"))? {
        Goal::Task(task) => Ok((Ordered::new(Order::Goal, task as u32), None)),
        Goal::Place(found) => Ok((Ordered::to_place(found.place), found.resolved)),
    }
}

/// Returns the index of the task that the order refers to by number, from 0. With `--state`, returns the number, from 1, of the
/// landmark state to resume from.
fn task_of(options: &SendOptions, system: &str, run: &RunConfig) -> Result<u32, Failure> {
    let (order, tasks) = (options.order, run.mission.task.len() as u32);
    if let Some(state) = options.state {
        let is_known = sketchnav_navigators::of(&run.mission).is_ok_and(|it| it.resumes_at_states);
        if order != Order::Resume || !is_known {
            let kinds = sketchnav_navigators::all().filter(|navigator| navigator.resumes_at_states);
            let kinds: Vec<_> = kinds.map(|navigator| format!("{:?}", navigator.kind)).collect();
            let expected = format!("--state: expected `resume` of a mission of kind {}", kinds.join(" or "));
            let found = format!("found `{order}` of kind {:?}", run.mission.navigator_kind());
            return Err(Failure::Input(anyhow!("{expected}, {found}")));
        }
        return Ok(state);
    }
    let task = options.task - 1;
    if task >= tasks.max(1) {
        let found = options.task;
        return Err(Failure::Input(anyhow!(
            "--task: expected 1 to {tasks}, because {system:?} has {tasks} tasks, found {found}"
        )));
    }
    Ok(task)
}

/// Checks that the order `here` has a position and goes to a robot that estimates its position in a drawing, and that
/// no other order has a position.
fn check_place(options: &SendOptions, run: &RunConfig) -> Result<(), Failure> {
    let kind = run.mission.navigator_kind();
    match (options.order, options.at) {
        (Order::Here, None) => Err(Failure::Input(anyhow!("`here`: expected --at X,Y, found none"))),
        (Order::Here, Some(_)) if !run.pad.draws() && canvas(run)?.is_none() => {
            let method = sketchnav_navigators::method_of(run);
            let expected = "a robot that estimates its position in a drawing";
            Err(Failure::Input(anyhow!(
                "`here`: expected {expected}, found kind {kind:?}, method {method:?}"
            )))
        }
        (Order::Here, Some(_)) | (_, None) => Ok(()),
        (order, Some(_)) => Err(Failure::Input(anyhow!("--at: expected the order `here`, found `{order}`"))),
    }
}

/// Converts a position in the current drawing, in image pixels, to the sketch.
fn here(node: &Node, run: &RunConfig, at: [f64; 2], yaw_rad: Option<f64>) -> Result<Here, Failure> {
    let (size_px, scale) = drawing(node, run)?;
    let here = Here { at: Point::new(at[0] * scale, size_px[1] - at[1] * scale), yaw_rad };
    if (0.0..size_px[0]).contains(&here.at.x) && (0.0..size_px[1]).contains(&here.at.y) {
        return Ok(here);
    }
    let [width, height] = size_px.map(|side| side / scale);
    let expected = format!("expected a place in the drawing of {width:.0} × {height:.0} px");
    Err(Failure::Input(anyhow!("--at: {expected}, found {},{}", at[0], at[1])))
}

/// Returns the width and height of the sketch, and its pixels per image pixel. They come from the last accepted drawing
/// if people draw, otherwise from the mission's drawing.
fn drawing(node: &Node, run: &RunConfig) -> Result<([f64; 2], f64), Failure> {
    if let Some(Canvas { size_px, scale }) = canvas(run)? {
        return Ok((size_px, scale));
    }
    let mut answers = node.reader(UNDERSTOOD).context("the sketcher's answers")?;
    let mut newest = None;
    let take = |answer: &Understood| newest = Some(*answer).filter(|answer| answer.sketch_seq > 0).or(newest);
    answers.take_kept(node, take).context("the sketcher's answers")?;
    let answer = newest
        .ok_or_else(|| Failure::Input(anyhow!("--at: expected a drawing, but none has been sent yet")))?;
    Ok(([answer.sketch_width_px, answer.sketch_height_px].map(f64::from), answer.scale))
}

/// Returns the drawing that the robot localizes in, if the mission has one.
fn canvas(run: &RunConfig) -> Result<Option<Canvas>, Failure> {
    let navigator = sketchnav_navigators::of(&run.mission).or_input()?;
    let Some(find) = navigator.canvas else { return Ok(None) };
    let files = sources::of_run(run).or_input()?;
    find(run, &read_from(&*files)).map_err(|error| anyhow!("{error}")).or_input()
}

/// Returns the sequence number of the latest order.
fn newest(node: &Node) -> anyhow::Result<u64> {
    let sent = SendTimes::open(node, MISSION.spec).context("the channel of orders")?;
    Ok(sent.newest())
}

fn report(
    options: &SendOptions,
    system: &str,
    given: &MissionCommand,
    resolved: Option<&str>,
) -> Result<Outcome, Failure> {
    let (order, seq) = (options.order, given.header.seq);
    if options.json {
        let mut object = serde_json::json!({
            "system": system, "order": order, "seq": seq, "stamp_ns": given.header.stamp_ns,
        });
        if given.place().is_none() {
            object["task"] = (if options.name.is_empty() { options.task } else { given.task + 1 }).into();
        }
        if !options.name.is_empty() {
            object["name"] = in_words(&options.name).into();
        }
        if let Some(resolved) = resolved {
            object["resolved"] = resolved.into();
        }
        if let Some(at) = options.at {
            object["at"] = at.into();
        }
        out!("{object}")?;
    } else {
        out!("{system}: {order} is order {seq} on channel {:?}", MISSION.spec.name)?;
    }
    Ok(Outcome::Success)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression test: the shell removes the quotes, without which *and* in a name separated two names.
    #[test]
    fn names_of_several_words_keep_their_quotes() {
        let words = |given: &[&str]| in_words(&given.iter().map(|&word| word.to_owned()).collect::<Vec<_>>());
        assert_eq!(
            words(&["the", "room", "nearest", "to", "food and drink"]),
            "the room nearest to \"food and drink\""
        );
        assert_eq!(words(&["between", "the \"A and B\"", "and", "C"]), "between 'the \"A and B\"' and C");
        assert_eq!(words(&["the room left of the kitchen"]), "the room left of the kitchen");
    }
}
