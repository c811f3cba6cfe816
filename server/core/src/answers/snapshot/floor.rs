//! The floor of the best graph: what stands where, and rooms.

use super::Snapshot;
use crate::answers::query::Grid;
use crate::geometry::Pose2;
use crate::graph::Place;
use crate::regions::Rooms;
use crate::regions::occupancy::{Plot, grid};
use std::sync::Arc;

impl Snapshot {
    /// Occupancy grid of the best particle, as far as anything is known.
    pub fn grid(&self, resolution_m: f64) -> Grid {
        grid(&self.posed(), resolution_m)
    }

    fn posed(&self) -> Vec<(Pose2, Arc<Place>)> {
        self.poses.iter().copied().zip(self.places.iter().cloned()).collect()
    }

    /// Regions of the best graph: made when first asked for, for all snapshots of one posterior together.
    pub fn rooms(&self) -> &Arc<Rooms> {
        self.shared
            .rooms
            .get_or_init(|| Arc::new(self.counted(|plot| Rooms::new(plot, &self.posed(), &self.forbidden()))))
    }

    /// Occupancy grid of the best particle with the cells from which regions are made: it costs what has moved since one of
    /// the two was last asked for.
    pub fn plan(&self) -> Grid {
        self.counted(|plot| {
            plot.follow(&self.posed());
            plot.grid()
        })
    }

    /// Does ahead what otherwise the first waits for who asks for a plan, or for regions.
    pub fn count_ahead(&self) {
        self.counted(|plot| plot.follow(&self.posed()));
    }

    /// What is made from the counts of the posterior that was asked last.
    fn counted<T>(&self, make: impl FnOnce(&mut Plot) -> T) -> T {
        // One that a panic left half counted is begun anew.
        let mut plot = self.shared.plot.lock().unwrap_or_else(|half| {
            self.shared.plot.clear_poison();
            let mut plot = half.into_inner();
            *plot = None;
            plot
        });
        make(plot.get_or_insert_with(Rooms::plot))
    }
}
