//! Parts of the free space: clearance is flooded from its peaks down, and parts that meet become one unless the saddle
//! between them is a narrowing.

use super::raster::Raster;
use std::collections::BTreeMap;

/// Two parts are one where the saddle has so much of the clearance of the narrower, …
const OF_NARROWER: f32 = 0.7;
/// … and so much of that of the wider: a corridor that opens into a hall ends there.
const OF_WIDER: f32 = 0.55;
/// Smaller parts, niches and doorways, belong to the neighbour with which they share the widest saddle.
const LEAST_M2: f64 = 1.5;

/// All parts.
pub struct Parts {
    /// The part of each free cell.
    pub of: Vec<Option<u32>>,
    /// The cells of each, in order.
    pub cells: Vec<Vec<usize>>,
    /// The highest clearance of each, metres.
    pub peak_m: Vec<f32>,
    /// Where two parts meet, each stretch once.
    pub saddles: Vec<Saddle>,
}

/// Where two parts meet.
pub struct Saddle {
    pub of: [u32; 2],
    /// The one with the widest clearance.
    pub cell: usize,
}

/// Parts that grow together.
struct Flood {
    /// Towards the part that took one up.
    parent: Vec<u32>,
    peak_m: Vec<f32>,
    cells: Vec<usize>,
}

impl Flood {
    fn root(&mut self, mut part: u32) -> u32 {
        while self.parent[part as usize] != part {
            let up = self.parent[self.parent[part as usize] as usize];
            self.parent[part as usize] = up;
            part = up;
        }
        part
    }

    fn begin(&mut self, peak_m: f32) -> u32 {
        let part = self.parent.len() as u32;
        self.parent.push(part);
        self.peak_m.push(peak_m);
        self.cells.push(0);
        part
    }

    fn are_one(&self, a: u32, b: u32, saddle_m: f32) -> bool {
        let [a, b] = [a, b].map(|part| self.peak_m[part as usize]);
        saddle_m >= OF_NARROWER * a.min(b) && saddle_m >= OF_WIDER * a.max(b)
    }

    /// The one with the higher peak takes the other up.
    fn join(&mut self, a: u32, b: u32) -> u32 {
        let higher = (self.peak_m[a as usize], b) >= (self.peak_m[b as usize], a);
        let (to, from) = if higher { (a, b) } else { (b, a) };
        self.parent[from as usize] = to;
        self.cells[to as usize] += self.cells[from as usize];
        to
    }
}

/// Parts of the free space by its clearance, metres.
pub fn basins(raster: &Raster, clearance: &[f32]) -> Parts {
    let mut order: Vec<usize> = (0..clearance.len()).filter(|&cell| raster.free[cell]).collect();
    order.sort_by(|&a, &b| clearance[b].total_cmp(&clearance[a]).then(a.cmp(&b)));
    let mut of: Vec<Option<u32>> = vec![None; clearance.len()];
    let mut flood = Flood { parent: Vec::new(), peak_m: Vec::new(), cells: Vec::new() };
    for cell in order {
        let around =
            raster.beside(cell, true).filter_map(|next| Some((clearance[next], flood.root(of[next]?))));
        let mut around: Vec<(f32, u32)> = around.collect();
        // It belongs to where the clearance rises most.
        around.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let own = match around.first() {
            None => flood.begin(clearance[cell]),
            Some(&(_, steepest)) => around[1..].iter().fold(steepest, |own, &(_, other)| {
                let (own, other) = (flood.root(own), flood.root(other));
                if own != other && flood.are_one(own, other, clearance[cell]) {
                    flood.join(own, other)
                } else {
                    own
                }
            }),
        };
        of[cell] = Some(own);
        flood.cells[own as usize] += 1;
    }
    take_up_small(raster, clearance, &mut flood, &of);
    numbered(raster, clearance, flood, of)
}

/// Gives parts that are too small to their neighbours, the smallest first.
fn take_up_small(raster: &Raster, clearance: &[f32], flood: &mut Flood, of: &[Option<u32>]) {
    let least = (LEAST_M2 / raster.resolution_m.powi(2)) as usize;
    let rooted: Vec<Option<u32>> = of.iter().map(|part| part.map(|part| flood.root(part))).collect();
    let mut saddles = saddles(raster, clearance, &rooted);
    saddles.sort_by(|a, b| clearance[b.cell].total_cmp(&clearance[a.cell]).then(a.cell.cmp(&b.cell)));
    let mut small: Vec<u32> = (0..flood.parent.len() as u32).filter(|&p| flood.root(p) == p).collect();
    small.sort_by_key(|&part| (flood.cells[part as usize], part));
    for part in small {
        let own = flood.root(part);
        if flood.cells[own as usize] >= least {
            continue;
        }
        let neighbour = saddles.iter().find_map(|s| {
            let [a, b] = s.of.map(|part| flood.root(part));
            (a != b && (a == own || b == own)).then_some(if a == own { b } else { a })
        });
        if let Some(neighbour) = neighbour {
            flood.join(own, neighbour);
        }
    }
}

/// Parts numbered in the order of their first cells.
fn numbered(raster: &Raster, clearance: &[f32], mut flood: Flood, mut of: Vec<Option<u32>>) -> Parts {
    let mut numbers: BTreeMap<u32, u32> = BTreeMap::new();
    let (mut peak_m, mut cells) = (Vec::new(), Vec::new());
    for (cell, part) in of.iter_mut().enumerate().filter_map(|(cell, part)| Some((cell, part.as_mut()?))) {
        let root = flood.root(*part);
        let next = numbers.len() as u32;
        *part = *numbers.entry(root).or_insert_with(|| {
            peak_m.push(flood.peak_m[root as usize]);
            cells.push(Vec::new());
            next
        });
        cells[*part as usize].push(cell);
    }
    let saddles = saddles(raster, clearance, &of);
    Parts { of, cells, peak_m, saddles }
}

/// Where parts meet: of each stretch of cells at which two do, the one with the widest clearance.
fn saddles(raster: &Raster, clearance: &[f32], of: &[Option<u32>]) -> Vec<Saddle> {
    // Cells of a part that lie at another, by both.
    let mut edges: BTreeMap<([u32; 2], usize), bool> = BTreeMap::new();
    for cell in 0..of.len() {
        let Some(own) = of[cell] else { continue };
        for other in raster.beside(cell, false).filter_map(|next| of[next]).filter(|&other| other > own) {
            edges.insert(([own, other], cell), false);
        }
    }
    let all: Vec<([u32; 2], usize)> = edges.keys().copied().collect();
    let mut saddles = Vec::new();
    for (pair, first) in all {
        if edges.insert((pair, first), true) != Some(false) {
            continue;
        }
        let (mut stretch, mut at) = (vec![first], 0);
        while at < stretch.len() {
            for next in raster.beside(stretch[at], true) {
                if let Some(seen @ false) = edges.get_mut(&(pair, next)) {
                    *seen = true;
                    stretch.push(next);
                }
            }
            at += 1;
        }
        let widest = |&&a: &&usize, &&b: &&usize| clearance[a].total_cmp(&clearance[b]).then(b.cmp(&a));
        let cell = stretch.iter().max_by(widest).copied().unwrap_or(first);
        saddles.push(Saddle { of: pair, cell });
    }
    saddles
}
