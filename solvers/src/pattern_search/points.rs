//! Lists of points.

/// Points, in memory that is used again.
#[derive(Debug, Default)]
pub struct Points {
    all: Vec<Vec<f64>>,
    count: usize,
}

impl Points {
    /// Forgets all.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds a point with given coordinates.
    pub fn push(&mut self, coordinates: impl Iterator<Item = f64>) {
        if self.count == self.all.len() {
            self.all.push(Vec::new());
        }
        let point = &mut self.all[self.count];
        point.clear();
        point.extend(coordinates);
        self.count += 1;
    }

    /// Adds a point with given coordinates if it is wanted; `is_wanted` gets it and the points before it.
    pub fn push_if(
        &mut self,
        coordinates: impl Iterator<Item = f64>,
        is_wanted: impl FnOnce(&[f64], &[Vec<f64>]) -> bool,
    ) {
        self.push(coordinates);
        let (last, before) = self.all[..self.count].split_last().expect("one was added");
        if !is_wanted(last, before) {
            self.count -= 1;
        }
    }

    pub fn as_slice(&self) -> &[Vec<f64>] {
        &self.all[..self.count]
    }

    pub fn len(&self) -> usize {
        self.count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_forgets_what_was_in_it() {
        let mut points = Points::default();
        points.push([1.0, 2.0].into_iter());
        points.push_if([1.0, 2.0].into_iter(), |point, before| point != before[0]);
        points.push_if([3.0].into_iter(), |point, before| point != before[0]);
        assert_eq!(points.as_slice(), [vec![1.0, 2.0], vec![3.0]]);
        points.clear();
        points.push([4.0].into_iter());
        assert_eq!((points.len(), points.as_slice()), (1, &[vec![4.0]][..]));
    }
}
