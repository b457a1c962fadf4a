//! `sketchnav pad --study` runs a user study. Participants draw on the page one after another. Each gets a
//! new system, so that the robot is back at its start. When a participant has answered, the drive is judged
//! and the pages are written.

mod page;

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::Context;
use sketchnav_files::Disk;
use sketchnav_lab::judge::log::Log;
use sketchnav_lab::judge::{self, Verdict};
use sketchnav_lab::picture::{self, FloorPicture, FloorShapes, TaskMark, TaskPicture};
use sketchnav_lab::sections;
use sketchnav_pad::study::folder::{self, Everyone, PAGE, PLACE, RECORDINGS, TABLE};
use sketchnav_pad::study::record::{Drive, Facts, Kept, Outcome as Judged, VERSION};
use sketchnav_pad::study::{Folder, tables};
use sketchnav_recordings::Recording;
use sketchnav_recordings::sources::RecordedRun;
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::geometry::{Point, Pose, wrap_angle};
use sketchnav_schemas::mission::{Mission, Place};

use crate::args::PadOptions;
use crate::failure::{Failure, OrInput, Outcome, story};
use crate::link::Link;
use crate::output::{out, say};
use crate::pad;
use crate::recordings::whole::Whole;

/// Time for which the page thanks a participant before the system is ended for the next one.
const THANKS: Duration = Duration::from_secs(3);
/// The name of the picture that shows where the robot was in the drawing. It is written beside the picture of the true
/// floor.
const IN_DRAWING: &str = "sketch.svg";
/// The name of the picture of the true floor.
const ON_FLOOR: &str = "floor.svg";

/// Serves the page to one participant after another, until a person ends it.
pub fn run(folder: &Path, options: &PadOptions) -> Result<Outcome, Failure> {
    let folder = std::path::absolute(folder).context("the current folder no longer exists").or_input()?;
    if folder.is_dir() {
        folder::check_own(&folder).or_input()?;
    }
    let mut options = options.clone();
    options.system.out = folder.join(RECORDINGS);
    let link = Link::new(&options.site, options.token.clone()).or_input()?.of_study(folder.clone());
    let mut worst = Outcome::Success;
    loop {
        let stage = pad::place(&options)?;
        let prepared = prepare(&folder, &stage.1, &options);
        let study = prepared.inspect_err(|_| stage.0.discard())?;
        let before = study.finished().or_input()?.len();
        say!("{before} participants have finished; the next can begin");
        // A folder that cannot be read is reported once the system has ended.
        let has_finished = || study.finished().is_ok_and(|finished| finished.len() > before);
        let mut since = None;
        let mut is_over = || {
            since = since.or_else(|| has_finished().then(Instant::now));
            since.is_some_and(|since: Instant| since.elapsed() > THANKS)
        };
        let ended = pad::host(&options, &link, stage, &mut is_over)?;
        worst = if worst == Outcome::Success { ended.outcome } else { worst };
        write(&study)?;
        if ended.by_person {
            return Ok(worst);
        }
    }
}

/// Writes the table and the pages again.
pub fn report(folder: &Path) -> Result<Outcome, Failure> {
    let study = Folder::open(folder).or_input()?;
    let everyone = write(&study)?;
    let finished = everyone.kept.iter().filter(|kept| kept.answers.is_some()).count();
    out!("{} participants, {finished} finished; {} left out", everyone.kept.len(), everyone.left_out.len())?;
    out!("page       {}", study.path().join(PAGE).display())?;
    Ok(if everyone.left_out.is_empty() { Outcome::Success } else { Outcome::Loss })
}

/// Prepares the study's folder, including the picture that participants see before they draw. With a real
/// robot, there is no picture, because they see the place itself.
fn prepare(folder: &Path, mission: &Mission, options: &PadOptions) -> Result<Folder, Failure> {
    let shows_floor = !options.system.without.contains(&Process::World);
    let facts = Facts {
        version: VERSION,
        mission: mission.name.clone(),
        method: sketchnav_navigators::method(mission).to_owned(),
        start_heading_deg: mission.start.world_heading_deg,
        goal: mission.task.first().map(|task| task.there.clone()).unwrap_or_default(),
        shows_floor,
    };
    let study = Folder::create(folder, &facts).or_input()?;
    if shows_floor {
        let world = sketchnav_sim::files::world_in(&Disk, &mission.world).or_input()?;
        write_in(folder, PLACE, floor(&FloorShapes::of(&world), mission, &facts.goal))?;
    }
    Ok(study)
}

/// Draws the floor from above, with the start and the goal.
fn floor(shapes: &FloorShapes, mission: &Mission, goal: &Place) -> String {
    let [x, y] = goal.middle();
    let task = TaskPicture {
        name: "goal".to_owned(),
        marks: vec![Point::new(x, y)],
        place: picture::place_outline(goal),
        trail: Vec::new(),
        particles: Vec::new(),
        outcome: TaskMark::NotBegun,
    };
    let start = &mission.start;
    picture::floor(&FloorPicture {
        title: "The place from above",
        shapes,
        people: &[],
        views: &[],
        start: Pose::new(start.world[0], start.world[1], start.world_heading_deg.to_radians()),
        tasks: if goal.is_unknown() { &[] } else { std::slice::from_ref(&task) },
        contacts: &[],
    })
}

/// Judges the drives that have not been judged yet, and writes the table and the pages. Unreadable files are named
/// and left out.
fn write(study: &Folder) -> Result<Everyone, Failure> {
    let mut everyone = study.everyone().or_input()?;
    for kept in &mut everyone.kept {
        let (Some(drive), Some(_), None) = (&kept.drive, &kept.answers, &kept.outcome) else { continue };
        match judged(study, kept, drive) {
            Ok(outcome) => {
                study.write(&kept.participant.code, &outcome).or_input()?;
                kept.outcome = Some(outcome);
            }
            Err(failure) => everyone.left_out.push(format!(
                "{}: the drive is not judged: {}",
                study.of(&kept.participant.code).display(),
                story(&failure.into_error())
            )),
        }
    }
    for words in &everyone.left_out {
        say!("left out: {words}");
    }
    write_in(study.path(), TABLE, tables::csv(&everyone.kept).context(TABLE)?)?;
    write_in(study.path(), PAGE, page::study(study.facts(), &everyone))?;
    for kept in &everyone.kept {
        let folder = study.of(&kept.participant.code);
        let pictures = [IN_DRAWING, ON_FLOOR].map(|name| folder.join(name));
        let pictures = pictures
            .iter()
            .filter_map(|path| sketchnav_files::read_to_string(path, sketchnav_files::PAGE).ok());
        write_in(&folder, PAGE, page::participant(kept, &pictures.collect::<Vec<_>>()))?;
    }
    Ok(everyone)
}

/// Judges a participant's drive from its recording, and draws it.
fn judged(study: &Folder, kept: &Kept, drive: &Drive) -> Result<Judged, Failure> {
    let whole = Whole::of(&study.path().join(&drive.recording))?;
    let recording = Recording::open(whole.path()).or_input()?;
    let log = Log::read_all(&recording).or_input()?;
    let RecordedRun { run, files } = RecordedRun::of(&recording).or_input()?;
    let mut run = log.with_drawn_tasks(run);
    let last = run.mission.task.last_mut();
    last.context("expected a recording with a path, found none in it").or_input()?.there =
        study.facts().goal.clone();
    let verdict = judge::judge(&run.mission, &log.truth, &log.status, &log.contacts);
    let folder = study.of(&kept.participant.code);
    if let Some(svg) = sections::believed(&run, &log, &verdict)? {
        write_in(&folder, IN_DRAWING, svg)?;
    }
    write_in(&folder, ON_FLOOR, sections::true_ground(&run, &files, &log, &verdict)?.1)?;
    let map = log.map().context("expected a recording with a drawing, found none in it").or_input()?;
    let heading_rad = map.start.pose().yaw_rad;
    outcome(&verdict, heading_rad, study.facts()).context("expected a recording with a drive").or_input()
}

/// Returns the outcome of a drive whose drawn start has this heading, or `None` if the drive had no task.
fn outcome(verdict: &Verdict, heading_rad: f64, facts: &Facts) -> Option<Judged> {
    let last = verdict.tasks.last()?;
    let decisive = verdict.tasks.iter().find(|task| !task.reached).unwrap_or(last);
    let turned_deg = wrap_angle(heading_rad - facts.start_heading_deg.to_radians()).to_degrees();
    Some(Judged {
        success: verdict.success,
        state: decisive.state.clone(),
        reason: decisive.reason.clone(),
        time_s: verdict.tasks.iter().map(|task| task.time_s).sum(),
        path_m: verdict.tasks.iter().map(|task| task.path_m).sum(),
        final_error_m: last.final_error_m,
        rotation_deg: (turned_deg * 10.0).round() / 10.0,
    })
}

fn write_in(folder: &Path, name: &str, content: impl AsRef<[u8]>) -> Result<(), Failure> {
    let path = folder.join(name);
    sketchnav_files::write(&path, content).with_context(|| path.display().to_string()).or_input()
}

#[cfg(test)]
mod tests {
    use sketchnav_lab::judge::TaskVerdict;

    use super::*;

    fn task(reached: bool, state: &str) -> TaskVerdict {
        TaskVerdict {
            name: String::new(),
            reached,
            state: state.into(),
            reason: String::new(),
            time_s: 4.0,
            path_m: 2.0,
            final_error_m: Some(0.5),
            collisions: 0,
        }
    }

    fn facts(start_heading_deg: f64) -> Facts {
        let (mission, method) = ("court".into(), "outline".into());
        let goal = Place::default();
        Facts { version: VERSION, mission, method, start_heading_deg, goal, shows_floor: true }
    }

    /// A participant who holds the plan upside down draws a robot that faces left, although it actually faces right.
    #[test]
    fn an_outcome_has_the_end_and_the_rotation_of_the_drawing() {
        let tasks = vec![task(true, "reached"), task(false, "lost"), task(false, "not begun")];
        let verdict = Verdict { success: false, tasks, sim_seconds: 9.0 };
        let judged = outcome(&verdict, std::f64::consts::PI, &facts(0.0)).unwrap();
        assert_eq!((judged.success, judged.state.as_str(), judged.path_m), (false, "lost", 6.0));
        assert_eq!(judged.rotation_deg.abs(), 180.0);
        let turned = outcome(&verdict, 100_f64.to_radians(), &facts(-170.0)).unwrap();
        assert_eq!(turned.rotation_deg, -90.0);
        let nothing = Verdict { success: true, tasks: Vec::new(), sim_seconds: 0.0 };
        assert_eq!(outcome(&nothing, 0.0, &facts(0.0)), None, "no success without a drive");
    }
}
