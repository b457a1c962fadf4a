//! The sensors of a running world allocate nothing; its physics no more than rapier itself does.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use sketchnav_schemas::geometry::{Pose, World as WorldFrame};
use sketchnav_schemas::message::{Header, LaserScan, Odometry, Twist, VelocityCommand};
use sketchnav_sim::{World, floor_plan, robots};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, counting by thread.
struct Counting;

// SAFETY: hands everything on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller's promises are the system allocator's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Furniture, two people, a robot that is driven into all of it.
const FLOOR: &str = "name='room'\nwall_thickness_m=0.2\n\
    [[wall]]\nclosed=true\npoints=[[0,0],[6,0],[6,4],[0,4]]\n[[wall]]\npoints=[[3,0],[3,4]]\n\
    [[door]]\nat=[3,2]\nwidth_m=1.0\n[[furniture]]\ncenter=[4.5,1.2]\nradius_m=0.3\n\
    [[person]]\nwaypoints=[[5.2,3.2],[0.6,3.2]]\nspeed_mps=0.8\n\
    [[person]]\nwaypoints=[[0.6,0.6],[2.4,2.4]]\nspeed_mps=0.5\npause_s=1.0\n";

/// rapier 0.36 allocates 3 times a physics step (the list of bodies whose velocity was set, the solver's
/// colours, its cursor) and 5 times while something is touched, and frees it all again.
const MOST_A_PHYSICS_STEP: u64 = 8;
const PHYSICS_STEPS: u64 = 10;

fn step(world: &mut World) {
    let phase = world.steps() as f64;
    let twist =
        Twist { vx_mps: 0.5, vy_mps: 0.3 * (phase / 20.0).sin(), yaw_rate_radps: 0.7 * (phase / 70.0).cos() };
    let header = Header { seq: 0, stamp_ns: world.stamp_ns(), source_seq: 0 };
    world.step(Some(&VelocityCommand { header, twist, last: 0, reserved: 0 }));
}

/// How often `work` allocates.
fn allocations(work: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.get();
    work();
    ALLOCATIONS.get() - before
}

#[test]
fn the_sensors_allocate_nothing_and_the_physics_no_more_than_rapier_does() {
    let robot = robots::find("robotino").unwrap().unwrap();
    let start = Pose::<WorldFrame>::new(1.0, 2.0, 0.0);
    let mut world = World::new(floor_plan::parse(FLOOR).unwrap(), &robot, start, 1).unwrap();
    let mut scan: Box<LaserScan> = bytemuck::zeroed_box();
    let mut odometry: Odometry = bytemuck::Zeroable::zeroed();
    let mut contacts = 0;
    for i in 0..4000 {
        let physics = allocations(|| step(&mut world));
        let sensors = allocations(|| {
            world.fill_scan(&mut scan);
            world.fill_odometry(&mut odometry);
            contacts += world.contacts().len();
        });
        assert_eq!(sensors, 0, "step {i}");
        assert!(physics <= MOST_A_PHYSICS_STEP * PHYSICS_STEPS, "step {i}: {physics}");
    }
    assert!(contacts > 20, "{contacts} contacts: the test is to cover them");
}
