//! Counts heap allocations, to verify that a step makes none.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
    static HANDLES: Cell<u64> = const { Cell::new(0) };
}

/// The system allocator, counting per thread how often memory was requested. A binary installs it with `#[global_allocator]
/// static A: CountingAllocator = CountingAllocator;`
#[derive(Debug, Clone, Copy, Default)]
pub struct CountingAllocator;

/// Returns the number of allocations and reallocations of this thread so far, excluding [`loan_handles_of_this_thread`]. Always
/// 0 if the binary has not installed [`CountingAllocator`].
pub fn allocations_of_this_thread() -> u64 {
    COUNT.try_with(Cell::get).unwrap_or(0)
}

/// Returns the number of allocations that iceoryx2 itself has made for loans of this thread. Version 0.10
/// keeps a small handle of each loaned sample on the heap until the sample is sent, which cannot be avoided:
/// one handle per message of any size. These allocations are counted separately so that a service's own steps
/// can be required to make none.
pub fn loan_handles_of_this_thread() -> u64 {
    HANDLES.try_with(Cell::get).unwrap_or(0)
}

/// Runs `take_loan` and counts its allocations as loan handles.
pub(crate) fn loan_handle<R>(take_loan: impl FnOnce() -> R) -> R {
    let before = allocations_of_this_thread();
    let loan = take_loan();
    // A thread that is ending no longer has counters, but it does not take any more loans either.
    let _ = COUNT.try_with(|count| {
        let made = count.replace(before) - before;
        HANDLES.try_with(|handles| handles.set(handles.get() + made))
    });
    loan
}

fn count() {
    // A thread that is ending no longer has a counter, but it does not make any more steps either.
    let _ = COUNT.try_with(|count| count.set(count.get() + 1));
}

// SAFETY: every call is passed to the system allocator unchanged; the counter is a thread-local cell without a
// destructor and allocates nothing itself.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: as the caller promises.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: as the caller promises.
        unsafe { System.realloc(pointer, layout, size) }
    }
}
