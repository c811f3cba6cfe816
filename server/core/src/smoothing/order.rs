//! In which order the poses of the tree's top are eliminated: minimum degree on a quotient graph.
//!
//! Amestoy, Davis, Duff (1996): an eliminated pose leaves an element, the set of poses it connects;
//! a pose's degree is bounded from the elements it is in. Among equal degrees the one that reached
//! its degree first goes first, so that a chain is eliminated every other pose at a time and the
//! tree stays shallow. Poses and elements are numbered locally from 0.

use std::mem;

/// No pose.
const NONE: u32 = u32::MAX;

/// What eliminating one pose leaves.
#[derive(Clone, Debug, Default)]
pub(super) struct Column {
    /// The pose eliminated.
    pub pose: u32,
    /// Elements that it took up: those given first, then columns by their place in the order.
    pub elements: Vec<u32>,
}

/// The graph to order, its work space, and the order found.
#[derive(Clone, Debug, Default)]
pub(super) struct Order {
    /// Poses joined by a factor to each pose.
    neighbours: Vec<Vec<u32>>,
    /// Elements that each pose is in.
    within: Vec<Vec<u32>>,
    /// Poses of each element: first the given ones, then one per column.
    pub elements: Vec<Vec<u32>>,
    /// In elimination order.
    pub columns: Vec<Column>,
    /// Elements given, before those of the columns.
    pub given: usize,
    poses: usize,
    degree: Vec<u32>,
    buckets: Buckets,
    held_back: Vec<bool>,
    mark: Vec<u32>,
    stamp: u32,
    /// Poses of an element outside the pivot's, and the pivot for which that was counted.
    outside: Vec<(u32, u32)>,
}

impl Order {
    /// Starts a graph of so many poses.
    pub fn clear(&mut self, poses: usize) {
        for list in self.neighbours.iter_mut().chain(&mut self.within).chain(&mut self.elements) {
            list.clear();
        }
        self.neighbours.resize_with(poses.max(self.neighbours.len()), Vec::new);
        self.within.resize_with(poses.max(self.within.len()), Vec::new);
        self.mark.clear();
        self.mark.resize(poses, 0);
        (self.poses, self.given, self.stamp) = (poses, 0, 0);
        self.columns.clear();
    }

    /// Joins two poses.
    pub fn join(&mut self, a: u32, b: u32) {
        if !self.neighbours[a as usize].contains(&b) {
            self.neighbours[a as usize].push(b);
            self.neighbours[b as usize].push(a);
        }
    }

    /// Joins all of some poses, and returns the number of that element.
    pub fn element(&mut self, poses: impl Iterator<Item = u32>) -> u32 {
        let e = self.given;
        if self.elements.len() == e {
            self.elements.push(Vec::new());
        }
        self.elements[e].extend(poses);
        for &p in &self.elements[e] {
            self.within[p as usize].push(e as u32);
        }
        self.given += 1;
        e as u32
    }

    /// Orders all poses: those in `late` after all others, and `last` (the newest) after them.
    pub fn run(&mut self, late: &[u32], last: u32) {
        self.held_back.clear();
        self.held_back.resize(self.poses, false);
        for &p in late.iter().chain([&last]) {
            self.held_back[p as usize] = true;
        }
        self.start();
        let mut remaining = self.poses;
        while remaining > 0 {
            let pivot = self.buckets.pop().unwrap_or_else(|| {
                self.release(late, last);
                self.buckets.pop().unwrap_or(last)
            });
            let met = self.eliminate(pivot);
            remaining -= 1;
            if met == remaining {
                self.finish_dense(last);
                return;
            }
            self.update_degrees(remaining);
        }
    }

    fn start(&mut self) {
        let (n, given) = (self.poses, self.given);
        self.elements.resize_with((given + n).max(self.elements.len()), Vec::new);
        for list in &mut self.elements[given..] {
            list.clear();
        }
        self.outside.clear();
        self.outside.resize(given + n, (0, NONE));
        self.degree.clear();
        self.degree.resize(n, 0);
        self.buckets.clear(n);
        for p in 0..n as u32 {
            self.stamp += 1;
            self.mark[p as usize] = self.stamp;
            let mut degree = 0;
            let elements = self.within[p as usize].iter().flat_map(|&e| &self.elements[e as usize]);
            for &q in elements.chain(&self.neighbours[p as usize]) {
                degree += u32::from(mem::replace(&mut self.mark[q as usize], self.stamp) != self.stamp);
            }
            self.degree[p as usize] = degree;
            if !self.held_back[p as usize] {
                self.buckets.push(p, degree);
            }
        }
    }

    /// Lets those held back that are not eliminated yet take their turns, but for the last.
    fn release(&mut self, late: &[u32], last: u32) {
        for &p in late.iter().filter(|&&p| p != last) {
            if std::mem::replace(&mut self.held_back[p as usize], false) {
                self.buckets.push(p, self.degree[p as usize]);
            }
        }
    }

    /// Makes the element of a pivot; returns its number of poses. These are marked.
    fn eliminate(&mut self, pivot: u32) -> usize {
        let p = pivot as usize;
        let e = self.given + self.columns.len();
        let mut poses = mem::take(&mut self.elements[e]);
        let absorbed = mem::take(&mut self.within[p]);
        self.stamp += 1;
        self.mark[p] = self.stamp;
        let neighbours = mem::take(&mut self.neighbours[p]);
        let met = absorbed.iter().flat_map(|&a| &self.elements[a as usize]).chain(&neighbours);
        for &q in met {
            if mem::replace(&mut self.mark[q as usize], self.stamp) != self.stamp {
                poses.push(q);
            }
        }
        self.neighbours[p] = neighbours;
        // Taken up: no longer alive.
        for &a in &absorbed {
            self.outside[a as usize].1 = NONE - 1;
        }
        self.elements[e] = poses;
        self.columns.push(Column { pose: pivot, elements: absorbed });
        self.elements[e].len()
    }

    /// Bounds the degrees of the poses of the last column's element.
    fn update_degrees(&mut self, remaining: usize) {
        let column = self.columns.len() - 1;
        let e = self.given + column;
        let (mut poses, pivot) = (mem::take(&mut self.elements[e]), column as u32);
        for &i in &poses {
            let (outside, elements) = (&mut self.outside, &self.elements);
            self.within[i as usize].retain(|&f| {
                let (count, counted_for) = &mut outside[f as usize];
                if *counted_for == NONE - 1 {
                    return false;
                }
                if *counted_for != pivot {
                    (*count, *counted_for) = (elements[f as usize].len() as u32, pivot);
                }
                *count -= 1;
                true
            });
            let (mark, stamp) = (&self.mark, self.stamp);
            self.neighbours[i as usize].retain(|&q| mark[q as usize] != stamp);
        }
        let inside = (poses.len() as u32).saturating_sub(1);
        for &i in &poses {
            let (within, neighbours) = (&mut self.within[i as usize], &self.neighbours[i as usize]);
            let others: u32 = within.iter().map(|&f| self.outside[f as usize].0).sum();
            within.push(e as u32);
            let bound = self.degree[i as usize] + inside;
            let degree = (inside + others + neighbours.len() as u32).min(bound).min(remaining as u32 - 1);
            self.degree[i as usize] = degree;
            if !self.held_back[i as usize] {
                self.buckets.remove(i);
                self.buckets.push(i, degree);
            }
        }
        mem::swap(&mut self.elements[e], &mut poses);
    }

    /// All remaining poses are joined: the older first, since the newer are touched again sooner.
    fn finish_dense(&mut self, last: u32) {
        let mut rest = self.elements[self.given + self.columns.len() - 1].clone();
        rest.sort_unstable_by_key(|&p| (p == last, self.held_back[p as usize], p));
        for (k, &pose) in rest.iter().enumerate() {
            let alive = |&&f: &&u32| self.outside[f as usize].1 != NONE - 1;
            let mut elements: Vec<u32> = self.within[pose as usize].iter().filter(alive).copied().collect();
            let e = self.given + self.columns.len();
            elements.push(e as u32 - 1);
            for &a in &elements {
                self.outside[a as usize].1 = NONE - 1;
            }
            self.elements[e].extend_from_slice(&rest[k + 1..]);
            self.columns.push(Column { pose, elements });
        }
    }
}

/// Poses by degree: queues, first come first served.
#[derive(Clone, Debug, Default)]
struct Buckets {
    head: Vec<u32>,
    tail: Vec<u32>,
    next: Vec<u32>,
    previous: Vec<u32>,
    of: Vec<u32>,
    lowest: usize,
}

impl Buckets {
    fn clear(&mut self, n: usize) {
        for list in [&mut self.head, &mut self.tail, &mut self.next, &mut self.previous, &mut self.of] {
            list.clear();
            list.resize(n, NONE);
        }
        self.lowest = 0;
    }

    fn push(&mut self, p: u32, degree: u32) {
        let d = degree as usize;
        let tail = mem::replace(&mut self.tail[d], p);
        (self.previous[p as usize], self.next[p as usize]) = (tail, NONE);
        match tail {
            NONE => self.head[d] = p,
            _ => self.next[tail as usize] = p,
        }
        self.of[p as usize] = degree;
        self.lowest = self.lowest.min(d);
    }

    fn remove(&mut self, p: u32) {
        let (d, previous, next) =
            (self.of[p as usize] as usize, self.previous[p as usize], self.next[p as usize]);
        match previous {
            NONE => self.head[d] = next,
            _ => self.next[previous as usize] = next,
        }
        match next {
            NONE => self.tail[d] = previous,
            _ => self.previous[next as usize] = previous,
        }
    }

    fn pop(&mut self) -> Option<u32> {
        while self.lowest < self.head.len() {
            let p = self.head[self.lowest];
            if p != NONE {
                self.remove(p);
                return Some(p);
            }
            self.lowest += 1;
        }
        None
    }
}
