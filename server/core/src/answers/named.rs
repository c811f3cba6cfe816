//! Names of rooms: what was said outright of which region of the best graph, and where descriptions put what they
//! speak of.

use crate::answers::described::Which;
use crate::answers::described::features::{Scene, Speaker};
use crate::answers::described::sense::{DEPTH_MAX, DOUBT, Sense};
use crate::edge::Vertex;
use crate::event::StampNs;
use crate::filter::labels::{Evidence, LabelId, Labels, Source};
use crate::filter::naming::Tally;
use crate::geometry::{Pose2, wrap};
use crate::language::act::Restriction;
use crate::language::{GroundPlace, READ};
use crate::regions::{Region, Rooms, Shape};
use crate::talk::ledger::{Entry, Ledger};
use crate::talk::locate::located;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, OnceLock};

/// δ: what is said once, and nothing else of that room, is false or misheard so often, in odds; that plain words are misread
/// ([`READ`]) counts here. As η, from tours of plans with 0 and 20 % of false talk (`tours --tour plans`, seeds 301 to 340).
pub const FALSE_ODDS: f64 = 0.05;
/// η: the same for each time that the room was called something else.
const RIVAL: f64 = 0.35;
/// In a region that is longer, names are said of spots: of the fountain in a corridor, of the bar in a hall.
const WIDE_M: f64 = 12.0;

/// Of what something may be said: a region, or a place that lies in none or in a wide one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Spot {
    /// By its index.
    Region(usize),
    /// By its number.
    Place(Vertex),
}

/// The rooms of the best graph and their names.
#[derive(Clone, Debug, Default)]
pub struct Named {
    /// The rooms.
    pub rooms: Arc<Rooms>,
    /// All places, not frozen ones too, in the best graph's map.
    places: Vec<GroundPlace>,
    stamps_ns: Vec<StampNs>,
    /// The region of each place.
    region_of: Vec<Option<usize>>,
    /// Of utterances that are evidence the place held, and the region in which who spoke was.
    said_in: BTreeMap<u32, (Vertex, Option<usize>)>,
    /// What was said outright of each region.
    outright: Vec<BTreeMap<LabelId, Tally>>,
    /// Names that something which stands describes, and where that puts them, once somebody asked.
    described: BTreeMap<LabelId, OnceLock<Option<Described>>>,
}

/// What comes of a name's descriptions.
#[derive(Clone, Debug)]
pub struct Described {
    /// Which region is meant.
    pub which: Which,
    /// The same before anything was described.
    pub prior: Which,
    /// The sentences.
    pub utterances: Vec<u32>,
}

impl Named {
    /// Of the best graph: rooms, all places with their stamps, and what is said of them.
    pub fn new(
        rooms: Arc<Rooms>,
        (places, stamps_ns): (Vec<GroundPlace>, Vec<StampNs>),
        labels: &Labels,
        ledger: &Ledger,
    ) -> Self {
        let mut region_of = vec![None; places.len()];
        for (r, region) in rooms.regions.iter().enumerate() {
            for &v in &region.places {
                region_of[v as usize] = Some(r);
            }
        }
        // Places not left yet have seen nothing of their room so far, but are in it.
        let left =
            rooms.regions.iter().flat_map(|r| &r.places).max().map_or(0, |&newest| newest as usize + 1);
        for (of, at) in region_of.iter_mut().zip(&places).skip(left) {
            *of = rooms.at(at.x_m, at.y_m);
        }
        let outright = vec![BTreeMap::new(); rooms.regions.len()];
        let described = figures(ledger).into_iter().map(|label| (label, OnceLock::new())).collect();
        let said_in = BTreeMap::new();
        let mut named = Self { rooms, places, stamps_ns, region_of, said_in, outright, described };
        for e in labels.evidence() {
            let entry = ledger.entries().get(e.utterance as usize);
            if let Some((entry, speaker)) = entry.and_then(|entry| Some((entry, named.speaker(entry)?))) {
                let region = || named.rooms.at(speaker.pose.x_m, speaker.pose.y_m);
                named.said_in.entry(e.utterance).or_insert_with(|| (entry.held, region()));
            }
            if let Some(r) = named.region(named.spot(e)) {
                let tally: &mut Tally = named.outright[r].entry(e.label).or_default();
                match e.source {
                    Source::Direct | Source::DirectOther => tally.said += e.weight,
                    Source::Denied => tally.denied -= e.weight,
                    _ => {}
                }
            }
        }
        named
    }

    /// Of what a piece of evidence speaks. Of where one is, who says it is, and a place is some steps long.
    pub fn spot(&self, e: &Evidence) -> Spot {
        let said_in = self.said_in.get(&e.utterance);
        let here = said_in.filter(|(held, _)| *held == e.place && e.source != Source::Carried);
        let region = here.map_or_else(|| self.region(Spot::Place(e.place)), |(_, region)| *region);
        let room = region.filter(|&r| !is_wide(&self.rooms.regions[r]));
        room.map_or(Spot::Place(e.place), Spot::Region)
    }

    /// The region in which a spot lies.
    pub fn region(&self, spot: Spot) -> Option<usize> {
        match spot {
            Spot::Region(r) => Some(r),
            Spot::Place(v) => self.region_of.get(v as usize).copied().flatten(),
        }
    }

    /// The place that stands for a spot, nearest to where its name was given if that is known.
    pub fn anchor(&self, spot: Spot, said_at: Option<(f64, f64)>) -> Vertex {
        let region = match spot {
            Spot::Place(v) => return v,
            Spot::Region(r) => &self.rooms.regions[r],
        };
        let (x, y) = said_at.unwrap_or(region.middle_m);
        let far_m = |v: &Vertex| {
            let p = &self.places[*v as usize];
            (p.x_m - x).hypot(p.y_m - y)
        };
        region.places.iter().copied().min_by(|a, b| far_m(a).total_cmp(&far_m(b))).unwrap_or(0)
    }

    /// Where who said something was: between the place held and the next.
    pub fn speaker(&self, entry: &Entry) -> Option<Speaker> {
        let v = entry.held as usize;
        let (from, began_ns) = (self.places.get(v)?, *self.stamps_ns.get(v)?);
        let here = Pose2::new(from.x_m, from.y_m, from.yaw_rad);
        let Some((to, next_ns)) = self.places.get(v + 1).zip(self.stamps_ns.get(v + 1)) else {
            return Some(Speaker { pose: here, place: entry.held, path_m: from.path_m });
        };
        let whole = (next_ns - began_ns).max(1) as f64;
        let share = ((entry.stamp_ns - began_ns) as f64 / whole).clamp(0.0, 1.0);
        let between = |a: f64, b: f64| a + share * (b - a);
        // A break lies between two places that are far apart.
        if (to.x_m - from.x_m).hypot(to.y_m - from.y_m) > 2.0 * (to.path_m - from.path_m).max(1.0) {
            return Some(Speaker { pose: here, place: entry.held, path_m: from.path_m });
        }
        let yaw_rad = from.yaw_rad + share * wrap(to.yaw_rad - from.yaw_rad);
        let pose = Pose2::new(between(from.x_m, to.x_m), between(from.y_m, to.y_m), yaw_rad);
        Some(Speaker { pose, place: entry.held, path_m: between(from.path_m, to.path_m) })
    }

    /// Whether something which stands describes where a name is.
    pub fn is_described(&self, label: LabelId) -> bool {
        self.described.contains_key(&label)
    }

    /// Where a name's descriptions put it; none if there are none, or nobody knows their landmarks.
    pub fn described(&self, label: LabelId, ledger: &Ledger) -> Option<&Described> {
        self.described.get(&label)?.get_or_init(|| self.described_at(label, ledger, 0)).as_ref()
    }

    /// The same by what descriptions were grounded to in a particle, each a distribution over places.
    pub fn grounded(&self, label: LabelId, labels: &Labels) -> Option<Described> {
        let of_it = |e: &&Evidence| e.label == label && e.source == Source::Grounded;
        let (mut which, mut utterances) = (Which::nothing(self.rooms.regions.len()), Vec::new());
        for e in labels.evidence().iter().filter(of_it) {
            utterances.push(e.utterance);
            match self.region_of.get(e.place as usize).copied().flatten() {
                Some(r) => which.p[r] += e.weight,
                None => which.p_none += e.weight,
            }
        }
        utterances.dedup();
        which.p_none += (1.0 - which.p.iter().sum::<f64>() - which.p_none).max(0.0);
        let prior = which.clone();
        (!utterances.is_empty()).then(|| Described { which: which.normalised(), prior, utterances })
    }

    fn described_at(&self, label: LabelId, ledger: &Ledger, depth: usize) -> Option<Described> {
        let other = self.other(label, ledger);
        let scene = Scene::new(&self.rooms, &self.places, &other, ledger.is_way(label));
        let prior = Which::anywhere(&scene);
        let bearers = |label, depth| self.bearers(label, ledger, depth);
        let (rooms, scene, prior) = (&self.rooms, &scene, &prior);
        let sense = Sense { rooms, bearers: &bearers, ledger, scene, prior, depth };
        let (mut which, mut utterances): (Option<Which>, Vec<u32>) = (None, Vec::new());
        for utterance in ledger.descriptions() {
            let entry = &ledger.entries()[utterance as usize];
            if !entry.stands || !ledger.speaks_of(utterance, label) {
                continue;
            }
            let said = self.speaker(entry).and_then(|speaker| sense.of(entry, &speaker, label));
            if let Some(of_it) = said {
                utterances.push(utterance);
                which = Some(which.map_or(of_it.clone(), |which| which.and(&of_it, prior, DOUBT)));
            }
        }
        Some(Described { which: which?, prior: prior.clone(), utterances })
    }

    /// Names that were given to a region outright, with the probability that each was rightly given.
    pub fn given_names(&self, region: usize, ledger: &Ledger) -> Vec<(LabelId, f64)> {
        let p = |(&label, &tally): (&LabelId, &Tally)| {
            (label, given(tally, self.rivals(Spot::Region(region), label, ledger)))
        };
        self.outright[region].iter().map(p).collect()
    }

    /// Where descriptions put the names that nothing was called outright.
    pub fn described_names<'a>(&'a self, ledger: &'a Ledger) -> impl Iterator<Item = (LabelId, &'a Which)> {
        let is_given = |label: &LabelId| self.outright.iter().any(|names| names.contains_key(label));
        let open = self.described.keys().copied().filter(move |label| !is_given(label));
        open.filter_map(|label| Some((label, &self.described(label, ledger)?.which)))
    }

    /// How often something was called otherwise, outright.
    pub fn rivals(&self, spot: Spot, label: LabelId, ledger: &Ledger) -> f64 {
        let Spot::Region(r) = spot else { return 0.0 };
        let is_rival = |l: &LabelId| *l != label && !ledger.is_way(*l) && !ledger.is_way(label);
        self.outright[r].iter().filter(|(l, _)| is_rival(l)).map(|(_, t)| t.concentration()).sum()
    }

    /// By region, how much likelier it is meant by a name where a question says how it lies: "the bathroom *next to the
    /// lounge*".
    pub fn narrowed(
        &self,
        label: LabelId,
        within: &[Restriction],
        ledger: &Ledger,
        speaker: &Speaker,
    ) -> Vec<f64> {
        let other = self.other(label, ledger);
        let scene = Scene::new(&self.rooms, &self.places, &other, ledger.is_way(label));
        let prior = Which::anywhere(&scene);
        let bearers = |label, depth| self.bearers(label, ledger, depth);
        let (rooms, scene, prior) = (&self.rooms, &scene, &prior);
        let sense = Sense { rooms, bearers: &bearers, ledger, scene, prior, depth: 0 };
        let each =
            within.iter().filter_map(|r| sense.lies((r.relation, &r.modifiers, &r.landmarks), None, speaker));
        let all = each.reduce(|a, b| a.and(&b, prior, DOUBT)).unwrap_or_else(|| prior.clone());
        let ratio = |p: f64, prior: f64| (1.0 - DOUBT) * p / prior.max(1e-9) + DOUBT;
        all.p.iter().zip(&prior.p).map(|(&p, &prior)| ratio(p, prior)).collect()
    }

    /// By region, the probability that it was given another name outright.
    fn other(&self, label: LabelId, ledger: &Ledger) -> Vec<f64> {
        let is_other = |l: &LabelId| *l != label && !ledger.is_way(*l);
        let of = |(names, region): (&BTreeMap<LabelId, Tally>, &Region)| {
            let told = names.iter().filter(|(l, _)| is_other(l)).map(|(_, t)| t.told()).fold(0.0, f64::max);
            // What is said in a wide one is said of a spot.
            if is_wide(region) { 0.0 } else { told }
        };
        self.outright.iter().zip(&self.rooms.regions).map(of).collect()
    }

    /// Regions that bear a name, and how likely each is meant by it.
    pub fn bearers(&self, label: LabelId, ledger: &Ledger, depth: usize) -> Vec<(usize, f64)> {
        let told = |names: &BTreeMap<LabelId, Tally>| names.get(&label).map_or(0.0, |t| t.told());
        let outright = self.outright.iter().map(told).enumerate();
        let mut p: Vec<(usize, f64)> = outright.filter(|(_, p)| *p > 0.0).collect();
        if p.is_empty() && depth < DEPTH_MAX {
            let described = self.described_at(label, ledger, depth + 1);
            p.extend(described.into_iter().flat_map(|d| d.which.p.into_iter().enumerate()));
        }
        p
    }
}

/// P(name was rightly given), by what was said for it and against it, and how often something else. What one sentence may
/// have said is as likely as that it said so.
pub fn given(tally: Tally, rivals: f64) -> f64 {
    let said = tally.concentration() / READ;
    said / (said.max(1.0) + FALSE_ODDS + RIVAL * rivals / READ)
}

/// Names that something which stands describes.
fn figures(ledger: &Ledger) -> BTreeSet<LabelId> {
    let stand = ledger.descriptions().map(|u| (u, &ledger.entries()[u as usize])).filter(|(_, e)| e.stands);
    let of = |(u, entry): (u32, &Entry)| {
        let located = located(&entry.parse).into_iter().filter_map(|(_, l)| l.figure.label());
        let labels = located.filter_map(|name| ledger.label(name.as_str()));
        labels.filter(|&label| ledger.speaks_of(u, label)).collect::<Vec<LabelId>>()
    };
    stand.flat_map(of).collect()
}

fn is_wide(region: &Region) -> bool {
    let span = |axis: fn(&(f64, f64)) -> f64| {
        let along = || region.polygon_m.iter().map(axis);
        along().fold(f64::MIN, f64::max) - along().fold(f64::MAX, f64::min)
    };
    region.shape == Shape::Corridor || span(|p| p.0).max(span(|p| p.1)) > WIDE_M
}

#[cfg(test)]
pub(crate) mod tests;
