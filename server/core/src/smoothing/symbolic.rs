//! Which blocks of the Cholesky factor are non-zero: ordering, elimination tree, column structure.

use super::{Factor, SmoothError};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;
use serde::{Deserialize, Serialize};

/// Position of the anchored pose, which is no variable.
pub(super) const ANCHORED: u32 = u32::MAX;
const NONE: u32 = u32::MAX;

/// Structure of the block lower triangle L of the variables in elimination order.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Symbolic {
    /// Elimination position of each pose; [`ANCHORED`] for pose 0. The newest pose comes last.
    pub position: Vec<u32>,
    /// Column k's blocks below the diagonal are `start[k]..start[k + 1]`.
    pub start: Vec<u32>,
    /// Row (elimination position) of each such block, ascending within a column.
    pub row: Vec<u32>,
}

impl Symbolic {
    /// Analyses a graph of `poses` ≥ 2 poses.
    pub fn new(poses: usize, factors: &[&Factor]) -> Result<Self, SmoothError> {
        let variables = poses - 1;
        let position = positions(variables, &neighbours(variables, factors))?;
        let below = below_diagonal(variables, &position, factors);
        let (start, row) = column_structure(&below);
        Ok(Self { position, start, row })
    }

    /// Number of variables (columns).
    pub fn columns(&self) -> usize {
        self.start.len() - 1
    }

    /// Storage range of column k's blocks below the diagonal.
    pub fn column(&self, k: usize) -> std::ops::Range<usize> {
        self.start[k] as usize..self.start[k + 1] as usize
    }

    /// Where the block (row, column) of L is stored, `row > column`; it must exist.
    pub fn slot(&self, row: u32, column: u32) -> usize {
        let range = self.column(column as usize);
        range.start + self.row[range].partition_point(|&r| r < row)
    }
}

/// Sorted neighbours of each variable (pose k + 1 is variable k) in the graph, without the
/// anchored pose.
fn neighbours(variables: usize, factors: &[&Factor]) -> Vec<Vec<u32>> {
    let mut adjacent = vec![Vec::new(); variables];
    for f in factors {
        if f.i > 0 && f.j > 0 {
            adjacent[f.i as usize - 1].push(f.j - 1);
            adjacent[f.j as usize - 1].push(f.i - 1);
        }
    }
    for list in &mut adjacent {
        list.sort_unstable();
        list.dedup();
    }
    adjacent
}

/// Elimination positions by pose: approximate minimum degree, with the newest pose kept last so
/// that its own marginal is the last diagonal block.
fn positions(variables: usize, adjacent: &[Vec<u32>]) -> Result<Vec<u32>, SmoothError> {
    let free = variables - 1;
    let mut start = vec![0_u32];
    let mut rows = Vec::new();
    for list in &adjacent[..free] {
        rows.extend(list.iter().filter(|&&v| (v as usize) < free));
        start.push(rows.len() as u32);
    }
    let (mut order, mut inverse) = (vec![0_u32; free], vec![0_u32; free]);
    let pattern = SymbolicSparseColMatRef::new_checked(free, free, &start, None, &rows);
    let mut memory = MemBuffer::new(amd::order_scratch::<u32>(free, rows.len()));
    amd::order(&mut order, &mut inverse, pattern, amd::Control::default(), MemStack::new(&mut memory))
        .map_err(|_| SmoothError::TooLarge)?;
    let mut position = vec![ANCHORED; variables + 1];
    for (k, &variable) in order.iter().enumerate() {
        position[variable as usize + 1] = k as u32;
    }
    position[variables] = free as u32;
    Ok(position)
}

/// For each column, the rows of the matrix itself below the diagonal (unsorted, with repeats).
fn below_diagonal(variables: usize, position: &[u32], factors: &[&Factor]) -> Vec<Vec<u32>> {
    let mut below = vec![Vec::new(); variables];
    for f in factors {
        let (a, b) = (position[f.i as usize], position[f.j as usize]);
        if a != ANCHORED && b != ANCHORED {
            below[a.min(b) as usize].push(a.max(b));
        }
    }
    below
}

/// Column k of L has the rows of the matrix and those of its children in the elimination tree;
/// the parent of a column is its first row.
fn column_structure(below: &[Vec<u32>]) -> (Vec<u32>, Vec<u32>) {
    let n = below.len();
    let (mut start, mut row) = (vec![0_u32], Vec::new());
    let mut first_child = vec![NONE; n];
    let mut next_sibling = vec![NONE; n];
    let mut seen = vec![NONE; n];
    for k in 0..n {
        let begin = row.len();
        let mut add = |row: &mut Vec<u32>, r: u32| {
            if r as usize != k && seen[r as usize] != k as u32 {
                seen[r as usize] = k as u32;
                row.push(r);
            }
        };
        below[k].iter().for_each(|&r| add(&mut row, r));
        let mut child = first_child[k];
        while child != NONE {
            for s in start[child as usize]..start[child as usize + 1] {
                let r = row[s as usize];
                add(&mut row, r);
            }
            child = next_sibling[child as usize];
        }
        row[begin..].sort_unstable();
        if let Some(&parent) = row.get(begin) {
            next_sibling[k] = first_child[parent as usize];
            first_child[parent as usize] = k as u32;
        }
        start.push(row.len() as u32);
    }
    (start, row)
}
