//! A log with the truth beside it, up to the places that the front end makes of it.
//!
//! A place's frame is the robot's pose at its first scan as the front end saw it. What matters is not by how
//! much that one scan was misplaced, by a sweep's odometry say, but where the frame lies among all that was
//! seen from the place: its truth is the mean over the scans of the next metre.

use nalgebra::Vector3;
use serde_json::Value;
use std::fs::{File, read_to_string};
use std::path::Path;
use toponym_core::event::StampNs;
use toponym_core::graph::Graph;
use toponym_core::{Config, Effect, Event, Mapper, Pose2};
use toponym_proto::record::RecordReader;
use toponym_server::convert::event;

/// Places without loops, and where they are.
pub struct Drive {
    /// Its folder.
    pub name: String,
    /// Tells buildings apart.
    pub building: String,
    /// Places and the chain between them.
    pub graph: Graph,
    /// World from place, by vertex.
    pub truth: Vec<Pose2>,
}

impl Drive {
    /// Reads a folder and runs the front end.
    pub fn read(folder: &Path) -> Self {
        let truth: Value = serde_json::from_str(&read_to_string(folder.join("truth.json")).unwrap()).unwrap();
        let rows = truth["trajectory"].as_array().unwrap().iter();
        let rows: Vec<[f64; 4]> = rows.map(|row| std::array::from_fn(|k| row[k].as_f64().unwrap())).collect();
        let mut mapper = Mapper::new(Config { particles: 1, loops: false, ..Config::default() });
        let mut placed: Vec<Vec<Pose2>> = Vec::new();
        for message in RecordReader::new(File::open(folder.join("sim.rec")).unwrap()).unwrap() {
            for effect in mapper.step(event(message.unwrap().1)) {
                if let Effect::ScanPlaced { stamp_ns, place, place_from_body, .. } = effect {
                    placed.resize(placed.len().max(place as usize + 1), Vec::new());
                    placed[place as usize].push(at(&rows, stamp_ns).compose(&place_from_body.inverse()));
                }
            }
        }
        mapper.step(Event::Flush);
        Self {
            name: folder.display().to_string(),
            building: truth["regions"].to_string(),
            truth: placed.iter().map(|poses| mean(poses)).collect(),
            graph: mapper.graph().clone(),
        }
    }
}

/// The truth at a stamp, between the rows around it.
fn at(rows: &[[f64; 4]], stamp_ns: StampNs) -> Pose2 {
    let t_s = stamp_ns as f64 * 1e-9;
    let pose = |r: &[f64; 4]| Pose2::new(r[1], r[2], r[3]);
    let k = rows.partition_point(|r| r[0] < t_s).clamp(1, rows.len() - 1);
    let (a, b) = (&rows[k - 1], &rows[k]);
    pose(a).blend(&pose(b), ((t_s - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0))
}

/// The mean of poses near each other; at least one.
pub fn mean(poses: &[Pose2]) -> Pose2 {
    let off: Vector3<f64> = poses.iter().map(|p| poses[0].between(p).log()).sum();
    poses[0].compose(&Pose2::exp(&(off / poses.len() as f64)))
}
