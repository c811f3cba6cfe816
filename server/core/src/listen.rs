//! Step 3 of Algorithm 1, the sentences: what each says, where each particle puts it, and the
//! ledger of them all.

use crate::effects::{Heard, HeardStatus, PlaceId};
use crate::event::{StampNs, Utterance};
use crate::filter::Filter;
use crate::geometry::Pose2;
use crate::graph::Vertex;
use crate::labels::{DIRECT, Evidence, LabelId, Labels, Source};
use crate::language::act::{Content, Head, Locate, Phrase};
use crate::language::{self, Act, GroundPlace, Name, Parse, Relation, Sameness};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Sentences remembered by id; the oldest ids are forgotten beyond.
const UTTERANCES_MAX: usize = 100_000;
/// Groundings less probable are not kept.
const GROUNDED_MIN: f64 = 0.02;
/// Groundings told to the guide.
const GROUNDED_TOLD: usize = 5;

/// One utterance that changed the map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// The guide's id of it.
    pub id: String,
    /// When it began.
    pub stamp_ns: StampNs,
    /// What was said.
    pub text: String,
    /// Its analysis.
    pub parse: Parse,
    /// The place held when it began.
    pub held: Vertex,
}

/// All names and utterances.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Ledger {
    names: Vec<String>,
    by_name: BTreeMap<String, LabelId>,
    entries: Vec<Entry>,
    ids: BTreeSet<String>,
}

impl Ledger {
    /// The id of a name, if it was ever said.
    pub fn label(&self, name: &str) -> Option<LabelId> {
        self.by_name.get(name).copied()
    }

    /// The spelling of a name.
    pub fn name(&self, label: LabelId) -> &str {
        self.names.get(label as usize).map_or("", String::as_str)
    }

    /// All names in the order first said.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// All utterances that changed the map.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// Enters an utterance and returns its number.
    fn enter(&mut self, entry: Entry) -> u32 {
        let number = self.entries.len() as u32;
        self.ids.insert(entry.id.clone());
        self.entries.push(entry);
        if let Some(oldest) = self.entries.len().checked_sub(UTTERANCES_MAX + 1) {
            self.ids.remove(&self.entries[oldest].id);
        }
        number
    }

    fn enter_name(&mut self, name: &Name) -> LabelId {
        if let Some(id) = self.label(name.as_str()) {
            return id;
        }
        let id = self.names.len() as LabelId;
        self.names.push(name.as_str().to_owned());
        self.by_name.insert(name.as_str().to_owned(), id);
        id
    }
}

/// Where the robot is while it listens.
pub struct Here<'a> {
    /// The place held when the sentence began; none before the first scan.
    pub held: Option<Vertex>,
    /// For one particle: the poses of all places, those not frozen yet included.
    pub poses: &'a (dyn Fn(&crate::particle::Particle) -> Vec<Pose2> + Sync),
    /// Path travelled up to each place, metres.
    pub path_m: Vec<f64>,
}

impl Filter {
    /// Takes a sentence: parses it and updates the labels of every particle.
    pub fn hear(&mut self, u: &Utterance, here: &Here) -> Heard {
        if !self.config.language {
            let words = "Nobody listens: language is switched off.".to_owned();
            return heard(u, HeardStatus::Refused, &Parse::default(), words);
        }
        let (text, parse) = understand(u);
        let known = |name: &Name| self.ledger.label(name.as_str()).is_some();
        let words = language::words(parse.acts(), known);
        if !parse.acts().iter().any(|act| plain(act).is_some() || matches!(act.content, Content::Ask { .. }))
        {
            return heard(u, HeardStatus::NotUnderstood, &parse, words);
        }
        if self.ledger.ids.contains(&u.id) {
            return heard(u, HeardStatus::Understood, &parse, format!("{words} (I had heard that already.)"));
        }
        let Some(held) = here.held else {
            let words = format!("{words} But I have seen nothing yet: say it again when I have moved.");
            return heard(u, HeardStatus::Refused, &parse, words);
        };
        if let Some(name) = unknown_landmark(parse.acts(), known) {
            let words = format!("{words} Name it where it is (\"this is the {name}\"), then say it again.");
            return heard(u, HeardStatus::Refused, &parse, words);
        }
        let entry = Entry { id: u.id.clone(), stamp_ns: u.began_ns, text, parse: parse.clone(), held };
        let number = Arc::make_mut(&mut self.ledger).enter(entry);
        for told in parse.acts().iter().filter_map(plain) {
            self.label(&told, number, held, here);
        }
        let mut heard = heard(u, HeardStatus::Understood, &parse, words);
        heard.grounded = self.told(number);
        heard
    }

    /// Updates the labels of every particle by one act, eqs. (12–16).
    fn label(&mut self, told: &Told, utterance: u32, held: Vertex, here: &Here) {
        match told {
            Told::Label { name, again } => {
                let label = Arc::make_mut(&mut self.ledger).enter_name(name);
                let source = if *again == Sameness::Other { Source::DirectOther } else { Source::Direct };
                for p in &mut self.particles {
                    p.labels.add(Evidence { utterance, label, place: held, weight: DIRECT, source });
                }
            }
            Told::Locate { figure, relation, landmark } => {
                let landmark = landmark.as_ref().and_then(|name| self.ledger.label(name.as_str()));
                let figure = Arc::make_mut(&mut self.ledger).enter_name(figure);
                for p in &mut self.particles {
                    let poses = (here.poses)(p);
                    let grounded = ground(*relation, figure, landmark, &p.labels, &poses, &here.path_m, held);
                    for (place, weight) in grounded {
                        let source = Source::Grounded;
                        p.labels.add(Evidence { utterance, label: figure, place, weight, source });
                    }
                }
            }
        }
    }

    /// Where the best particle put an utterance, likeliest first.
    fn told(&self, utterance: u32) -> Vec<(PlaceId, f64)> {
        let mut told: Vec<(PlaceId, f64)> = self
            .best()
            .labels
            .evidence()
            .iter()
            .filter(|e| e.utterance == utterance)
            .map(|e| (PlaceId::from(e.place), e.weight))
            .collect();
        told.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        told.truncate(GROUNDED_TOLD);
        told
    }
}

/// What the map takes from an act: other acts are set aside.
enum Told {
    /// The place held is called so.
    Label { name: Name, again: Sameness },
    /// The figure lies so to a named landmark; to the place held if none.
    Locate { figure: Name, relation: Relation, landmark: Option<Name> },
}

fn plain(act: &Act) -> Option<Told> {
    match &act.content {
        Content::Label { at, what, sameness } if at.head == Head::Here => {
            Some(Told::Label { name: what.label()?, again: *sameness })
        }
        Content::Locate(Locate { figure, relation, landmarks, repaired: false, .. }) => {
            let [landmark] = landmarks.as_slice() else { return None };
            let landmark = if landmark.head == Head::Here { None } else { Some(bare(landmark)?) };
            Some(Told::Locate { figure: bare(figure)?, relation: *relation, landmark })
        }
        _ => None,
    }
}

/// The name of a phrase that says nothing more.
fn bare(phrase: &Phrase) -> Option<Name> {
    let counted = phrase.features.ordinal.is_some() || phrase.features.count.is_some();
    if counted || !phrase.within.is_empty() { None } else { phrase.label() }
}

/// The likeliest reading over all hearings, and the text that it reads.
fn understand(u: &Utterance) -> (String, Parse) {
    let parse = language::parse_hearings(&u.text, &u.alternatives);
    let heard = parse.best().map_or(0, |best| best.hearing);
    let text = heard.checked_sub(1).and_then(|k| u.alternatives.get(k)).map_or(&u.text, |(text, _)| text);
    (text.clone(), parse)
}

fn unknown_landmark(acts: &[Act], known: impl Fn(&Name) -> bool) -> Option<String> {
    acts.iter().filter_map(plain).find_map(|told| match told {
        Told::Locate { landmark: Some(name), .. } if !known(&name) => Some(name.as_str().to_owned()),
        _ => None,
    })
}

/// Δα of a relation in one particle, eqs. (13–16).
fn ground(
    relation: Relation,
    figure: LabelId,
    landmark: Option<LabelId>,
    labels: &Labels,
    poses: &[Pose2],
    path_m: &[f64],
    held: Vertex,
) -> Vec<(Vertex, f64)> {
    let places: Vec<GroundPlace> = poses
        .iter()
        .zip(path_m)
        .map(|(p, &path_m)| GroundPlace { x_m: p.x_m, y_m: p.y_m, yaw_rad: p.yaw_rad, path_m })
        .collect();
    let landmark: Vec<(usize, f64)> = match landmark {
        None => vec![(held as usize, 1.0)],
        Some(label) => {
            let applies = labels.applies(label);
            // One landmark is meant: what applies to several is shared among them.
            let sum: f64 = applies.values().sum::<f64>().max(1.0);
            applies.iter().map(|(v, p)| (*v as usize, p / sum)).collect()
        }
    };
    let applies = labels.applies(figure);
    let prior: Vec<f64> =
        (0..places.len() as Vertex).map(|v| applies.get(&v).copied().unwrap_or(0.0)).collect();
    language::ground(relation, &places, held as usize, &landmark, &prior)
        .p
        .into_iter()
        .enumerate()
        .filter(|(_, p)| *p >= GROUNDED_MIN)
        .map(|(v, p)| (v as Vertex, p))
        .collect()
}

fn heard(u: &Utterance, status: HeardStatus, parse: &Parse, words: String) -> Heard {
    Heard {
        id: u.id.clone(),
        stamp_ns: u.began_ns,
        text: u.text.clone(),
        status,
        parse: parse.notation().to_owned(),
        grounded: Vec::new(),
        words,
    }
}
