//! Rooms, names and sentences as JSON, with its schema.

use crate::convert::{labels_reply, regions_reply};
use serde_json::{Value, json};
use toponym_core::Snapshot;
use toponym_proto::answer::MapIdentity;

/// The map; metres in its frame.
pub fn map(snapshot: &Snapshot) -> Value {
    let places = snapshot.places();
    let place = |p: &toponym_core::answers::query::PlaceView| json!({"id": p.id, "stamp_ns": p.stamp_ns, "x_m": p.pose.x_m, "y_m": p.pose.y_m, "yaw_rad": p.pose.yaw_rad});
    let sentences = snapshot.sentences();
    let rooms = regions_reply(snapshot, MapIdentity::default());
    let sentence = |s: &toponym_core::answers::constraints::Sentence| json!({"id": s.id, "stamp_ns": s.stamp_ns, "text": s.text, "stands": s.stands});
    json!({
        "$schema": "map.schema.json",
        "version": 1,
        "places": places.iter().map(place).collect::<Vec<_>>(),
        "regions": rooms.regions,
        "areas": rooms.areas,
        "names": labels_reply(snapshot.labels(), MapIdentity::default()).labels,
        "sentences": sentences.iter().map(sentence).collect::<Vec<_>>(),
        "unresolved": snapshot.unresolved(),
    })
}

fn list(of: &Value) -> Value {
    json!({"type": "array", "items": of})
}

fn object(required: &[&str], properties: &Value) -> Value {
    json!({"type": "object", "required": required, "properties": properties})
}

/// What it looks like (JSON Schema, draft 2020-12).
pub fn schema() -> Value {
    let (id, number, text) =
        (json!({"type": "integer", "minimum": 0}), json!({"type": "number"}), json!({"type": "string"}));
    let probability = json!({"type": "number", "minimum": 0, "maximum": 1});
    let point = json!({"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2});
    let stamp = json!({"type": "integer", "description": "nanoseconds on the robot's clock"});
    let place = object(
        &["id", "x_m", "y_m", "yaw_rad"],
        &json!({"id": id, "stamp_ns": stamp, "x_m": number, "y_m": number, "yaw_rad": number}),
    );
    let doorway = object(
        &["to", "x_m", "y_m", "width_m"],
        &json!({"to": id, "x_m": number, "y_m": number, "width_m": number}),
    );
    let region = object(
        &["id", "kind", "names", "polygon_m", "holes_m", "doorways", "places"],
        &json!({
            "id": id,
            "kind": {"enum": ["room", "corridor", "hall"]},
            "names": list(&object(&["label", "p"], &json!({"label": text, "p": probability}))),
            "area_m2": number,
            "polygon_m": list(&point),
            "holes_m": list(&list(&point)),
            "doorways": list(&doorway),
            "places": list(&id),
        }),
    );
    let area = object(
        &["id", "name", "forbidden", "polygon_m"],
        &json!({"id": text, "name": {"type": ["string", "null"]}, "forbidden": {"type": "boolean"}, "polygon_m": list(&point)}),
    );
    let name = object(
        &["label", "shown", "utterances", "region"],
        &json!({"label": text, "shown": text, "utterances": id, "region": id}),
    );
    let sentence = object(
        &["id", "text", "stands"],
        &json!({"id": text, "stamp_ns": stamp, "text": text, "stands": {"type": "boolean"}}),
    );
    let mut schema = object(
        &["version", "places", "regions", "names", "sentences"],
        &json!({
            "version": {"const": 1},
            "places": list(&place),
            "regions": list(&region),
            "areas": list(&area),
            "names": list(&name),
            "sentences": list(&sentence),
            "unresolved": probability,
        }),
    );
    schema["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    schema["title"] = json!("A map of toponym: metres and radians in the map's frame");
    schema
}
