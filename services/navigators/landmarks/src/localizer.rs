//! The localizer stage of `landmarks`, which publishes the robot's view and its estimated pose in the sketch once per tick.

use rand::RngExt;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::channels::{MARKERS, ODOMETRY, SCAN, SONAR};
use sketchnav_schemas::geometry::Point;
use sketchnav_schemas::message::{MarkerView, MissionCommand, PoseM};
use sketchnav_schemas::run::RunConfig;
use sketchnav_schemas::seed;
use sketchnav_stage::{Denied, Incoming, Instant, Outbox, Stage, StageError};

use crate::error::LandmarksError;
use crate::instructions::{Instructions, Marked};
use crate::labels::Labels;
use crate::locator::{Located, Locating, Locator};
use crate::messages::{LANDMARK_ROUTE, LANDMARK_VIEW, LandmarkView};
use crate::mission::{LandmarksMission, Method, Parameters};
use crate::motion::Motion;
use crate::perception::{Perceiving, Perception, Seen};
use crate::ring::{Ring, RingSensor};
use crate::sketch::Sketch;
use crate::view;

/// Name of the belief's random stream.
const STREAM: &str = "landmarks/belief";

/// Localizer of a run.
pub struct Localizer {
    method: Method,
    locating: Locating,
    seed: u64,
    ring: Ring,
    perception: Perception,
    motion: Motion,
    /// Number of the last route received, or 0 if there has been none.
    route: u64,
    /// Whether people draw the route while the mission runs. The robot then reports its view before there is a route.
    is_drawn: bool,
    sketch: Option<Sketch>,
    locator: Option<Locator>,
    /// The markers on objects, sorted by number.
    markers: Vec<Marked>,
    /// Recognizes objects by their markers, if the robot drives by landmark states.
    labels: Option<Labels>,
}

/// State of the localizer, as read back from a checkpoint.
#[derive(Debug, Deserialize)]
pub struct State {
    route: u64,
    motion: Motion,
    located: Option<Located>,
    labels: Option<Labels>,
}

/// Borrowed counterpart of [`State`], with the same fields, from which a checkpoint is written.
#[derive(Debug, Serialize)]
struct StateView<'a> {
    route: u64,
    motion: &'a Motion,
    located: Option<&'a Located>,
    labels: Option<&'a Labels>,
}

impl Localizer {
    /// Creates the localizer of a run for its robot, with the parameters of its mission.
    ///
    /// # Errors
    /// [`LandmarksError`], which names the key or the sensor, if the robot or a parameter is unsuitable.
    pub fn new(run: &RunConfig) -> Result<Self, LandmarksError> {
        let method = LandmarksMission::of(&run.mission)?.method;
        let parameters = Parameters::of(&run.mission)?.localizer;
        let ring = Ring::of(&run.robot)?;
        let settings = Perceiving {
            robot_m: 2.0 * run.robot.radius_m,
            ring_m: ring.ring_m(),
            range_max_m: ring.range_max_m(),
            ..parameters.perception
        };
        let perception = Perception::nomad(settings)
            .map_err(|cause| LandmarksError::Input { file: "parameters.localizer".into(), cause })?;
        let (locating, motion) = (parameters.locating(), Motion::default());
        Ok(Self {
            method,
            locating,
            seed: run.seed,
            ring,
            perception,
            motion,
            route: 0,
            is_drawn: run.pad.draws(),
            sketch: None,
            locator: None,
            markers: Vec::new(),
            labels: None,
        })
    }

    /// Processes the markers in view that are on landmarks.
    fn see_markers(&mut self, view: &MarkerView) {
        let Self { markers, locator, labels, .. } = self;
        let markers = &*markers;
        let known = view.markers().iter().filter_map(|seen| {
            let i = markers.binary_search_by_key(&seen.id, |known| known.marker).ok()?;
            Some((i, Point::from([seen.x_m, seen.y_m].map(f64::from))))
        });
        if let Some(labels) = labels {
            known.clone().for_each(|(i, place)| labels.see(i, place));
        }
        if let Some(locator) = locator {
            locator.see_markers(known.map(|(i, place)| (markers[i].landmark, place)));
        }
    }

    /// Returns the objects in view, each with the landmark that it has been recognized as.
    fn objects(&self) -> impl Iterator<Item = Seen> {
        let (sectors, settings) = (self.ring.sectors(), self.perception.settings());
        self.perception.last_seen().iter().map(move |seen| {
            let known = self.labels.as_ref();
            let landmark = known.and_then(|labels| labels.landmark(seen, &sectors, &self.markers, settings));
            Seen { landmark, ..*seen }
        })
    }

    fn write(&self, view: &mut LandmarkView) {
        view.sectors_m = self.ring.sectors();
        view::write_objects(self.objects(), view);
        match &self.locator {
            Some(locator) => {
                view::write_estimate(&locator.estimate(), view);
                view.sure_count = locator.sure_places() as u32;
                let places = locator.places();
                view.place_count = places.len().min(view.places_m.len()) as u32;
                for (at, place) in view.places_m.iter_mut().zip(places) {
                    *at = [place.x as f32, place.y as f32];
                }
            }
            None => {
                view.in_sketch = PoseM { orientation_w: 1.0, ..view.in_sketch };
                view.stretch = 1.0;
            }
        }
    }
}

/// Passes the latest measurement of the ring's own sensor to the ring. Returns true if it has arrived since the previous instant,
/// which is not always the case, because other sensors of the robot may publish more often.
fn sense(ring: &mut Ring, instant: &Instant<'_>) -> Result<bool, Denied> {
    match ring.sensor() {
        RingSensor::Sonar => {
            instant.newest(SONAR)?.into_iter().for_each(|sonar| ring.receive(sonar));
            Ok(instant.fresh(SONAR)?.is_some())
        }
        RingSensor::Laser => {
            instant.newest(SCAN)?.into_iter().for_each(|scan| ring.see(scan));
            Ok(instant.fresh(SCAN)?.is_some())
        }
    }
}

impl Stage for Localizer {
    const FORM: &'static str = "landmarks localizer 7";
    type State = State;

    fn receive(&mut self, message: &Incoming<'_>) -> Result<(), StageError> {
        if let Some(route) = message.on(LANDMARK_ROUTE)? {
            let instructions = Instructions::read(message.cells())?;
            let seed = seed::stream(self.seed, STREAM).random();
            self.markers = instructions.markers;
            let has_labels = self.method == Method::Chronis2007 && !self.markers.is_empty();
            self.labels = has_labels.then(|| Labels::new(self.markers.len()));
            let locate = |sketch: &Sketch| Locator::new(sketch, self.locating, seed);
            self.locator = instructions.sketch.as_ref().map(locate).transpose()?;
            (self.sketch, self.route) = (instructions.sketch, route.header.seq);
        } else if let Some(here) = message.order()?.and_then(MissionCommand::here)
            && let (Some(locator), Some(sketch)) = (&mut self.locator, &self.sketch)
        {
            locator.place(sketch.place(&here), here.yaw_rad);
        }
        Ok(())
    }

    fn is_ready(&self) -> bool {
        self.route > 0 || self.is_drawn
    }

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let Some(odometry) = instant.newest(ODOMETRY)? else { return Ok(()) };
        let [moved_m, turned_rad] = self.motion.to(&odometry.pose());
        let is_fresh = sense(&mut self.ring, instant)?;
        self.perception.see(&self.ring.sectors())?;
        if let Some(labels) = &mut self.labels {
            labels.moved(moved_m, turned_rad);
        }
        if let Some(view) = instant.fresh(MARKERS)?.filter(|_| !self.markers.is_empty()) {
            self.see_markers(view);
        }
        if let Some(locator) = &mut self.locator {
            let returns = self.ring.returns();
            locator.step(moved_m, turned_rad, is_fresh.then_some(&returns));
        }
        let odometry = odometry.pose;
        out.send(LANDMARK_VIEW, |view| {
            view.odometry = odometry;
            self.write(view);
        })?;
        Ok(())
    }

    fn state(&self) -> impl Serialize {
        StateView {
            route: self.route,
            motion: &self.motion,
            located: self.locator.as_ref().map(Locator::located),
            labels: self.labels.as_ref(),
        }
    }

    fn restore(&mut self, state: State) -> Result<(), StageError> {
        self.motion = state.motion;
        // If people draw, a newer route may have arrived instead.
        if state.route == self.route {
            if let (Some(locator), Some(located)) = (&mut self.locator, state.located) {
                locator.restore(located);
            }
            self.labels = state.labels;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use sketchnav_schemas::channels::ChannelSpec;
    use sketchnav_schemas::codes::Process;
    use sketchnav_schemas::message::{LaserScan, SonarScan};
    use sketchnav_schemas::robot::Robot;
    use sketchnav_stage::{Access, Inputs, Reading};

    use super::*;

    /// An old sonar message together with a new laser scan.
    struct OldSonarNewScan(SonarScan, Box<LaserScan>);

    impl Inputs for OldSonarNewScan {
        fn newest(&self, spec: &ChannelSpec) -> Option<Reading<'_>> {
            let of = |message, is_fresh| Some(Reading { message, cells: &[], is_fresh });
            match spec {
                spec if *spec == *SONAR.spec => of(bytemuck::bytes_of(&self.0), false),
                spec if *spec == *SCAN.spec => of(bytemuck::bytes_of(&*self.1), true),
                _ => None,
            }
        }
    }

    /// On a robot with both sensors, each laser scan used to make the belief process the same old sonar reading again.
    #[test]
    fn only_the_ring_s_own_sensor_is_news() {
        const NOMAD: &str = include_str!("../../../../sim/robots/nomad200.toml");
        const ROBOTINO: &str = include_str!("../../../../sim/robots/robotino.toml");
        let [nomad, robotino] = [NOMAD, ROBOTINO].map(|text| Robot::parse(text).unwrap());
        let both = Robot { laser: robotino.laser.clone(), ..nomad };
        let inputs = OldSonarNewScan(SonarScan::zeroed(), bytemuck::zeroed_box());
        let access = Access::new(Process::Localizer, "landmarks");
        let instant = Instant::new(&access, 1, 0, &inputs);
        assert!(!sense(&mut Ring::of(&both).unwrap(), &instant).unwrap());
        assert!(sense(&mut Ring::of(&robotino).unwrap(), &instant).unwrap());
    }
}
