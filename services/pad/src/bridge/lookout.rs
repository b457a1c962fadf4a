//! What a page sees of a navigator that has no drawing: its sensors, and what its localizer makes of them.
//!
//! A kind of its own shapes implements [`Lookout`] and has a line in [`open`]; any other shows its sensors.

use sketchnav_runtime::{Node, Reader};
use sketchnav_schemas::channels::{
    DESCRIPTION, ITINERARY, JOURNEY, LANDMARK_ROUTE, RELATIONS, SCAN, SKETCH, SONAR,
};
use sketchnav_schemas::message::{Description, Itinerary, Journey, LaserScan, Relations, SonarScan};
use sketchnav_schemas::robot::Robot;

use crate::feed::plane::Plane;
use crate::feed::scene::{Around, Shape};

/// Reads what a kind of navigator says, and draws it around the robot.
pub(super) trait Lookout {
    /// Takes what has come. Answers whether there is anything new.
    ///
    /// # Errors
    /// A channel that fails.
    fn receive(&mut self) -> anyhow::Result<bool>;

    /// Draws the newest.
    fn draw(&self, around: &Around, robot: &Robot, shapes: &mut Vec<Shape>);
}

/// What there is to see of the navigator `kind`, the lowest layer first; nothing where a drawing or a
/// sketch is shown.
pub(super) fn open(node: &Node, kind: &str, robot: &Robot) -> anyhow::Result<Vec<Box<dyn Lookout>>> {
    if [SKETCH.spec, LANDMARK_ROUTE.spec].iter().any(|spec| spec.belongs_to(kind)) {
        return Ok(Vec::new());
    }
    let mut layers: Vec<Box<dyn Lookout>> = vec![Box::new(Sensors::open(node, robot)?)];
    if RELATIONS.spec.belongs_to(kind) {
        layers.push(Box::new(Corridor { reader: node.reader(RELATIONS)?, newest: None }));
    }
    if JOURNEY.spec.belongs_to(kind) {
        layers.push(Box::new(Directions::open(node)?));
    }
    Ok(layers)
}

/// The robot's laser and sonars.
struct Sensors {
    scans: Option<Reader<LaserScan>>,
    sonars: Option<Reader<SonarScan>>,
    scan: Option<Box<LaserScan>>,
    sonar: Option<SonarScan>,
}

impl Sensors {
    fn open(node: &Node, robot: &Robot) -> anyhow::Result<Self> {
        let scans = robot.laser.as_ref().map(|_| node.reader(SCAN)).transpose()?;
        let sonars = robot.sonar.as_ref().map(|_| node.reader(SONAR)).transpose()?;
        Ok(Self { scans, sonars, scan: None, sonar: None })
    }
}

impl Lookout for Sensors {
    fn receive(&mut self) -> anyhow::Result<bool> {
        let mut is_new = false;
        while let Some(scan) = self.scans.as_mut().map_or(Ok(None), Reader::receive_valid)? {
            (self.scan, is_new) = (Some(Box::new(*scan)), true);
        }
        while let Some(scan) = self.sonars.as_mut().map_or(Ok(None), Reader::receive_valid)? {
            (self.sonar, is_new) = (Some(*scan), true);
        }
        Ok(is_new)
    }

    fn draw(&self, around: &Around, robot: &Robot, shapes: &mut Vec<Shape>) {
        shapes.extend(self.scan.as_ref().and_then(|scan| around.scan(scan, robot)));
        shapes.extend(self.sonar.iter().flat_map(|scan| around.sonar(scan)));
        shapes.extend(robot.camera.iter().flat_map(|camera| around.view_cone(camera)));
    }
}

/// The markers of a corridor.
struct Corridor {
    reader: Reader<Relations>,
    newest: Option<Box<Relations>>,
}

impl Lookout for Corridor {
    fn receive(&mut self) -> anyhow::Result<bool> {
        let mut is_new = false;
        while let Some(relations) = self.reader.receive_valid()? {
            (self.newest, is_new) = (Some(Box::new(*relations)), true);
        }
        Ok(is_new)
    }

    fn draw(&self, around: &Around, _: &Robot, shapes: &mut Vec<Shape>) {
        shapes.extend(self.newest.iter().flat_map(|relations| around.relations(relations)));
    }
}

/// A plane of dots with a journey by a custom map.
struct Directions {
    itineraries: Reader<Itinerary>,
    descriptions: Reader<Description>,
    journeys: Reader<Journey>,
    plane: Plane,
}

impl Directions {
    fn open(node: &Node) -> anyhow::Result<Self> {
        Ok(Self {
            itineraries: node.reader(ITINERARY)?,
            descriptions: node.reader(DESCRIPTION)?,
            journeys: node.reader(JOURNEY)?,
            plane: Plane::default(),
        })
    }
}

impl Lookout for Directions {
    fn receive(&mut self) -> anyhow::Result<bool> {
        let mut is_new = false;
        while let Some(itinerary) = self.itineraries.receive()? {
            self.plane.intend(&itinerary, itinerary.cells());
            is_new = true;
        }
        while let Some(description) = self.descriptions.receive_valid()? {
            (self.plane.description, is_new) = (Some(Box::new(*description)), true);
        }
        while let Some(journey) = self.journeys.receive_valid()? {
            (self.plane.journey, is_new) = (Some(*journey), true);
        }
        Ok(is_new)
    }

    fn draw(&self, around: &Around, robot: &Robot, shapes: &mut Vec<Shape>) {
        shapes.extend(robot.view.iter().flat_map(|view| self.plane.shapes(around, view.side_m)));
    }
}
