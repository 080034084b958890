//! Points with values: what the models go through.

/// Points and the values of all rows there, the oldest first.
#[derive(Debug)]
pub struct Known {
    dimension: usize,
    rows: usize,
    count: usize,
    points: Vec<f64>,
    values: Vec<f64>,
}

/// Points that are forgotten at a time.
const MEMORY: usize = 200;

/// Points within this many radii take part in the models.
const REACH: f64 = 2.5;

impl Known {
    /// None yet, of points with so many coordinates and values.
    pub fn new(dimension: usize, rows: usize) -> Self {
        Self { dimension, rows, count: 0, points: Vec::new(), values: Vec::new() }
    }

    pub fn len(&self) -> usize {
        self.count
    }

    pub fn point(&self, i: usize) -> &[f64] {
        &self.points[i * self.dimension..(i + 1) * self.dimension]
    }

    pub fn values(&self, i: usize) -> &[f64] {
        &self.values[i * self.rows..(i + 1) * self.rows]
    }

    pub fn contains(&self, point: &[f64]) -> bool {
        (0..self.count).any(|i| self.point(i) == point)
    }

    /// Adds a point that is not there yet.
    pub fn remember(&mut self, point: &[f64], values: &[f64]) {
        if !self.contains(point) {
            self.points.extend_from_slice(point);
            self.values.extend_from_slice(values);
            self.count += 1;
        }
    }

    /// Forgets the oldest points where there are many: few of them are near. `true` when it did.
    pub fn forget(&mut self) -> bool {
        let n = self.dimension;
        let many = self.count > MEMORY + 2 * (n + 1) * (n + 2);
        if many {
            self.points.drain(..MEMORY * n);
            self.values.drain(..MEMORY * self.rows);
            self.count -= MEMORY;
        }
        many
    }

    /// Finds the points around a centre, with their distances in radii, the nearest first: at most as many as determine a
    /// quadratic.
    pub fn near(&self, centre: &[f64], radius: f64, near: &mut Vec<(f64, usize)>) {
        let n = self.dimension;
        let distance =
            |i: usize| self.point(i).iter().zip(centre).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / radius;
        near.clear();
        near.extend((0..self.count).map(|i| (distance(i), i)).filter(|(distance, _)| *distance <= REACH));
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.truncate((n + 1) * (n + 2) / 2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_are_forgotten_and_the_nearest_found() {
        let mut known = Known::new(1, 1);
        let count = MEMORY + 13;
        for i in (0..count).chain(0..3) {
            #[allow(clippy::cast_precision_loss)]
            let x = i as f64;
            known.remember(&[x], &[10.0 * x]);
        }
        assert_eq!(known.len(), count);
        assert!(known.forget() && !known.forget());
        assert_eq!((known.len(), known.point(0)[0], known.values(12)[0]), (13, 200.0, 2120.0));
        assert!(known.contains(&[212.0]) && !known.contains(&[199.0]));
        let mut near = Vec::new();
        known.near(&[205.2], 1.0, &mut near);
        assert_eq!(near.iter().map(|(_, i)| *i).collect::<Vec<_>>(), [5, 6, 4]);
        known.near(&[199.0], 1.0, &mut near);
        assert_eq!(near, [(1.0, 0), (2.0, 1)]);
    }
}
