//! Other values of shapes that no fit moves, such as the number of waves in a turn, of the effects that were found.

use mops_core::InitialGrid;
use rayon::prelude::*;

use crate::search::{Search, Trial};
use crate::variant::Added;
use crate::weigh::{CLEARLY, Dispersion, criterion};

/// Iterations with which every beginning begins.
const LOOK: usize = 4;

impl<'a> Search<'a> {
    /// The model with the best of such values, and those that the data allow in its place.
    pub fn shapes(&self, last: Trial<'a>) -> (Trial<'a>, Vec<Trial<'a>>) {
        let all: Vec<(usize, Vec<Vec<f64>>)> = (0..last.added.len())
            .flat_map(|index| others(&last.added[index]).into_iter().map(move |begins| (index, begins)))
            .collect();
        let fitted = all.into_par_iter().filter_map(|(index, begins)| {
            let looked = begins.into_iter().filter_map(|strengths| {
                let mut added = last.added.clone();
                added[index].strengths = strengths;
                self.from(&last, &added, LOOK)
            });
            looked.min_by(|a, b| a.fitted.chi2.total_cmp(&b.fitted.chi2))?.continued(40)
        });
        let mut rivals: Vec<Trial<'a>> = fitted.collect();
        rivals.insert(0, last);
        let of = rivals.iter().map(Dispersion::of).min_by(|a, b| a.square.total_cmp(&b.square)).expect("one is there");
        rivals.sort_by(|a, b| criterion(a, &of).total_cmp(&criterion(b, &of)));
        let most = criterion(&rivals[0], &of) + CLEARLY;
        let mut allowed = rivals.into_iter().take_while(|trial| criterion(trial, &of) <= most);
        (allowed.next().expect("the best is allowed"), allowed.collect())
    }
}

/// For every other value of a shape that no fit moves, strengths to begin with.
fn others(own: &Added) -> Vec<Vec<Vec<f64>>> {
    let effect = own.candidate.effect.as_ref();
    let kept: Vec<usize> = (0..effect.parameters().len()).filter(|&k| effect.parameters()[k].fixed).collect();
    let values = |strengths: &[f64]| kept.iter().map(|&k| strengths[k]).collect::<Vec<f64>>();
    let mut others: Vec<Vec<Vec<f64>>> = Vec::new();
    if kept.is_empty() {
        return others;
    }
    for mut strengths in own.sizes.combinations(effect) {
        if values(&strengths) == values(&own.strengths) {
            continue;
        }
        if effect.parameters()[0].grid == InitialGrid::Linear {
            strengths[0] = own.strengths[0];
        }
        match others.iter_mut().find(|begins| values(&begins[0]) == values(&strengths)) {
            Some(begins) => begins.push(strengths),
            None => others.push(vec![strengths]),
        }
    }
    others
}
