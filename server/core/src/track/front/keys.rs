//! The scans of the last metres of path, of which the local map and the places to come are made.

use crate::geometry::wrap;
use crate::scan::sweep::Sweep;
use crate::track::front::{CONTENT_REACH_M, FrontEnd, Key, LOCAL_PATH_M};
use crate::track::local::LocalMap;
use std::collections::VecDeque;

/// A scan becomes part of the local map after so much motion.
const KEY_STEP_M: f64 = 0.25;
const KEY_TURN_RAD: f64 = 0.35;
/// Scans in the local map.
const KEYS_MAX: usize = 60;
/// A local map of less path does not show what stands in it.
const SHORT_PATH_M: f64 = 0.75;

impl FrontEnd {
    /// Adds the scan to the local map if it shows it from a pose new to the last metres of path: what
    /// is older leaves both the local map and the places to come.
    pub(super) fn keep_key(&mut self, sweep: Sweep) {
        let near = |k: &Key| {
            self.path_m - k.path_m < CONTENT_REACH_M
                && k.front_from_body.distance_m(&self.front_from_body) < KEY_STEP_M
                && wrap(k.front_from_body.yaw_rad - self.front_from_body.yaw_rad).abs() < KEY_TURN_RAD
        };
        if sweep.points.is_empty() || self.keys.iter().rev().take(KEYS_MAX / 2).any(near) {
            return;
        }
        self.keys.push_back(Key { front_from_body: self.front_from_body, path_m: self.path_m, sweep });
        let keep_from_m = self.path_m - LOCAL_PATH_M;
        let gone = |keys: &VecDeque<Key>| {
            keys.len() > KEYS_MAX || keys.front().is_some_and(|k| k.path_m < keep_from_m)
        };
        let mut left = Vec::new();
        while gone(&self.keys) {
            left.extend(self.keys.pop_front());
        }
        if let (Some(local), Some(new)) = (&mut self.local, self.keys.back()) {
            local.add(&new.sweep.points, &new.front_from_body, new.path_m);
            for key in left {
                local.take_away(&key.sweep.points, &key.front_from_body, key.path_m);
            }
        }
    }

    pub(super) fn local(&mut self) -> &mut LocalMap {
        let keys = &self.keys;
        self.local.get_or_insert_with(|| {
            let mut local = LocalMap::default();
            for key in keys {
                local.add(&key.sweep.points, &key.front_from_body, key.path_m);
            }
            local
        })
    }

    /// Whether the local map is of so little path that it does not show what stands.
    pub(super) fn is_short(&self) -> bool {
        let ends = self.keys.front().zip(self.keys.back());
        ends.is_none_or(|(first, last)| last.path_m - first.path_m < SHORT_PATH_M)
    }
}
