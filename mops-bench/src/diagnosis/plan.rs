//! Plan of the simulated cases.

use mops::math;
use mops_testbed::{
    Draw, Effect, Missing, NOMINAL, Plant, Setting, Trial, disturbed, effects, generate, outside, plants,
};

/// Number of attempts to generate a case, as not every effect reaches every size in every plant.
const ATTEMPTS: u64 = 60;

/// Kind of a case: effects missing in its model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Kind {
    /// One effect of the catalogue.
    One,
    /// Two effects of the catalogue.
    Two,
    /// No effect.
    Nothing,
    /// An effect that is not in the catalogue.
    Outside,
    /// One effect or none, with or without a model error in the background.
    Setting(Setting),
}

impl Kind {
    /// Returns the name of the kind in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::One => "one",
            Self::Two => "two",
            Self::Nothing => "nothing",
            Self::Outside => "outside",
            Self::Setting(setting) => setting.letter(),
        }
    }
}

/// Plan of a benchmark.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    /// Names of the plants.
    pub plants: Vec<String>,
    /// Names of the effects.
    pub effects: Vec<String>,
    /// Errors of the refitted nominal model, in units of the noise.
    pub sizes: Vec<f64>,
    /// Number of cases of each kind.
    pub counts: Vec<(Kind, usize)>,
    /// True if no case of a setting has a record for selection.
    pub without_selection: bool,
    /// Seed.
    pub seed: u64,
    /// Names of the selected cases; all if empty.
    pub only: Vec<String>,
}

/// Requested case.
#[derive(Debug, Clone)]
pub(crate) struct Wish {
    /// Kind of the case.
    pub kind: Kind,
    /// Number of the case within its kind.
    pub number: usize,
}

impl Plan {
    /// Returns all cases, with the kinds mixed in proportion, so that an interrupted benchmark covers every kind.
    #[allow(clippy::cast_precision_loss)]
    pub fn wishes(&self) -> Vec<Wish> {
        let of_kind = |&(kind, count): &(Kind, usize)| {
            (0..count).map(move |number| ((number as f64 + 0.5) / count as f64, Wish { kind, number }))
        };
        let may_be = |name: &String, wish: &Wish| self.number_in(name) == Some(wish.number as u64);
        let is_wanted = |wish: &Wish| self.only.is_empty() || self.only.iter().any(|name| may_be(name, wish));
        let mut all: Vec<(f64, Wish)> = self.counts.iter().flat_map(of_kind).filter(|(_, w)| is_wanted(w)).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all.into_iter().map(|(_, wish)| wish).collect()
    }

    /// Returns the cases selected by name.
    pub fn named(&self) -> Vec<Trial> {
        if self.only.is_empty() {
            return Vec::new();
        }
        self.wishes().iter().filter_map(|wish| self.make(wish)).filter(|trial| self.wants(&trial.name)).collect()
    }

    /// Returns true if a case with this name is selected.
    pub fn wants(&self, name: &str) -> bool {
        self.only.is_empty() || self.only.iter().any(|wanted| wanted == name)
    }

    /// Returns the seed of an attempt to generate a case.
    fn seed_of(&self, number: u64, attempt: u64) -> u64 {
        (self.seed << 32) + number * ATTEMPTS + attempt
    }

    /// Returns the number of a case from its name, which ends with its seed.
    fn number_in(&self, name: &str) -> Option<u64> {
        let seed: u64 = name.rsplit('-').next()?.parse().ok()?;
        Some(seed.checked_sub(self.seed_of(0, 0))? / ATTEMPTS)
    }

    /// Returns the requested size that is nearest to a reached one.
    pub fn nearest(&self, reached: f64) -> f64 {
        let off = |size: &f64| math::ln(size / reached).abs();
        self.sizes.iter().copied().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(reached)
    }

    /// Generates the case; returns `None` if no plant reaches the size with a plausible parameter.
    ///
    /// Cases cycle through the effects, then through the sizes, so that every effect occurs at every size. The plant is
    /// drawn from those that the effect fits.
    pub fn make(&self, wish: &Wish) -> Option<Trial> {
        let Wish { kind, number } = *wish;
        if let Kind::Setting(setting) = kind {
            return self.make_setting(setting, number);
        }
        let mut draw = Draw::new(self.seed, &format!("{kind:?} {number}"));
        let size = |among: usize| self.sizes[(number / among.max(1)) % self.sizes.len()];
        let fitting = |effect: &Effect| -> Vec<&'static Plant> {
            let all = plants().iter().copied().filter(|plant| self.plants.iter().any(|name| name == plant.name));
            all.filter(|plant| !(effect.fits)(plant).is_empty()).collect()
        };
        let known: Vec<&'static Effect> = match kind {
            Kind::Outside => outside(),
            _ => effects().into_iter().filter(|e| self.effects.iter().any(|name| name == e.name)).collect(),
        };
        // Names are unique here: some effects have variants for joints and for actuators.
        let mut names: Vec<&'static str> = known.iter().map(|e| e.name).collect();
        names.dedup();
        let places = |name: &str| -> Vec<&'static Plant> {
            let of_name = known.iter().filter(|e| e.name == name);
            let mut all: Vec<&'static Plant> = of_name.flat_map(|e| fitting(e)).collect();
            all.dedup_by_key(|plant| plant.name);
            all
        };
        (0..ATTEMPTS).find_map(|attempt| {
            let seed = self.seed_of(number as u64, attempt);
            if kind == Kind::Nothing {
                let name = &self.plants[number % self.plants.len()];
                return generate(name, Missing::Nothing, 0.0, seed);
            }
            let first = *names.get(number % names.len().max(1))?;
            let possible = places(first);
            let plant = *possible.get(draw.below(possible.len().max(1)))?;
            match kind {
                Kind::Two => {
                    let others: Vec<&str> =
                        names.iter().copied().filter(|n| places(n).iter().any(|p| p.name == plant.name)).collect();
                    let second = others[draw.below(others.len())];
                    generate(plant.name, Missing::Effects(&[first, second]), size(names.len()), seed)
                }
                Kind::Outside => generate(plant.name, Missing::Outside(first), size(names.len()), seed),
                _ => generate(plant.name, Missing::Effects(&[first]), size(names.len()), seed),
            }
        })
    }

    /// Generates a case of a setting. Cases cycle through the plants, then through the effects of each in random order.
    fn make_setting(&self, setting: Setting, number: usize) -> Option<Trial> {
        let effects_of = |plant: &str| -> Vec<&'static str> {
            let is_chosen =
                |effect: &str| self.effects.iter().any(|name| Some(name.as_str()) == effect.split('@').next());
            let own = NOMINAL.iter().filter(|nominal| nominal.plant == plant && is_chosen(nominal.effect));
            own.flat_map(|nominal| std::iter::repeat_n(nominal.effect, nominal.weight)).collect()
        };
        let plants: Vec<(&String, Vec<&str>)> = self.plants.iter().map(|plant| (plant, effects_of(plant))).collect();
        let plants: Vec<_> = plants.iter().filter(|(_, effects)| !effects.is_empty()).collect();
        let (plant, effects) = plants.get(number % plants.len().max(1))?;
        let mut order: Vec<&str> = effects.clone();
        let mut draw = Draw::new(self.seed, &format!("{} effects of {plant}", setting.letter()));
        for i in (1..order.len()).rev() {
            order.swap(i, draw.below(i + 1));
        }
        let effect = order[number / plants.len() % order.len()];
        let seeds = (0..ATTEMPTS).map(|attempt| self.seed_of(number as u64, attempt));
        let trial = seeds.into_iter().find_map(|seed| disturbed(setting, plant, effect, seed))?;
        Some(if self.without_selection { trial.without_selection() } else { trial })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan() -> Plan {
        Plan {
            plants: vec!["pendulum".into(), "servo".into()],
            effects: vec!["coulomb-friction".into(), "input-delay".into()],
            sizes: vec![5.0, 2.0],
            counts: vec![(Kind::One, 4), (Kind::Two, 1), (Kind::Nothing, 2), (Kind::Outside, 1)],
            without_selection: false,
            seed: 1,
            only: Vec::new(),
        }
    }

    #[test]
    fn every_effect_occurs_at_every_size_and_kinds_are_mixed() {
        let plan = plan();
        let wishes = plan.wishes();
        assert_eq!(wishes.len(), 8);
        assert!(wishes[..4].iter().any(|wish| wish.kind != Kind::One));
        let of_one = wishes.iter().filter(|wish| wish.kind == Kind::One);
        let made: Vec<(String, f64)> = of_one
            .map(|wish| plan.make(wish).expect("these can be made"))
            .map(|trial| (trial.truth.effects[0].class.clone(), if trial.truth.size > 3.0 { 5.0 } else { 2.0 }))
            .collect();
        for effect in ["coulomb-friction", "input-delay"] {
            for size in [5.0, 2.0] {
                assert!(made.contains(&(effect.to_owned(), size)), "{effect} {size}: {made:?}");
            }
        }
    }

    #[test]
    fn a_case_can_be_generated_again_by_its_name() {
        let all = plan();
        let third = all.make(&Wish { kind: Kind::One, number: 3 }).expect("it can be made");
        let only = Plan { only: vec![third.name.clone(), "nothing-9".into()], ..all };
        assert!(only.wants(&third.name) && !only.wants("nothing-9-1"));
        assert_eq!(only.wishes().len(), 1, "no other kind has so many");
        assert_eq!(only.named(), [third]);
    }

    #[test]
    fn cases_of_a_setting_cycle_through_the_plants_and_can_be_generated_again_by_their_names() {
        let (setting, kind) = (Setting::EffectAndBackground, Kind::Setting(Setting::EffectAndBackground));
        let plants = ["driven-pendulum", "cascade"].map(str::to_owned).to_vec();
        let effects = ["coulomb-friction", "leak", "linear-loss"].map(str::to_owned).to_vec();
        let plan = Plan { plants, effects, counts: vec![(kind, 6)], ..plan() };
        let all: Vec<Trial> = plan.wishes().iter().map(|wish| plan.make(wish).expect("it can be made")).collect();
        for (number, trial) in all.iter().enumerate() {
            assert_eq!(trial.plant, plan.plants[number % 2]);
            assert!(trial.name.starts_with(setting.letter()) && plan.effects.contains(&trial.truth.effects[0].class));
        }
        // Both effects of the cascade have one weight.
        let leaks = all.iter().filter(|trial| trial.truth.effects[0].class == "leak").count();
        assert!((1..=2).contains(&leaks), "{leaks}");
        let only = Plan { only: vec![all[3].name.clone()], ..plan };
        assert_eq!(only.named(), [all[3].clone()]);
    }

    #[test]
    fn the_same_plan_makes_the_same_cases() {
        let (plan, wish) = (plan(), Wish { kind: Kind::One, number: 3 });
        assert_eq!(plan.make(&wish), plan.make(&wish));
    }
}
