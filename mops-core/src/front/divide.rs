//! Non-dominated sorting of three or more objectives by divide and conquer.
//!
//! Source: M. T. Jensen, IEEE Transactions on Evolutionary Computation 7 (2003) 503-515; F.-A. Fortin, S. Grenier, M.
//! Parizeau, GECCO (2013) 615-622, for equal objectives; M. Buzdalov, A. Shalyto, PPSN XIII (2014) 528-537, for the
//! bound `O(n log^(m-1) n)`.

/// Largest set that is compared pair by pair.
const FEW: usize = 32;

/// Distinct points in lexicographic order, with lower bounds of their ranks.
pub(super) struct Divide<'a> {
    /// Objectives, `m` per point.
    objectives: &'a [f64],
    m: usize,
    /// Ranks of the points.
    pub(super) ranks: Vec<u32>,
    /// Position of each point's second objective in the sorted list of all.
    seconds: Vec<u32>,
    /// Fenwick tree of maxima for a sweep: by that position, one more than the largest rank so far.
    tree: Vec<u32>,
}

impl<'a> Divide<'a> {
    /// Returns the ranks of the points.
    #[allow(clippy::cast_possible_truncation)]
    pub(super) fn ranked(objectives: &'a [f64], m: usize) -> Vec<u32> {
        let count = objectives.len() / m;
        let all: Vec<u32> = (0..count as u32).collect();
        let second = |i: u32| objectives[i as usize * m + 1];
        let mut order = all.clone();
        order.sort_unstable_by(|&a, &b| second(a).total_cmp(&second(b)));
        let mut seconds = vec![0; count];
        let mut place = 0;
        for pair in order.windows(2) {
            place += u32::from(second(pair[0]) < second(pair[1]));
            seconds[pair[1] as usize] = place;
        }
        let mut divide = Self { objectives, m, ranks: vec![0; count], seconds, tree: vec![0; place as usize + 2] };
        divide.among(&all, m);
        divide.ranks
    }

    /// Ranks points that are equal in the objectives from `k` on among each other.
    fn among(&mut self, points: &[u32], k: usize) {
        if points.len() <= FEW {
            for (at, &j) in points.iter().enumerate() {
                self.compare(&points[..at], j, k);
            }
        } else if k == 2 {
            self.sweep_among(points);
        } else {
            let middle = self.median(points.iter(), k);
            let [less, equal, more] = self.split(points, middle, k);
            if equal.len() == points.len() {
                return self.among(points, k - 1);
            }
            self.among(&less, k);
            self.after(&less, &equal, k - 1);
            self.among(&equal, k - 1);
            self.after(&merged(&less, &equal), &more, k - 1);
            self.among(&more, k);
        }
    }

    /// Ranks points after others with known ranks that are not worse in the objectives from `k` on.
    fn after(&mut self, known: &[u32], points: &[u32], k: usize) {
        if known.len().min(points.len()) <= 2 || known.len() * points.len() <= FEW * FEW {
            for &j in points {
                self.compare(known, j, k);
            }
        } else if k == 2 {
            self.sweep(known, points);
        } else {
            let values = |of: &[u32]| -> [f64; 2] {
                let values = of.iter().map(|&i| self.value(i, k));
                values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
            };
            let ([best, worst], [least, most]) = (values(known), values(points));
            if worst <= least {
                return self.after(known, points, k - 1);
            }
            if best > most {
                return;
            }
            let middle = self.median(known.iter().chain(points), k);
            let [less, equal, more] = self.split(known, middle, k);
            let [nearer, level, farther] = self.split(points, middle, k);
            self.after(&less, &nearer, k);
            self.after(&merged(&less, &equal), &merged(&level, &farther), k - 1);
            self.after(&more, &farther, k);
        }
    }

    /// Ranks a point after those that are not worse in the first `k` objectives.
    fn compare(&mut self, known: &[u32], j: u32, k: usize) {
        let row = |i: u32| &self.objectives[i as usize * self.m..][..k];
        let own = row(j);
        let mut rank = self.ranks[j as usize];
        for &i in known {
            if self.ranks[i as usize] >= rank && row(i).iter().zip(own).all(|(a, b)| a <= b) {
                rank = self.ranks[i as usize] + 1;
            }
        }
        self.ranks[j as usize] = rank;
    }

    /// Ranks points among each other by their first two objectives.
    fn sweep_among(&mut self, points: &[u32]) {
        for &j in points {
            self.follow(j);
            self.enter(j);
        }
        self.clear(points);
    }

    /// Ranks points after those with known ranks, by their first two objectives.
    fn sweep(&mut self, known: &[u32], points: &[u32]) {
        let mut before = known.iter().copied().peekable();
        for &j in points {
            // Points that are not worse come first in lexicographic order.
            while let Some(i) = before.next_if(|&i| i < j) {
                self.enter(i);
            }
            self.follow(j);
        }
        self.clear(known);
    }

    /// Ranks a point after those in the tree.
    fn follow(&mut self, j: u32) {
        let rank = &mut self.ranks[j as usize];
        let mut place = self.seconds[j as usize] + 1;
        while place > 0 {
            *rank = (*rank).max(self.tree[place as usize]);
            place &= place - 1;
        }
    }

    /// Removes these points from the tree.
    fn clear(&mut self, points: &[u32]) {
        for &i in points {
            self.change(i, |_| 0);
        }
    }

    /// Adds a point to the tree.
    fn enter(&mut self, i: u32) {
        let rank = self.ranks[i as usize] + 1;
        self.change(i, |most| most.max(rank));
    }

    /// Changes every node of the tree that covers a point.
    fn change(&mut self, i: u32, to: impl Fn(u32) -> u32) {
        let mut place = self.seconds[i as usize] as usize + 1;
        while place < self.tree.len() {
            self.tree[place] = to(self.tree[place]);
            place += place & place.wrapping_neg();
        }
    }

    /// Returns the last of the first `k` objectives of a point.
    fn value(&self, i: u32, k: usize) -> f64 {
        self.objectives[i as usize * self.m + k - 1]
    }

    fn median<'i>(&self, points: impl Iterator<Item = &'i u32>, k: usize) -> f64 {
        let mut values: Vec<f64> = points.map(|&i| self.value(i, k)).collect();
        let middle = values.len() / 2;
        *values.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    /// Splits points into those whose last of the first `k` objectives is less, equal and greater, keeping their order.
    fn split(&self, points: &[u32], middle: f64, k: usize) -> [Vec<u32>; 3] {
        let mut parts = [const { Vec::new() }; 3];
        for &i in points {
            let value = self.value(i, k);
            parts[usize::from(value >= middle) + usize::from(value > middle)].push(i);
        }
        parts
    }
}

/// Merges two lists in increasing order.
fn merged(a: &[u32], b: &[u32]) -> Vec<u32> {
    let mut all = Vec::with_capacity(a.len() + b.len());
    let mut rest = b.iter().copied().peekable();
    for &i in a {
        while let Some(j) = rest.next_if(|&j| j < i) {
            all.push(j);
        }
        all.push(i);
    }
    all.extend(rest);
    all
}
