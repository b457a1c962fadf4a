//! The sensors of a running world do not allocate, and its physics allocates no more than rapier itself.

mod support;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use sketchnav_schemas::geometry::{Pose, World as WorldFrame};
use sketchnav_sim::{Floor, Simulation, floor_plan, robots};
use support::{Readings, command};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// The system allocator, counting allocations per thread.
struct Counting;

// SAFETY: every call is passed to the system allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// A floor with furniture and two people, which the robot runs into.
const FLOOR: &str = "name='room'\nwall_thickness_m=0.2\n\
    [[wall]]\nclosed=true\npoints=[[0,0],[6,0],[6,4],[0,4]]\n[[wall]]\npoints=[[3,0],[3,4]]\n\
    [[door]]\nat=[3,2]\nwidth_m=1.0\n[[furniture]]\ncenter=[4.5,1.2]\nradius_m=0.3\n\
    [[person]]\nwaypoints=[[5.2,3.2],[0.6,3.2]]\nspeed_mps=0.8\n\
    [[person]]\nwaypoints=[[0.6,0.6],[2.4,2.4]]\nspeed_mps=0.5\npause_s=1.0\n";

/// rapier 0.36 allocates 3 times per physics step: for the list of bodies whose velocity was set, for the solver's colours, and
/// for its cursor. While something is touched, it allocates 5 times. Everything is freed again.
const MOST_A_PHYSICS_STEP: u64 = 8;
const PHYSICS_STEPS: u64 = 10;

fn step(floor: &mut Floor) {
    let phase = floor.steps() as f64;
    floor.step(Some(&command(floor, 0.5, 0.3 * (phase / 20.0).sin(), 0.7 * (phase / 70.0).cos())));
}

/// Returns how often `work` allocates.
fn allocations(work: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.get();
    work();
    ALLOCATIONS.get() - before
}

#[test]
fn the_sensors_allocate_nothing_and_the_physics_no_more_than_rapier_does() {
    // A robot that cannot move sideways is held up by the first wall.
    for (name, hz, least) in
        [("robotino", None, 20), ("robotino", Some(50.0), 20), ("nomad200", Some(50.0), 1)]
    {
        let mut robot = robots::find(name).unwrap().unwrap();
        robot.odometry.as_mut().unwrap().rate_hz = hz;
        let start = Pose::<WorldFrame>::new(1.0, 2.0, 0.0);
        let mut floor = Floor::new(floor_plan::parse(FLOOR).unwrap(), &robot, start, 1).unwrap();
        let mut readings = Readings::new();
        for i in 0..4000 {
            let physics = allocations(|| step(&mut floor));
            let sensors = allocations(|| readings.take(&floor));
            assert_eq!(sensors, 0, "{name}: step {i}");
            assert!(physics <= MOST_A_PHYSICS_STEP * PHYSICS_STEPS, "{name}: step {i}: {physics}");
        }
        let contacts = readings.contacts.len();
        assert!(contacts >= least, "{name}: {contacts} contacts: the test is to cover them");
    }
}
