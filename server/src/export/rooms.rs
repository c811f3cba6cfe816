//! Rooms as GeoJSON, in metres of the map: a robot knows no longitude.

use crate::convert::regions_reply;
use serde_json::{Value, json};
use toponym_core::Snapshot;
use toponym_proto::answer::MapIdentity;

/// Rooms and areas as polygons, doorways as points.
pub fn collection(snapshot: &Snapshot) -> Value {
    let mut features = Vec::new();
    let rooms = regions_reply(snapshot, MapIdentity::default());
    for area in rooms.areas {
        features.push(json!({
            "type": "Feature",
            "geometry": {"type": "Polygon", "coordinates": [ring(&area.polygon_m)]},
            "properties": {"what": "area", "name": area.name, "forbidden": area.forbidden},
        }));
    }
    for region in rooms.regions {
        let rings: Vec<Value> =
            std::iter::once(&region.polygon_m).chain(&region.holes_m).map(|line| ring(line)).collect();
        features.push(json!({
            "type": "Feature",
            "id": region.id,
            "geometry": {"type": "Polygon", "coordinates": rings},
            "properties": {
                "what": "room",
                "kind": region.kind,
                "name": region.names.first().map(|n| &n.label),
                "names": region.names,
                "area_m2": region.area_m2,
            },
        }));
        // Each once.
        for door in region.doorways.iter().filter(|d| d.to > region.id) {
            features.push(json!({
                "type": "Feature",
                "geometry": {"type": "Point", "coordinates": [door.x_m, door.y_m]},
                "properties": {"what": "doorway", "between": [region.id, door.to], "width_m": door.width_m},
            }));
        }
    }
    json!({"type": "FeatureCollection", "name": "rooms", "features": features})
}

/// A ring ends where it began.
fn ring(line: &[[f64; 2]]) -> Value {
    let closed: Vec<&[f64; 2]> = line.iter().chain(line.first()).collect();
    json!(closed)
}
