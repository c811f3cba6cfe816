//! Reads hallways of floor plans in the KTH campus data set's XML format: rooms along them, doors.

use roxmltree::{Document, Node};
use toponym_core::language::Footprint;

/// A point in the plan, metres.
pub type Point = (f64, f64);

/// A room with a door to a hallway or to a room on it; in the hallway's frame.
pub struct Room {
    /// Its outline.
    pub outline: Vec<Point>,
    /// Where one goes in.
    pub door: Point,
    /// A point well inside.
    pub middle: Point,
    /// The room that one comes through, if it has no door to the hallway.
    pub through: Option<usize>,
}

/// A straight hallway along x, its middle at the origin.
pub struct Hallway {
    /// Half of its length.
    pub half_length_m: f64,
    /// Rooms, by x of the door.
    pub rooms: Vec<Room>,
}

struct Space {
    name: String,
    outline: Vec<Point>,
    /// Middle of each portal and where it leads.
    doors: Vec<(Point, String)>,
}

/// A hallway is so many times longer than wide, at least this long, fills its rectangle, and has doors.
const ELONGATION: f64 = 3.0;
const LENGTH_MIN_M: f64 = 12.0;
const FILL: f64 = 0.75;
const DOORS_MIN: usize = 4;
/// The middle of a larger room is further than a guide would take a robot.
const DEPTH_MAX_M: f64 = 10.0;

/// The straight hallways of a plan.
pub fn hallways(xml: &str) -> Vec<Hallway> {
    let Ok(document) = Document::parse(xml) else { return Vec::new() };
    let root = document.root_element();
    let scale = root.children().find(|n| n.has_tag_name("Scale"));
    let Some(unit_m) = scale.and_then(|s| Some(number(s, "RealDistance")? / number(s, "PixelDistance")?))
    else {
        return Vec::new();
    };
    let spaces: Vec<Space> =
        root.children().filter(|n| n.has_tag_name("space")).map(|n| space(n, unit_m)).collect();
    spaces.iter().filter_map(|s| hallway(s, &spaces)).collect()
}

fn number(node: Node, name: &str) -> Option<f64> {
    node.attribute(name)?.parse().ok()
}

fn space(node: Node, unit_m: f64) -> Space {
    let (mut outline, mut doors) = (Vec::new(), Vec::new());
    for line in node.descendants().filter(|n| n.has_tag_name("linesegment")) {
        let at = |name| number(line, name).unwrap_or(0.0) * unit_m;
        let (a, b) = ((at("x1"), at("y1")), (at("x2"), at("y2")));
        outline.push(a);
        if line.attribute("type") == Some("Portal") {
            let to = line.attribute("target").unwrap_or_default().to_owned();
            doors.push(((0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1)), to));
        }
    }
    Space { name: node.attribute("name").unwrap_or_default().to_owned(), outline, doors }
}

fn hallway(hall: &Space, spaces: &[Space]) -> Option<Hallway> {
    let frame = Footprint::around(&hall.outline)?;
    let straight = frame.half_length_m >= ELONGATION * frame.half_width_m
        && 2.0 * frame.half_length_m >= LENGTH_MIN_M
        && area_m2(&hall.outline) >= FILL * frame.area_m2()
        && hall.doors.len() >= DOORS_MIN;
    if !straight {
        return None;
    }
    let mut rooms: Vec<(Room, &Space)> = Vec::new();
    // More doors than a hallway needs: a hallway itself, and no room.
    let is_room = |s: &&Space| s.doors.len() < DOORS_MIN;
    for s in spaces.iter().filter(is_room) {
        rooms.extend(room(s, hall, &frame, &rooms));
    }
    rooms.sort_by(|a, b| a.0.door.0.total_cmp(&b.0.door.0));
    for outer in rooms.iter().map(|r| r.1).collect::<Vec<_>>() {
        let only_there = |s: &&Space| s.doors.iter().all(|d| d.1 == outer.name || d.1.is_empty());
        for s in spaces.iter().filter(is_room).filter(only_there) {
            rooms.extend(room(s, outer, &frame, &rooms));
        }
    }
    let rooms: Vec<Room> = rooms.into_iter().map(|r| r.0).collect();
    (rooms.len() >= DOORS_MIN).then_some(Hallway { half_length_m: frame.half_length_m, rooms })
}

/// A room that one enters from the hallway, or from a room known.
fn room<'a>(
    space: &'a Space,
    from: &Space,
    frame: &Footprint,
    known: &[(Room, &'a Space)],
) -> Option<(Room, &'a Space)> {
    let local = |p: &Point| frame.local(p.0, p.1);
    let door = space.doors.iter().find(|d| d.1 == from.name).map(|d| local(&d.0))?;
    let outline: Vec<Point> = space.outline.iter().map(local).collect();
    let middle = middle(&outline);
    let near = (middle.0 - door.0).hypot(middle.1 - door.1) < DEPTH_MAX_M;
    let new = !known.iter().any(|r| r.1.name == space.name);
    let through = known.iter().position(|r| r.1.name == from.name);
    (new && near && inside(middle, &outline)).then_some((Room { outline, door, middle, through }, space))
}

fn area_m2(outline: &[Point]) -> f64 {
    let next = outline.iter().cycle().skip(1);
    0.5 * outline.iter().zip(next).map(|(a, b)| a.0 * b.1 - a.1 * b.0).sum::<f64>().abs()
}

fn middle(outline: &[Point]) -> Point {
    let count = outline.len().max(1) as f64;
    let low = outline.iter().fold((f64::INFINITY, f64::INFINITY), |l, p| (l.0.min(p.0), l.1.min(p.1)));
    let high =
        outline.iter().fold((f64::NEG_INFINITY, f64::NEG_INFINITY), |h, p| (h.0.max(p.0), h.1.max(p.1)));
    let boxed = (0.5 * (low.0 + high.0), 0.5 * (low.1 + high.1));
    if inside(boxed, outline) {
        return boxed;
    }
    let sum = outline.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
    (sum.0 / count, sum.1 / count)
}

/// Is a point inside an outline?
pub fn inside(p: Point, outline: &[Point]) -> bool {
    let next = outline.iter().cycle().skip(1);
    let crossings = outline
        .iter()
        .zip(next)
        .filter(|(a, b)| (a.1 > p.1) != (b.1 > p.1) && p.0 < a.0 + (p.1 - a.1) / (b.1 - a.1) * (b.0 - a.0));
    crossings.count() % 2 == 1
}

/// Least distance between corners of one outline and sides of the other.
pub fn apart_m(a: &[Point], b: &[Point]) -> f64 {
    let to_side = |p: &Point, (s, e): (&Point, &Point)| {
        let side = Footprint::strip(*s, *e, 0.0);
        side.signed_distance_m(side.local(p.0, p.1))
    };
    let to_sides = |p: &Point, sides: &[Point]| {
        let next = sides.iter().cycle().skip(1);
        sides.iter().zip(next).map(|side| to_side(p, side)).fold(f64::INFINITY, f64::min)
    };
    let one = a.iter().map(|p| to_sides(p, b)).fold(f64::INFINITY, f64::min);
    b.iter().map(|p| to_sides(p, a)).fold(one, f64::min)
}
