//! "Where is the gym?"

use super::{Snapshot, open_poses};
use crate::answers::described::features::Speaker;
use crate::answers::meaning::{Meaning, meaning};
use crate::answers::named::Spot;
use crate::answers::query::{Candidate, WhereAnswer};
use crate::answers::whereabouts::{Bearer, Known, Whereabouts, whereabouts};
use crate::edge::{PlaceId, Vertex};
use crate::effects::TrackState;
use crate::filter::labels::LabelId;
use crate::filter::particle::Particle;
use crate::geometry::Pose2;
use crate::language::act::{About, Act, Locate, Restriction};
use crate::language::{Content, Name};

/// Candidates told.
const CANDIDATES_MAX: usize = 10;
/// Less probable ones are noise.
const CANDIDATE_MIN: f64 = 0.01;

/// A text of no more words that is a name is no more than that.
const BARE_WORDS: usize = 3;

/// What is asked for.
pub(crate) struct Asked {
    /// Its name.
    pub name: Name,
    /// How it lies.
    pub within: Vec<Restriction>,
    /// The nearest that is so.
    pub nearest: bool,
}

impl Snapshot {
    /// "Where is the gym?", "the bathroom next to the lounge", "the nearest exit": over all particles, which place is meant.
    pub fn where_is(&self, text: &str, lang: Option<&str>) -> WhereAnswer {
        let found = match self.asked(text, lang) {
            Some(Asked { nearest: true, .. }) => self.nearest(text, lang),
            Some(Asked { name, within, .. }) => self.narrowed(self.where_named(&name), &within),
            None if self.is_of_robot(text, lang) => self.here(),
            None => self.nowhere(None),
        };
        WhereAnswer { text: text.to_owned(), ..found }
    }

    /// What is asked for; none if it is not understood.
    pub(crate) fn asked(&self, text: &str, lang: Option<&str>) -> Option<Asked> {
        let speech = self.speech(lang)?;
        let name = speech.parse_query(text);
        let bare = |name| Asked { name, within: Vec::new(), nearest: false };
        // To read a question takes longer than to answer it.
        if name.is_some() && text.split_whitespace().count() <= BARE_WORDS {
            return name.map(bare);
        }
        let of = |act: &Act| match &act.content {
            Content::Ask { about: About::Phrase(phrase), .. } => {
                let (within, nearest) = (phrase.within.clone(), phrase.features.nearest);
                Some(Asked { name: phrase.label()?, within, nearest })
            }
            Content::Locate(l) => {
                let Locate { relation, modifiers, landmarks, .. } = l.clone();
                let within = vec![Restriction { relation, modifiers, landmarks }];
                Some(Asked { name: l.figure.label()?, within, nearest: false })
            }
            _ => None,
        };
        let parse = speech.parse(text);
        match (name, parse.acts().iter().find_map(of)) {
            (Some(name), Some(asked)) => Some(Asked { name, ..asked }),
            (name, asked) => asked.or_else(|| name.map(bare)),
        }
    }

    /// An answer of which only what lies so is meant.
    fn narrowed(&self, answer: WhereAnswer, within: &[Restriction]) -> WhereAnswer {
        let label = answer.candidates.first().and_then(|c| self.ledger.label(&c.label));
        let Some(label) = label.filter(|_| !within.is_empty()) else { return answer };
        let pose = self.now.robot.unwrap_or_default();
        let place = (self.poses.len() as Vertex).saturating_sub(1);
        let path_m = self.places.last().map_or(0.0, |p| p.path_m);
        let so = self.named().narrowed(label, within, &self.ledger, &Speaker { pose, place, path_m });
        let ids: Vec<PlaceId> = self.rooms().regions.iter().map(|r| r.id).collect();
        let ratio = |c: &Candidate| ids.iter().position(|id| *id == c.place).map_or(1.0, |r| so[r]);
        let mut candidates = answer.candidates.clone();
        for c in &mut candidates {
            c.probability *= ratio(c);
        }
        let sum = candidates.iter().map(|c| c.probability).sum::<f64>() + answer.p_none;
        for c in &mut candidates {
            c.probability /= sum;
        }
        candidates.sort_by(|a, b| b.probability.total_cmp(&a.probability).then(a.place.cmp(&b.place)));
        WhereAnswer { p_none: answer.p_none / sum, candidates, ..answer }
    }

    /// "Where am I?": in the room that the robot is in, by its likeliest name.
    fn here(&self) -> WhereAnswer {
        let mut answer =
            WhereAnswer { label: Some("here".to_owned()), via: "here".to_owned(), ..self.nowhere(None) };
        let Some(robot) = answer.robot else { return answer };
        let spot = self.rooms().at(robot.x_m, robot.y_m).map(Spot::Region);
        let name = spot.and_then(|_| self.what(robot.x_m, robot.y_m).names.into_iter().next());
        let named = name.and_then(|(_, name, p)| Some((self.ledger.label(&name)?, p)));
        if let (Some(spot), Some((label, p_is))) = (spot, named) {
            let place = self.named().anchor(spot, Some((robot.x_m, robot.y_m)));
            let bearer =
                Bearer { spot, room: self.named().region(spot), place, p_is, probability: self.resolved() };
            answer.candidates = vec![self.candidate(label, bearer)];
            answer.p_none = self.unresolved;
        }
        answer
    }

    pub(crate) fn nowhere(&self, name: Option<&Name>) -> WhereAnswer {
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
        let found: Vec<(LabelId, Whereabouts)> = labels.iter().map(|&l| (l, self.found(l))).collect();
        // One place is meant: names that are as likely share it, as far as each is anywhere.
        let somewhere: f64 = found.iter().map(|(_, found)| 1.0 - found.p_none).sum();
        let share = p * self.resolved() / somewhere.max(1.0);
        let mut all: Vec<(LabelId, Bearer)> = Vec::new();
        for (label, found) in found {
            let likely = found.bearers.into_iter().filter(|r| r.p_is >= CANDIDATE_MIN);
            all.extend(likely.map(|r| (label, Bearer { probability: share * r.probability, ..r })));
        }
        all.sort_by(|(_, a), (_, b)| b.probability.total_cmp(&a.probability).then(a.place.cmp(&b.place)));
        all.truncate(CANDIDATES_MAX);
        // None of those told: of the others each is next to impossible.
        answer.p_none = 1.0 - all.iter().map(|(_, r)| r.probability).sum::<f64>();
        answer.candidates = all.into_iter().map(|(label, r)| self.candidate(label, r)).collect();
        answer
    }

    /// Where a name applies.
    pub(crate) fn found(&self, label: LabelId) -> Whereabouts {
        let pose = |p: &Particle, v: Vertex| self.pose(p, v);
        let (particles, named, ledger) = (&self.particles, self.named(), &self.ledger);
        let known = Known { particles, pose: &pose, named, ledger, by_paper: self.by_paper };
        whereabouts(&known, label, CANDIDATE_MIN)
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
        let is_said =
            evidence.any(|e| e.label == label && e.weight > 0.0) || self.named().is_described(label);
        is_said && !self.ledger.name(label).is_empty()
    }

    /// Names that something speaks for, in the order first said.
    pub(crate) fn known(&self) -> Vec<LabelId> {
        let mut known = vec![false; self.ledger.names().len()];
        let evidence = self.particles.iter().flat_map(|p| p.labels.evidence());
        for label in evidence.filter(|e| e.weight > 0.0).map(|e| e.label) {
            if let Some(known) = known.get_mut(label as usize) {
                *known = true;
            }
        }
        let ids =
            (0..known.len() as LabelId).filter(|&id| known[id as usize] || self.named().is_described(id));
        ids.filter(|&id| !self.ledger.name(id).is_empty()).collect()
    }

    /// Share of the posterior that the particles stand for; what was pruned and may yet be true is none of
    /// them, and no question is answered from it.
    fn resolved(&self) -> f64 {
        1.0 - self.unresolved
    }
}
