//! The part of judging that concerns only runs in a drawing.

use std::collections::BTreeMap;
use std::path::Path;

use sketchnav_recordings::Recording;
use sketchnav_schemas::run::RunConfig;
use sketchnav_sketch::mission::SketchMission;

use super::anchors::Anchors;
use super::figures::MetricMap;
use super::homotopy::Correspondence;
use super::log::Log;

/// Returns, for each task with a drawn route, whether the true path was homotopic to the route with respect to the drawing. This
/// counts as success in Boniardi et al. 2016, IV and V. In the anchors, the table of the drawing has the name of the mission, and
/// that of the floor the name of the floor plan.
///
/// # Errors
/// Fails if the drawing cannot be read, or if the anchors do not match it.
pub fn homotopic(
    run: &RunConfig,
    files: &sketchnav_stage::Files<'_>,
    log: &Log,
    anchors: &Anchors,
) -> anyhow::Result<BTreeMap<String, bool>> {
    if run.pad.draws() {
        // Anchors come from a file, which cannot contain a drawing made during the run.
        return Ok(BTreeMap::new());
    }
    let (drawing, _) = sketchnav_sketch::sketcher::understand(run, files)?;
    let floor =
        run.mission.world.floor_plan.as_deref().or(run.mission.world.map.as_deref()).unwrap_or_default();
    let floor = Path::new(floor).file_name().unwrap_or_default().to_string_lossy().into_owned();
    let floor = floor.split('.').next().unwrap_or_default();
    let join = Correspondence::new(&anchors.of(&run.mission.name, floor, |at| drawing.from_image(at))?)?;
    let spans = super::spans(run.mission.task.len(), &log.status);
    let mut ways = BTreeMap::new();
    for (task, span) in SketchMission::of(&run.mission)?.tasks.iter().zip(spans) {
        let (Some(route), Some(span)) = (task.aim.route(), span) else { continue };
        let route: Vec<_> = route.iter().map(|&at| drawing.from_image(at)).collect();
        let way: Vec<_> = span.of(&log.truth).iter().map(|truth| truth.pose().position()).collect();
        ways.insert(task.name.clone(), join.is_homotopic(&way, &route));
    }
    Ok(ways)
}

/// Returns the scale and position of the drawing in the world, if the drawing is the world's own map.
pub fn map_of(recording: &Recording, run: &RunConfig) -> Option<MetricMap> {
    let map = Path::new(run.mission.world.map.as_ref()?);
    let drawing = SketchMission::of(&run.mission).ok()?.drawing;
    (Path::new(&drawing) == map).then_some(())?;
    let name = format!("world/{}", map.file_name()?.to_str()?);
    let yaml = recording.attachments().get(&name)?;
    let info = sketchnav_sim::ros_map::MapInfo::parse(std::str::from_utf8(&yaml.data).ok()?).ok()?;
    Some(MetricMap { resolution_m: info.resolution, origin_m: [info.origin[0], info.origin[1]] })
}
