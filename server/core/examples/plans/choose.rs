//! Chooses scales on half of the buildings: those by which right rooms are likeliest.

use crate::outcomes;
use std::path::Path;
use toponym_core::language::Scales;

/// A scale, by name.
pub type Field = (&'static str, fn(&mut Scales) -> &mut f64);

macro_rules! fields {
    ($($name:ident)*) => { &[$((stringify!($name), |s| &mut s.$name),)*] };
}

/// All of them.
pub const FIELDS: &[Field] = fields! {
    next_to_m between_m across_from_m near_m at_end_m side_of_m left_of_m past_m through_m just side_kappa
    other_side door_pitch_m door_share door_missed door_any
};
/// Factors by which each is changed in turn, as long as one of them pays.
const STEPS: [f64; 3] = [1.6, 1.25, 1.1];
/// Least mass counted: one hopeless statement does not outweigh all others.
const MASS_MIN: f64 = 0.01;
/// What a scale costs that is twice or half what was set by hand. Statements here are true to the
/// decimetre, guides are not: only what pays clearly may become so narrow, or so wide.
const DOUBT: f64 = 0.01;
/// No reach is less than places are apart.
const REACH_MIN_M: f64 = 1.0;

/// Coordinate descent from what was set by hand, on the mean −log mass on right rooms, over statements
/// about rooms that were visited and about rooms that were not yet, all alike.
pub fn choose(plans: &Path) {
    let mut scales = Scales::BY_HAND;
    let mut best = loss(plans, &scales);
    for step in STEPS {
        for (name, field) in FIELDS {
            for factor in [step, 1.0 / step] {
                loop {
                    let mut other = scales;
                    *field(&mut other) *= factor;
                    let loss = loss(plans, &other);
                    if loss > best - 1e-5 || (name.ends_with("_m") && *field(&mut other) < REACH_MIN_M) {
                        break;
                    }
                    (scales, best) = (other, loss);
                    eprintln!("{best:.5} {name} {:.4}", field(&mut scales));
                }
            }
        }
    }
    println!("mean -log mass {best:.4}");
    for (name, field) in FIELDS {
        println!("{name}: {:.2},", field(&mut scales));
    }
}

fn loss(plans: &Path, scales: &Scales) -> f64 {
    let of = |later| {
        let (outcomes, _) = outcomes(plans, true, later, scales);
        let all: Vec<f64> = outcomes.values().flatten().map(|o| -o.ours.0.max(MASS_MIN).ln()).collect();
        all.iter().sum::<f64>() / all.len() as f64
    };
    let (mut scales, mut by_hand) = (*scales, Scales::BY_HAND);
    let doublings = FIELDS.iter().map(|(_, field)| (*field(&mut scales) / *field(&mut by_hand)).log2());
    of(false) + of(true) + DOUBT * doublings.map(|d| d * d).sum::<f64>()
}
