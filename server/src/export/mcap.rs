//! The map as messages of ROS 2 in MCAP: opens in Foxglove and rerun, plays with `ros2 bag play`.

use crate::convert::{graph_reply, pose, regions_reply};
use anyhow::{Result, anyhow};
use std::io::Cursor;
use toponym_core::Snapshot;
use toponym_proto::answer::MapIdentity;
use toponym_ros::bag::BagWriter;
use toponym_ros::msg::{Header, Path, PoseStamped, StringMsg, TFMessage, Time, Transform, TransformStamped};
use toponym_ros::plan::kind;
use toponym_ros::shown::{markers, occupancy, points, posed};

/// The frame of the map, and that of the body in it.
const MAP: &str = "map";
const BODY: &str = "base_link";

/// Map and markers, the way, what each place saw, and what was said when.
pub fn file(snapshot: &Snapshot, resolution_m: f64) -> Result<Vec<u8>> {
    write(snapshot, resolution_m).map_err(|why| anyhow!("map.mcap: {why}"))
}

fn write(snapshot: &Snapshot, resolution_m: f64) -> Result<Vec<u8>, String> {
    let mut bag = BagWriter::new(Cursor::new(Vec::new()))?;
    let header = |ns: i64| Header { stamp: Time::from(ns), frame_id: MAP.into() };
    let places = snapshot.places();
    // What is of all of the time stands at its beginning.
    let first_ns = places.iter().map(|p| p.stamp_ns).min().unwrap_or(0);
    let (whole, id) = (header(first_ns), MapIdentity::default());
    let grid = snapshot.grid(resolution_m);
    let size = (grid.width, grid.height);
    let map = occupancy(&whole, grid.resolution_m, size, &pose(&grid.map_from_grid), grid.cells);
    bag.write("/map", kind::GRID, first_ns, &map)?;
    let marked = markers(&whole, &regions_reply(snapshot, id.clone()), &graph_reply(snapshot.graph(), id));
    bag.write("/toponym/markers", kind::MARKERS, first_ns, &marked)?;
    let posed = |p: &toponym_core::answers::query::PlaceView| PoseStamped {
        header: header(p.stamp_ns),
        pose: posed(&pose(&p.pose)),
    };
    let way = Path { header: whole, poses: places.iter().map(posed).collect() };
    bag.write("/toponym/path", kind::PATH, first_ns, &way)?;
    for PoseStamped { header, pose } in &way.poses {
        let transform = Transform { translation: pose.position, rotation: pose.orientation };
        let moved = TransformStamped { header: header.clone(), child_frame_id: BODY.into(), transform };
        bag.write("/tf", kind::TF, header.stamp.ns(), &TFMessage { transforms: vec![moved] })?;
    }
    for (stamp_ns, at, cloud) in snapshot.clouds() {
        let seen = cloud.iter().map(|p| {
            let p = p.moved(&at);
            [p.x, p.y]
        });
        bag.write("/toponym/places", kind::POINTS, stamp_ns, &points(&header(stamp_ns), seen))?;
    }
    for sentence in snapshot.sentences() {
        bag.write("/speech", kind::TEXT, sentence.stamp_ns, &StringMsg { data: sentence.text })?;
    }
    Ok(bag.finish()?.into_inner())
}
