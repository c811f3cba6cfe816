//! A floor plan as a world to drive in.

use super::doors;
use super::floor::Floor;
use super::floorplan::FloorPlan;
use super::names::{Use, name_of};
use super::random::Draw;
use super::world::{Room, RoomKind, Surface, Ways, World};
use crate::geom::{Area, Point, Segment, distance_m};

/// What a wall is made of may change from here to there: a wall dark all along is rare.
const PATCH_M: f64 = 2.0;
/// Share of the windows that are glass down to the laser.
const GLASS: f64 = 0.1;
/// Share of the walls that are dark.
const DARK: f64 = 0.01;
/// A robot needs this much room round it to stop and turn about.
const TURN_M: f64 = 0.4;
/// A visit begins this far inside a large room.
const INSIDE_MAX_M: f64 = 0.8;

/// A floor plan as a world.
#[derive(Clone, Debug)]
pub struct Storey {
    /// Its rooms are those in reach of each other: what no door joins to the largest part of the
    /// floor has walls only.
    pub world: World,
    /// Rooms to visit, as indices into [`World::rooms`].
    pub stops: Vec<usize>,
}

impl Storey {
    /// Puts up the walls of a plan, some of them dark or of glass by chance, and finds the ways.
    pub fn new(plan: &FloorPlan, draw: &mut Draw) -> Self {
        let built = doors::walls(plan);
        let corners =
            |space: &crate::floorplan::Space| space.contour.iter().map(|(line, _)| line.a).collect();
        let spaces: Vec<Area> = plan.spaces.iter().map(|s| Area { corners: corners(s) }).collect();
        let patched = built.lines.iter().flat_map(|(line, window)| patches(line).map(|p| (p, *window)));
        let (walls, windows): (Vec<_>, Vec<bool>) = patched.unzip();
        let open: Vec<Area> = spaces.iter().cloned().chain(built.doorways).collect();
        let floor = Floor::new(&open, &walls);
        let part = floor.largest_part();
        let (mut rooms, mut waypoints, mut stops) = (Vec::new(), Vec::new(), Vec::new());
        for ((space, area), doors) in plan.spaces.iter().zip(spaces).zip(built.doors) {
            let Some(spot) = roomiest(&floor, &part, &area) else { continue };
            let (name, purpose) = name_of(&space.category, doors);
            let kind = if purpose == Use::Corridor { RoomKind::Corridor } else { RoomKind::Room };
            let room_m = floor.clearance_m(spot);
            if purpose == Use::Room && room_m >= TURN_M {
                stops.push(rooms.len());
            }
            let inside_m = INSIDE_MAX_M.min(room_m / 2.0);
            rooms.push(Room { name, area, kind, inside_m, spot: waypoints.len() });
            waypoints.push(spot);
        }
        let surface = |window: bool| match (window, draw.unit()) {
            (true, u) if u < GLASS => Surface::Glass,
            (false, u) if u < DARK => Surface::Dark,
            _ => Surface::Plain,
        };
        let surfaces = windows.into_iter().map(surface).collect();
        let mut world = World::new(walls, rooms, waypoints, Ways::Open(floor));
        world.surfaces = surfaces;
        Self { world, stops }
    }
}

/// A wall in pieces of equal length.
fn patches(wall: &Segment) -> impl Iterator<Item = Segment> {
    let Segment { a, b } = *wall;
    let count = (distance_m(a, b) / PATCH_M).ceil().max(1.0);
    let at = move |k: usize| {
        let f = k as f64 / count;
        // At the ends exactly the wall's: no crack in the corner.
        [0, 1].map(|axis| (1.0 - f) * a[axis] + f * b[axis])
    };
    (0..count as usize).map(move |k| Segment { a: at(k), b: at(k + 1) })
}

/// The point of an area, within a part of the floor, with the most room round it; of many, one
/// near the middle.
fn roomiest(floor: &Floor, part: &[bool], area: &Area) -> Option<Point> {
    let centre = area.centre();
    let score = |p: Point| floor.clearance_m(p) - 0.01 * distance_m(p, centre);
    let reached = floor.cells_in(area).into_iter().filter(|&cell| part[cell]);
    reached.map(|cell| floor.middle(cell)).max_by(|&a, &b| score(a).total_cmp(&score(b)))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::path::Path;

    /// An office of 4 m by 4 m and a corridor, 0.2 m of wall between them with a door of 1 m,
    /// and a portal to nowhere at the corridor's end.
    pub(crate) const TWO_ROOMS: &str = r#"<floor BuildingName="B" FloorName="1">
<Scale PixelDistance="400" RealDistance="4"/>
<space name="a" type="KONTOR"><contour>
<centroid x="200" y="200"/>
<linesegment x1="0" y1="0" x2="400" y2="0" type="Wall" target=""/>
<linesegment x1="400" y1="0" x2="400" y2="100" type="Wall" target=""/>
<linesegment x1="400" y1="100" x2="400" y2="200" type="Portal" target="b"/>
<linesegment x1="400" y1="200" x2="400" y2="400" type="Wall" target=""/>
<linesegment x1="400" y1="400" x2="0" y2="400" type="Wall" target=""/>
<linesegment x1="0" y1="400" x2="0" y2="0" type="Window" target=""/>
</contour><portal target="b"/></space>
<space name="b" type="KORRIDOR"><contour>
<linesegment x1="420" y1="0" x2="1000" y2="0" type="Wall" target=""/>
<linesegment x1="1000" y1="0" x2="1000" y2="100" type="Wall" target=""/>
<linesegment x1="1000" y1="100" x2="1000" y2="200" type="Portal" target="c"/>
<linesegment x1="1000" y1="200" x2="1000" y2="400" type="Wall" target=""/>
<linesegment x1="1000" y1="400" x2="420" y2="400" type="Wall" target=""/>
<linesegment x1="420" y1="400" x2="420" y2="210" type="Wall" target=""/>
<linesegment x1="420" y1="210" x2="420" y2="90" type="Portal" target="a"/>
<linesegment x1="420" y1="90" x2="420" y2="0" type="Wall" target=""/>
</contour><portal target="a"/></space>
</floor>
"#;

    /// Three rooms of 4 m by 3 m in a row along a hallway.
    pub(crate) const ROW: &str = r#"<floor BuildingName="B" FloorName="2">
<Scale PixelDistance="10" RealDistance="1"/>
<space name="a" type="PENTRY"><contour>
<linesegment x1="0" y1="22" x2="15" y2="22" type="Wall"/>
<linesegment x1="15" y1="22" x2="25" y2="22" type="Portal" target="h"/>
<linesegment x1="25" y1="22" x2="40" y2="22" type="Wall"/>
<linesegment x1="40" y1="22" x2="40" y2="52" type="Wall"/>
<linesegment x1="40" y1="52" x2="0" y2="52" type="Window"/>
<linesegment x1="0" y1="52" x2="0" y2="22" type="Wall"/>
</contour></space>
<space name="b" type="VERKSTAD"><contour>
<linesegment x1="42" y1="22" x2="43" y2="22" type="Wall"/>
<linesegment x1="43" y1="22" x2="50" y2="22" type="Portal" target="h"/>
<linesegment x1="50" y1="22" x2="82" y2="22" type="Wall"/>
<linesegment x1="82" y1="22" x2="82" y2="52" type="Wall"/>
<linesegment x1="82" y1="52" x2="42" y2="52" type="Window"/>
<linesegment x1="42" y1="52" x2="42" y2="22" type="Wall"/>
</contour></space>
<space name="c" type="BIBL"><contour>
<linesegment x1="84" y1="22" x2="110" y2="22" type="Wall"/>
<linesegment x1="110" y1="22" x2="118" y2="22" type="Portal" target="h"/>
<linesegment x1="118" y1="22" x2="124" y2="22" type="Wall"/>
<linesegment x1="124" y1="22" x2="124" y2="52" type="Wall"/>
<linesegment x1="124" y1="52" x2="84" y2="52" type="Window"/>
<linesegment x1="84" y1="52" x2="84" y2="22" type="Wall"/>
</contour></space>
<space name="h" type="KORRIDOR"><contour>
<linesegment x1="0" y1="0" x2="124" y2="0" type="Wall"/>
<linesegment x1="124" y1="0" x2="124" y2="20" type="Wall"/>
<linesegment x1="124" y1="20" x2="118" y2="20" type="Wall"/>
<linesegment x1="118" y1="20" x2="110" y2="20" type="Portal" target="c"/>
<linesegment x1="110" y1="20" x2="50" y2="20" type="Wall"/>
<linesegment x1="50" y1="20" x2="43" y2="20" type="Portal" target="b"/>
<linesegment x1="43" y1="20" x2="25" y2="20" type="Wall"/>
<linesegment x1="25" y1="20" x2="15" y2="20" type="Portal" target="a"/>
<linesegment x1="15" y1="20" x2="0" y2="20" type="Wall"/>
<linesegment x1="0" y1="20" x2="0" y2="0" type="Wall"/>
</contour></space>
</floor>
"#;

    pub(crate) fn two_rooms() -> Storey {
        Storey::new(&FloorPlan::parse(TWO_ROOMS, Path::new("p.xml")).unwrap(), &mut Draw::new(1, 0))
    }

    #[test]
    fn doors_are_open_and_portals_to_nowhere_shut() {
        let world = two_rooms().world;
        for (from, deg, want) in [
            ([1.0, 1.5], 0.0, 9.0),    // through the door to the shut one
            ([9.0, 1.5], 180.0, 9.0),  // and back to the window
            ([1.0, 0.5], 0.0, 3.0),    // against the wall
            ([9.0, 0.95], 180.0, 4.8), // the wider portal's rest is shut
            ([4.1, 1.5], 90.0, 0.5),   // a jamb
            ([4.1, 1.5], -90.0, 0.5),
        ] {
            let got = world.cast(from, f64::to_radians(deg), 30.0).unwrap();
            assert!((got - want).abs() < 1e-9, "{from:?} at {deg}°: {got}, not {want}");
        }
    }

    #[test]
    fn patches_make_up_the_wall() {
        let wall = Segment { a: [1.0, 0.0], b: [1.0, 5.0] };
        let patches: Vec<Segment> = patches(&wall).collect();
        assert_eq!(patches.len(), 3);
        assert!(patches.windows(2).all(|w| distance_m(w[0].b, w[1].a) < 1e-12));
        let ends_m = distance_m(patches[0].a, wall.a) + distance_m(patches[2].b, wall.b);
        assert!(ends_m < 1e-12 && patches.iter().all(|p| distance_m(p.a, p.b) <= PATCH_M));
    }

    #[test]
    fn rooms_have_names_spots_and_a_way_between_them() {
        let Storey { world, stops } = two_rooms();
        let told: Vec<_> = world.rooms.iter().map(|r| (r.name.as_str(), r.kind)).collect();
        assert_eq!(told, [("office", RoomKind::Room), ("hallway", RoomKind::Corridor)]);
        assert_eq!(stops, [0]);
        assert!(distance_m(world.waypoints[0], [2.0, 2.0]) < 0.2, "{:?}", world.waypoints[0]);
        assert!(world.route(0, 1).unwrap().iter().any(|p| (1.2..1.8).contains(&p[1])));
    }

    #[test]
    fn a_room_without_a_door_is_not_in_reach() {
        let shut = TWO_ROOMS.replace(r#"type="Portal" target="a""#, r#"type="Wall" target="""#);
        let plan = FloorPlan::parse(&shut, Path::new("p.xml")).unwrap();
        let Storey { world, stops } = Storey::new(&plan, &mut Draw::new(1, 0));
        assert_eq!((world.rooms.len(), stops.len()), (1, 0), "the corridor is larger");
    }
}
