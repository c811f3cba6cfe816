//! What the colours of a picture mean, and how long a metre is.

use super::sketch::Mark;
use super::view::{MARGIN, View};
use super::{Drawn, END, PLACE, START, TRAJECTORY, kind_style};
use crate::picture::names::NAME;
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use std::collections::BTreeMap;
use toponym_core::edge::EdgeKind;

/// Height of the legend below the map, pixels.
pub const HEIGHT: i32 = 92;

const INK: Rgb888 = Rgb888::new(0x20, 0x20, 0x20);

/// Marks below a map of this size in pixels.
pub fn legend(view: &View, of: &Drawn, (width, height): (i32, i32)) -> Vec<Mark> {
    let mut count: BTreeMap<EdgeKind, usize> = BTreeMap::new();
    for edge in of.graph.particles.first().iter().flat_map(|best| &best.edges) {
        *count.entry(edge.kind).or_default() += 1;
    }
    let row = |k: i32| height + 10 + k * 25;
    let word =
        |text: String, x: i32, k: i32| Mark::Text { text, top_left: Point::new(x, row(k)), colour: INK };
    let dash = |x: i32, k: i32, colour: Rgb888, width: u32| {
        let points = vec![Point::new(x, row(k) + 9), Point::new(x + 24, row(k) + 9)];
        Mark::Line { points, colour, width }
    };
    let disc = |x: i32, k: i32, diameter: u32, colour: Rgb888| Mark::Disc {
        middle: Point::new(x + 12, row(k) + 9),
        diameter,
        colour,
    };
    let [left, middle, right] = [MARGIN, MARGIN + 230, MARGIN + 510];
    let mut marks = vec![
        dash(left, 0, TRAJECTORY, 1),
        word("trajectory".into(), left + 32, 0),
        disc(left, 1, 5, PLACE),
        word(format!("{} places", of.graph.places.len()), left + 32, 1),
        disc(left, 2, 7, NAME),
        word("name, how sure".into(), left + 32, 2),
        disc(right, 0, 9, START),
        word("start".into(), right + 32, 0),
        disc(right, 1, 9, END),
        word("robot".into(), right + 32, 1),
    ];
    for (kind, k) in [EdgeKind::Distance, EdgeKind::Semantic, EdgeKind::Relocalisation].into_iter().zip(0..) {
        let (colour, name) = kind_style(kind);
        let edges = count.get(&kind).copied().unwrap_or(0);
        marks.push(dash(middle, k, colour, 2));
        marks.push(word(format!("{edges} {name} edges"), middle + 32, k));
    }
    let bar_m = scale_bar_m(view.pixels_per_m);
    let bar = (bar_m * view.pixels_per_m).round() as i32;
    let (end, y) = (width - MARGIN, row(2) + 9);
    for (a, b) in
        [((end - bar, y), (end, y)), ((end - bar, y - 5), (end - bar, y + 5)), ((end, y - 5), (end, y + 5))]
    {
        marks.push(Mark::Line { points: vec![a.into(), b.into()], colour: INK, width: 2 });
    }
    marks.push(word(format!("{bar_m} m"), end - bar, 1));
    marks
}

/// The longest of 1, 2, 5, 10 … metres that stays below 140 pixels.
fn scale_bar_m(pixels_per_m: f64) -> f64 {
    let steps = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0];
    steps.into_iter().rfind(|m| m * pixels_per_m <= 140.0).unwrap_or(steps[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_bar_is_a_round_number() {
        assert!((scale_bar_m(20.0) - 5.0).abs() < 1e-12);
        assert!((scale_bar_m(100.0) - 1.0).abs() < 1e-12);
    }
}
