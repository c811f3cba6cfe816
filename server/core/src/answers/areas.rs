//! Areas drawn at a desk, in the best graph.

use super::snapshot::Snapshot;

/// An area that stands.
#[derive(Clone, Debug, PartialEq)]
pub struct AreaView {
    /// Id by which it is taken back.
    pub id: String,
    /// What it is called.
    pub name: Option<String>,
    /// Whether robots keep out.
    pub forbidden: bool,
    /// Its corners in the map, metres.
    pub polygon_m: Vec<(f64, f64)>,
}

impl Snapshot {
    /// Areas that stand, oldest first.
    pub fn areas(&self) -> Vec<AreaView> {
        let ledger = self.ledger();
        let view = |area: &crate::talk::ledger::Drawn| AreaView {
            id: ledger.entries()[area.utterance as usize].id.clone(),
            name: area
                .name
                .map(|said| ledger.meant(said))
                .filter(|&label| ledger.speaks_of(area.utterance, label))
                .map(|label| ledger.name(label).to_owned()),
            forbidden: area.forbidden,
            polygon_m: area.polygon_m(self.poses()),
        };
        ledger.areas().iter().map(view).collect()
    }

    /// Where robots keep out: polygons in the map, metres.
    pub(crate) fn forbidden(&self) -> Vec<Vec<(f64, f64)>> {
        let areas = self.ledger().areas().iter().filter(|area| area.forbidden);
        areas.map(|area| area.polygon_m(self.poses())).collect()
    }
}
