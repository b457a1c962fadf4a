//! Converts between what the robot sees and the messages that describe it.

use sketchnav_qualitative::hof::Surround;
use sketchnav_schemas::geometry::Pose;
use sketchnav_schemas::message::PoseM;

use crate::belief::Estimate;
use crate::drawn::{Drawn, DrawnMetres, Stretch};
use crate::messages::{LandmarkEvent, LandmarkProgress, LandmarkView, SeenObject};
use crate::perception::Seen;
use crate::route::{DIRECTIONS, Place, Route, State};

/// First codes for places of objects around the robot: see [`SeenObject::place`].
const COMPLETELY: u32 = 16;
const FROM: u32 = 32;
const OPENING_AT: u32 = 48;

/// Returns the code of an object's place.
pub fn code(place: Place) -> u32 {
    match place {
        Place::Direction(direction) => u32::from(direction),
        Place::Surrounds(Surround::Completely) => COMPLETELY,
        Place::Surrounds(Surround::From(direction)) => FROM + direction as u32,
        Place::Surrounds(Surround::OpeningAt(direction)) => OPENING_AT + direction as u32,
    }
}

/// Returns the place for a code. Codes from 17 to 31, which [`code`] never returns, count as completely around the robot.
pub fn place(code: u32) -> Place {
    let direction = code % u32::from(DIRECTIONS);
    match code / u32::from(DIRECTIONS) {
        0 => Place::Direction(direction as u8),
        1 => Place::Surrounds(Surround::Completely),
        2 => Place::Surrounds(Surround::From(direction as usize)),
        _ => Place::Surrounds(Surround::OpeningAt(direction as usize)),
    }
}

/// Writes the objects seen into a message.
pub fn write_objects(seen: impl Iterator<Item = Seen>, view: &mut LandmarkView) {
    view.object_count = 0;
    for (object, seen) in view.objects.iter_mut().zip(seen) {
        let Seen { proximity_m, width, .. } = seen;
        let [first, count] = seen.beams.map(u32::from);
        let landmark = seen.landmark.map_or(0, |index| index as u32 + 1);
        *object = SeenObject { place: code(seen.place), first, count, landmark, proximity_m, width };
        view.object_count += 1;
    }
}

/// Returns the objects in a message.
pub fn objects(view: &LandmarkView) -> impl Iterator<Item = Seen> + '_ {
    view.objects().iter().map(|object| Seen {
        place: place(object.place),
        proximity_m: object.proximity_m,
        width: object.width,
        beams: [object.first as u16, object.count as u16],
        landmark: object.landmark.checked_sub(1).map(|index| index as usize),
    })
}

/// Returns the state that a progress message refers to: the one that has just been matched or, if none has, the next one.
pub fn state_of<'a>(route: &'a Route, progress: &LandmarkProgress) -> Option<&'a State> {
    let is_matched = progress.event == LandmarkEvent::Matched.code();
    route.states.get((progress.next as usize).saturating_sub(usize::from(is_matched)))
}

/// Returns the names of the objects that meet the state returned by [`state_of`], without duplicates.
pub fn met<'a>(route: &'a Route, progress: &LandmarkProgress) -> Vec<&'a str> {
    let state = state_of(route, progress);
    let mut names: Vec<&str> = Vec::new();
    for met in progress.met() {
        let relation = state.and_then(|state| state.relations.get(met.relation as usize));
        let name = relation.and_then(|relation| route.objects.get(relation.object)).map(String::as_str);
        names.extend(name.filter(|name| !name.is_empty() && !names.contains(name)));
    }
    names
}

/// Writes an estimated pose into a message.
pub fn write_estimate(estimate: &Estimate, view: &mut LandmarkView) {
    let Estimate { at, heading_rad, stretch, spread, fit } = estimate;
    view.in_sketch = PoseM::new(&Pose::<Drawn>::new(at.x, at.y, *heading_rad));
    (view.stretch, view.spread_m, view.fit) = (stretch.0, spread.0, fit.clamp(0.0, 1.0));
}

/// Returns the estimated pose in a message.
pub fn estimate(view: &LandmarkView) -> Estimate {
    let pose = view.in_sketch();
    Estimate {
        at: pose.position(),
        heading_rad: pose.yaw_rad,
        stretch: Stretch(view.stretch),
        spread: DrawnMetres(view.spread_m),
        fit: view.fit,
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;
    use crate::messages::MAX_SEEN_OBJECTS;

    #[test]
    fn places_survive_the_way() {
        let directions = (0..16).map(Place::Direction);
        let around = (0..16).flat_map(|d| [Surround::From(d), Surround::OpeningAt(d)]);
        let all = directions.chain(around.chain([Surround::Completely]).map(Place::Surrounds));
        for one in all {
            assert_eq!(place(code(one)), one);
        }
    }

    #[test]
    fn what_is_seen_survives_the_way() {
        let one = |direction| Seen {
            place: Place::Direction(direction),
            proximity_m: 1.5,
            width: 20.0,
            beams: [14, 3],
            landmark: None,
        };
        let seen = [one(15), Seen { landmark: Some(0), ..one(3) }];
        let mut view = LandmarkView::zeroed();
        write_objects(seen.into_iter(), &mut view);
        assert_eq!(objects(&view).collect::<Vec<_>>(), seen);
        write_objects([one(0); 40].into_iter(), &mut view);
        assert_eq!(objects(&view).count(), MAX_SEEN_OBJECTS);
    }
}
