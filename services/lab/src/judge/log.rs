//! Collects the messages of a mission that judging and drawing need. They come either from a mission that is being driven, or from
//! a recording, which is read in one pass over the chunks that contain them.

use std::collections::BTreeMap;

use sketchnav_directions::messages::{
    CHART, DIRECTIONS, ITINERARY, Itinerary, JOURNEY, Journey, WHEREABOUTS, Whereabouts,
};
use sketchnav_landmarks::messages::{
    LANDMARK_PROGRESS, LANDMARK_ROUTE, LANDMARK_VIEW, LandmarkProgress, LandmarkView,
};
use sketchnav_schemas::channels::{
    COMMAND, CONTACT, ChannelSpec, FAULTS, HEALTH, LATENCY, MARKERS, ORDERS, PEOPLE, Role, SCAN, STATUS,
    TRUTH, of_topic, sensors,
};
use sketchnav_schemas::codes::{Order, TaskState, Tracking};
use sketchnav_schemas::geometry::{Point, Pose, Sketch, World};
use sketchnav_schemas::message::{
    Contact, Fault, GroundTruth, Health, Latency, MarkerView, MissionStatus, People, VelocityCommand,
};
use sketchnav_schemas::mission::{Place, Task};
use sketchnav_schemas::run::RunConfig;
use sketchnav_sketch::messages::{
    CORRESPONDENCE, Correspondence, ESTIMATE, PARTICLES, Particles, PoseEstimate, ROUTE, Route, RouteTask,
    SKETCH, SketchMap,
};

use sketchnav_directions::stages::sketcher::dots_of;
use sketchnav_navigators::method_of;
use sketchnav_recordings::RecordingError;
use sketchnav_recordings::faults::FaultInfo;
use sketchnav_recordings::reader::{RawMessage, Recording, Selection};
use sketchnav_recordings::rejected::Rejections;
use sketchnav_recordings::writer::topic_name;
use sketchnav_rehearsal::{Onlooker, Tap};
use sketchnav_sketch::mission::SketchMission;
use sketchnav_sketch::planner::ROOMS;

/// An estimate, and the true pose of the same instant.
#[derive(Debug, Clone, Copy)]
pub struct Instant {
    /// Simulation time, in nanoseconds.
    pub stamp_ns: u64,
    /// True pose of the robot.
    pub truth: Pose<World>,
    /// The robot's estimated pose.
    pub estimate: Pose<Sketch>,
    /// Local scales along and across the walls, in pixels per metre.
    pub scales_pxpm: [f64; 2],
    /// Kish's effective sample size.
    pub effective_sample_size: f64,
    /// The localizer's measure of how well the scan fits.
    pub fit: f64,
    /// Code of a [`sketchnav_schemas::codes::Tracking`].
    pub tracking: u32,
}

/// The messages of a mission. All of them are kept in memory, at a few kilobytes for each instant and ten for each sample of the
/// particles.
#[derive(Debug, Clone, Default)]
pub struct Log {
    /// The channel `truth`.
    pub truth: Vec<GroundTruth>,
    /// The channel `status`. If people draw, only the part that belongs to the last drive.
    pub status: Vec<MissionStatus>,
    /// The channel `people`.
    pub people: Vec<People>,
    /// The channel `markers`.
    pub markers: Vec<MarkerView>,
    /// The channel `journey`.
    pub journeys: Vec<Journey>,
    /// The map-maker's itinerary, with the landmarks that its maps refer to.
    pub itinerary: Option<Box<Itinerary>>,
    /// Positions of the dots as the map-maker saw them, as x and y in metres.
    pub seen_dots: Vec<[f64; 2]>,
    /// The custom maps as text.
    pub directions: Option<String>,
    /// Positions of the landmarks in the list of a navigator with a belief, as x and y in metres.
    pub chart: Vec<[f64; 2]>,
    /// The channel `whereabouts`.
    pub whereabouts: Vec<Whereabouts>,
    /// The channel `contact`.
    pub contacts: Vec<Contact>,
    /// The channel `estimate`, only for the last drawing.
    pub estimates: Vec<PoseEstimate>,
    /// The channel `command`.
    pub commands: Vec<VelocityCommand>,
    /// The route past landmarks as the sketcher published it. Empty if there is none.
    pub landmark_route: Vec<u8>,
    /// The channel `landmark_view`.
    pub landmark_views: Vec<LandmarkView>,
    /// The channel `landmark_progress`.
    pub landmark_progress: Vec<LandmarkProgress>,
    /// The channel `particles`, only for the last drawing. Recordings are read without it, except by [`Log::read_all`].
    pub particles: Vec<Particles>,
    /// The channel `correspondence`, only for the last drawing. Recordings are read without it, except by [`Log::read_all`].
    pub correspondences: Vec<Correspondence>,
    /// The channel `health`.
    pub health: Vec<Health>,
    /// The channel `latency`.
    pub latencies: Vec<Latency>,
    /// The channel `faults`.
    pub faults: Vec<Fault>,
    /// The estimates of a recording that have a true pose of the same instant.
    pub instants: Vec<Instant>,
    /// The invalid messages in a recording, which processes ignore.
    pub rejected: Rejections,
    /// Number of scans.
    pub scans: u64,
    /// Number of scans that a command responded to.
    pub answered_scans: u64,
    /// The tasks. If several lists were sent, only the last one is kept.
    pub route: Option<Box<Route>>,
    /// The drawing and its cells. If people drew several, only the last one is kept.
    pub sketch: Option<(SketchMap, Vec<u8>)>,
    /// Simulation time in nanoseconds at which people last started the robot on the first task.
    pub(crate) began_ns: Option<u64>,
    /// Number of the scan that the last command responded to.
    pub(crate) last_answered: u64,
}

/// The channels that verdicts and figures need.
const NEEDED: [&ChannelSpec; 19] = [
    CHART.spec,
    WHEREABOUTS.spec,
    DIRECTIONS.spec,
    ITINERARY.spec,
    JOURNEY.spec,
    PEOPLE.spec,
    MARKERS.spec,
    TRUTH.spec,
    STATUS.spec,
    CONTACT.spec,
    ESTIMATE.spec,
    HEALTH.spec,
    LATENCY.spec,
    FAULTS.spec,
    ROUTE.spec,
    SKETCH.spec,
    SCAN.spec,
    COMMAND.spec,
    ORDERS.spec,
];

/// Further channels, which pages show.
const SHOWN: [&ChannelSpec; 5] =
    [PARTICLES.spec, CORRESPONDENCE.spec, LANDMARK_ROUTE.spec, LANDMARK_VIEW.spec, LANDMARK_PROGRESS.spec];

impl Log {
    /// Returns the method by which the robot drove in this run. If a mission by a drawing does not name a method, the kind of the
    /// drawing determines it, which is known only after the drawing was read.
    pub fn method<'a>(&self, run: &'a RunConfig) -> &'a str {
        let by_drawing =
            || Some(SketchMission::of(&run.mission).ok()?.method_in(self.map()?.origin()).word());
        by_drawing().unwrap_or_else(|| method_of(run))
    }

    /// Describes how the planner drove, if it did not always drive by the mission's method.
    pub fn driven(&self) -> Option<&'static str> {
        let drove_by_rooms = self.status.iter().any(|status| status.reason.as_str() == ROOMS);
        drove_by_rooms.then_some("outline (among rooms, it drives as beam does)")
    }

    /// Returns the goal of the task that was under way at that time.
    pub fn goal_at(&self, stamp_ns: u64) -> Option<Point<Sketch>> {
        let until = self.status.partition_point(|status| status.header.stamp_ns <= stamp_ns);
        let task = self.status[..until].last().map_or(0, |status| status.task as usize);
        let route = self.route.as_ref()?;
        route.points(route.tasks().get(task)?).last()
    }

    /// Reads a recording, except for the particles and the messages about landmarks.
    ///
    /// # Errors
    /// [`RecordingError`] if the recording cannot be read.
    pub fn read(recording: &Recording) -> Result<Self, RecordingError> {
        Self::of_channels(recording, &NEEDED)
    }

    /// Reads all channels of a recording that a log can contain.
    ///
    /// # Errors
    /// [`RecordingError`] if the recording cannot be read.
    pub fn read_all(recording: &Recording) -> Result<Self, RecordingError> {
        Self::of_channels(recording, &[&NEEDED[..], &SHOWN].concat())
    }

    fn of_channels(recording: &Recording, channels: &[&ChannelSpec]) -> Result<Self, RecordingError> {
        // Sensor channels are read only so that invalid messages are found.
        let names = channels.iter().map(|spec| spec.name).chain(sensors().map(|spec| spec.name));
        let topics = names.map(topic_name);
        let mut log = Self::default();
        for message in recording.select(Selection::of_topics(topics))? {
            log.take(&message?, recording)?;
        }
        log.forget_earlier_drawings();
        if recording.run().is_ok_and(|run| run.pad.draws()) {
            log.forget_earlier_drives();
        }
        log.instants = instants(&log.truth, &log.estimates);
        Ok(log)
    }

    /// Removes messages that refer to a drawing other than the last one, or to none.
    fn forget_earlier_drawings(&mut self) {
        let drawn_ns = self.map().map_or(0, |map| map.header.stamp_ns);
        self.estimates.retain(|e| e.header.stamp_ns >= drawn_ns && e.tracking != Tracking::Waiting.code());
        self.particles.retain(|set| set.header.stamp_ns >= drawn_ns);
        self.correspondences.retain(|found| found.header.stamp_ns >= drawn_ns);
    }

    /// Removes messages about tasks from before the last tasks began, whether they concern other tasks or an earlier drive of the
    /// same tasks. If the last tasks were sent but not driven, nothing is left.
    fn forget_earlier_drives(&mut self) {
        let sent_ns = self.route.as_ref().map_or(0, |route| route.header.stamp_ns);
        let Some(began_ns) = self.began_ns.filter(|began_ns| *began_ns > sent_ns) else {
            self.status.clear();
            return;
        };
        // The planner obeys an order a few steps after it was given.
        let is_begin = |status: &MissionStatus| {
            let is_driving = TaskState::from_code(status.state) == Some(TaskState::Driving);
            status.header.stamp_ns > began_ns && status.task == 0 && is_driving
        };
        let first = self.status.iter().position(is_begin).unwrap_or(self.status.len());
        self.status.drain(..first);
    }

    /// Returns the run with the tasks that people drew last, if any. Where they lie in the true world is not known.
    #[must_use]
    pub fn with_drawn_tasks(&self, mut run: RunConfig) -> RunConfig {
        if let Some(route) = self.route.as_ref().filter(|_| run.pad.draws()) {
            let task = |task: &RouteTask| Task {
                name: task.name.as_str().to_owned(),
                there: Place::default(),
                time_limit_s: task.time_limit_s,
                given: Default::default(),
            };
            run.mission.task = route.tasks().iter().map(task).collect();
        }
        run
    }

    /// Returns the true pose of the robot at that time, or the last one before it.
    pub fn pose_at(&self, stamp_ns: u64) -> Option<Pose<World>> {
        let after = self.truth.partition_point(|truth| truth.header.stamp_ns <= stamp_ns);
        self.truth[..after].last().map(GroundTruth::pose)
    }

    /// Returns the drawing without its cells.
    pub fn map(&self) -> Option<&SketchMap> {
        self.sketch.as_ref().map(|(map, _)| map)
    }

    /// Returns the faults and recoveries of the processes.
    pub fn told_faults(&self) -> Vec<FaultInfo> {
        self.faults.iter().map(FaultInfo::new).collect()
    }

    /// Processes a message of a recording. Sensor messages other than markers are checked, and scans are counted, but they are not
    /// decoded.
    fn take(&mut self, raw: &RawMessage, recording: &Recording) -> Result<(), RecordingError> {
        let Some(spec) = of_topic(&raw.topic.name) else { return Ok(()) };
        self.rejected.look_at(raw, spec);
        if spec.role == Role::Sensor && *spec != *MARKERS.spec {
            self.scans += u64::from(*spec == *SCAN.spec);
            return Ok(());
        }
        let message = raw.decode_in(spec, recording.path())?;
        self.see(spec, message.bytes(), message.cells());
        Ok(())
    }

    /// Keeps the latest instructions and orders.
    fn see_instruction(&mut self, spec: &ChannelSpec, message: &[u8], cells: &[u8]) {
        if let Some(sketch) = SKETCH.message(spec, message) {
            self.sketch = Some((*sketch, cells.to_vec()));
        } else if let Some(route) = ROUTE.message(spec, message) {
            self.route = Some(Box::new(*route));
        } else if DIRECTIONS.message(spec, message).is_some() {
            self.directions = Some(String::from_utf8_lossy(cells).into_owned());
        } else if CHART.message(spec, message).is_some() {
            self.chart = dots_of(cells).map(|at| [at.x, at.y]).collect();
        } else if LANDMARK_ROUTE.message(spec, message).is_some() {
            self.landmark_route = cells.to_vec();
        } else if let Some(itinerary) = ITINERARY.message(spec, message) {
            self.itinerary = Some(Box::new(*itinerary));
            self.seen_dots = dots_of(cells).map(|at| [at.x, at.y]).collect();
        } else if let Some(order) = ORDERS.message(spec, message)
            && Order::from_code(order.order) == Some(Order::Start)
        {
            self.began_ns = Some(order.header.stamp_ns);
        }
    }

    /// Counts a scan as answered, but only once if several commands respond to it.
    fn answer(&mut self, command: &VelocityCommand) {
        let scan = command.header.source_seq;
        self.answered_scans += u64::from(scan > self.last_answered);
        self.last_answered = self.last_answered.max(scan);
    }
}

impl Tap for Log {
    fn see(&mut self, spec: &'static ChannelSpec, message: &[u8], cells: &[u8]) {
        self.truth.extend(TRUTH.message(spec, message));
        self.status.extend(STATUS.message(spec, message));
        self.people.extend(PEOPLE.message(spec, message));
        self.markers.extend(MARKERS.message(spec, message));
        self.journeys.extend(JOURNEY.message(spec, message));
        self.whereabouts.extend(WHEREABOUTS.message(spec, message));
        self.contacts.extend(CONTACT.message(spec, message));
        self.estimates.extend(ESTIMATE.message(spec, message));
        self.particles.extend(PARTICLES.message(spec, message));
        self.correspondences.extend(CORRESPONDENCE.message(spec, message));
        self.landmark_views.extend(LANDMARK_VIEW.message(spec, message));
        self.landmark_progress.extend(LANDMARK_PROGRESS.message(spec, message));
        self.health.extend(HEALTH.message(spec, message));
        self.latencies.extend(LATENCY.message(spec, message));
        self.faults.extend(FAULTS.message(spec, message));
        if let Some(command) = COMMAND.message(spec, message) {
            self.answer(command);
            self.commands.push(*command);
        }
        self.scans += u64::from(*spec == *SCAN.spec);
        self.see_instruction(spec, message, cells);
    }
}

impl Onlooker for Log {}

fn instants(truth: &[GroundTruth], estimates: &[PoseEstimate]) -> Vec<Instant> {
    let places: BTreeMap<u64, Pose<World>> = truth.iter().map(|m| (m.header.stamp_ns, m.pose())).collect();
    let beside = |estimate: &PoseEstimate| {
        let truth = places.get(&estimate.header.stamp_ns)?;
        Some(instant(*truth, estimate))
    };
    estimates.iter().filter(|estimate| estimate.is_placed()).filter_map(beside).collect()
}

fn instant(truth: Pose<World>, estimate: &PoseEstimate) -> Instant {
    Instant {
        stamp_ns: estimate.header.stamp_ns,
        truth,
        estimate: estimate.pose.pose(),
        scales_pxpm: [estimate.scale_a_pxpm, estimate.scale_b_pxpm],
        effective_sample_size: estimate.effective_sample_size,
        fit: estimate.fit,
        tracking: estimate.tracking,
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;

    /// Regression test: pictures of an early task in the report used to show the goal of the last one.
    #[test]
    fn the_goal_is_that_of_the_current_task() {
        let mut route: Box<Route> = Box::new(Zeroable::zeroed());
        route.task_count = 2;
        for (k, at) in [[10.0, 20.0], [30.0, 40.0]].into_iter().enumerate() {
            (route.tasks[k].first_point, route.tasks[k].point_count) = (k as u32, 1);
            route.points_px[k] = at;
        }
        let status = |stamp_ns, task| {
            let mut status = MissionStatus { task, ..Zeroable::zeroed() };
            status.header.stamp_ns = stamp_ns;
            status
        };
        let log = Log {
            status: vec![status(1, 0), status(5, 0), status(6, 1)],
            route: Some(route),
            ..Log::default()
        };
        let goals = [0, 5, 6, 9].map(|stamp_ns| log.goal_at(stamp_ns).map(|goal| goal.x));
        assert_eq!(goals, [Some(10.0), Some(10.0), Some(30.0), Some(30.0)]);
        assert_eq!(Log::default().goal_at(5), None);
    }
}
