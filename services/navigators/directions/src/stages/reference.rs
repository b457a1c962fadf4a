//! Infers from the messages about a journey which landmark of the map the navigator believes its reference to be.
//!
//! Each entry except the first begins at a landmark that the map refers to, and that landmark is the navigator's reference while it
//! follows the entry. While the navigator moves a landmark to its corner, its messages do not yet name the entry at which it will
//! continue. This is the next entry, unless the number of recoveries has increased. In that case, it is unknown until the entry
//! begins.

use crate::custom_map::CustomMap;
use crate::custom_map::graph::Node;
use crate::messages::{Activity, Journey};

/// The state of the inference, updated with each message of a journey.
#[derive(Debug, Clone, Copy, Default)]
pub struct Reference {
    accepted: u32,
    recoveries: u32,
    node: Option<Node>,
}

impl Reference {
    /// Updates the inference with the next message of a journey that follows `map`. All messages must belong to the same task.
    pub fn update(&mut self, map: &CustomMap, journey: &Journey) {
        let accepts = journey.accepted > self.accepted;
        let turns = journey.recoveries > self.recoveries;
        let entry = journey.entry as usize;
        self.node = match Activity::from_code(journey.activity) {
            Some(Activity::Seek | Activity::Slide) => Some(Node::Entry(entry)),
            // The navigator looks around a landmark that should be the right one.
            Some(Activity::Verify) => map.right(entry).map(|edge| edge.to),
            Some(Activity::Adjust) if accepts => (!turns).then(|| map.next(entry)),
            Some(Activity::Rest) if accepts => Some(Node::Goal),
            Some(Activity::Recover) => None,
            Some(Activity::Adjust | Activity::Rest) | None => self.node,
        };
        (self.accepted, self.recoveries) = (journey.accepted, journey.recoveries);
    }

    /// Returns the node of the landmark that the navigator believes its reference to be, or `None` while this is unknown.
    pub fn node(&self) -> Option<Node> {
        self.node
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;

    #[test]
    fn the_landmark_is_that_of_the_entry_that_is_read_next() {
        let map: CustomMap = "(*, SW)\n(Isol, (2, NE, 4), (3, -), SW)\n(Isol, -)\n(Isol, -)".parse().unwrap();
        let mut reference = Reference::default();
        let mut after = |activity: Activity, entry: u32, accepted: u32, recoveries: u32| {
            let journey =
                Journey { activity: activity.code(), entry, accepted, recoveries, ..Journey::zeroed() };
            reference.update(&map, &journey);
            reference.node()
        };
        assert_eq!(after(Activity::Adjust, 0, 1, 0), Some(Node::Entry(1)));
        assert_eq!(after(Activity::Seek, 1, 1, 0), Some(Node::Entry(1)));
        assert_eq!(after(Activity::Verify, 1, 1, 0), Some(Node::Entry(2)), "the one that should be right");
        assert_eq!(after(Activity::Adjust, 1, 2, 1), None, "it branches, and does not say to where");
        assert_eq!(after(Activity::Adjust, 1, 2, 1), None);
        assert_eq!(after(Activity::Seek, 3, 2, 1), Some(Node::Entry(3)));
        assert_eq!(after(Activity::Rest, 3, 3, 1), Some(Node::Goal));
        assert_eq!(after(Activity::Rest, 3, 3, 1), Some(Node::Goal), "it hovers over the goal");
    }
}
