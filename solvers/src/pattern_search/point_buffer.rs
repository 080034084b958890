//! Buffer of points.

/// List of points that reuses its memory.
#[derive(Debug, Default)]
pub struct PointBuffer {
    points: Vec<Vec<f64>>,
    count: usize,
}

impl PointBuffer {
    /// Removes all points.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds a point with the given coordinates.
    pub fn push(&mut self, coordinates: impl Iterator<Item = f64>) {
        if self.count == self.points.len() {
            self.points.push(Vec::new());
        }
        let point = &mut self.points[self.count];
        point.clear();
        point.extend(coordinates);
        self.count += 1;
    }

    /// Adds a point with the given coordinates if `is_accepted` returns true for it and the points before it.
    pub fn push_if(
        &mut self,
        coordinates: impl Iterator<Item = f64>,
        is_accepted: impl FnOnce(&[f64], &[Vec<f64>]) -> bool,
    ) {
        self.push(coordinates);
        let (last, previous) = self.points[..self.count].split_last().expect("one was added");
        if !is_accepted(last, previous) {
            self.count -= 1;
        }
    }

    pub fn as_slice(&self) -> &[Vec<f64>] {
        &self.points[..self.count]
    }

    pub fn len(&self) -> usize {
        self.count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cleared_buffer_is_empty() {
        let mut points = PointBuffer::default();
        points.push([1.0, 2.0].into_iter());
        points.push_if([1.0, 2.0].into_iter(), |point, previous| point != previous[0]);
        points.push_if([3.0].into_iter(), |point, previous| point != previous[0]);
        assert_eq!(points.as_slice(), [vec![1.0, 2.0], vec![3.0]]);
        points.clear();
        points.push([4.0].into_iter());
        assert_eq!((points.len(), points.as_slice()), (1, &[vec![4.0]][..]));
    }
}
