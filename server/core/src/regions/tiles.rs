//! Counts by cell, of a plane without edges of which little is known.

/// Cells along the edge of a tile.
const EDGE: i32 = 64;
const CELLS: usize = (EDGE * EDGE) as usize;

/// What happened in a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Count {
    /// Rays that went through.
    pub passes: u32,
    /// Points that lie in it.
    pub hits: u32,
    /// Times that a robot drove over it.
    pub drives: u32,
}

/// Opposite corners of a rectangle of cells, both in it.
pub type Bounds = [(i32, i32); 2];

/// Tiles where something happened, in a table of all that lie between them.
#[derive(Clone, Debug, Default)]
pub struct Tiles {
    /// The tile in the lower left corner of the table.
    corner: (i32, i32),
    width: i32,
    height: i32,
    slots: Vec<Option<Box<[Count]>>>,
}

impl Tiles {
    /// The count of a cell.
    pub fn at(&mut self, x: i32, y: i32) -> &mut Count {
        let tile = (x.div_euclid(EDGE), y.div_euclid(EDGE));
        let is_inside = |(tx, ty): (i32, i32)| {
            (0..self.width).contains(&(tx - self.corner.0))
                && (0..self.height).contains(&(ty - self.corner.1))
        };
        if !is_inside(tile) {
            self.grow(tile);
        }
        let slot = (tile.1 - self.corner.1) * self.width + tile.0 - self.corner.0;
        let counts = self.slots[slot as usize].get_or_insert_with(|| vec![Count::default(); CELLS].into());
        &mut counts[(y.rem_euclid(EDGE) * EDGE + x.rem_euclid(EDGE)) as usize]
    }

    fn grow(&mut self, (tx, ty): (i32, i32)) {
        let (low, high) = if self.slots.is_empty() {
            ((tx, ty), (tx, ty))
        } else {
            let end = (self.corner.0 + self.width - 1, self.corner.1 + self.height - 1);
            ((self.corner.0.min(tx), self.corner.1.min(ty)), (end.0.max(tx), end.1.max(ty)))
        };
        let mut grown =
            Self { corner: low, width: high.0 - low.0 + 1, height: high.1 - low.1 + 1, slots: Vec::new() };
        grown.slots.resize(grown.width as usize * grown.height as usize, None);
        for (k, tile) in std::mem::take(&mut self.slots).into_iter().enumerate() {
            let (x, y) = (k as i32 % self.width + self.corner.0, k as i32 / self.width + self.corner.1);
            grown.slots[((y - low.1) * grown.width + x - low.0) as usize] = tile;
        }
        *self = grown;
    }

    /// All cells in which something happened, row by row within a tile.
    pub fn known(&self) -> impl Iterator<Item = (i32, i32, Count)> + '_ {
        let tiles = self.slots.iter().enumerate().filter_map(|(k, tile)| Some((k as i32, tile.as_ref()?)));
        let cells = tiles.flat_map(|(k, tile)| {
            let x0 = (k % self.width + self.corner.0) * EDGE;
            let y0 = (k / self.width + self.corner.1) * EDGE;
            let cell =
                move |(n, count): (usize, &Count)| (x0 + n as i32 % EDGE, y0 + n as i32 / EDGE, *count);
            tile.iter().enumerate().map(cell)
        });
        cells.filter(|(_, _, count)| *count != Count::default())
    }

    /// Where all of them lie; none if there are none.
    pub fn bounds(&self) -> Option<Bounds> {
        self.known().fold(None, |bounds: Option<Bounds>, (x, y, _)| {
            let [low, high] = bounds.unwrap_or([(x, y); 2]);
            Some([(low.0.min(x), low.1.min(y)), (high.0.max(x), high.1.max(y))])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    proptest! {
        #[test]
        fn counts_stay_where_they_are(cells in prop::collection::vec((-300_i32..300, -300_i32..300), 0..60)) {
            let (mut tiles, mut oracle) = (Tiles::default(), BTreeMap::new());
            for (x, y) in cells {
                tiles.at(x, y).hits += 1;
                *oracle.entry((x, y)).or_insert(0) += 1;
            }
            let known: BTreeMap<(i32, i32), u32> = tiles.known().map(|(x, y, c)| ((x, y), c.hits)).collect();
            let (xs, ys) = (oracle.keys().map(|c| c.0), oracle.keys().map(|c| c.1));
            let corners = xs.clone().min().zip(ys.clone().min()).zip(xs.max().zip(ys.max()));
            prop_assert_eq!(tiles.bounds(), corners.map(|(low, high)| [low, high]));
            prop_assert_eq!(known, oracle);
        }
    }
}
