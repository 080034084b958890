use crate::search::*;
use crate::*;
use mops_core::{Effect, Study};
use std::sync::Arc;
use std::sync::atomic::AtomicUsize;
pub fn dev(study: &Study, effects: &[Arc<dyn Effect>]) {
    let subject = subject::Subject::new(study).unwrap();
    let sims = AtomicUsize::new(0);
    let t0 = std::time::Instant::now();
    let Some(cal) = base::fit(&subject, 1, &sims) else {
        println!("base fit failed");
        return;
    };
    println!(
        "base cal {:.4} n={} {:?} {:.2}s sims {:?}",
        cal.normalised(),
        cal.count,
        cal.point.globals,
        t0.elapsed().as_secs_f64(),
        sims
    );
    let s = Search {
        subject: &subject,
        effects,
        limits: Limits { effects: 3, refits: 10, finalists: 5, least_gain: 25.0 },
        simulations: &sims,
    };
    let Some(mut current) = s.declared(&cal) else {
        println!("declared failed");
        return;
    };
    println!(
        "base joint {:.4} n={} {:?} {:.2}s",
        current.fitted.normalised(),
        current.fitted.count,
        current.fitted.point.globals,
        t0.elapsed().as_secs_f64()
    );
    current = s.in_windows(current);
    println!("windows {} {:.4} {:.2}s", current.windows, current.fitted.normalised(), t0.elapsed().as_secs_f64());
    for round in 0..3 {
        if current.windows > 1 {
            if let Some(w) = s.over_whole(&current) {
                println!("  whole {:.4} {:.2}s", w.fitted.normalised(), t0.elapsed().as_secs_f64());
                if w.fitted.normalised() < 6.0 {
                    current = w;
                }
            }
        }
        let Some(r) = s.round(&current) else {
            println!("round failed");
            break;
        };
        println!("round {round}: {} screened {:.2}s sims {:?}", r.screened.len(), t0.elapsed().as_secs_f64(), sims);
        for x in r.screened.iter().take(6) {
            println!(
                "    screen {:9.1} abs {:.4} {} {} {:?}",
                x.gain,
                x.absorbed,
                x.added.candidate.effect.name(),
                x.added.candidate.place(),
                x.added.strengths
            );
        }
        for x in r.trials.iter().take(5) {
            println!(
                "  fit {:.4} score {:10.1} {} {:?} {:?}",
                x.fitted.normalised(),
                x.score(),
                x.name(),
                x.added.last().unwrap().strengths,
                x.fitted.point.globals
            );
        }
        let before = current.score();
        let Some(best) = r.trials.into_iter().next() else { break };
        let gain = before - best.score();
        println!("  gain {gain:.1}");
        if gain < 25.0 {
            break;
        }
        current = best;
    }
    println!(
        "FINAL {} {:.4}  {:.2}s sims {:?}",
        current.name(),
        current.fitted.normalised(),
        t0.elapsed().as_secs_f64(),
        sims
    );
}
