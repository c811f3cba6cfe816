//! A picture of the map: grid, trajectory, places, edges by kind, names.

use super::canvas::{Canvas, LETTER};
use super::shades::shades;
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use embedded_graphics::primitives::Rectangle;
use std::collections::BTreeMap;
use toponym_core::Pose2;
use toponym_core::answers::query::{EdgeView, GraphAnswer, Grid, PlaceView};
use toponym_core::edge::{EdgeKind, PlaceId};
use toponym_proto::regions::Region;

/// Longest side of the map's part of the picture, pixels.
const SIDE_MAX: usize = 1800;
/// Largest edge of a cell, pixels.
const CELL_MAX: usize = 6;
/// Free border round the map, pixels.
const MARGIN: i32 = 20;
/// Height of the legend below the map, pixels.
const LEGEND: i32 = 92;
/// Narrowest picture that the legend fits into, pixels.
const WIDTH_MIN: i32 = 640;
/// Names within this distance of each other are written once.
const NAME_SPACING_M: f64 = 8.0;
/// Share of the known cells that may fall outside the picture on each side.
const STRAY: f64 = 0.001;
/// Above so many edges each is drawn thin.
const EDGES_THICK_MAX: usize = 150;
/// A place is taken to be called so from this probability on.
const NAME_P_MIN: f64 = 0.3;

const INK: Rgb888 = Rgb888::new(0x20, 0x20, 0x20);
const UNKNOWN: Rgb888 = Rgb888::new(0xd8, 0xdc, 0xe0);
const TRAJECTORY: Rgb888 = Rgb888::new(0x5a, 0xae, 0x61);
const PLACE: Rgb888 = Rgb888::new(0x1b, 0x78, 0x37);
const NAME: Rgb888 = Rgb888::new(0x54, 0x27, 0x88);

/// Colour and word of a kind of edge.
fn kind_style(kind: EdgeKind) -> (Rgb888, &'static str) {
    match kind {
        EdgeKind::Distance => (Rgb888::new(0x1f, 0x6f, 0xc4), "distance"),
        EdgeKind::Semantic => (Rgb888::new(0xd6, 0x27, 0x28), "semantic"),
        EdgeKind::Relocalisation => (Rgb888::new(0xf0, 0x8c, 0x00), "relocalisation"),
    }
}

/// Edge of a grid's cell such that a map of this extent fits into a picture, metres.
pub fn resolution_m(extent_m: f64) -> f64 {
    (extent_m / SIDE_MAX as f64).max(0.05)
}

/// Draws a map. `trajectory` in order of time, map frame; `regions` as far as they are known.
pub fn draw(grid: &Grid, graph: &GraphAnswer, trajectory: &[Pose2], regions: &[Region]) -> Canvas {
    let view = View::of(grid, graph, trajectory);
    let (full_width, height) = view.size();
    let mut canvas = Canvas::new(Size::new(full_width as u32, (height + LEGEND) as u32), Rgb888::WHITE);
    view.draw_grid(grid, &shades(grid, regions), &mut canvas, height);
    for pair in trajectory.windows(2) {
        canvas.line(view.pixel(&pair[0]), view.pixel(&pair[1]), TRAJECTORY, 1);
    }
    let places: BTreeMap<PlaceId, &PlaceView> = graph.places.iter().map(|p| (p.id, p)).collect();
    let mut edges: Vec<&EdgeView> = graph.particles.first().iter().flat_map(|best| &best.edges).collect();
    let width = if edges.len() > EDGES_THICK_MAX { 1 } else { 2 };
    // The rare kinds last, above the others.
    edges.sort_by_key(|e| e.kind);
    for edge in edges {
        let thicker = u32::from(edge.kind != EdgeKind::Distance);
        if let (Some(i), Some(j)) = (places.get(&edge.i), places.get(&edge.j)) {
            let (a, b) = (view.pixel(&i.pose), view.pixel(&j.pose));
            canvas.line(a, b, kind_style(edge.kind).0, width + thicker);
        }
    }
    for place in &graph.places {
        canvas.disc(view.pixel(&place.pose), 5, PLACE);
    }
    write_names(&view, graph, &mut canvas, height);
    legend(&view, graph, &mut canvas, full_width, height);
    canvas
}

/// Which part of the map is shown, and how large.
struct View {
    /// Map to grid axes, which the picture is aligned with.
    grid_from_map: Pose2,
    /// Corners shown, grid axes, metres.
    low: [f64; 2],
    high: [f64; 2],
    pixels_per_m: f64,
}

impl View {
    /// Nearly all that is known of the grid, every pose and every place.
    fn of(grid: &Grid, graph: &GraphAnswer, trajectory: &[Pose2]) -> Self {
        let grid_from_map = grid.map_from_grid.inverse();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut show = |x: f64, y: f64| {
            (low, high) = ([low[0].min(x), low[1].min(y)], [high[0].max(x), high[1].max(y)]);
        };
        for end in grid_bounds(grid) {
            show(end[0], end[1]);
        }
        for pose in trajectory.iter().chain(graph.places.iter().map(|p| &p.pose)) {
            let (x, y) = grid_from_map.apply(pose.x_m, pose.y_m);
            show(x, y);
        }
        if low[0] > high[0] {
            (low, high) = ([0.0; 2], [1.0; 2]);
        }
        let side_m = (high[0] - low[0]).max(high[1] - low[1]).max(grid.resolution_m);
        // Whole pixels per cell keep walls crisp; only a map too large for that is shrunk.
        let per_cell = (SIDE_MAX as f64 * grid.resolution_m / side_m).min(CELL_MAX as f64);
        let per_cell = if per_cell >= 1.0 { per_cell.floor() } else { per_cell };
        Self { grid_from_map, low, high, pixels_per_m: per_cell / grid.resolution_m }
    }

    /// Width and height of the map's part of the picture, pixels.
    fn size(&self) -> (i32, i32) {
        let side = |k: usize| ((self.high[k] - self.low[k]) * self.pixels_per_m).ceil() as i32 + 2 * MARGIN;
        (side(0).max(WIDTH_MIN), side(1))
    }

    fn pixel(&self, pose: &Pose2) -> Point {
        let (x, y) = self.grid_from_map.apply(pose.x_m, pose.y_m);
        self.grid_pixel(x, y)
    }

    /// Pictures count rows downwards, maps upwards.
    fn grid_pixel(&self, x_m: f64, y_m: f64) -> Point {
        let x = ((x_m - self.low[0]) * self.pixels_per_m).round() as i32 + MARGIN;
        let y = ((self.high[1] - y_m) * self.pixels_per_m).round() as i32 + MARGIN;
        Point::new(x, y)
    }

    fn draw_grid(&self, grid: &Grid, shades: &[Option<Rgb888>], canvas: &mut Canvas, height: i32) {
        let all = Size::new(canvas.size().width, height as u32);
        canvas.fill(Rectangle::new(Point::zero(), all), UNKNOWN);
        // Occupied cells last: where several share a pixel, a wall must not get lost.
        let mut known: Vec<usize> = (0..grid.cells.len()).filter(|&k| grid.cells[k] >= 0).collect();
        known.sort_by_key(|&k| grid.cells[k]);
        for k in known {
            let (x, y) = ((k % grid.width) as f64, (k / grid.width) as f64);
            let corner = |dx: f64, dy: f64| {
                self.grid_pixel((x + dx) * grid.resolution_m, (y + dy) * grid.resolution_m)
            };
            let (top_left, below_right) = (corner(0.0, 1.0), corner(1.0, 0.0));
            let size = Size::new(
                (below_right.x - top_left.x).max(1) as u32,
                (below_right.y - top_left.y).max(1) as u32,
            );
            let paper = shades[k].unwrap_or(Rgb888::WHITE);
            let light = 255 - u32::from(grid.cells[k].clamp(0, 100) as u8) * 235 / 100;
            let inked = |paper: u8| (u32::from(paper) * light / 255) as u8;
            let colour = Rgb888::new(inked(paper.r()), inked(paper.g()), inked(paper.b()));
            canvas.fill(Rectangle::new(top_left, size), colour);
        }
    }
}

/// Opposite corners of what is known of a grid, grid axes, metres. A stray beam through a window
/// would shrink all the rest: the outermost [`STRAY`] of the cells on each side may fall outside.
fn grid_bounds(grid: &Grid) -> Vec<[f64; 2]> {
    let known = || grid.cells.iter().enumerate().filter(|(_, cell)| **cell >= 0).map(|(k, _)| k);
    let bounds = |count: usize, line: &dyn Fn(usize) -> usize| {
        let mut cells = vec![0_usize; count];
        known().for_each(|k| cells[line(k)] += 1);
        let stray = (STRAY * cells.iter().sum::<usize>() as f64) as usize;
        let seen = |left: &mut usize, n: &usize| {
            *left += n;
            Some(*left)
        };
        let first = cells.iter().scan(0, seen).position(|sum| sum > stray)?;
        let last = count - cells.iter().rev().scan(0, seen).position(|sum| sum > stray)?;
        Some([first as f64 * grid.resolution_m, last as f64 * grid.resolution_m])
    };
    let columns = bounds(grid.width, &|k| k % grid.width);
    let rows = bounds(grid.height, &|k| k / grid.width);
    columns.zip(rows).map_or(Vec::new(), |(x, y)| vec![[x[0], y[0]], [x[1], y[1]]])
}

/// Where each name is written: by the best place of each cluster that bears it, best first.
fn names(places: &[PlaceView]) -> Vec<(&str, &PlaceView)> {
    let mut bearers: Vec<(f64, &str, &PlaceView)> = places
        .iter()
        .flat_map(|p| p.labels.iter().map(move |(name, probability)| (*probability, name.as_str(), p)))
        .filter(|b| b.0 >= NAME_P_MIN)
        .collect();
    bearers.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.2.id.cmp(&b.2.id)));
    let mut chosen: Vec<(&str, &PlaceView)> = Vec::new();
    for (_, name, place) in bearers {
        let near =
            |(n, p): &(&str, &PlaceView)| *n == name && p.pose.distance_m(&place.pose) < NAME_SPACING_M;
        if !chosen.iter().any(near) {
            chosen.push((name, place));
        }
    }
    chosen
}

/// Writes names beside their places, each where it covers no other.
fn write_names(view: &View, graph: &GraphAnswer, canvas: &mut Canvas, height: i32) {
    let mut taken: Vec<Rectangle> = Vec::new();
    let letters = Size::new(canvas.size().width, height as u32);
    for (name, place) in names(&graph.places) {
        let at = view.pixel(&place.pose);
        let size = Size::new(name.chars().count() as u32 * LETTER.width + 2, LETTER.height);
        let (w, h) = (size.width as i32, size.height as i32);
        let rows = [0, 1, -1, 2, -2, 3, -3].map(|row| row * (h + 1) - h / 2);
        let spots = rows.iter().flat_map(|&dy| [(8, dy), (-w - 8, dy)]);
        let boxes = spots.map(|(dx, dy)| {
            let x = (at.x + dx).clamp(2, (letters.width as i32 - w - 2).max(2));
            let y = (at.y + dy).clamp(2, (height - h - 2).max(2));
            Rectangle::new(Point::new(x, y), size)
        });
        let free = |b: &Rectangle| taken.iter().all(|t| t.intersection(b).is_zero_sized());
        let Some(spot) = boxes.clone().find(free).or_else(|| boxes.clone().next()) else { continue };
        canvas.text(name, spot.top_left, NAME, Rgb888::WHITE);
        canvas.disc(at, 7, NAME);
        taken.push(spot);
    }
}

/// What the colours mean, and how long a metre is.
fn legend(view: &View, graph: &GraphAnswer, canvas: &mut Canvas, width: i32, height: i32) {
    let mut count: BTreeMap<EdgeKind, usize> = BTreeMap::new();
    for edge in graph.particles.first().iter().flat_map(|best| &best.edges) {
        *count.entry(edge.kind).or_default() += 1;
    }
    let kinds = [EdgeKind::Distance, EdgeKind::Semantic, EdgeKind::Relocalisation];
    let row = |k: i32| height + 10 + k * 25;
    let word = |canvas: &mut Canvas, text: &str, x: i32, y: i32| {
        canvas.text(text, Point::new(x, y), INK, Rgb888::WHITE);
    };
    canvas.line(Point::new(MARGIN, row(0) + 9), Point::new(MARGIN + 24, row(0) + 9), TRAJECTORY, 1);
    word(canvas, "trajectory", MARGIN + 32, row(0));
    canvas.disc(Point::new(MARGIN + 12, row(1) + 9), 5, PLACE);
    word(canvas, &format!("{} places", graph.places.len()), MARGIN + 32, row(1));
    canvas.disc(Point::new(MARGIN + 12, row(2) + 9), 7, NAME);
    word(canvas, "name taught here", MARGIN + 32, row(2));
    let x = MARGIN + 230;
    for (kind, k) in kinds.into_iter().zip(0..) {
        let (colour, name) = kind_style(kind);
        canvas.line(Point::new(x, row(k) + 9), Point::new(x + 24, row(k) + 9), colour, 2);
        let edges = count.get(&kind).copied().unwrap_or(0);
        word(canvas, &format!("{edges} {name} edges"), x + 32, row(k));
    }
    let bar_m = scale_bar_m(view.pixels_per_m);
    let bar = (bar_m * view.pixels_per_m).round() as i32;
    let (right, y) = (width - MARGIN, row(1) + 9);
    canvas.line(Point::new(right - bar, y), Point::new(right, y), INK, 2);
    for x in [right - bar, right] {
        canvas.line(Point::new(x, y - 5), Point::new(x, y + 5), INK, 2);
    }
    word(canvas, &format!("{bar_m} m"), right - bar, row(0) - 2);
}

/// The longest of 1, 2, 5, 10 … metres that stays below 140 pixels.
fn scale_bar_m(pixels_per_m: f64) -> f64 {
    let steps = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0];
    steps.into_iter().rfind(|m| m * pixels_per_m <= 140.0).unwrap_or(steps[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_core::answers::query::ParticleView;

    fn place(id: PlaceId, x: f64, y: f64, labels: &[(&str, f64)]) -> PlaceView {
        let labels = labels.iter().map(|(n, p)| ((*n).to_string(), *p)).collect();
        PlaceView { id, stamp_ns: 0, pose: Pose2::new(x, y, 0.0), labels }
    }

    fn graph() -> GraphAnswer {
        let edge = EdgeView { i: 0, j: 1, kind: EdgeKind::Semantic, i_from_j: Pose2::default() };
        GraphAnswer {
            epoch: 0,
            rev: 0,
            places: vec![place(0, 1.0, 1.0, &[("gym", 0.9)]), place(1, 9.0, 1.0, &[])],
            particles: vec![ParticleView { weight: 1.0, edges: vec![edge], poses: vec![] }],
            unresolved: 0.0,
            differences: vec![],
            effective_sample_size: 1.0,
        }
    }

    /// 10 m by 4 m, free, with a wall along the top row; its corner at (−1, −1).
    fn grid() -> Grid {
        let mut cells = vec![0; 100 * 40];
        cells[39 * 100..].fill(100);
        let map_from_grid = Pose2::new(-1.0, -1.0, 0.0);
        Grid { resolution_m: 0.1, width: 100, height: 40, map_from_grid, cells }
    }

    #[test]
    fn things_are_where_they_belong() {
        let trajectory = [Pose2::new(1.0, 2.0, 0.0), Pose2::new(8.0, 2.0, 0.0)];
        let canvas = draw(&grid(), &graph(), &trajectory, &[]);
        let at = |x_m: f64, y_m: f64| {
            let (x, y) = ((x_m + 1.0) * 60.0, (4.0 - (y_m + 1.0)) * 60.0);
            canvas.pixel(Point::new(x as i32 + MARGIN, y as i32 + MARGIN)).unwrap()
        };
        assert_eq!(at(5.0, 2.0), TRAJECTORY);
        assert_eq!(at(5.0, 1.0), kind_style(EdgeKind::Semantic).0);
        assert_eq!(at(1.0, 1.0), NAME);
        assert_eq!(at(9.0 - 1e-9, 1.0), PLACE);
        assert_eq!(at(5.0, 2.95), Rgb888::new(20, 20, 20), "wall");
        assert_eq!(at(5.0, 0.0), Rgb888::WHITE, "free");
        assert_eq!(canvas.pixel(Point::new(2, 2)), Some(UNKNOWN));
    }

    #[test]
    fn a_stray_beam_does_not_shrink_the_map() {
        let mut cells = vec![-1; 400 * 40];
        for row in 0..40 {
            cells[row * 400..row * 400 + 100].fill(0);
        }
        cells[20 * 400 + 399] = 100;
        let stray = Grid { width: 400, cells, ..grid() };
        assert_eq!(grid_bounds(&stray), [[0.0, 0.0], [10.0, 4.0]]);
        assert_eq!(draw(&stray, &graph(), &[], &[]).size(), draw(&grid(), &graph(), &[], &[]).size());
    }

    #[test]
    fn an_empty_map_and_a_huge_one_fit_too() {
        let none = GraphAnswer { places: vec![], particles: vec![], ..graph() };
        let empty = Grid { width: 0, height: 0, cells: vec![], ..grid() };
        assert!(draw(&empty, &none, &[], &[]).size().width >= WIDTH_MIN as u32);
        let far = [Pose2::default(), Pose2::new(900.0, 100.0, 0.0)];
        let size = draw(&grid(), &graph(), &far, &[]).size();
        assert!(size.width <= 2000 && size.height <= 2000, "{size:?}");
    }

    #[test]
    fn a_name_is_written_once_per_neighbourhood() {
        let places = [
            place(0, 0.0, 0.0, &[("lobby", 0.6)]),
            place(1, 1.0, 0.0, &[("lobby", 0.9), ("hall", 0.1)]),
            place(2, 30.0, 0.0, &[("lobby", 0.5)]),
        ];
        let written: Vec<(&str, PlaceId)> = names(&places).iter().map(|(n, p)| (*n, p.id)).collect();
        assert_eq!(written, [("lobby", 1), ("lobby", 2)]);
    }

    #[test]
    fn the_scale_bar_is_a_round_number() {
        assert!((scale_bar_m(20.0) - 5.0).abs() < 1e-12);
        assert!((scale_bar_m(100.0) - 1.0).abs() < 1e-12);
    }
}
