//! Areas drawn at a desk: what they are called, and that robots keep out of them. An area lies where the places do that are
//! nearest to its corners, however the map moves.

use crate::edge::Vertex;
use crate::event::{Area, StampNs};
use crate::filter::Filter;
use crate::filter::labels::{DIRECT, Evidence, LabelId, Labels, Source};
use crate::geometry::{Pose2, is_inside};
use crate::language::Name;
use crate::language::act::Parse;
use crate::talk::ledger::{Drawn, Entry};
use crate::talk::{Here, Talk};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Areas kept.
pub const AREAS_MAX: usize = 500;
/// Of the places in an area some get its name, so far apart at least: in a room one or two. A sentence is one unit of evidence,
/// and one from a desk is no more.
const APART_M: f64 = 4.0;

/// Takes one in, and tells what that comes to, or why it can't be.
pub(crate) fn draw(
    talk: &mut Talk,
    filter: &mut Filter,
    (area, stamp_ns): (&Area, StampNs),
    here: &Here,
) -> Result<String, String> {
    let poses = (here.poses)(filter.best());
    let newest = here.held.ok_or("the robot has not seen anything yet")?;
    if talk.ledger.has(&area.id) {
        return Err(format!("{:?} was told before", area.id));
    }
    if talk.ledger.is_full() || talk.ledger.areas().len() >= AREAS_MAX {
        return Err("this map has heard all that it can keep".into());
    }
    let name = match &area.name {
        Some(text) => Some(Name::new(text).ok_or_else(|| format!("{text:?} is no name"))?),
        None => None,
    };
    let at = |v: &Vertex| (poses[*v as usize].x_m, poses[*v as usize].y_m);
    let inside: Vec<Vertex> =
        (0..poses.len() as Vertex).filter(|v| is_inside(&area.polygon_m, at(v))).collect();
    if name.is_some() && inside.is_empty() {
        return Err("the robot was never in that area, and only where it was has a name".into());
    }
    // Not where the robot is by chance: what is said of the place held is said of its whole room.
    let held = inside.first().copied().unwrap_or(newest);
    let text = words(name.as_ref(), area);
    let entry = Entry {
        id: area.id.clone(),
        stamp_ns,
        text: text.clone(),
        parse: Parse::default(),
        held,
        stands: true,
    };
    let ledger = Arc::make_mut(&mut talk.ledger);
    let utterance = ledger.enter(entry, false);
    let said = name.map(|name| ledger.enter_name(&name));
    let corners = area.polygon_m.iter().map(|&corner| anchored(&poses, corner)).collect();
    ledger.draw(Drawn { utterance, corners, name: said, forbidden: area.forbidden });
    if let Some(said) = said {
        let label = ledger.meant(said);
        let named = spread(&poses, &inside, &area.polygon_m);
        for p in &mut filter.particles {
            if area.instead {
                deny_others(&mut p.labels, &inside, utterance, |said| {
                    said != label && !talk.ledger.name(said).is_empty()
                });
            }
            for &place in &named {
                p.labels.add(Evidence {
                    utterance,
                    said,
                    label,
                    place,
                    weight: DIRECT,
                    source: Source::Direct,
                });
            }
        }
        filter.weigh_words(talk);
    }
    Ok(text)
}

/// Of places so many that they lie apart, from the one nearest to the middle of the corners on.
fn spread(poses: &[Pose2], inside: &[Vertex], corners: &[(f64, f64)]) -> Vec<Vertex> {
    let middle = middle(corners);
    let far_m = |v: &Vertex| (poses[*v as usize].x_m - middle.0).hypot(poses[*v as usize].y_m - middle.1);
    let mut nearest = inside.to_vec();
    nearest.sort_by(|a, b| far_m(a).total_cmp(&far_m(b)).then(a.cmp(b)));
    let mut chosen: Vec<Vertex> = Vec::new();
    for v in nearest {
        if chosen.iter().all(|c| poses[*c as usize].distance_m(&poses[v as usize]) >= APART_M) {
            chosen.push(v);
        }
    }
    chosen
}

/// Denies what was said of places: of each name as much as all sentences say together, each of them once however many places
/// it was carried to, less what was denied before.
fn deny_others(labels: &mut Labels, inside: &[Vertex], utterance: u32, is_other: impl Fn(LabelId) -> bool) {
    let (mut said, mut denied) = (BTreeMap::<_, f64>::new(), BTreeMap::<_, f64>::new());
    let mut at = BTreeSet::new();
    let here = |e: &&Evidence| is_other(e.label) && inside.binary_search(&e.place).is_ok();
    for e in labels.evidence().iter().filter(here) {
        at.insert((e.said, e.label, e.place));
        let of = if e.source == Source::Denied { &mut denied } else { &mut said };
        let most = of.entry((e.label, e.utterance)).or_insert(0.0);
        *most = most.max(e.weight.abs());
    }
    for (said_as, label, place) in at {
        let sum = |of: &BTreeMap<(LabelId, u32), f64>| {
            of.range((label, 0)..=(label, u32::MAX)).map(|(_, w)| w).sum::<f64>()
        };
        let weight = sum(&said) - sum(&denied);
        if weight > 0.0 {
            let source = Source::Denied;
            labels.add(Evidence { utterance, said: said_as, label, place, weight: -weight, source });
        }
    }
}

/// A corner in the frame of the place nearest to it.
fn anchored(poses: &[Pose2], (x, y): (f64, f64)) -> (Vertex, f64, f64) {
    let far_m = |pose: &Pose2| (pose.x_m - x).hypot(pose.y_m - y);
    let nearest = poses.iter().enumerate().min_by(|a, b| far_m(a.1).total_cmp(&far_m(b.1)));
    nearest.map_or((0, x, y), |(v, pose)| {
        let off = pose.between(&Pose2::new(x, y, 0.0));
        (v as Vertex, off.x_m, off.y_m)
    })
}

/// Of corners.
fn middle(corners: &[(f64, f64)]) -> (f64, f64) {
    let n = corners.len() as f64;
    corners.iter().fold((0.0, 0.0), |sum, c| (sum.0 + c.0 / n, sum.1 + c.1 / n))
}

fn words(name: Option<&Name>, area: &Area) -> String {
    let (x_m, y_m) = middle(&area.polygon_m);
    let at = format!("the area about x {x_m:.1} m, y {y_m:.1} m");
    let rest = if area.forbidden { "robots keep out of it" } else { "" };
    match (name, area.instead) {
        (Some(name), true) => {
            format!("{at} is {} and nothing else{}{rest}", name.with_article(), comma(rest))
        }
        (Some(name), false) => format!("{at} is {}{}{rest}", name.with_article(), comma(rest)),
        (None, _) => format!("{at}: {rest}"),
    }
}

fn comma(rest: &str) -> &'static str {
    if rest.is_empty() { "" } else { ", " }
}
