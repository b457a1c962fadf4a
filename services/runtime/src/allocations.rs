//! Counting heap allocations, to show that a step makes none.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
    static HANDLES: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, which counts for each thread how often it was asked for memory.
/// A binary installs it: `#[global_allocator] static A: CountingAllocator = CountingAllocator;`
#[derive(Debug, Clone, Copy, Default)]
pub struct CountingAllocator;

/// Allocations and reallocations of this thread so far, except for [`loan_handles_of_this_thread`];
/// 0 for good where the binary has not installed [`CountingAllocator`].
pub fn allocations_of_this_thread() -> u64 {
    COUNT.try_with(Cell::get).unwrap_or(0)
}

/// The allocations that iceoryx2 itself made for loans. Version 0.10 keeps a small handle of each loaned sample on the
/// heap until the sample is sent, and offers no way around it. That is one handle a message, whatever the message's
/// size. They are counted apart so that a service's own steps can be held to none at all.
pub fn loan_handles_of_this_thread() -> u64 {
    HANDLES.try_with(Cell::get).unwrap_or(0)
}

/// Does what allocates a loan's handle, and counts it as such.
pub(crate) fn loan_handle<R>(take_loan: impl FnOnce() -> R) -> R {
    let before = allocations_of_this_thread();
    let loan = take_loan();
    // A thread that is ending has no counters any more, and no loans.
    let _ = COUNT.try_with(|count| {
        let made = count.replace(before) - before;
        HANDLES.try_with(|handles| handles.set(handles.get() + made))
    });
    loan
}

fn count() {
    // A thread that is ending has no counter any more, and no steps.
    let _ = COUNT.try_with(|count| count.set(count.get() + 1));
}

// SAFETY: every call goes to the system's allocator unchanged; the counter is a thread-local cell
// without destructor, which itself allocates nothing.
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
