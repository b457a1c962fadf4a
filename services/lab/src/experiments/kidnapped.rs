//! The `…-kidnapped` suites repeat the drives of other suites, but somebody carries the robot on the way. It is set down where another
//! drive on the same floor begins, with any heading, and has to notice this and find out where that is.

use rand::RngExt;
use rand::seq::IndexedRandom;
use sketchnav_schemas::mission::Carry;
use sketchnav_schemas::seed;

use crate::error::EvalError;
use crate::experiments::single_drives::single_drives;
use crate::experiments::suite::Suite;
use crate::experiments::trial::Trial;
use crate::experiments::unmarked::FINDING_S;

/// Time after which the robot is carried, in seconds. In some drives, this is soon after the robot has set off, in others shortly
/// before it would arrive.
const CARRIED_S: std::ops::Range<f64> = 5.0..20.0;
/// Minimum distance between the start and where the robot is set down, in metres.
const CARRIED_M: f64 = 4.0;

/// Returns the suite whose drives are the tasks of `suite`, during which the robot is carried.
///
/// # Errors
/// [`EvalError`] if a mission of the suite is invalid.
pub fn of(suite: Suite) -> Result<Suite, EvalError> {
    let title = format!("{} On the way, the robot is carried elsewhere.", suite.title);
    let mut suite = single_drives(Suite { title, ..suite })?;
    let starts: Vec<_> = suite.trials.iter().map(|Trial { mission, .. }| mission.start.world).collect();
    let worlds: Vec<_> = suite.trials.iter().map(|Trial { mission, .. }| mission.world.clone()).collect();
    for Trial { name, mission, .. } in &mut suite.trials {
        let [x, y] = mission.start.world;
        let is_far = |at: &[f64; 2]| (at[0] - x).hypot(at[1] - y) >= CARRIED_M;
        let places = starts.iter().zip(&worlds).filter(|(at, world)| **world == mission.world && is_far(at));
        let places: Vec<_> = places.map(|(at, _)| *at).collect();
        let mut rng = seed::stream(1, &format!("eval/kidnapped/{}/{name}", mission.name));
        let (at_s, heading_deg) = (rng.random_range(CARRIED_S), rng.random_range(-180.0..180.0));
        let to = places.choose(&mut rng).copied();
        mission.world.carry = to.map(|to| Carry { at_s, to, heading_deg }).into_iter().collect();
        mission.task[0].time_limit_s += FINDING_S;
    }
    Ok(suite)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::protocol;
    use crate::experiments::suite::Folders;

    #[test]
    fn every_robot_is_carried_once_and_far() {
        let suite = of(protocol::building(&Folders::of_checkout()).unwrap()).unwrap();
        assert_eq!(suite.trials.len(), 36);
        for Trial { mission, .. } in suite.trials {
            let ([carry], [x, y]) = (&mission.world.carry[..], mission.start.world) else {
                panic!("{mission:?}")
            };
            assert!((carry.to[0] - x).hypot(carry.to[1] - y) >= CARRIED_M && CARRIED_S.contains(&carry.at_s));
        }
    }
}
