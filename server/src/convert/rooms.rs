//! Rooms as they are told.

use super::{line, millimetres};
use toponym_core::Snapshot;
use toponym_core::answers::areas::AreaView;
use toponym_core::answers::query::WhatAnswer;
use toponym_core::regions::{self, Shape};
use toponym_proto::Stamp;
use toponym_proto::answer::{ANSWER_VERSION, Called, MapIdentity, WhatReply};
use toponym_proto::regions::{Area, Doorway, Region, RegionName, RegionsReply};

/// Answer of `ask/what`.
pub fn what_reply(answer: WhatAnswer, map: MapIdentity, stamp: Stamp) -> WhatReply {
    let called = |(shown, label, p)| Called { label, shown, p };
    WhatReply {
        v: ANSWER_VERSION,
        query: "what".into(),
        map,
        stamp,
        x_m: answer.x_m,
        y_m: answer.y_m,
        region: answer.region,
        kind: answer.shape.map(|shape| kind(shape).into()),
        names: answer.names.into_iter().map(called).collect(),
        unresolved: answer.unresolved,
    }
}

fn kind(shape: Shape) -> &'static str {
    match shape {
        Shape::Corridor => "corridor",
        Shape::Room => "room",
        Shape::Hall => "hall",
    }
}

/// Answer of `ask/regions`, coordinates to the millimetre.
pub fn regions_reply(snapshot: &Snapshot, map: MapIdentity) -> RegionsReply {
    let (regions, places) = (&snapshot.rooms().regions, snapshot.places());
    let names = |region: usize| {
        let called = snapshot.called(region).into_iter();
        called.map(|(label, p)| RegionName { label, p }).collect()
    };
    let entry = |(k, r): (usize, &regions::Region)| Region {
        id: r.id,
        kind: kind(r.shape).into(),
        names: names(k),
        area_m2: millimetres(r.area_m2),
        polygon_m: line(&r.polygon_m),
        holes_m: r.holes_m.iter().map(|hole| line(hole)).collect(),
        doorways: r
            .doorways
            .iter()
            .map(|d| Doorway {
                to: regions[d.to].id,
                x_m: millimetres(d.at_m.0),
                y_m: millimetres(d.at_m.1),
                width_m: millimetres(d.width_m),
            })
            .collect(),
        places: r.places.iter().map(|&v| places[v as usize].id).collect(),
    };
    let mut all: Vec<Region> = regions.iter().enumerate().map(entry).collect();
    all.sort_by_key(|r| r.id);
    let area =
        |a: AreaView| Area { id: a.id, name: a.name, forbidden: a.forbidden, polygon_m: line(&a.polygon_m) };
    let areas = snapshot.areas().into_iter().map(area).collect();
    RegionsReply { v: ANSWER_VERSION, query: "regions".into(), map, regions: all, areas }
}
