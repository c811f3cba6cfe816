//! "Where is the gym?"

use super::{PROBABILITY_MIN, Snapshot, open_poses};
use crate::answers::meaning::{Meaning, meaning};
use crate::answers::query::WhereAnswer;
use crate::answers::whereabouts::{Known, Region, whereabouts};
use crate::edge::Vertex;
use crate::effects::TrackState;
use crate::filter::labels::LabelId;
use crate::filter::particle::Particle;
use crate::geometry::Pose2;
use crate::language::Name;

/// Candidates told.
const CANDIDATES_MAX: usize = 10;

impl Snapshot {
    /// "Where is the gym?": over all particles, which place is meant.
    pub fn where_is(&self, text: &str, lang: Option<&str>) -> WhereAnswer {
        let name = self.speech(lang).and_then(|speech| speech.parse_query(text));
        let found = name.map(|name| self.where_named(&name));
        WhereAnswer { text: text.to_owned(), ..found.unwrap_or_else(|| self.nowhere(None)) }
    }

    fn nowhere(&self, name: Option<&Name>) -> WhereAnswer {
        WhereAnswer {
            text: name.map_or_else(String::new, |n| n.as_str().to_owned()),
            label: name.map(|n| n.as_str().to_owned()),
            via: "unknown".to_owned(),
            p_none: 1.0,
            unresolved: self.unresolved,
            candidates: Vec::new(),
            suggestions: Vec::new(),
            // Who is lost is nowhere to count distances from.
            robot: self.now.robot.filter(|_| self.now.state != TrackState::Lost),
        }
    }

    /// Where is what people may mean by a name.
    pub(crate) fn where_named(&self, name: &Name) -> WhereAnswer {
        let Meaning { via, p, labels, suggestions } =
            meaning(name, &self.ledger, &|label| self.is_known(label), &|| self.known());
        let names = |ids: Vec<LabelId>| ids.iter().map(|&id| self.ledger.name(id).to_owned()).collect();
        let (via, suggestions) = (via.to_owned(), names(suggestions));
        let mut answer = WhereAnswer { via, suggestions, ..self.nowhere(Some(name)) };
        let pose = |p: &Particle, v: Vertex| self.pose(p, v);
        let (particles, named, ledger) = (&self.particles, self.named(), &self.ledger);
        let known = Known { particles, pose: &pose, named, ledger, by_paper: self.by_paper };
        let found = |&label: &LabelId| {
            let found = whereabouts(&known, label, PROBABILITY_MIN);
            (label, found.regions, found.p_none)
        };
        let found: Vec<(LabelId, Vec<Region>, f64)> = labels.iter().map(found).collect();
        // One place is meant: names that are as likely share it, as far as each is anywhere.
        let somewhere: f64 = found.iter().map(|(.., p_none)| 1.0 - p_none).sum();
        let share = p * self.resolved() / somewhere.max(1.0);
        let mut all: Vec<(LabelId, Region)> = Vec::new();
        for (label, regions, _) in found {
            let likely = regions.into_iter().filter(|r| r.p_is >= PROBABILITY_MIN);
            all.extend(likely.map(|r| (label, Region { probability: share * r.probability, ..r })));
        }
        all.sort_by(|(_, a), (_, b)| b.probability.total_cmp(&a.probability).then(a.place.cmp(&b.place)));
        all.truncate(CANDIDATES_MAX);
        // None of those told: of the others each is next to impossible.
        answer.p_none = 1.0 - all.iter().map(|(_, r)| r.probability).sum::<f64>();
        answer.candidates = all.into_iter().map(|(label, r)| self.candidate(label, r)).collect();
        answer
    }

    /// Pose of a place, or of one that is not frozen yet, in a particle's map.
    fn pose(&self, p: &Particle, v: Vertex) -> Option<Pose2> {
        let frozen = p.belief.len();
        if (v as usize) < frozen {
            return Some(p.belief.pose(v));
        }
        open_poses(p, &self.places, &self.open).get(v as usize - frozen).copied()
    }

    /// Whether something speaks for a name.
    fn is_known(&self, label: LabelId) -> bool {
        let mut evidence = self.particles.iter().flat_map(|p| p.labels.evidence());
        evidence.any(|e| e.label == label && e.weight > 0.0) && !self.ledger.name(label).is_empty()
    }

    /// Names that something speaks for, in the order first said.
    fn known(&self) -> Vec<LabelId> {
        let mut known = vec![false; self.ledger.names().len()];
        for e in self.particles.iter().flat_map(|p| p.labels.evidence()).filter(|e| e.weight > 0.0) {
            if let Some(known) = known.get_mut(e.label as usize) {
                *known = true;
            }
        }
        let ids = (0..known.len()).filter(|&id| known[id]).map(|id| id as LabelId);
        ids.filter(|&id| !self.ledger.name(id).is_empty()).collect()
    }

    /// Share of the posterior that the particles stand for; what was pruned and may yet be true is none of
    /// them, and no question is answered from it.
    fn resolved(&self) -> f64 {
        1.0 - self.unresolved
    }
}
