use mops_core::*;
use mops_problems::*;
use std::time::Instant;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let suite = suites().into_iter().find(|s| s.name == args[1]).unwrap();
    let slope = if args[2] == "g" { Slope::Exact } else { Slope::Differences };
    let kind = args.get(3).map_or("sqp", |s| s);
    let only = args.get(4);
    let mut solved = 0;
    let mut evs = vec![];
    let mut total = 0;
    let mut worst = vec![];
    for p in (suite.problems)() {
        if let Some(o) = only {
            if *o != p.name {
                continue;
            }
        }
        let posed = Posed::new(&p, slope);
        let mut s = mops_solvers::kinds().into_iter().find(|k| k.name == kind).unwrap().default_choice().make();
        let t = Instant::now();
        let m = measure(&p, &posed, &posed.start(), s.as_mut(), 2000 * (1 + p.dimension()));
        let el = t.elapsed().as_secs_f64();
        total += 1;
        let e = m.evaluations_to(suite.accuracy);
        let ok = e.is_some();
        if ok {
            solved += 1;
            evs.push(e.unwrap());
        } else {
            worst.push(p.name.clone());
        }
        println!(
            "{:16} n{:3} m{:4} f* {:>16.9e} reached {:>16.9e} viol {:.1e} ev3 {:>6} ev {:>6} of {:>6} lin {:>4} {:?} {:.1}ms {}",
            p.name,
            p.dimension(),
            posed.shape().rows.len(),
            m.target.unwrap_or(f64::NAN),
            m.best.objective,
            m.best.violation,
            m.evaluations_to(1e-3).map_or("-".into(), |e| e.to_string()),
            e.map_or("-".into(), |e| e.to_string()),
            m.history.len(),
            m.linearisations,
            m.stop,
            el * 1e3,
            if ok { "" } else { "  <<<<<" }
        );
        if m.claims_what_is_violated() {
            println!("   FALSE SUCCESS");
        }
    }
    evs.sort();
    println!("solved {solved}/{total}, median {:?}, not: {worst:?}", evs.get(evs.len() / 2));
}
