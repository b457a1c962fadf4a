//! The threads that do the filter's work: either just the calling thread, or a pool supplied by the host.
//!
//! This module never starts threads. Work is divided into blocks whose bounds do not depend on the number of
//! threads, so neither do the results.

use std::sync::Arc;

use rayon_core::ThreadPool;

/// Either just the calling thread, which is the default, or a pool of threads.
#[derive(Debug, Clone, Default)]
pub struct Workers {
    pool: Option<Arc<ThreadPool>>,
}

impl Workers {
    /// Uses the threads of `pool`. A caller that is one of these threads does not wait for the others to wake up, and nothing is
    /// allocated.
    pub fn of(pool: Arc<ThreadPool>) -> Self {
        Self { pool: Some(pool) }
    }

    /// Calls `job` once for each block of `block` elements, with the index of the block's first element. The last block may be
    /// shorter.
    pub fn each<T: Send>(&self, all: &mut [T], block: usize, job: impl Fn(usize, &mut [T]) + Sync) {
        match &self.pool {
            None => all.chunks_mut(block).enumerate().for_each(|(i, part)| job(i * block, part)),
            Some(pool) => pool.install(|| halve(0, all, block, &job)),
        }
    }
}

fn halve<T: Send>(first: usize, all: &mut [T], block: usize, job: &(impl Fn(usize, &mut [T]) + Sync)) {
    let blocks = all.len().div_ceil(block);
    if blocks <= 1 {
        return job(first, all);
    }
    let middle = blocks / 2 * block;
    let (front, back) = all.split_at_mut(middle);
    rayon_core::join(|| halve(first, front, block, job), || halve(first + middle, back, block, job));
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon_core::ThreadPoolBuilder;

    #[test]
    fn every_element_is_worked_on_once_and_in_the_same_block() {
        let pool = Arc::new(ThreadPoolBuilder::new().num_threads(3).build().unwrap());
        for workers in [Workers::default(), Workers::of(pool)] {
            for count in [0, 1, 9, 10, 11, 95, 100] {
                let mut blocks = vec![usize::MAX; count];
                workers.each(&mut blocks[..], 10, |first, part| part.fill(first));
                let expected: Vec<usize> = (0..count).map(|i| i / 10 * 10).collect();
                assert_eq!(blocks, expected);
            }
        }
    }
}
