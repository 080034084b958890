//! Evaluated points, which the models interpolate.

/// Points and the values of all criteria there, the oldest first.
#[derive(Debug)]
pub struct SampleSet {
    dimension: usize,
    criteria: usize,
    count: usize,
    points: Vec<f64>,
    values: Vec<f64>,
}

/// Number of points dropped at a time.
const DROP_COUNT: usize = 200;

/// Radius of the neighbourhood whose points enter the models, in trust-region radii.
const NEIGHBOURHOOD_RADIUS: f64 = 2.5;

/// Number of points that enter the models, which is that of the coefficients of a quadratic in 20 coordinates. The fit
/// takes time in proportion to the third power of this number.
const MAX_NEIGHBOURS: usize = 231;

impl SampleSet {
    /// Creates an empty set for points with `dimension` coordinates and `criteria` values.
    pub fn new(dimension: usize, criteria: usize) -> Self {
        Self { dimension, criteria, count: 0, points: Vec::new(), values: Vec::new() }
    }

    pub fn len(&self) -> usize {
        self.count
    }

    pub fn point(&self, i: usize) -> &[f64] {
        &self.points[i * self.dimension..(i + 1) * self.dimension]
    }

    pub fn values(&self, i: usize) -> &[f64] {
        &self.values[i * self.criteria..(i + 1) * self.criteria]
    }

    pub fn contains(&self, point: &[f64]) -> bool {
        (0..self.count).any(|i| self.point(i) == point)
    }

    /// Adds a point unless it is already in the set.
    pub fn insert(&mut self, point: &[f64], values: &[f64]) {
        if !self.contains(point) {
            self.points.extend_from_slice(point);
            self.values.extend_from_slice(values);
            self.count += 1;
        }
    }

    /// Drops the oldest points of a large set, few of which are near; returns true if it did.
    pub fn drop_oldest(&mut self) -> bool {
        let n = self.dimension;
        let is_full = self.count > DROP_COUNT + 2 * (n + 1) * (n + 2);
        if is_full {
            self.points.drain(..DROP_COUNT * n);
            self.values.drain(..DROP_COUNT * self.criteria);
            self.count -= DROP_COUNT;
        }
        is_full
    }

    /// Finds the points around a centre with their distances in radii, the nearest first. Their number is limited to
    /// that of the coefficients of a quadratic, for many coordinates to the larger of [`MAX_NEIGHBOURS`] and three per
    /// coordinate.
    pub fn neighbours(&self, centre: &[f64], radius: f64, neighbours: &mut Vec<(f64, usize)>) {
        let n = self.dimension;
        let distance =
            |i: usize| self.point(i).iter().zip(centre).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / radius;
        neighbours.clear();
        neighbours.extend(
            (0..self.count).map(|i| (distance(i), i)).filter(|(distance, _)| *distance <= NEIGHBOURHOOD_RADIUS),
        );
        neighbours.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        neighbours.truncate(((n + 1) * (n + 2) / 2).min(MAX_NEIGHBOURS.max(3 * n)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_points_are_dropped_and_the_nearest_found() {
        let mut samples = SampleSet::new(1, 1);
        let count = DROP_COUNT + 13;
        for i in (0..count).chain(0..3) {
            #[allow(clippy::cast_precision_loss)]
            let x = i as f64;
            samples.insert(&[x], &[10.0 * x]);
        }
        assert_eq!(samples.len(), count);
        assert!(samples.drop_oldest() && !samples.drop_oldest());
        assert_eq!((samples.len(), samples.point(0)[0], samples.values(12)[0]), (13, 200.0, 2120.0));
        assert!(samples.contains(&[212.0]) && !samples.contains(&[199.0]));
        let mut neighbours = Vec::new();
        samples.neighbours(&[205.2], 1.0, &mut neighbours);
        assert_eq!(neighbours.iter().map(|(_, i)| *i).collect::<Vec<_>>(), [5, 6, 4]);
        samples.neighbours(&[199.0], 1.0, &mut neighbours);
        assert_eq!(neighbours, [(1.0, 0), (2.0, 1)]);
    }
}
