//! Non-dominated sorting.

use super::compare;

/// Sorts points into fronts: rank 0 is dominated by none, rank 1 only by those of rank 0, and so on. Keeps its memory between
/// calls.
///
/// Two objectives take `O(n log n)`: the points are swept in the order of the first, and each front remembers the least
/// second objective so far. More take the efficient non-dominated sort with binary search: at worst `O(m n^2)`, and
/// `O(m n log n)` where there are few fronts of few points.
///
/// Source: M. T. Jensen, IEEE Transactions on Evolutionary Computation 7 (2003) 503-515 (two objectives); X. Zhang, Y. Tian,
/// R. Cheng, Y. Jin, IEEE Transactions on Evolutionary Computation 19 (2015) 201-213.
#[derive(Debug, Clone, Default)]
pub struct FrontSorter {
    order: Vec<u32>,
    ranks: Vec<u32>,
    /// The least second objective of every front.
    tails: Vec<f64>,
    /// Members of every front, in the order of the sweep.
    fronts: Vec<Vec<u32>>,
}

impl FrontSorter {
    /// The rank of every point.
    #[allow(clippy::cast_possible_truncation)]
    pub fn sort(&mut self, objectives: &[f64], m: usize) -> &[u32] {
        let count = objectives.len().checked_div(m).unwrap_or(0);
        let row = |i: u32| &objectives[i as usize * m..(i as usize + 1) * m];
        self.order.clear();
        self.order.extend(0..count as u32);
        if m == 2 {
            // In the order of the first objective; equal ones by the second.
            let key = |i: u32| (objectives[2 * i as usize], objectives[2 * i as usize + 1]);
            self.order.sort_unstable_by(|&a, &b| {
                let ((a0, a1), (b0, b1)) = (key(a), key(b));
                a0.total_cmp(&b0).then(a1.total_cmp(&b1)).then(a.cmp(&b))
            });
        } else {
            self.order.sort_unstable_by(|&a, &b| compare(row(a), row(b)).then(a.cmp(&b)));
        }
        self.ranks.clear();
        self.ranks.resize(count, 0);
        match m {
            0 => {}
            2 => self.sweep(objectives),
            _ => self.search(objectives, m),
        }
        &self.ranks
    }

    #[allow(clippy::cast_possible_truncation)]
    fn sweep(&mut self, objectives: &[f64]) {
        self.tails.clear();
        let mut before: Option<u32> = None;
        for &i in &self.order {
            let at = |i: u32| (objectives[2 * i as usize], objectives[2 * i as usize + 1]);
            let rank = match before {
                // Equal points do not dominate each other.
                Some(b) if at(b) == at(i) => self.ranks[b as usize],
                _ => {
                    let second = at(i).1;
                    let rank = self.tails.partition_point(|tail| *tail <= second);
                    if rank == self.tails.len() {
                        self.tails.push(second);
                    } else {
                        self.tails[rank] = second;
                    }
                    rank as u32
                }
            };
            self.ranks[i as usize] = rank;
            before = Some(i);
        }
    }

    #[allow(clippy::cast_possible_truncation)]
    fn search(&mut self, objectives: &[f64], m: usize) {
        self.fronts.iter_mut().for_each(Vec::clear);
        let mut used = 0;
        for &i in &self.order {
            let here = &objectives[i as usize * m..(i as usize + 1) * m];
            let dominated = |front: &[u32]| {
                front.iter().rev().any(|&j| dominates(&objectives[j as usize * m..(j as usize + 1) * m], here))
            };
            let rank = self.fronts[..used].partition_point(|front| dominated(front));
            if rank == used {
                used += 1;
                if used > self.fronts.len() {
                    self.fronts.push(Vec::new());
                }
            }
            self.fronts[rank].push(i);
            self.ranks[i as usize] = rank as u32;
        }
    }
}

/// Whether `a` dominates `b`.
fn dominates(a: &[f64], b: &[f64]) -> bool {
    let mut better = false;
    for (a, b) in a.iter().zip(b) {
        if a > b {
            return false;
        }
        better |= a < b;
    }
    better
}

#[cfg(test)]
mod tests {
    use rand::Rng;

    use super::*;

    /// By the definition: peel off what nothing left dominates.
    fn peeled(objectives: &[f64], m: usize) -> Vec<u32> {
        let points: Vec<&[f64]> = objectives.chunks_exact(m).collect();
        let mut ranks = vec![u32::MAX; points.len()];
        for rank in 0.. {
            let left: Vec<usize> = (0..points.len()).filter(|&i| ranks[i] == u32::MAX).collect();
            if left.is_empty() {
                return ranks;
            }
            for &i in &left {
                if !left.iter().any(|&j| dominates(points[j], points[i])) {
                    ranks[i] = rank;
                }
            }
        }
        ranks
    }

    #[test]
    fn ranks_are_those_of_the_definition() {
        let mut random = crate::stream(1, "fronts");
        let mut sorter = FrontSorter::default();
        for m in 1..=5 {
            for count in [0, 1, 2, 40, 200] {
                // Coarse values, so that many are equal.
                let points: Vec<f64> = (0..m * count).map(|_| f64::from(random.random_range(0..12))).collect();
                assert_eq!(sorter.sort(&points, m), peeled(&points, m), "{m} objectives, {count} points");
            }
        }
    }
}
