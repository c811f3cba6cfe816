//! Names on a picture: of rooms inside them, of parts of corridors and halls where they were told.

use super::canvas::LETTER;
use super::sketch::Mark;
use super::view::View;
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use embedded_graphics::primitives::Rectangle;
use std::collections::{BTreeMap, BTreeSet};
use toponym_core::answers::query::PlaceView;
use toponym_core::edge::PlaceId;
use toponym_proto::regions::Region;

/// Names of wide regions within this distance of each other are written once.
const SPACING_M: f64 = 8.0;
/// A region or place is taken to be called so from this probability on.
const P_MIN: f64 = 0.3;
/// Probabilities from here on are as good as 1.
const CERTAIN: f64 = 0.995;

pub const NAME: Rgb888 = Rgb888::new(0x54, 0x27, 0x88);

/// A name and where it is written.
#[derive(Debug, PartialEq)]
struct Written {
    text: String,
    x_m: f64,
    y_m: f64,
}

/// Marks of names, each where it covers no other, within a picture of this size.
pub fn names(view: &View, places: &[PlaceView], regions: &[Region], size: (i32, i32)) -> Vec<Mark> {
    let mut taken: Vec<Rectangle> = Vec::new();
    let mut marks = Vec::new();
    for Written { text, x_m, y_m } in written(places, regions) {
        let at = view.pixel(x_m, y_m);
        let box_size = Size::new(text.chars().count() as u32 * LETTER.width + 2, LETTER.height);
        let (w, h) = (box_size.width as i32, box_size.height as i32);
        let rows = [0, 1, -1, 2, -2, 3, -3].map(|row| row * (h + 1) - h / 2);
        let boxes = rows.iter().flat_map(|&dy| [-w / 2, 8, -w - 8].map(|dx| (dx, dy))).map(|(dx, dy)| {
            let x = (at.x + dx).clamp(2, (size.0 - w - 2).max(2));
            let y = (at.y + dy).clamp(2, (size.1 - h - 2).max(2));
            Rectangle::new(Point::new(x, y), box_size)
        });
        let free = |b: &Rectangle| taken.iter().all(|t| t.intersection(b).is_zero_sized());
        let Some(spot) = boxes.clone().find(free).or_else(|| boxes.clone().next()) else { continue };
        marks.push(Mark::Disc { middle: at, diameter: 7, colour: NAME });
        marks.push(Mark::Text { text, top_left: spot.top_left, colour: NAME });
        taken.push(spot);
    }
    marks
}

/// Surest first.
fn written(places: &[PlaceView], regions: &[Region]) -> Vec<Written> {
    let at: BTreeMap<PlaceId, &PlaceView> = places.iter().map(|p| (p.id, p)).collect();
    let mut all: Vec<(f64, Written)> = Vec::new();
    let mut is_told: BTreeSet<&str> = BTreeSet::new();
    for region in regions.iter().filter(|r| r.kind == "room") {
        let inside: Vec<&PlaceView> = region.places.iter().filter_map(|id| at.get(id).copied()).collect();
        let Some(middle) = middle(&inside) else { continue };
        for name in region.names.iter().filter(|n| n.p >= P_MIN) {
            all.push((name.p, told(&name.label, name.p, middle)));
            is_told.insert(&name.label);
        }
    }
    for (p, name, place) in beside(places) {
        if !is_told.contains(name) {
            all.push((p, told(name, p, place)));
        }
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.text.cmp(&b.1.text)));
    all.into_iter().map(|(_, written)| written).collect()
}

fn told(name: &str, p: f64, place: &PlaceView) -> Written {
    let sure = if p >= CERTAIN { String::new() } else { format!(" {p:.2}").replacen("0.", ".", 1) };
    Written { text: format!("{name}{sure}"), x_m: place.pose.x_m, y_m: place.pose.y_m }
}

/// The place nearest to the middle of all.
fn middle<'a>(places: &[&'a PlaceView]) -> Option<&'a PlaceView> {
    let mean = |axis: fn(&PlaceView) -> f64| {
        places.iter().map(|p| axis(p)).sum::<f64>() / places.len().max(1) as f64
    };
    let (x_m, y_m) = (mean(|p| p.pose.x_m), mean(|p| p.pose.y_m));
    let far_m = |p: &&&PlaceView| (p.pose.x_m - x_m).hypot(p.pose.y_m - y_m);
    places.iter().min_by(|a, b| far_m(a).total_cmp(&far_m(b))).copied()
}

/// The best place of each cluster that bears a name, best first.
fn beside(places: &[PlaceView]) -> Vec<(f64, &str, &PlaceView)> {
    let mut bearers: Vec<(f64, &str, &PlaceView)> = places
        .iter()
        .flat_map(|p| p.labels.iter().map(move |(name, probability)| (*probability, name.as_str(), p)))
        .filter(|b| b.0 >= P_MIN)
        .collect();
    bearers.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.2.id.cmp(&b.2.id)));
    let mut chosen: Vec<(f64, &str, &PlaceView)> = Vec::new();
    for bearer in bearers {
        let near = |(_, name, place): &(f64, &str, &PlaceView)| {
            *name == bearer.1 && place.pose.distance_m(&bearer.2.pose) < SPACING_M
        };
        if !chosen.iter().any(near) {
            chosen.push(bearer);
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::super::tests::{place, region};
    use super::*;

    #[test]
    fn a_name_is_written_once_per_neighbourhood() {
        let places = [
            place(0, 0.0, 0.0, &[("lobby", 0.6)]),
            place(1, 1.0, 0.0, &[("lobby", 0.9), ("hall", 0.1)]),
            place(2, 30.0, 0.0, &[("lobby", 1.0)]),
        ];
        let texts: Vec<(String, f64)> = written(&places, &[]).into_iter().map(|w| (w.text, w.x_m)).collect();
        assert_eq!(texts, [("lobby".into(), 30.0), ("lobby .90".into(), 1.0)]);
    }

    #[test]
    fn a_room_is_named_within_and_by_what_it_is_called() {
        let places = [
            place(0, 0.0, 0.0, &[("gym", 0.5)]),
            place(1, 3.0, 0.0, &[]),
            place(2, 9.0, 0.0, &[("lobby", 0.8)]),
        ];
        let regions = [
            region(0, "room", &[("gym", 0.97), ("pool", 0.1)], &[0, 1]),
            region(2, "corridor", &[("lobby", 0.7)], &[2]),
        ];
        let texts: Vec<String> = written(&places, &regions).into_iter().map(|w| w.text).collect();
        assert_eq!(texts, ["gym .97", "lobby .80"]);
    }
}
