//! What people say while the robot is somewhere: sentences, and where they see it.

use crate::answers::snapshot::open_poses;
use crate::answers::spoken;
use crate::edge::Vertex;
use crate::effects::{Effect, Effects};
use crate::event::{Area, StampNs, Told, Utterance};
use crate::filter::Filter;
use crate::filter::particle::Particle;
use crate::graph::stretches;
use crate::mapper::Mapper;
use crate::talk::{Here, Talk};
use crate::track::places::OpenPlace;

impl Mapper {
    /// A sentence.
    pub(super) fn hear(&mut self, u: &Utterance, effects: &mut Effects) {
        let mut heard = None;
        self.change_here(u.began_ns, effects, |filter, talk, here| {
            heard = Some(talk.hear(filter, u, here));
            Effects::new()
        });
        if let Some((mut heard, asks)) = heard {
            if !asks.is_empty() {
                heard.words = spoken::answers(&self.snapshot(), &asks, &heard.words);
            }
            effects.push(Effect::Heard(heard));
        }
        self.stand(effects);
    }

    /// Where somebody sees the robot now.
    pub(super) fn told(&mut self, told: &Told, effects: &mut Effects) {
        let front = &self.track.front;
        let stamp_ns = front.newest_ns().unwrap_or_default();
        let of_graph = self.filter.graph.places().last().map(|place| place.front_from_place);
        let front_from_place = front.open_places().last().map(|place| place.front_from_place).or(of_graph);
        let body_from_place = front.front_from_body().between(&front_from_place.unwrap_or_default());
        self.change_here(stamp_ns, effects, |filter, talk, here| {
            vec![Effect::Mended(talk.tell(filter, (told, stamp_ns), &body_from_place, here))]
        });
        self.stand(effects);
    }

    /// An area of the map as it is now.
    pub(super) fn drawn(&mut self, area: &Area, effects: &mut Effects) {
        let stamp_ns = self.track.front.newest_ns().unwrap_or_default();
        self.change_here(stamp_ns, effects, |filter, talk, here| {
            vec![Effect::Mended(talk.draw(filter, (area, stamp_ns), here))]
        });
        self.stand(effects);
    }

    /// Changes the posterior by what is said of where the robot was then.
    fn change_here(
        &mut self,
        began_ns: StampNs,
        effects: &mut Effects,
        change: impl FnOnce(&mut Filter, &mut Talk, &Here) -> Effects,
    ) {
        let open: Vec<OpenPlace> = self.track.front.open_places().cloned().collect();
        let places = self.filter.graph.places().to_vec();
        let path_m: Vec<f64> = places.iter().map(|p| p.path_m).chain(open.iter().map(|p| p.path_m)).collect();
        let stamps = places.iter().map(|p| p.stamp_ns).chain(open.iter().map(|p| p.stamp_ns));
        let stamps: Vec<StampNs> = stamps.collect();
        // The place held when the sentence began; one from before the map is said of its first.
        let held = stamps.iter().rposition(|&s| s <= began_ns).or((!stamps.is_empty()).then_some(0));
        let poses = |p: &Particle| {
            let mut poses = p.belief.poses();
            poses.extend(open_poses(p, &places, &open));
            poses
        };
        let (part, dark) = self.parts(&open);
        let here = Here { held: held.map(|v| v as Vertex), poses: &poses, path_m, part, dark };
        self.change(effects, |filter, talk| change(filter, talk, &here));
    }

    /// For all places, those not left yet included: in which part of the map they are, and whether the robot sees
    /// nothing there or soon after: in the dark the first places come late.
    fn parts(&self, open: &[OpenPlace]) -> (Vec<usize>, Vec<bool>) {
        let places = self.filter.graph.places();
        let chains = places.iter().map(|p| &p.chain).chain(open.iter().map(|p| &p.chain));
        let unseen: Vec<bool> = chains.map(|c| c.unseen).chain([self.track.front.sees_nothing()]).collect();
        let mut stretches = self.filter.graph.stretches.clone();
        let mut before_m = places.last().map(|p| p.path_m);
        for (v, place) in (places.len()..).zip(open) {
            if let Some(before_m) = before_m.replace(place.path_m) {
                stretches.extend(v as Vertex, &place.chain, place.path_m - before_m);
            }
        }
        let ends = stretches.ends();
        let part = (0..places.len() + open.len()).map(|v| stretches::part(&ends, v as Vertex));
        (part.collect(), unseen.windows(2).map(|w| w[0] || w[1]).collect())
    }
}
