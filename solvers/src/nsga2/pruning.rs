//! Removal of the most crowded members of a front, one at a time.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::evolution::Pool;

/// Pruning of a front; stores the neighbours of every member along every objective.
#[derive(Debug, Default)]
pub struct Pruning {
    /// Previous and next member along objective `k`, at `[member * m + k]`.
    before: Vec<u32>,
    after: Vec<u32>,
    sorted: Vec<u32>,
    ranges: Vec<f64>,
    /// Crowding distances as bits, which have the order of the numbers for non-negative values. Outdated entries are
    /// skipped.
    queue: BinaryHeap<Reverse<(u64, u32)>>,
    removed: Vec<bool>,
}

const NONE: u32 = u32::MAX;

impl Pruning {
    /// Removes the most crowded members of `front` one at a time and moves the remaining `keep` to its start.
    /// `distance` is indexed by position in the pool.
    #[allow(clippy::cast_possible_truncation)]
    pub fn prune(&mut self, pool: &Pool, front: &mut [u32], keep: usize, distance: &mut [f64]) {
        let (m, count) = (pool.m, front.len());
        self.link(pool, front);
        self.removed.clear();
        self.removed.resize(count, false);
        self.queue.clear();
        for member in 0..count {
            let crowding = self.crowding(pool, front, member);
            distance[front[member] as usize] = crowding;
            self.queue.push(Reverse((crowding.to_bits(), member as u32)));
        }
        let mut remaining = count;
        while remaining > keep {
            let Some(Reverse((bits, member))) = self.queue.pop() else { break };
            let index = member as usize;
            if self.removed[index] || distance[front[index] as usize].to_bits() != bits {
                continue;
            }
            self.removed[index] = true;
            remaining -= 1;
            for k in 0..m {
                let (before, after) = (self.before[index * m + k], self.after[index * m + k]);
                if before != NONE {
                    self.after[before as usize * m + k] = after;
                }
                if after != NONE {
                    self.before[after as usize * m + k] = before;
                }
            }
            for k in 0..m {
                for near in [self.before[index * m + k], self.after[index * m + k]] {
                    if near != NONE {
                        let crowding = self.crowding(pool, front, near as usize);
                        distance[front[near as usize] as usize] = crowding;
                        self.queue.push(Reverse((crowding.to_bits(), near)));
                    }
                }
            }
        }
        let mut end = 0;
        for member in 0..count {
            if !self.removed[member] {
                front.swap(end, member);
                end += 1;
            }
        }
    }

    /// Finds the neighbours of every member.
    #[allow(clippy::cast_possible_truncation)]
    fn link(&mut self, pool: &Pool, front: &[u32]) {
        let m = pool.m;
        for links in [&mut self.before, &mut self.after] {
            links.clear();
            links.resize(front.len() * m, NONE);
        }
        self.ranges.clear();
        for k in 0..m {
            let value = |member: u32| pool.objectives[front[member as usize] as usize * m + k];
            self.sorted.clear();
            self.sorted.extend(0..front.len() as u32);
            self.sorted.sort_unstable_by(|&a, &b| value(a).total_cmp(&value(b)).then(a.cmp(&b)));
            for pair in self.sorted.windows(2) {
                self.after[pair[0] as usize * m + k] = pair[1];
                self.before[pair[1] as usize * m + k] = pair[0];
            }
            self.ranges.push(value(self.sorted[front.len() - 1]) - value(self.sorted[0]));
        }
    }

    /// Returns the sum of the gaps between the neighbours, relative to the range of the front; infinite at an end.
    fn crowding(&self, pool: &Pool, front: &[u32], member: usize) -> f64 {
        let m = pool.m;
        let value = |index: u32, k: usize| pool.objectives[front[index as usize] as usize * m + k];
        let gap = |k: usize| {
            let (before, after) = (self.before[member * m + k], self.after[member * m + k]);
            if before == NONE || after == NONE {
                return f64::INFINITY;
            }
            if self.ranges[k] > 0.0 { (value(after, k) - value(before, k)) / self.ranges[k] } else { 0.0 }
        };
        (0..m).map(gap).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_crowded_go_first_and_the_ends_stay() {
        // Line with a cluster: 0, 1, 2, 3, 3.1, 3.2, 4.
        let at = [0.0, 1.0, 2.0, 3.0, 3.1, 3.2, 4.0];
        let objectives = at.iter().flat_map(|x| [*x, 4.0 - *x]).collect();
        let pool = Pool { m: 2, points: Vec::new(), objectives, violations: vec![0.0; 7] };
        let mut front: Vec<u32> = (0..7).collect();
        Pruning::default().prune(&pool, &mut front, 5, &mut [0.0; 7]);
        let mut kept = front[..5].to_vec();
        kept.sort_unstable();
        assert!(kept == [0, 1, 2, 3, 6] || kept == [0, 1, 2, 5, 6], "{kept:?}");
    }
}
