//! Learns a map from a drive by a drawing, or in a map learned before, for the next drive to start from.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use sketchnav_navigators::read_from;
use sketchnav_recordings::Recording;
use sketchnav_recordings::replay::replay;
use sketchnav_recordings::sources::RecordedRun;
use sketchnav_schemas::say;
use sketchnav_sketch::learned::{CELL_M, Learned, map_server, of_drive, svg};
use sketchnav_sketch::mission::KIND;
use sketchnav_sketch::reading::DrawnMap;
use sketchnav_stage::drawn::See;

use super::args::LearnOptions;
use super::whole::Whole;
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::out;

/// Learns a map from a recording and writes it.
pub fn learn(whole: &Whole, options: &LearnOptions) -> Result<Outcome, Failure> {
    let output = options.output.clone().unwrap_or_else(|| whole.name().with_extension("learned"));
    let name = output.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let in_folder =
        |ending| options.map_server.as_ref().map(|folder| folder.join(format!("{name}.{ending}")));
    let [picture, yaml] = ["pgm", "yaml"].map(in_folder);
    refuse_outputs(whole, [Some(&output), picture.as_ref(), yaml.as_ref(), options.svg.as_ref()])?;
    let recording = super::open(whole.path())?;
    if recording.index().or_input()?.is_cut_off() {
        // The drive may go on: this is no damage.
        say!(
            "notice: {} is still being written, or its recorder was killed; the map covers everything up to the last message",
            whole.name().display()
        );
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

/// Returns the map learned from the drive of a recording, and the drawing that it used.
fn of(recording: &Recording) -> anyhow::Result<(Learned, DrawnMap)> {
    let RecordedRun { run, files } = RecordedRun::of(recording)?;
    let kind = run.mission.navigator_kind();
    if kind != KIND {
        return Err(anyhow!("expected a drive of kind {KIND:?}, found one of {kind:?}"));
    }
    let mut messages = |see: &mut See<'_>| {
        Ok(replay(recording, KIND, |spec, message| see(spec, message.bytes(), message.cells()))?)
    };
    of_drive(&run, &read_from(&files), &mut messages).map_err(|error| anyhow!(error))
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
