//! Learns from a drive by a drawing, or in what was learned before, for the next drive to start from.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use sketchnav_navigators::read_from;
use sketchnav_recordings::Recording;
use sketchnav_recordings::reader::Selection;
use sketchnav_recordings::sources::RecordedRun;
use sketchnav_recordings::writer::topic_name;
use sketchnav_schemas::channels::{self, ChannelSpec, DRAWING};
use sketchnav_schemas::codes::{DrawingKind, Process};
use sketchnav_schemas::erased::Owned;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sketch::learned::{CELL_M, DrawingFile, Learned, Learner, map_server, svg};
use sketchnav_sketch::mission::{KIND, SketchMission};
use sketchnav_sketch::reading::DrawnMap;
use sketchnav_sketch::reading::desk::{self, Change, Desk};
use sketchnav_sketch::sketcher;

use super::args::LearnOptions;
use super::whole::Whole;
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::out;

/// Learns from a recording and writes what was learned.
pub fn learn(whole: &Whole, options: &LearnOptions) -> Result<Outcome, Failure> {
    let output = options.output.clone().unwrap_or_else(|| whole.name().with_extension("learned"));
    let name = output.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let in_folder =
        |ending| options.map_server.as_ref().map(|folder| folder.join(format!("{name}.{ending}")));
    let [picture, yaml] = ["pgm", "yaml"].map(in_folder);
    refuse_outputs(whole, [Some(&output), picture.as_ref(), yaml.as_ref(), options.svg.as_ref()])?;
    let recording = super::open(whole.path())?;
    if recording.index().or_input()?.is_cut_off() {
        super::tell_cut_off(whole.name().display());
    }
    let (learned, drawing) = of(&recording).with_context(|| whole.name().display().to_string()).or_input()?;
    write(&output, &learned.to_bytes())?;
    let mut exports = Vec::new();
    if let Some(folder) = &options.map_server {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string()).or_input()?;
        let map = map_server(&learned.map, &format!("{name}.pgm"));
        for (path, content) in
            picture.into_iter().zip([map.pgm]).chain(yaml.into_iter().zip([map.yaml.into_bytes()]))
        {
            write(&path, &content)?;
            exports.push(path);
        }
    }
    if let Some(path) = &options.svg {
        write(path, svg(&learned, &drawing).as_bytes())?;
        exports.push(path.clone());
    }
    report(&output, &learned, &exports, options.json)?;
    Ok(Outcome::Success)
}

/// Rejects outputs that would overwrite the recording, another recording or each other.
fn refuse_outputs(whole: &Whole, outputs: [Option<&PathBuf>; 4]) -> Result<(), Failure> {
    let outputs: Vec<_> = outputs.into_iter().flatten().collect();
    for (i, output) in outputs.iter().enumerate() {
        super::refuse_to_overwrite(whole.sources(), output)?;
        super::refuse_a_recording(output, None)?;
        if outputs[..i].contains(output) {
            let place = output.display();
            return Err(Failure::Input(anyhow!(
                "{place}: expected a file of its own for each output, found it twice"
            )));
        }
    }
    Ok(())
}

fn write(path: &Path, content: &[u8]) -> Result<(), Failure> {
    sketchnav_files::write(path, content).with_context(|| path.display().to_string()).or_input()
}

/// Returns what the drive of a recording teaches, and the drawing that it was by.
fn of(recording: &Recording) -> anyhow::Result<(Learned, DrawnMap)> {
    let RecordedRun { run, files } = RecordedRun::of(recording)?;
    let kind = run.mission.navigator_kind();
    if kind != KIND {
        return Err(anyhow!("expected a drive of kind {KIND:?}, found one of {kind:?}"));
    }
    if run.pad.draws() {
        return of_pad(recording, &run);
    }
    let mission = SketchMission::of(&run.mission)?;
    let files = read_from(&files);
    let (drawing, places) = sketcher::understand(&run, &files)?;
    let mut learner = Learner::new(&run.robot)?;
    replay(recording, |spec, message| {
        learner.see(spec, message.bytes());
        Ok(())
    })?;
    match sketcher::learned_before(&run, &files)? {
        Some(before) => Ok((learner.merged(&before.learned, &before.intent, &places)?, before.drawing)),
        None => {
            let file = DrawingFile::of(&mission.drawing, &files(&mission.drawing)?);
            Ok((learner.learned(file, &drawing, &places)?, drawing))
        }
    }
}

/// Returns what the drives by the last drawing that people made on the pad teach. The goals are those that were marked last.
fn of_pad(recording: &Recording, run: &RunConfig) -> anyhow::Result<(Learned, DrawnMap)> {
    let mut desk = Desk::new(run)?;
    let (mut sketch, mut learner) = (Vec::new(), Learner::new(&run.robot)?);
    replay(recording, |spec, message| {
        let Some(about) = DRAWING.message(spec, message.bytes()) else {
            learner.see(spec, message.bytes());
            return Ok(());
        };
        let Some(kind) = DrawingKind::from_code(about.kind) else { return Ok(()) };
        // A drawing that is rejected now was rejected then.
        match desk.take(kind, message.cells()) {
            Ok(Change::Sketch) => sketch = message.cells().to_vec(),
            Ok(Change::Start) => learner = Learner::new(&run.robot)?,
            Ok(Change::Tasks) => learner.begin_tasks(),
            Err(_) => {}
        }
        Ok(())
    })?;
    let drawn = desk.placed();
    let (drawing, places) = drawn.context("expected a drawing with a route or goals in it, found none")?;
    let file = DrawingFile::of(desk::NAME, &sketch);
    Ok((learner.learned(file, drawing, places)?, drawing.clone()))
}

/// Calls `see` for every valid message of the planner's channels and for every drawing, in order.
fn replay(
    recording: &Recording,
    mut see: impl FnMut(&ChannelSpec, &Owned) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let planner = Process::Planner;
    let heard = channels::read_by(planner, KIND).chain(channels::written_by(planner, KIND));
    let topics = heard.chain([DRAWING.spec]).map(|spec| topic_name(spec.name));
    for message in recording.timeline(Selection::of_topics(topics))? {
        let message = message?;
        let Some(spec) = channels::of_topic(&message.topic.name) else { continue };
        match message.decode(spec) {
            // What the robot's processes rejected, it has not learned from either.
            Err(error) if error.is_one_message() => {}
            Err(error) => return Err(error.into()),
            Ok(decoded) if spec.message.check(decoded.bytes()).is_err() => {}
            Ok(decoded) => see(spec, &decoded)?,
        }
    }
    Ok(())
}

fn report(output: &Path, learned: &Learned, exports: &[PathBuf], json: bool) -> anyhow::Result<()> {
    let seen_m2 = learned.map.free_cells() as f64 * CELL_M * CELL_M;
    let reached = learned.goals.iter().filter(|goal| goal.reached).count();
    let paths: Vec<_> = exports.iter().map(|path| path.display().to_string()).collect();
    if json {
        return out!(
            "{}",
            serde_json::json!({
                "learned": output.display().to_string(),
                "drawing": learned.drawing.file,
                "seen_m2": seen_m2,
                "goals": learned.goals,
                "exports": paths,
            })
        );
    }
    out!("learned    {}", output.display())?;
    out!("drawing    {}", learned.drawing.file)?;
    out!("seen       {seen_m2:.0} m² of floor; {reached} of {} goals reached", learned.goals.len())?;
    paths.iter().try_for_each(|path| out!("exported   {path}"))
}
