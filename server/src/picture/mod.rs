//! A picture of a map: grid, rooms, trajectory, places, edges by kind, names.
//!
//! ```text
//! grid, graph, regions ─ view ─▶ which part, how large ─ sketch ─▶ marks ─ canvas ─▶ PNG
//!                                                                        └───────▶ SVG
//! ```

mod canvas;
mod legend;
mod names;
mod shades;
mod sketch;
mod view;

pub use self::sketch::{Sketch, form};
pub use self::view::resolution_m;

use self::shades::shades;
use self::sketch::Mark;
use self::view::View;
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use std::collections::BTreeMap;
use toponym_core::Pose2;
use toponym_core::answers::query::{EdgeView, GraphAnswer, Grid, PlaceView};
use toponym_core::edge::{EdgeKind, PlaceId};
use toponym_proto::regions::Region;

/// Of edges of one kind whose ends lie within this distance of each other one is drawn: corridors that were driven
/// through ten times must not vanish below them.
const EDGES_APART_M: f64 = 3.0;
/// With fewer pixels to a metre places are points.
const PLACES_FROM_PX: f64 = 8.0;
/// Length of the robot's nose, pixels.
const NOSE: f64 = 14.0;

const TRAJECTORY: Rgb888 = Rgb888::new(0x5a, 0xae, 0x61);
const PLACE: Rgb888 = Rgb888::new(0x1b, 0x78, 0x37);
const START: Rgb888 = Rgb888::new(0x00, 0x6d, 0x6f);
const END: Rgb888 = Rgb888::new(0x10, 0x10, 0x10);

/// What is drawn.
pub struct Drawn<'a> {
    /// What stands where.
    pub grid: &'a Grid,
    /// Places and edges.
    pub graph: &'a GraphAnswer,
    /// In order of time, map frame.
    pub trajectory: &'a [Pose2],
    /// As far as they are known.
    pub regions: &'a [Region],
    /// Where the robot is, map frame.
    pub robot: Option<Pose2>,
}

/// Colour and word of a kind of edge.
fn kind_style(kind: EdgeKind) -> (Rgb888, &'static str) {
    match kind {
        EdgeKind::Distance => (Rgb888::new(0x1f, 0x6f, 0xc4), "distance"),
        EdgeKind::Semantic => (Rgb888::new(0xd6, 0x27, 0x28), "semantic"),
        EdgeKind::Relocalisation => (Rgb888::new(0xf0, 0x8c, 0x00), "relocalisation"),
    }
}

/// Draws a map.
pub fn draw(of: &Drawn) -> Sketch {
    let poses = of.trajectory.iter().chain(of.graph.places.iter().map(|p| &p.pose)).chain(&of.robot);
    let view = View::of(of.grid, poses);
    let size = view.size();
    let mut marks = vec![Mark::Cells(view.cells(of.grid, &shades(of.grid, of.regions)))];
    let pixel = |pose: &Pose2| view.pixel(pose.x_m, pose.y_m);
    marks.push(Mark::Line {
        points: of.trajectory.iter().map(pixel).collect(),
        colour: TRAJECTORY,
        width: 1,
    });
    let places: BTreeMap<PlaceId, &PlaceView> = of.graph.places.iter().map(|p| (p.id, p)).collect();
    for (kind, a, b) in apart(of.graph, &places) {
        let width = if kind == EdgeKind::Distance { 1 } else { 2 };
        marks.push(Mark::Line { points: vec![pixel(&a), pixel(&b)], colour: kind_style(kind).0, width });
    }
    let diameter = if view.pixels_per_m >= PLACES_FROM_PX { 5 } else { 2 };
    marks.extend(of.graph.places.iter().map(|p| Mark::Disc {
        middle: pixel(&p.pose),
        diameter,
        colour: PLACE,
    }));
    if let Some(start) = of.trajectory.first() {
        marks.push(Mark::Disc { middle: pixel(start), diameter: 9, colour: START });
    }
    if let Some(robot) = &of.robot {
        let (nose_m, at) = (NOSE / view.pixels_per_m, pixel(robot));
        let (x, y) = robot.apply(nose_m, 0.0);
        marks.push(Mark::Line { points: vec![at, view.pixel(x, y)], colour: END, width: 3 });
        marks.push(Mark::Disc { middle: at, diameter: 9, colour: END });
    }
    marks.extend(names::names(&view, &of.graph.places, of.regions, size));
    marks.extend(legend::legend(&view, of, size));
    Sketch { size: Size::new(size.0 as u32, (size.1 + legend::HEIGHT) as u32), marks }
}

/// Loop edges of the best graph, thinned; the rare kinds last, above the others.
fn apart(graph: &GraphAnswer, places: &BTreeMap<PlaceId, &PlaceView>) -> Vec<(EdgeKind, Pose2, Pose2)> {
    let mut edges: Vec<&EdgeView> = graph.particles.first().iter().flat_map(|best| &best.edges).collect();
    edges.sort_by_key(|e| e.kind);
    let mut drawn: Vec<(EdgeKind, Pose2, Pose2)> = Vec::new();
    for edge in edges {
        let (Some(i), Some(j)) = (places.get(&edge.i), places.get(&edge.j)) else { continue };
        let (kind, a, b) = (edge.kind, i.pose, j.pose);
        let near = |(k, c, d): &(EdgeKind, Pose2, Pose2)| {
            *k == kind && a.distance_m(c) < EDGES_APART_M && b.distance_m(d) < EDGES_APART_M
        };
        if !drawn.iter().any(near) {
            drawn.push((kind, a, b));
        }
    }
    drawn
}

#[cfg(test)]
mod tests;
