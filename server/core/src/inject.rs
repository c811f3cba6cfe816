//! A trial of the filter: a share of what the matcher found replaced by what it might have found.
//!
//! A fit that counts as evidence has passed every gate of the matcher and the agreement of several
//! places; its transform is replaced after all of them, so that only eqs. (17–18) stand between a wrong
//! edge and the map.

use crate::config::Config;
use crate::edge::Vertex;
use crate::filter::loops::Fit;
use crate::geometry::Pose2;
use crate::random::{Purpose, generator};
use crate::scan::correlate::WINDOW_M;
use rand::RngExt;
use std::f64::consts::PI;

/// Replaces the transform of each fit with probability `config.inject_loops` by one that is uniform over
/// the search's window.
pub fn inject(config: &Config, t: Vertex, fits: &mut [Fit]) {
    if config.inject_loops <= 0.0 {
        return;
    }
    for fit in fits {
        let mut draw = generator(config.seed, t.into(), fit.i.into(), Purpose::Inject);
        if draw.random::<f64>() < config.inject_loops {
            let mut within = |half: f64| half * (2.0 * draw.random::<f64>() - 1.0);
            fit.mode.i_from_j = Pose2::new(within(WINDOW_M), within(WINDOW_M), within(PI));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edge::EdgeKind;
    use crate::scan::matching::Mode;
    use nalgebra::Matrix3;

    fn fits() -> Vec<Fit> {
        let mode = Mode {
            i_from_j: Pose2::new(1.0, 2.0, 0.5),
            covariance: Matrix3::identity(),
            score: 0.9,
            overlap: 0.6,
        };
        (0..1000).map(|i| Fit::supported_by(i, mode, EdgeKind::Distance, 3)).collect()
    }

    #[test]
    fn the_share_asked_for_is_replaced_by_anything_in_the_window() {
        let config = Config { inject_loops: 0.3, ..Config::default() };
        let mut spoilt = fits();
        inject(&config, 2000, &mut spoilt);
        let wrong: Vec<&Fit> = spoilt.iter().filter(|f| (f.mode.i_from_j.x_m - 1.0).abs() > 1e-12).collect();
        assert!((250..350).contains(&wrong.len()), "{}", wrong.len());
        let side = |f: &&&Fit| f.mode.i_from_j.x_m > 0.0;
        assert!((wrong.len() / 3..wrong.len() * 2 / 3).contains(&wrong.iter().filter(side).count()));
        assert!(wrong.iter().all(|f| f.mode.i_from_j.y_m.abs() <= WINDOW_M));
        let mut again = fits();
        inject(&config, 2000, &mut again);
        assert_eq!(spoilt, again);
    }

    #[test]
    fn nothing_is_replaced_unasked() {
        let mut same = fits();
        inject(&Config::default(), 2000, &mut same);
        assert_eq!(same, fits());
    }
}
