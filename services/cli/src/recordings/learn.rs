//! Learns a map from a drive by a drawing, or in a map learned before, for the next drive to start from. Adds to it what was learned
//! on other drives in the same place.

use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use serde_json::json;
use sketchnav_navigators::read_from;
use sketchnav_recordings::Recording;
use sketchnav_recordings::replay::replay;
use sketchnav_recordings::sources::RecordedRun;
use sketchnav_schemas::message::MAX_TASKS;
use sketchnav_schemas::say;
use sketchnav_sketch::learned::{CELL_M, Gain, Learned, map_server, of_drive, svg};
use sketchnav_sketch::mission::KIND;
use sketchnav_sketch::reading::DrawnMap;
use sketchnav_stage::drawn::See;

use super::args::LearnOptions;
use super::whole::Whole;
use crate::failure::{Failure, OrInput, Outcome};
use crate::output::out;

/// Learns a map from a recording, or reads a learned map, adds the other ones, and writes it.
pub fn learn(file: &Path, options: &LearnOptions) -> Result<Outcome, Failure> {
    let source = Source::of(file)?;
    let others = options.with.iter().map(|file| Source::of(file)).collect::<Result<Vec<_>, _>>()?;
    let output = source.output(options)?;
    let name = output.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let in_folder =
        |ending| options.map_server.as_ref().map(|folder| folder.join(format!("{name}.{ending}")));
    let [picture, yaml] = ["pgm", "yaml"].map(in_folder);
    let inputs: Vec<_> = std::iter::once(&source).chain(&others).flat_map(Source::files).collect();
    refuse_outputs(&inputs, [Some(&output), picture.as_ref(), yaml.as_ref(), options.svg.as_ref()])?;
    let (mut learned, drawing) = source.learned()?;
    let mut merged = Vec::new();
    for other in &others {
        let (theirs, _) = other.learned()?;
        let (both, gain) = learned
            .combined_with(&theirs)
            .with_context(|| format!("{} with {}", file.display(), other.name().display()))
            .or_input()?;
        learned = both;
        merged.push(Merged { file: other.name().to_owned(), drawing: theirs.drawing.file, gain });
    }
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
    if let (Some(path), Some(drawing)) = (&options.svg, &drawing) {
        write(path, svg(&learned, drawing).as_bytes())?;
        exports.push(path.clone());
    }
    report(&output, &learned, &merged, &exports, options.json)?;
    Ok(Outcome::Success)
}

/// An input of `learn`: a recording, or a learned map.
enum Source {
    /// The recording of a drive.
    Recording(Whole),
    /// What was learned on a drive.
    Learned(PathBuf, Box<Learned>),
}

impl Source {
    /// Opens a recording, the folder of a run, or a learned map.
    fn of(file: &Path) -> Result<Self, Failure> {
        if !begins_as_json(file) {
            return Ok(Self::Recording(Whole::of(file)?));
        }
        let named = || file.display().to_string();
        let bytes = std::fs::read(file).with_context(named).or_input()?;
        let learned = Learned::parse(&bytes).with_context(named).or_input()?;
        Ok(Self::Learned(file.to_owned(), Box::new(learned)))
    }

    fn name(&self) -> &Path {
        match self {
            Self::Recording(whole) => whole.name(),
            Self::Learned(file, _) => file,
        }
    }

    /// Returns the files that must not be overwritten.
    fn files(&self) -> Vec<&PathBuf> {
        match self {
            Self::Recording(whole) => whole.sources().iter().collect(),
            Self::Learned(file, _) => vec![file],
        }
    }

    /// Returns the file to write. A picture of the corrected drawing can only be made from a recording.
    fn output(&self, options: &LearnOptions) -> Result<PathBuf, Failure> {
        let wrong = |what: &str| Err(Failure::Input(anyhow!("{}: {what}", self.name().display())));
        match (self, &options.output) {
            (Self::Learned(..), _) if options.svg.is_some() => {
                wrong("expected a recording for --svg, because it contains the drawing, found a learned map")
            }
            (Self::Learned(..), None) => wrong(
                "expected --output with a file for the result, because the input is a learned map itself",
            ),
            (_, Some(output)) => Ok(output.clone()),
            (Self::Recording(whole), None) => Ok(whole.name().with_extension("learned")),
        }
    }

    /// Returns what was learned and, from a recording, the drawing that was used.
    fn learned(&self) -> Result<(Learned, Option<DrawnMap>), Failure> {
        let whole = match self {
            Self::Learned(_, learned) => return Ok((Learned::clone(learned), None)),
            Self::Recording(whole) => whole,
        };
        let read = || {
            let recording = super::open(whole.path())?;
            if recording.index().or_input()?.is_cut_off() {
                // The drive may go on: this is no damage.
                say!(
                    "notice: {} is still being written, or is incomplete; the map covers everything up to the last message",
                    whole.name().display()
                );
            }
            of(&recording).with_context(|| whole.name().display().to_string()).or_input()
        };
        let (learned, drawing) = whole.known(read())?;
        Ok((learned, Some(drawing)))
    }
}

/// Returns true if a file begins like a JSON file. No recording does.
fn begins_as_json(file: &Path) -> bool {
    let first = || {
        let mut head = [0; 64];
        // Opening a pipe would wait for its writer.
        let count = std::fs::File::open(file.is_file().then_some(file)?).ok()?.read(&mut head).ok()?;
        head[..count].iter().copied().find(|byte| !byte.is_ascii_whitespace())
    };
    first() == Some(b'{')
}

/// What was added from another learned map.
struct Merged {
    file: PathBuf,
    /// The file name of its drawing.
    drawing: String,
    gain: Gain,
}

impl Merged {
    fn json(&self) -> serde_json::Value {
        let Gain { motion, agreement, rival, floor_m2, goals, left_out } = &self.gain;
        json!({
            "file": self.file.display().to_string(),
            "drawing": self.drawing,
            "motion": { "x_m": motion.x, "y_m": motion.y, "yaw_deg": motion.yaw_rad.to_degrees() },
            "common_floor_m2": agreement.floor_m2,
            "common_walls_m": agreement.wall_m,
            "agreement": agreement.share(),
            "residual_m": agreement.residual_m,
            "rival": rival,
            "added_floor_m2": floor_m2,
            "added_goals": goals,
            "left_out_goals": left_out,
        })
    }

    fn print(&self) -> anyhow::Result<()> {
        let Gain { motion, agreement, floor_m2, goals, left_out, .. } = &self.gain;
        let (file, degrees) = (self.file.display(), motion.yaw_rad.to_degrees());
        out!(
            "merged     {file}, by {}: moved by ({:.2}, {:.2}) m and turned by {degrees:.1}°",
            self.drawing,
            motion.x,
            motion.y
        )?;
        out!(
            "           {:.0} m² of floor and {:.0} m of walls in common; {:.0} % of the walls agree, to {:.2} m",
            agreement.floor_m2,
            agreement.wall_m,
            100.0 * agreement.share(),
            agreement.residual_m
        )?;
        let names = |names: &[String]| match names {
            [] => "no goals".to_owned(),
            [name] => format!("1 goal ({name})"),
            names => format!("{} goals ({})", names.len(), names.join(", ")),
        };
        out!("           added {floor_m2:.0} m² of floor and {}", names(goals))?;
        if !left_out.is_empty() {
            out!(
                "           left out {}: a learned map has room for {MAX_TASKS} goals, and each needs a place in the drawing",
                names(left_out)
            )?;
        }
        Ok(())
    }
}

/// Rejects outputs that would overwrite an input, a recording or each other.
fn refuse_outputs(inputs: &[&PathBuf], outputs: [Option<&PathBuf>; 4]) -> Result<(), Failure> {
    let outputs: Vec<_> = outputs.into_iter().flatten().collect();
    for (i, output) in outputs.iter().enumerate() {
        super::refuse_to_overwrite(inputs.iter().copied(), output)?;
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

fn report(
    output: &Path,
    learned: &Learned,
    merged: &[Merged],
    exports: &[PathBuf],
    json: bool,
) -> anyhow::Result<()> {
    let seen_m2 = learned.map.free_cells() as f64 * CELL_M * CELL_M;
    let reached = learned.goals.iter().filter(|goal| goal.reached).count();
    let paths: Vec<_> = exports.iter().map(|path| path.display().to_string()).collect();
    if json {
        return out!(
            "{}",
            json!({
                "learned": output.display().to_string(),
                "drawing": learned.drawing.file,
                "seen_m2": seen_m2,
                "goals": learned.goals,
                "merged": merged.iter().map(Merged::json).collect::<Vec<_>>(),
                "exports": paths,
            })
        );
    }
    out!("learned    {}", output.display())?;
    out!("drawing    {}", learned.drawing.file)?;
    merged.iter().try_for_each(Merged::print)?;
    out!("seen       {seen_m2:.0} m² of floor; {reached} of {} goals reached", learned.goals.len())?;
    paths.iter().try_for_each(|path| out!("exported   {path}"))
}
