//! Tests that a running filter does not allocate, on one thread or on two, and that two threads give the same bits as one.

mod support;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use rayon_core::{ThreadPool, ThreadPoolBuilder};
use sketchnav_schemas::geometry::Pose;
use sketchnav_sketch::filter::Start;
use sketchnav_sketch::filter::parameters::{Likelihood, Parameters};
use sketchnav_sketch::filter::workers::Workers;
use support::{Drawing, Drive, WAY, localizer_at};

const DRAWING: Drawing = Drawing { size: [400, 400], a: 22.0, b: 28.0, turn_rad: 0.1, wobble_px: 0.0 };

/// An allocator that counts the allocations of the threads that have opted in.
struct Counting;

static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    static IS_COUNTED: Cell<bool> = const { Cell::new(false) };
}

fn count() {
    if IS_COUNTED.try_with(Cell::get).unwrap_or(false) {
        ALLOCATIONS.fetch_add(1, Relaxed);
    }
}

// SAFETY: every call goes to the system's allocator unchanged, and neither the flag nor the counter has a destructor.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller upholds the contract of `GlobalAlloc::alloc`.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller upholds the contract of `GlobalAlloc::dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Creates a pool whose threads have all called `warm`. A thread that begins to work late would otherwise allocate its slot in the
/// pool and its buffers in the middle of a step.
fn pool(threads: usize, warm: impl Fn() + Sync) -> Arc<ThreadPool> {
    let counted = |_| IS_COUNTED.set(true);
    let pool = ThreadPoolBuilder::new().num_threads(threads).start_handler(counted).build().unwrap();
    pool.broadcast(|_| warm());
    Arc::new(pool)
}

/// Takes `count` steps, none of which may allocate, and returns the bits of the filter's belief after each.
fn steps(drive: &mut Drive, count: usize) -> Vec<[u64; 3]> {
    let mut beliefs = Vec::with_capacity(count);
    for _ in 0..count {
        let (odometry, scan) = drive.advance(WAY[1]);
        let before = ALLOCATIONS.load(Relaxed);
        let estimate = drive.localizer.step(&odometry, &scan);
        assert_eq!(ALLOCATIONS.load(Relaxed), before);
        beliefs.push([estimate.pose.x, estimate.pose.yaw_rad, estimate.fit].map(f64::to_bits));
    }
    beliefs
}

#[test]
fn a_steady_update_allocates_nothing_and_two_threads_change_no_bit() {
    IS_COUNTED.set(true);
    let adaptive = Parameters { least_particles: 500, ..Parameters::default() };
    let both = [adaptive, Parameters::paper()].map(|parameters| Parameters { particles: 3000, ..parameters });
    let warm = |parameters: &Parameters| {
        let mut drive = Drive::new(DRAWING, parameters.clone(), 1);
        let (odometry, scan) = drive.advance(WAY[1]);
        drive.localizer.step(&odometry, &scan);
        drive
    };
    let alone = both.each_ref().map(|parameters| steps(&mut warm(parameters), 40));
    // Both runs share one pool, because the threads of a pool that is dropped would allocate while the next steps are counted.
    let pool = pool(2, || both.iter().for_each(|parameters| drop(warm(parameters))));
    for (parameters, alone) in both.iter().zip(&alone) {
        let together = pool.install(|| {
            let mut drive = Drive::new(DRAWING, parameters.clone(), 1);
            drive.localizer.set_workers(Workers::of(pool.clone()));
            let (odometry, scan) = drive.advance(WAY[1]);
            drive.localizer.step(&odometry, &scan);
            steps(&mut drive, 40)
        });
        assert_eq!(*alone, together);
    }
    // A robot that may be anywhere in a map searches from its second scan on.
    let mut anywhere = Drive::anywhere(1);
    let (odometry, scan) = anywhere.advance(WAY[1]);
    anywhere.localizer.step(&odometry, &scan);
    steps(&mut anywhere, 120);
    // In a drawing, particles are scattered everywhere, and their number drops once they agree. This one looks the same after half a
    // turn, so that they agree on either place unless the heading is known.
    let (placed_share, placed_after_m) = (0.0, 0.1);
    let parameters =
        Parameters { anywhere_particles: 5000, placed_share, placed_after_m, ..Parameters::default() };
    for spread_rad in [std::f64::consts::PI, 0.1] {
        let mut unmarked = Drive::new(DRAWING, Parameters::default(), 1);
        let pose = Pose::new(100.0, 100.0, unmarked.truth.yaw_rad);
        let start = Start { spread_rad, ..Start::anywhere(pose, DRAWING.size) };
        unmarked.localizer = localizer_at(&DRAWING, parameters.clone(), start, 1);
        let (odometry, scan) = unmarked.advance(WAY[1]);
        unmarked.localizer.step(&odometry, &scan);
        steps(&mut unmarked, 120);
        assert_eq!(unmarked.localizer.is_unplaced(), spread_rad > 1.0, "it was found by its heading");
    }
    assert_eq!(Parameters::paper().likelihood, Likelihood::Field);
    assert!(ALLOCATIONS.load(Relaxed) > 0, "it does count");
}
