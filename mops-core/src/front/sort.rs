//! Non-dominated sorting.

use super::divide::Divide;

/// Sorter of points into fronts: rank 0 is dominated by none, rank 1 only by points of rank 0, and so on.
///
/// Objectives may be infinite, but not NaN. With one or two objectives, buffers are reused between calls.
///
/// Two objectives take `O(n log n)`: the points are swept in the order of the first, and each front keeps the least
/// second objective so far. More objectives take `O(n log^(m-1) n)` by divide and conquer.
///
/// Source: M. T. Jensen, IEEE Transactions on Evolutionary Computation 7 (2003) 503-515.
#[derive(Debug, Clone, Default)]
pub struct FrontSorter {
    order: Vec<u32>,
    ranks: Vec<u32>,
    /// Smallest second objective of every front.
    tails: Vec<f64>,
    /// Objectives of the distinct points, in lexicographic order.
    different: Vec<f64>,
}

impl FrontSorter {
    /// Returns the rank of every point.
    #[allow(clippy::cast_possible_truncation)]
    pub fn sort(&mut self, objectives: &[f64], m: usize) -> &[u32] {
        let count = objectives.len().checked_div(m).unwrap_or(0);
        let row = |i: u32| &objectives[i as usize * m..(i as usize + 1) * m];
        self.order.clear();
        self.order.extend(0..count as u32);
        if m == 2 {
            // Points are ordered by the first objective, equal ones by the second. Zeros of either sign are equal.
            let key = |i: u32| (objectives[2 * i as usize] + 0.0, objectives[2 * i as usize + 1] + 0.0);
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
            1 => self.levels(objectives),
            _ => self.divide(objectives, m),
        }
        &self.ranks
    }

    /// Ranks points by a single objective; equal points share a rank.
    fn levels(&mut self, objectives: &[f64]) {
        let mut rank = 0;
        for pair in self.order.windows(2) {
            rank += u32::from(objectives[pair[0] as usize] < objectives[pair[1] as usize]);
            self.ranks[pair[1] as usize] = rank;
        }
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

    /// Ranks the distinct points by divide and conquer.
    #[allow(clippy::cast_possible_truncation)]
    fn divide(&mut self, objectives: &[f64], m: usize) {
        let row = |i: u32| &objectives[i as usize * m..(i as usize + 1) * m];
        self.different.clear();
        let mut places = Vec::with_capacity(self.order.len());
        for (at, &i) in self.order.iter().enumerate() {
            if at == 0 || row(self.order[at - 1]) != row(i) {
                self.different.extend_from_slice(row(i));
            }
            places.push(self.different.len() / m - 1);
        }
        let ranks = Divide::ranked(&self.different, m);
        for (&i, place) in self.order.iter().zip(places) {
            self.ranks[i as usize] = ranks[place];
        }
    }
}

/// Returns the indices of the non-dominated points, in increasing order; only the first of equal points.
pub fn non_dominated(objectives: &[f64], m: usize) -> Vec<usize> {
    let mut sorter = FrontSorter::default();
    let ranks = sorter.sort(objectives, m);
    let row = |i: usize| &objectives[i * m..(i + 1) * m];
    let mut first: Vec<usize> = (0..ranks.len()).filter(|&i| ranks[i] == 0).collect();
    first.sort_by(|&a, &b| compare(row(a), row(b)).then(a.cmp(&b)));
    first.dedup_by(|b, a| row(*a) == row(*b));
    first.sort_unstable();
    first
}

/// Compares lexicographically: by the first objective, then the second, and so on.
pub fn compare(a: &[f64], b: &[f64]) -> std::cmp::Ordering {
    // Zeros of either sign are equal, consistent with the operator `<`.
    let order = |(a, b): (&f64, &f64)| a.partial_cmp(b).unwrap_or_else(|| a.total_cmp(b));
    a.iter().zip(b).map(order).find(|order| order.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
}

#[cfg(test)]
mod tests {
    use rand::Rng;

    use super::*;

    /// Returns true if `a` dominates `b`.
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

    /// Returns the ranks by definition: repeatedly removes the non-dominated points.
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
        let mut random = mops_math::stream(1, "fronts");
        let mut sorter = FrontSorter::default();
        for m in 1..=5 {
            for count in [0, 1, 2, 40, 200] {
                // Coarse values, so that many are equal.
                let points: Vec<f64> = (0..m * count).map(|_| f64::from(random.random_range(0..12))).collect();
                assert_eq!(sorter.sort(&points, m), peeled(&points, m), "{m} objectives, {count} points");
            }
            // Points near a sphere, as at the end of a search, some with a negative zero.
            let near = |_| {
                let point: Vec<f64> = (0..m).map(|_| random.random()).collect();
                let far = 1.0 + 0.05 * f64::from(random.random_range(0..3));
                let length = point.iter().map(|x| x * x).sum::<f64>().sqrt();
                let zero = random.random_range(0..8 * m);
                let to = |(k, x): (usize, f64)| if k == zero { [0.0, -0.0][k % 2] } else { x * far / length };
                point.into_iter().enumerate().map(to).collect::<Vec<f64>>()
            };
            let points: Vec<f64> = (0..600).flat_map(near).collect();
            assert_eq!(sorter.sort(&points, m), peeled(&points, m), "{m} objectives, near a sphere");
        }
    }
}
