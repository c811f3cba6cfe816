//! Masks for Nav2's costmap filters: where robots keep out, and where they go slowly.

use super::Content;
use super::nav2;
use crate::convert::regions_reply;
use anyhow::{Result, bail};
use toponym_core::Snapshot;
use toponym_core::answers::query::Grid;
use toponym_core::geometry::is_inside;
use toponym_proto::answer::MapIdentity;
use toponym_proto::regions::{Region, RegionName};

/// A room bears a name that is rather its own than not.
const CALLED_MIN: f64 = 0.5;

/// Rooms by name where robots go at a share of their speed.
#[derive(Clone, Debug)]
pub struct Slow {
    name: String,
    percent: u8,
}

/// From `kitchen=50`.
pub fn slow(text: &str) -> Result<Slow, String> {
    let wrong = || format!("{text:?} is no room and a share of speed, such as kitchen=50");
    let (name, percent) = text.rsplit_once('=').ok_or_else(wrong)?;
    let percent =
        percent.trim_end_matches('%').parse().ok().filter(|p| (1..=100).contains(p)).ok_or_else(wrong)?;
    Ok(Slow { name: name.trim().to_owned(), percent })
}

/// `keepout_mask` and `speed_mask`, each as picture and how to read it. `grid`: the map whose cells they have.
///
/// # Errors
/// If nothing bears one of the names.
pub fn files(snapshot: &Snapshot, grid: &Grid, keep_out: &[String], slow: &[Slow]) -> Result<Vec<Content>> {
    let mut forbidden: Vec<Polygon> =
        snapshot.areas().into_iter().filter(|area| area.forbidden).map(|area| area.polygon_m).collect();
    for name in keep_out {
        forbidden.extend(called(snapshot, name)?);
    }
    let out = mask(grid, &[(forbidden, 100)]);
    let mut files = nav2::picture(grid, "trinary", ["keepout_mask.yaml", "keepout_mask.pgm"], &out).to_vec();
    if !slow.is_empty() {
        // Base 100, multiplier −1, as in Nav2's own example: 0 is as fast as ever.
        let limits = slow.iter().map(|s| Ok((called(snapshot, &s.name)?, 100 - s.percent)));
        let limits: Vec<(Vec<Polygon>, u8)> = limits.collect::<Result<_>>()?;
        let limited = mask(grid, &limits);
        files.extend(nav2::picture(grid, "scale", ["speed_mask.yaml", "speed_mask.pgm"], &limited));
    }
    Ok(files)
}

type Polygon = Vec<(f64, f64)>;

/// Areas and rooms of a name.
fn called(snapshot: &Snapshot, name: &str) -> Result<Vec<Polygon>> {
    let rooms = regions_reply(snapshot, MapIdentity::default());
    // Just that: of what is only like it nobody said that robots keep out.
    let is_it = |label: &String| label.eq_ignore_ascii_case(name);
    let areas =
        rooms.areas.iter().filter(|a| a.name.as_ref().is_some_and(is_it)).map(|a| a.polygon_m.clone());
    let areas: Vec<Vec<[f64; 2]>> = areas.collect();
    let is_called = |names: &[RegionName]| names.iter().any(|n| is_it(&n.label) && n.p >= CALLED_MIN);
    let regions = rooms.regions.iter().filter(|r| is_called(&r.names)).map(Region::line_m);
    // What somebody drew is what they mean.
    let all: Vec<Vec<[f64; 2]>> = if areas.is_empty() { regions.collect() } else { areas };
    if all.is_empty() {
        bail!("no room of this map is {name:?}: `toponym rooms` lists their names");
    }
    Ok(all.into_iter().map(|line| line.into_iter().map(|[x, y]| (x, y)).collect()).collect())
}

/// Values of cells, row-major as in the grid: the highest of those that hold there, else 0.
fn mask(grid: &Grid, areas: &[(Vec<Polygon>, u8)]) -> Vec<u8> {
    let (x0, y0) = (grid.map_from_grid.x_m, grid.map_from_grid.y_m);
    let middle = |k: usize| {
        let cell = |n: usize| (n as f64 + 0.5) * grid.resolution_m;
        (x0 + cell(k % grid.width), y0 + cell(k / grid.width))
    };
    let value = |k: usize| {
        let holds = |polygons: &[Polygon]| polygons.iter().any(|polygon| is_inside(polygon, middle(k)));
        areas.iter().filter(|(polygons, _)| holds(polygons)).map(|(_, value)| *value).max().unwrap_or(0)
    };
    (0..grid.cells.len()).map(value).collect()
}
