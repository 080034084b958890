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

    /// Takes the last one back unless it is wanted, as the ones before it are given too.
    pub fn keep_last(&mut self, is_wanted: impl FnOnce(&[f64], &[Vec<f64>]) -> bool) {
        if let Some((last, before)) = self.all[..self.count].split_last()
            && !is_wanted(last, before)
        {
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
