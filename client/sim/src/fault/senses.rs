//! What lasers see and send on a drive on which something goes wrong.

use super::{Fault, Incident};
use crate::laser::{LaserModel, Sweep};
use crate::random::Draw;
use crate::world::{Surface, World};
use std::borrow::Cow;
use std::f64::consts::PI;
use toponym_proto::Stamp;

/// The building, with some of its walls of another stuff.
pub(crate) fn building<'a>(world: &'a World, faults: &[Fault], draw: &mut Draw) -> Cow<'a, World> {
    let mut world = Cow::Borrowed(world);
    for fault in faults {
        let (share, surface) = match *fault {
            Fault::Glass { share } => (share, Surface::Glass),
            Fault::Dark { share } => (share, Surface::Dark),
            _ => continue,
        };
        let world = world.to_mut();
        world.surfaces.resize(world.walls.len(), Surface::default());
        for of_wall in &mut world.surfaces {
            if draw.chance(share) {
                *of_wall = surface;
            }
        }
    }
    world
}

/// How many people walk about.
pub(crate) fn people(faults: &[Fault], people: usize) -> usize {
    let crowd = |fault: &Fault| if let Fault::Crowd { people } = *fault { people } else { 0 };
    faults.iter().map(crowd).fold(people, usize::max)
}

/// A laser as it really sits, whatever setup says.
pub(crate) fn mounted(faults: &[Fault], laser: &LaserModel) -> LaserModel {
    let mut laser = laser.clone();
    for fault in faults {
        match fault {
            Fault::Mirrored => laser.mount.upside_down ^= true,
            Fault::Backwards => laser.mount.yaw_rad += PI,
            _ => {}
        }
    }
    laser
}

/// Whether no scan is sent at a time.
pub(crate) fn covered(incidents: &[Incident], t_s: f64) -> bool {
    incidents.iter().any(|i| i.fault == Fault::Carried && i.at(t_s))
}

/// What becomes of a sweep until it is sent; `last` is what was sent before.
pub(crate) fn sent(incidents: &[Incident], t_s: f64, sweep: Sweep, last: Option<&Sweep>) -> Sweep {
    let mut sweep = sweep;
    for incident in incidents.iter().filter(|i| i.at(t_s)) {
        match incident.fault {
            Fault::Frozen { .. } => return last.cloned().unwrap_or(sweep),
            Fault::Millimetres => sweep.ranges_m.iter_mut().for_each(|r| *r *= 1000.0),
            _ => {}
        }
    }
    sweep
}

/// The stamp that a laser gives it.
pub(crate) fn stamped(faults: &[Fault], stamp: Stamp) -> Stamp {
    let behind =
        |fault: &Fault| if let Fault::Clock { behind_s } = *fault { (behind_s * 1e9) as i64 } else { 0 };
    Stamp { ns: stamp.ns - faults.iter().map(behind).sum::<i64>() }
}

#[cfg(test)]
mod tests {
    use crate::Scenario;
    use toponym_proto::{Message, Odom, Scan};

    /// Odometry and scans of a short tour on which something goes wrong.
    fn streams(fault: &str) -> (Vec<Odom>, Vec<Scan>) {
        let mut scenario = Scenario::demo(1);
        scenario.tour.truncate(3);
        scenario.faults = fault.parse().into_iter().collect();
        let (mut odom, mut scans) = (Vec::new(), Vec::new());
        for message in scenario.run().unwrap().messages {
            match message {
                Message::Odom(o) => odom.push(o),
                Message::Scan(s) => scans.push(s),
                _ => {}
            }
        }
        (odom, scans)
    }

    #[test]
    fn lasers_go_wrong_as_they_are_told_to() {
        let (right_odom, right) = streams("none");
        let of = |fault| streams(fault).1;
        let (mirrored, backwards, millimetres) = (of("mirrored"), of("backwards"), of("millimetres"));
        let median = |scan: &Scan, from: usize, to: usize| {
            let mut ranges: Vec<f32> =
                scan.ranges_m[from..to].iter().copied().filter(|r| r.is_finite()).collect();
            ranges.sort_by(f32::total_cmp);
            ranges[ranges.len() / 2]
        };
        let (n, half) = (right[0].ranges_m.len(), right[0].ranges_m.len() / 2);
        assert!((median(&right[0], 0, half) - median(&mirrored[0], half, n)).abs() < 0.05);
        assert!((median(&right[0], 0, n) - median(&millimetres[0], 0, n) / 1000.0).abs() < 1e-3);
        assert!(right[0].ranges_m != backwards[0].ranges_m);
        let repeated = |scans: &[Scan]| {
            scans.windows(2).filter(|s| s[0].ranges_m.iter().eq(s[1].ranges_m.iter())).count()
        };
        assert!(repeated(&of("frozen:10")) >= 45 && repeated(&right) == 0);
        let clock = of("clock:100");
        assert_eq!(right[7].header.stamp.ns - clock[7].header.stamp.ns, 100_000_000_000);
        let seen = |scans: &[Scan]| scans.iter().flat_map(|s| &s.ranges_m).filter(|r| r.is_finite()).count();
        for stuff in ["glass:1", "dark:1"] {
            assert!(seen(&of(stuff)) < seen(&right) * 3 / 4, "{stuff}");
        }
        assert!(right.iter().zip(&of("crowd:20")).any(|(a, b)| a.ranges_m != b.ranges_m));
        let (carried_odom, carried) = streams("carried");
        assert!(carried.len() < right.len() - 20 && carried_odom.len() == right_odom.len());
    }

    #[test]
    fn wheels_go_wrong_as_they_are_told_to() {
        let (right, _) = streams("none");
        let way_m = |odom: &[Odom]| -> f64 {
            let step = |o: &[Odom]| {
                let (a, b) = (&o[0].odom_from_body, &o[1].odom_from_body);
                (a.x_m - b.x_m).hypot(a.y_m - b.y_m)
            };
            odom.windows(2).map(step).sum()
        };
        let whole_m = way_m(&right);
        assert!((way_m(&streams("scale:0.5").0) / whole_m - 0.5).abs() < 0.02);
        assert!(way_m(&streams("constant").0) < 1e-9);
        assert!((way_m(&streams("pushed:3").0) - (whole_m - 3.0)).abs() < 0.2);
        assert!(way_m(&streams("jitter:0.01").0) > whole_m + 1.0);
        let stale = streams("stale:5").0;
        let held = stale.windows(2).filter(|o| o[0].odom_from_body == o[1].odom_from_body).count();
        assert!(held > stale.len() * 3 / 4, "{held} of {}", stale.len());
    }
}
