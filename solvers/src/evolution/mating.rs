//! Creation of offspring from tournament winners.

use rand::Rng;

use super::{State, Survival};

impl State {
    /// Overwrites the children: copies pairs of tournament winners, then crosses and mutates them.
    pub(super) fn mate(&mut self, survival: &impl Survival) {
        // Buffers of dropped points are reused; allocate any that are missing.
        let n = self.members.points[0].len();
        self.children.resize_with(self.size, || vec![0.0; n]);
        for pair in 0..self.size.div_ceil(2) {
            let parents = [self.tournament_winner(survival), self.tournament_winner(survival)];
            let (first, second) = self.children.split_at_mut(2 * pair + 1);
            let a = first.last_mut().expect("a child");
            a.copy_from_slice(&self.members.points[parents[0]]);
            if let Some(b) = second.first_mut() {
                b.copy_from_slice(&self.members.points[parents[1]]);
                self.variation.cross(a, b, &mut self.random);
                self.variation.mutate(b, &mut self.random);
            }
            self.variation.mutate(a, &mut self.random);
        }
    }

    /// Returns the winner of a tournament between two random members.
    fn tournament_winner(&mut self, survival: &impl Survival) -> usize {
        let size = self.members.len();
        let (a, b) = (self.random.random_range(0..size), self.random.random_range(0..size));
        if survival.prefers(a, b).is_gt() { b } else { a }
    }
}
