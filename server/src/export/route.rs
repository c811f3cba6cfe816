//! A graph for Nav2's route server: places and doorways as nodes, ways that a robot can drive as edges, both directions.

use crate::convert::regions_reply;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use toponym_core::answers::query::PlaceView;
use toponym_core::geometry::is_inside;
use toponym_core::regions::{FOOTPRINT_M, Rooms};
use toponym_core::{Pose2, Snapshot};
use toponym_proto::answer::MapIdentity;
use toponym_proto::regions::Region;

/// Places further apart are not joined.
const JOIN_MAX_M: f64 = 3.0;
/// A name is told from this probability on.
const NAME_P_MIN: f64 = 0.3;
/// Steps along an edge at which its clearance is looked at, metres.
const STEP_M: f64 = 0.1;
/// A way that was driven has at least so much room, whatever the map says of it.
const DRIVEN_M: f64 = 0.05;

struct Node {
    id: u64,
    x_m: f64,
    y_m: f64,
    metadata: Value,
}

/// An edge between two nodes, by index.
struct Way {
    of: [usize; 2],
    length_m: f64,
    clearance_m: f64,
    driven: bool,
}

/// The graph as GeoJSON.
pub fn graph(snapshot: &Snapshot) -> Value {
    let (places, rooms) = (snapshot.places(), snapshot.rooms());
    let regions = regions_reply(snapshot, MapIdentity::default()).regions;
    let mut nodes: Vec<Node> = places.iter().map(|p| node_of(p, &regions)).collect();
    let mut ways = driven(snapshot, &places, rooms);
    ways.extend(beside(&places, rooms, &ways));
    let mut next = places.iter().map(|p| p.id + 1).max().unwrap_or(0);
    let index: BTreeMap<u64, usize> = places.iter().enumerate().map(|(k, p)| (p.id, k)).collect();
    for region in &regions {
        for door in region.doorways.iter().filter(|d| d.to > region.id) {
            let other = regions.iter().find(|r| r.id == door.to);
            let sides = [Some(region), other].map(|r| nearest(r, (door.x_m, door.y_m), &places, &index));
            let between: Vec<Option<&str>> = [Some(region), other].map(|r| r.and_then(name)).into();
            let metadata = json!({"class": "doorway", "between": [region.id, door.to], "names": between, "width_m": door.width_m});
            let (of, at) = (nodes.len(), Pose2::new(door.x_m, door.y_m, 0.0));
            let way = |place: usize| way([place, of], [&places[place].pose, &at], rooms, false);
            let through: Vec<Way> =
                sides.into_iter().flatten().map(way).filter(|w| w.clearance_m >= FOOTPRINT_M).collect();
            // One that is too narrow joins nothing.
            if !through.is_empty() {
                nodes.push(Node { id: next, x_m: door.x_m, y_m: door.y_m, metadata });
                next += 1;
                ways.extend(through);
            }
        }
    }
    let areas = snapshot.areas();
    ways.retain(|way| {
        let [a, b] = way.of.map(|k| (nodes[k].x_m, nodes[k].y_m));
        let steps = (way.length_m / STEP_M).ceil().max(1.0);
        let at = |k: usize| {
            let share = k as f64 / steps;
            (a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1))
        };
        let keeps_out = |p| areas.iter().any(|area| area.forbidden && is_inside(&area.polygon_m, p));
        !(0..=steps as usize).any(|k| keeps_out(at(k)))
    });
    collection(&nodes, &ways)
}

fn name(region: &Region) -> Option<&str> {
    region.names.first().filter(|n| n.p >= NAME_P_MIN).map(|n| n.label.as_str())
}

fn node_of(place: &PlaceView, regions: &[Region]) -> Node {
    let region = regions.iter().find(|r| r.places.contains(&place.id));
    let names = region.map_or(&[][..], |r| &r.names);
    let class = region.and_then(name).or(region.map(|r| r.kind.as_str())).unwrap_or("place");
    let metadata = json!({
        "class": class,
        "names": names.iter().map(|n| &n.label).collect::<Vec<_>>(),
        "probabilities": names.iter().map(|n| n.p).collect::<Vec<_>>(),
        "region": region.map(|r| r.id),
        "yaw_rad": place.pose.yaw_rad,
    });
    Node { id: place.id, x_m: place.pose.x_m, y_m: place.pose.y_m, metadata }
}

/// The place of a region that is nearest to a point.
fn nearest(
    region: Option<&Region>,
    at: (f64, f64),
    places: &[PlaceView],
    index: &BTreeMap<u64, usize>,
) -> Option<usize> {
    let far_m = |k: &usize| (places[*k].pose.x_m - at.0).hypot(places[*k].pose.y_m - at.1);
    let all = region?.places.iter().filter_map(|id| index.get(id).copied());
    all.min_by(|a, b| far_m(a).total_cmp(&far_m(b)))
}

/// From place to place as they follow each other.
fn driven(snapshot: &Snapshot, places: &[PlaceView], rooms: &Rooms) -> Vec<Way> {
    let chain = snapshot.constraints().into_iter().filter(|c| !c.is_loop);
    let newest = (snapshot.left_behind().max(1)..places.len()).map(|j| [j - 1, j]);
    let all = chain.map(|c| [c.i as usize, c.j as usize]).chain(newest);
    let near = all.filter(|[i, j]| places[*i].pose.distance_m(&places[*j].pose) <= JOIN_MAX_M);
    near.map(|of| way(of, of.map(|k| &places[k].pose), rooms, true)).collect()
}

/// From each place to the nearest of those that lie beside it and do not follow it: where ways cross, and go side by
/// side.
fn beside(places: &[PlaceView], rooms: &Rooms, driven: &[Way]) -> Vec<Way> {
    let mut ways = Vec::new();
    for j in 0..places.len() {
        let is_other = |i: &usize| *i + 3 < j && !driven.iter().any(|w| w.of == [*i, j]);
        let near_m = |i: &usize| places[*i].pose.distance_m(&places[j].pose);
        let nearest = (0..j).filter(is_other).min_by(|a, b| near_m(a).total_cmp(&near_m(b)));
        let Some(i) = nearest.filter(|i| near_m(i) <= JOIN_MAX_M) else { continue };
        let way = way([i, j], [&places[i].pose, &places[j].pose], rooms, false);
        if way.clearance_m >= FOOTPRINT_M {
            ways.push(way);
        }
    }
    ways
}

fn way(of: [usize; 2], [a, b]: [&Pose2; 2], rooms: &Rooms, driven: bool) -> Way {
    let length_m = a.distance_m(b);
    let steps = (length_m / STEP_M).ceil().max(1.0);
    let at = |k: usize| {
        let share = k as f64 / steps;
        rooms.clearance_m(a.x_m + share * (b.x_m - a.x_m), a.y_m + share * (b.y_m - a.y_m))
    };
    let least_m = (0..=steps as usize).map(at).fold(f64::INFINITY, f64::min);
    Way { of, length_m, clearance_m: least_m.max(if driven { DRIVEN_M } else { 0.0 }), driven }
}

/// Nodes first, then an edge for each direction, with ids of their own.
fn collection(nodes: &[Node], ways: &[Way]) -> Value {
    let mut features: Vec<Value> = nodes
        .iter()
        .map(|node| {
            json!({
                "type": "Feature",
                "properties": {"id": node.id, "frame": "map", "metadata": node.metadata},
                "geometry": {"type": "Point", "coordinates": [node.x_m, node.y_m]},
            })
        })
        .collect();
    let mut next = nodes.iter().map(|n| n.id + 1).max().unwrap_or(0);
    for way in ways {
        for of in [way.of, [way.of[1], way.of[0]]] {
            let [from, to] = of.map(|k| &nodes[k]);
            features.push(json!({
                "type": "Feature",
                "properties": {
                    "id": next,
                    "startid": from.id,
                    "endid": to.id,
                    "cost": way.length_m,
                    "overridable": true,
                    "metadata": {
                        "class": if way.driven { "driven" } else { "seen" },
                        "length_m": way.length_m,
                        "clearance_m": way.clearance_m,
                    },
                },
                "geometry": {
                    "type": "MultiLineString",
                    "coordinates": [[[from.x_m, from.y_m], [to.x_m, to.y_m]]],
                },
            }));
            next += 1;
        }
    }
    json!({
        "type": "FeatureCollection",
        "name": "graph",
        "crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::3857"}},
        "features": features,
    })
}
