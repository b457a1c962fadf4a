//! The recorder does not allocate for a message. The only allocations left are those of the mcap crate for each chunk.

use std::convert::Infallible;
use std::io;

use bytemuck::Zeroable;
use sketchnav_recorder::core::Core;
use sketchnav_runtime::{CountingAllocator, allocations_of_this_thread};
use sketchnav_schemas::channels::{self, Channel, ChannelVisitor, RECORDED_EVERY};
use sketchnav_schemas::message::{Header, Odometry};
use sketchnav_schemas::ros2::{Ros2, transforms};
use sketchnav_schemas::samples::sample;
use sketchnav_schemas::seed::stream;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Returns the maximum number of allocations by mcap 0.26 for a chunk with [`RECORDED_EVERY`] messages of each of `topics`,
/// including its end. For the chunk itself these are zstd's output buffer, the buffers of three checksums, two trees, and the entry
/// of the chunk index. The message index has a list for each topic, which is first allocated for 4 messages and therefore grows at
/// the 1st, 5th, 9th, 17th message and so on. A buffer of the whole chunk is doubled when it is full, and the list of chunks grows
/// occasionally. The crate allocates all of these again for every chunk. The only option that avoids them is to leave out the index
/// and the checksums.
fn most_a_chunk(topics: u64) -> u64 {
    // The trees have nodes of eleven entries.
    47 + topics / 11 + 3 * topics
}

/// Returns the number of allocations by `work`.
fn allocations<R>(work: impl FnOnce() -> R) -> u64 {
    let before = allocations_of_this_thread();
    work();
    allocations_of_this_thread() - before
}

/// Encodes random messages of every channel as CDR, one after another.
struct Encode;

impl ChannelVisitor for Encode {
    type Error = Infallible;

    fn visit<T: Ros2>(&mut self, channel: Channel<T>) -> Result<(), Infallible> {
        let (mut form, mut out) = (T::Form::default(), Vec::with_capacity(1 << 20));
        for seq in 1..=40 {
            // Latched messages are sent only once, or repeated unchanged.
            let seed = if channel.spec.is_latched() { 0 } else { seq };
            let (message, cells) = sample::<T>(&mut stream(seed, T::NAME), seq);
            out.clear();
            let allocated = allocations(|| message.to_cdr_by(&cells, &mut form, &mut out).unwrap());
            assert!(seq == 1 || allocated == 0, "{} {seq}: {allocated}", T::NAME);
        }
        Ok(())
    }
}

#[test]
fn encoding_allocates_only_for_the_first_message() {
    let Ok(()) = sketchnav_navigators::visit(&mut Encode);
    let (mut form, mut out) = (transforms::Form::default(), Vec::with_capacity(1 << 20));
    for seq in 1..=3 {
        let header = Header { seq, stamp_ns: seq, source_seq: seq };
        let odometry = Odometry { header, ..Zeroable::zeroed() };
        out.clear();
        let allocated = allocations(|| transforms::base_in_odom(&odometry, &mut form, &mut out).unwrap());
        assert!(seq == 1 || allocated == 0, "transform {seq}: {allocated}");
    }
}

/// Records an empty message with the number `seq` on every channel, into a sink that discards it.
struct Round {
    core: Core<io::Sink>,
    seq: u64,
    allocated: u64,
}

impl Round {
    fn next(&mut self) -> u64 {
        self.seq += 1;
        self.allocated = 0;
        let Ok(()) = sketchnav_navigators::visit(self);
        self.allocated
    }
}

impl ChannelVisitor for Round {
    type Error = Infallible;

    fn visit<T: Ros2>(&mut self, channel: Channel<T>) -> Result<(), Infallible> {
        if channel.spec.is_recorded() && channel.spec.belongs_to("sketch") {
            let mut message = T::zeroed();
            *message.header_mut() = Header { seq: self.seq, stamp_ns: self.seq, source_seq: self.seq };
            self.allocated +=
                allocations(|| self.core.record(channel.spec, bytemuck::bytes_of(&message), &[]).unwrap());
        }
        Ok(())
    }
}

#[test]
fn recording_allocates_only_what_mcap_needs_per_chunk() {
    sketchnav_navigators::register(&[]).unwrap();
    let run = serde_json::from_str(include_str!("run.json")).unwrap();
    let mut round = Round { core: Core::new(io::sink(), &run, &[]).unwrap(), seq: 0, allocated: 0 };
    round.next();
    let recorded = channels::all().filter(|channel| channel.is_recorded()).count() as u64;
    let most = most_a_chunk(recorded);
    for chunk in 0..20 {
        round.core.flush().unwrap();
        let allocated: Vec<u64> = (0..RECORDED_EVERY).map(|_| round.next()).collect();
        for (message, &now) in allocated.iter().enumerate() {
            let most_now = match message {
                0 | 4 | 8 => most, // The lists of the topics grow.
                _ => 1,            // The buffer of the chunk is doubled.
            };
            assert!(now <= most_now, "chunk {chunk}, message {message}: {allocated:?}");
        }
        let end = allocations(|| round.core.end_pass().unwrap());
        let all = allocated.iter().sum::<u64>() + end;
        assert!(all <= most, "chunk {chunk}: {all}, {allocated:?}, its end {end}");
    }
    assert_eq!(allocations(|| round.core.end_pass().unwrap()), 0, "a pass with nothing to do");
}
