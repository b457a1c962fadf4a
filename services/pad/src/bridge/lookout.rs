//! The view that pages show of a run, drawn by the navigator's lookout from its channels. If there is no
//! drawing, the robot's sensors are shown below it.

use sketchnav_runtime::{Node, RawReader};
use sketchnav_schemas::channels::{self, Role};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::lookout::{Lookout, Picture, Sensors, Sheet, Walls};
use sketchnav_stage::{Access, Incoming, Navigator};

/// The channels that lookouts receive, and the one or two lookouts, lowest layer first.
pub(super) struct Watch {
    access: Access,
    readers: Vec<RawReader>,
    layers: Vec<Box<dyn Lookout>>,
}

impl Watch {
    /// Opens only those channels of the sensors and of this navigator that the table lets the pad read.
    pub(super) fn open(node: &Node, navigator: &Navigator, run: &RunConfig) -> anyhow::Result<Self> {
        let own = navigator.lookout.map(|make| make(run));
        let mut layers: Vec<Box<dyn Lookout>> = Vec::new();
        if own.as_ref().is_none_or(|own| own.sheet() == Sheet::Robot) {
            layers.push(Box::new(Sensors::new(&run.robot)));
        }
        layers.extend(own);
        let incoming = channels::of_kind(navigator.kind).filter(|spec| {
            spec.readers.contains(&Process::Pad) && (spec.kind.is_some() || spec.role == Role::Sensor)
        });
        let readers = incoming.map(|spec| node.raw_reader(spec)).collect::<Result<_, _>>()?;
        Ok(Self { access: Access::new(Process::Pad, navigator.kind), readers, layers })
    }

    /// Passes what has arrived to the lookouts. Returns true if there is anything new.
    pub(super) fn receive(&mut self) -> anyhow::Result<bool> {
        let mut is_new = false;
        for reader in &mut self.readers {
            while let Some(sample) = reader.receive_valid()? {
                let message = Incoming::new(&self.access, reader.spec(), sample.message(), sample.cells());
                self.layers.iter_mut().try_for_each(|lookout| lookout.receive(&message))?;
                is_new = true;
            }
        }
        Ok(is_new)
    }

    pub(super) fn take_walls(&mut self) -> Option<Walls> {
        self.layers.iter_mut().find_map(|lookout| lookout.take_walls())
    }

    pub(super) fn is_ready(&self) -> bool {
        self.layers.iter().all(|lookout| lookout.is_ready())
    }

    pub(super) fn question(&self) -> Option<Vec<[f64; 2]>> {
        self.layers.iter().find_map(|lookout| lookout.question())
    }

    /// The sheet of the topmost lookout.
    pub(super) fn sheet(&self) -> Sheet {
        self.layers.last().map_or(Sheet::Robot, |lookout| lookout.sheet())
    }

    pub(super) fn draw(&mut self) -> Picture {
        let mut picture = Picture::default();
        self.layers.iter_mut().for_each(|lookout| lookout.draw(&mut picture));
        picture
    }
}
