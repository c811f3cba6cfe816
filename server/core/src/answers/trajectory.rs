//! Carries odometry through the map: the robot's pose at every odometry stamp.

use crate::edge::PlaceId;
use crate::geometry::Pose2;
use std::collections::BTreeMap;

/// A scan's final pose relative to its place, as told by `Effect::ScanPlaced`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keyframe {
    /// How many odometry rows came before the scan.
    pub rows_before: usize,
    /// The place held.
    pub place: PlaceId,
    /// The body in that place's frame.
    pub place_from_body: Pose2,
    /// Odometry at the scan.
    pub odom_from_body: Pose2,
}

/// Who went twice as far as odometry says, and by more than that, metres plus radians, went unnoticed by it.
const UNLIKE: f64 = 0.02;

/// Poses of odometry `rows` (in order of arrival) in the map: odometry since the keyframe before
/// and back from the keyframe after, blended by odometry's path, or by rows if it hardly noticed the
/// way. Keyframes are in order of arrival; those whose place is not in `places` are passed over. Before
/// the first keyframe and after the last, the one that there is; with no keyframe at all, odometry itself.
pub fn carry(rows: &[Pose2], keyframes: &[Keyframe], places: &BTreeMap<PlaceId, Pose2>) -> Vec<Pose2> {
    let known: Vec<(usize, Pose2, Pose2)> = keyframes
        .iter()
        .filter_map(|k| {
            let place = places.get(&k.place)?;
            Some((k.rows_before, place.compose(&k.place_from_body), k.odom_from_body))
        })
        .collect();
    let mut path_m = vec![0.0; rows.len()];
    for i in 1..rows.len() {
        path_m[i] = path_m[i - 1] + rows[i - 1].distance_m(&rows[i]) + wrap_abs(&rows[i - 1], &rows[i]);
    }
    rows.iter()
        .enumerate()
        .map(|(i, row)| {
            // Row i came before every keyframe with rows_before > i.
            let next = known.partition_point(|k| k.0 <= i);
            let from = |k: &(usize, Pose2, Pose2)| k.1.compose(&k.2.between(row));
            match (next.checked_sub(1).and_then(|p| known.get(p)), known.get(next)) {
                (None, None) => *row,
                (Some(k), None) | (None, Some(k)) => from(k),
                (Some(a), Some(b)) => {
                    let at = |r: usize| path_m[r.saturating_sub(1)];
                    let span = at(b.0) - at(a.0);
                    let moved = a.1.distance_m(&b.1) + wrap_abs(&a.1, &b.1);
                    let (done, all) = if moved > 2.0 * span + UNLIKE {
                        ((i + 1).saturating_sub(a.0) as f64, (b.0 - a.0) as f64)
                    } else {
                        (path_m[i] - at(a.0), span)
                    };
                    let f = if all > 1e-9 { (done / all).clamp(0.0, 1.0) } else { 0.0 };
                    from(a).blend(&from(b), f)
                }
            }
        })
        .collect()
}

fn wrap_abs(a: &Pose2, b: &Pose2) -> f64 {
    a.between(b).yaw_rad.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_between_keyframes_are_blended_by_path() {
        // Odometry says 1 m a row along x; the second place says that it was 1.1 m a row.
        let rows: Vec<Pose2> = (0..=10).map(|i| Pose2::new(f64::from(i), 0.0, 0.0)).collect();
        let places = BTreeMap::from([(0, Pose2::default()), (1, Pose2::new(11.0, 0.0, 0.0))]);
        let key = |rows_before: usize, place, x| Keyframe {
            rows_before,
            place,
            place_from_body: Pose2::default(),
            odom_from_body: Pose2::new(x, 0.0, 0.0),
        };
        let poses = carry(&rows, &[key(1, 0, 0.0), key(11, 1, 10.0)], &places);
        for (i, p) in poses.iter().enumerate() {
            assert!((p.x_m - 1.1 * i as f64).abs() < 1e-9, "row {i}: {p:?}");
        }
    }

    #[test]
    fn where_odometry_stands_still_rows_are_blended_by_number() {
        let rows = vec![Pose2::default(); 9];
        let places = BTreeMap::from([(0, Pose2::default())]);
        let key = |rows_before: usize, x| Keyframe {
            rows_before,
            place: 0,
            place_from_body: Pose2::new(x, 0.0, 0.0),
            odom_from_body: Pose2::default(),
        };
        let poses = carry(&rows, &[key(1, 0.0), key(5, 0.4), key(9, 0.8)], &places);
        for (i, p) in poses.iter().enumerate() {
            assert!((p.x_m - 0.1 * i as f64).abs() < 1e-9, "row {i}: {p:?}");
        }
    }

    #[test]
    fn no_keyframe_leaves_odometry() {
        let rows = [Pose2::new(1.0, 2.0, 0.3)];
        assert_eq!(carry(&rows, &[], &BTreeMap::new()), rows);
    }
}
