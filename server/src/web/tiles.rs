//! A map's grid in tiles: a page asks which there are and fetches those that it does not have yet.

use super::Web;
use super::api::refuse;
use crate::serve::aside;
use crate::serve::board::MapView;
use axum::Json;
use axum::body::Bytes;
use axum::extract::rejection::PathRejection;
use axum::extract::{Path, Query, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;
use tokio::sync::Mutex;
use tokio::task::spawn_blocking;
use toponym_core::answers::query::Grid;
use toponym_proto::answer::{ANSWER_VERSION, ErrorCode, MapIdentity, Problem};
use toponym_proto::grid::png_of;

/// Edge of a tile, cells.
const TILE: i64 = 128;

/// The newest tiles of each map.
#[derive(Default)]
pub struct Tiles {
    /// Held while they are made: others wait for the same.
    of: Mutex<BTreeMap<String, Arc<Tiled>>>,
}

/// The tiles of one state of a map.
struct Tiled {
    map: MapIdentity,
    resolution_m: f64,
    /// By column and row, from the map's origin on.
    tiles: BTreeMap<(i64, i64), Tile>,
}

#[derive(PartialEq)]
struct Tile {
    /// Of its pixels: the same pixels have the same.
    hash: String,
    png: Bytes,
}

/// Answer of `/map/{map}/tiles`.
#[derive(Serialize)]
struct TilesReply {
    v: u32,
    map: MapIdentity,
    resolution_m: f64,
    /// Cells in a row, and in a column, of a tile.
    tile_cells: i64,
    tiles: Vec<TileEntry>,
}

#[derive(Serialize)]
struct TileEntry {
    /// Its lower left corner is at x · cells · resolution, in the map.
    x: i64,
    y: i64,
    hash: String,
}

impl Tiles {
    /// The tiles of a map as it is now: made once for each state of it, however many look.
    async fn of(&self, view: Arc<MapView>) -> Result<Arc<Tiled>, Problem> {
        let mut all = self.of.lock().await;
        let snapshot = view.snapshot.load_full();
        let map = view.identity(&snapshot);
        if let Some(known) = all.get(&view.id).filter(|tiled| tiled.map == map) {
            return Ok(known.clone());
        }
        let before = all.get(&view.id).cloned();
        let made = spawn_blocking(move || {
            aside::give_way();
            Arc::new(Tiled::new(map, &snapshot.plan(), before.as_deref()))
        })
        .await;
        let tiled = made.map_err(|e| Problem::new(ErrorCode::Internal, e.to_string()))?;
        all.insert(view.id.clone(), tiled.clone());
        Ok(tiled)
    }

    /// A tile of the newest that were asked for.
    async fn last(&self, id: &str, at: (i64, i64)) -> Option<(String, Bytes)> {
        let all = self.of.lock().await;
        all.get(id)?.tiles.get(&at).map(|tile| (tile.hash.clone(), tile.png.clone()))
    }
}

impl Tiled {
    /// Cuts a grid along lines that stay where they are when it grows. Tiles of which nothing is known are left out; of those
    /// that are as before, the pictures are too.
    fn new(map: MapIdentity, grid: &Grid, before: Option<&Self>) -> Self {
        let before = before.filter(|b| b.resolution_m.to_bits() == grid.resolution_m.to_bits());
        let drawn = cut(grid).into_iter().filter_map(|(at, cells)| {
            let mut hash = DefaultHasher::new();
            cells.hash(&mut hash);
            let hash = format!("{:016x}", hash.finish());
            let same = before.and_then(|b| b.tiles.get(&at)).filter(|tile| tile.hash == hash);
            let png = match same {
                Some(tile) => tile.png.clone(),
                None => png_of(TILE as usize, TILE as usize, &cells).ok()?.into(),
            };
            Some((at, Tile { hash, png }))
        });
        Self { map, resolution_m: grid.resolution_m, tiles: drawn.collect() }
    }
}

/// Cells of tiles, by column and row from the map's origin on.
fn cut(grid: &Grid) -> BTreeMap<(i64, i64), Vec<i8>> {
    let cell = |m: f64| (m / grid.resolution_m).round() as i64;
    let (left, low) = (cell(grid.map_from_grid.x_m), cell(grid.map_from_grid.y_m));
    let mut tiles: BTreeMap<(i64, i64), Vec<i8>> = BTreeMap::new();
    for (k, &value) in grid.cells.iter().enumerate().filter(|(_, value)| **value >= 0) {
        let (x, y) = (left + (k % grid.width) as i64, low + (k / grid.width) as i64);
        let tile = tiles.entry((x.div_euclid(TILE), y.div_euclid(TILE)));
        let tile = tile.or_insert_with(|| vec![-1; (TILE * TILE) as usize]);
        tile[(y.rem_euclid(TILE) * TILE + x.rem_euclid(TILE)) as usize] = value;
    }
    tiles
}

/// Which tiles there are.
pub async fn list(State(web): State<Arc<Web>>, Path(id): Path<String>) -> Response {
    let Some(view) = web.board.maps.load().get(&id).cloned() else {
        let problem = Problem::new(ErrorCode::NoSuchMap, format!("there is no map {id:?}")).field("map");
        return refuse(StatusCode::NOT_FOUND, problem);
    };
    let tiled = match web.tiles.of(view).await {
        Ok(tiled) => tiled,
        Err(problem) => return refuse(StatusCode::INTERNAL_SERVER_ERROR, problem),
    };
    let entry = |(&(x, y), tile): (&(i64, i64), &Tile)| TileEntry { x, y, hash: tile.hash.clone() };
    let reply = TilesReply {
        v: ANSWER_VERSION,
        map: tiled.map.clone(),
        resolution_m: tiled.resolution_m,
        tile_cells: TILE,
        tiles: tiled.tiles.iter().map(entry).collect(),
    };
    ([(header::CACHE_CONTROL, "no-store")], Json(reply)).into_response()
}

/// Which state of a tile.
#[derive(Deserialize)]
pub struct Which {
    hash: Option<String>,
}

/// One tile of those listed last: an indexed PNG, as `ask/grid` has it.
pub async fn tile(
    State(web): State<Arc<Web>>,
    path: Result<Path<(String, i64, i64)>, PathRejection>,
    Query(which): Query<Which>,
) -> Response {
    let tile = match path {
        Ok(Path((id, x, y))) => web.tiles.last(&id, (x, y)).await,
        Err(_) => None,
    };
    let Some((hash, png)) = tile else {
        let problem = Problem::new(ErrorCode::NoSuchQuery, "there is no such tile").field("tile");
        return refuse(StatusCode::NOT_FOUND, problem.hint("/map/{map}/tiles lists those there are"));
    };
    // Whoever asked for this state of it need never ask again.
    let keep =
        if which.hash.as_ref() == Some(&hash) { "private, max-age=86400, immutable" } else { "no-store" };
    ([(header::CONTENT_TYPE, "image/png"), (header::CACHE_CONTROL, keep)], png).into_response()
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_core::Pose2;

    fn grid(left: i64, low: i64, cells: Vec<i8>, width: usize) -> Grid {
        let height = cells.len() / width;
        let map_from_grid = Pose2::new(left as f64 * 0.1, low as f64 * 0.1, 0.0);
        Grid { resolution_m: 0.1, width, height, map_from_grid, cells }
    }

    fn tiled(grid: &Grid, before: Option<&Tiled>) -> Tiled {
        let map = MapIdentity { id: "m".into(), uuid: "u".into(), epoch: 0, rev: 0, level: None };
        Tiled::new(map, grid, before)
    }

    #[test]
    fn tiles_stay_where_they_are_when_the_map_grows() {
        let before = tiled(&grid(-1, 2, vec![100, 0, 0, 100], 2), None);
        let small = &before.tiles;
        assert_eq!(small.keys().collect::<Vec<_>>(), [&(-1, 0), &(0, 0)]);
        // Grown by a column to the left, unknown, and one of the right beyond the second tile.
        let mut cells = vec![-1; 2 * 400];
        for (k, value) in [(1, 100), (2, 0), (401, 0), (402, 100), (399, 0)] {
            cells[k] = value;
        }
        let grid = grid(-2, 2, cells, 400);
        let (anew, kept) = (tiled(&grid, None).tiles, tiled(&grid, Some(&before)).tiles);
        let grown = &kept;
        assert!(anew == kept, "as from nothing");
        assert_eq!(grown.len(), 3);
        assert!(
            [(-1, 0), (0, 0)]
                .iter()
                .all(|at| grown[at].hash == small[at].hash && grown[at].png == small[at].png)
        );
    }
}
