//! The ledger: every name and every sentence that changed the map, so that any of it can be taken
//! back.

use crate::edge::Vertex;
use crate::event::StampNs;
use crate::filter::labels::LabelId;
use crate::geometry::Pose2;
use crate::language::act::Parse;
use crate::language::{Glossary, Name};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

/// Sentences taken in; beyond, none is.
pub const UTTERANCES_MAX: usize = 20_000;
/// Names taken in, about; beyond, no sentence is.
pub const NAMES_MAX: usize = 2_000;
/// Descriptions that are grounded again as the map grows; the oldest stay where they are.
const DESCRIPTIONS_MAX: usize = 256;

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
    /// False once it was taken back.
    pub stands: bool,
}

/// An area in the ledger.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drawn {
    /// The entry that tells of it.
    pub utterance: u32,
    /// Each corner in the frame of a place.
    pub(crate) corners: Vec<(Vertex, f64, f64)>,
    /// What it is called, as said.
    pub name: Option<LabelId>,
    /// Whether robots keep out.
    pub forbidden: bool,
}

impl Drawn {
    /// Its corners in the map, metres, by the poses of all places.
    pub fn polygon_m(&self, poses: &[Pose2]) -> Vec<(f64, f64)> {
        let corners = self.corners.iter();
        corners.filter_map(|&(place, x, y)| Some(poses.get(place as usize)?.apply(x, y))).collect()
    }
}

/// All names and utterances.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Ledger {
    names: Vec<String>,
    /// Of the first names, whether they are those of ways: known again once the next is entered.
    #[serde(skip)]
    ways: Vec<bool>,
    /// Of each name, whether many rooms bear it.
    common: Vec<bool>,
    by_name: BTreeMap<String, LabelId>,
    /// Names that mean another one, with the utterance that says so; none: the operator does.
    aliases: BTreeMap<LabelId, (LabelId, Option<u32>)>,
    /// Names that nothing said before an utterance speaks of any more.
    forgotten: BTreeMap<LabelId, u32>,
    /// Words of the site's own.
    pub glossary: Arc<Glossary>,
    /// How guides spell names that have capitals or other signs.
    spelled: BTreeMap<String, String>,
    /// Names by what they are spelled as, where that reads as another name: "kuche", a kitchen.
    by_spelling: BTreeMap<String, String>,
    entries: Vec<Entry>,
    ids: BTreeSet<String>,
    /// Utterances that describe, oldest first.
    descriptions: VecDeque<u32>,
    /// Areas drawn at a desk.
    areas: Vec<Drawn>,
}

impl Ledger {
    /// What a name means, if it was ever said.
    pub fn label(&self, name: &str) -> Option<LabelId> {
        self.by_name.get(name).map(|&said| self.meant(said))
    }

    /// The id of a name as it is spelt, whatever it means.
    pub fn said(&self, name: &str) -> Option<LabelId> {
        self.by_name.get(name).copied()
    }

    /// What a name that was said means: itself, or what it is another name of.
    pub fn meant(&self, said: LabelId) -> LabelId {
        // Aliases never point to one another: see `call`.
        self.aliases.get(&said).map_or(said, |(meant, _)| *meant)
    }

    /// The spelling of a name.
    pub fn name(&self, label: LabelId) -> &str {
        self.names.get(label as usize).map_or("", String::as_str)
    }

    /// A name as guides spell it: "Nick's Office".
    pub fn spelled<'a>(&'a self, name: &'a str) -> &'a str {
        self.spelled.get(name).map_or(name, String::as_str)
    }

    /// A name by how guides spell it, as that reads: maybe in another language.
    pub fn spelled_so(&self, spelled: &str) -> Option<LabelId> {
        self.by_spelling.get(spelled).and_then(|name| self.label(name))
    }

    /// Whether a name is that of a way, such as every building has.
    pub fn is_way(&self, label: LabelId) -> bool {
        let name_is_way = || Name::new(self.name(label)).is_some_and(|name| name.is_way());
        self.ways.get(label as usize).copied().unwrap_or_else(name_is_way)
    }

    /// Whether several rooms of a building bear a name more often than not.
    pub fn is_common(&self, label: LabelId) -> bool {
        self.common.get(label as usize) == Some(&true)
    }

    /// All names in the order first said.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// All utterances that changed the map.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// Whether an utterance with this id was entered.
    pub fn has(&self, id: &str) -> bool {
        self.ids.contains(id)
    }

    /// Whether no more fits in.
    pub fn is_full(&self) -> bool {
        self.entries.len() >= UTTERANCES_MAX || self.names.len() >= NAMES_MAX
    }

    /// The number of an utterance that stands; without an id of the newest one, but areas, which nobody said.
    pub fn standing(&self, id: Option<&str>) -> Option<u32> {
        let is_drawn = |k: u32| self.areas.iter().any(|area| area.utterance == k);
        let wanted = |k: &u32| {
            let entry = &self.entries[*k as usize];
            entry.stands && id.map_or_else(|| !is_drawn(*k), |id| entry.id == id)
        };
        (0..self.entries.len() as u32).rev().find(wanted)
    }

    /// Descriptions that are still grounded again, oldest first.
    pub fn descriptions(&self) -> impl ExactSizeIterator<Item = u32> + '_ {
        self.descriptions.iter().copied()
    }

    /// Areas that stand, oldest first.
    pub fn areas(&self) -> &[Drawn] {
        &self.areas
    }

    /// Whether what an utterance said of a name still holds.
    pub fn speaks_of(&self, utterance: u32, label: LabelId) -> bool {
        self.forgotten.get(&label).is_none_or(|&before| utterance >= before)
    }

    /// Enters an utterance and returns its number.
    pub(crate) fn enter(&mut self, entry: Entry, describes: bool) -> u32 {
        let number = self.entries.len() as u32;
        self.ids.insert(entry.id.clone());
        self.entries.push(entry);
        if describes {
            self.descriptions.push_back(number);
            if self.descriptions.len() > DESCRIPTIONS_MAX {
                self.descriptions.pop_front();
            }
        }
        number
    }

    /// One more area.
    pub(crate) fn draw(&mut self, area: Drawn) {
        self.areas.push(area);
    }

    /// The id of a name as it is spelt, which may be another's alias.
    pub(crate) fn enter_name(&mut self, name: &Name) -> LabelId {
        if let Some(&id) = self.by_name.get(name.as_str()) {
            return id;
        }
        let id = self.names.len() as LabelId;
        self.names.push(name.as_str().to_owned());
        self.by_name.insert(name.as_str().to_owned(), id);
        let ways = (self.ways.len()..self.names.len()).map(|label| self.is_way(label as LabelId));
        let ways: Vec<bool> = ways.collect();
        self.ways.extend(ways);
        self.common.push(name.is_common());
        id
    }

    /// From now on a name is spelled so.
    pub(crate) fn spell(&mut self, name: &Name, spelled: String) {
        if let Some(read) = Name::new(&spelled).filter(|read| read != name) {
            self.by_spelling.insert(read.as_str().to_owned(), name.as_str().to_owned());
        }
        self.spelled.insert(name.as_str().to_owned(), spelled);
    }

    /// Takes an utterance back.
    pub(crate) fn strike(&mut self, utterance: u32) {
        self.entries[utterance as usize].stands = false;
        self.descriptions.retain(|&u| u != utterance);
        self.areas.retain(|area| area.utterance != utterance);
        self.aliases.retain(|_, (_, by)| *by != Some(utterance));
    }

    /// From now on `also` means what `label` means.
    pub(crate) fn call(&mut self, label: LabelId, also: LabelId, by: Option<u32>) {
        let (label, also) = (self.meant(label), self.meant(also));
        if label == also {
            return;
        }
        for (meant, _) in self.aliases.values_mut().filter(|(meant, _)| *meant == also) {
            *meant = label;
        }
        self.aliases.insert(also, (label, by));
    }

    /// Makes a name mean itself again.
    pub(crate) fn call_itself(&mut self, name: LabelId) {
        self.aliases.remove(&name);
    }

    /// Nothing said so far speaks of the name any more.
    pub(crate) fn forget(&mut self, label: LabelId) {
        self.forgotten.insert(label, self.entries.len() as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(names: &[&str]) -> Ledger {
        let mut ledger = Ledger::default();
        for name in names {
            ledger.enter_name(&Name::new(name).unwrap());
        }
        ledger
    }

    #[test]
    fn aliases_lead_to_one_name_in_whatever_order_they_were_given() {
        let mut l = named(&["gym", "hall a", "arena"]);
        l.call(1, 2, None);
        l.call(0, 1, None);
        assert_eq!((l.label("gym"), l.label("hall a"), l.label("arena")), (Some(0), Some(0), Some(0)));
        l.call(2, 0, None);
        assert_eq!(l.label("gym"), Some(0), "round in a circle changes nothing");
    }

    #[test]
    fn what_was_forgotten_may_be_said_again() {
        let mut l = named(&["gym"]);
        let entry = Entry {
            id: "a".into(),
            stamp_ns: 0,
            text: String::new(),
            parse: Parse::default(),
            held: 0,
            stands: true,
        };
        let first = l.enter(entry.clone(), true);
        l.forget(0);
        let second = l.enter(Entry { id: "b".into(), ..entry }, true);
        assert_eq!((l.speaks_of(first, 0), l.speaks_of(second, 0)), (false, true));
        l.strike(first);
        assert_eq!((l.descriptions().collect::<Vec<_>>(), l.standing(None)), (vec![second], Some(second)));
    }
}
