//! A growing sequence whose copies share what neither has changed since.

use serde::{Deserialize, Serialize};
use std::ops::Index;
use std::sync::Arc;

/// Elements copied when one of a shared chunk changes.
const CHUNK: usize = 32;

/// Like a `Vec`, in chunks of which each is copied when first written after a copy of the whole.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Chunked<T> {
    chunks: Vec<Arc<Vec<T>>>,
    len: usize,
}

impl<T> Default for Chunked<T> {
    fn default() -> Self {
        Self { chunks: Vec::new(), len: 0 }
    }
}

impl<T: Clone> Chunked<T> {
    pub fn len(&self) -> usize {
        self.len
    }

    pub fn get(&self, i: usize) -> Option<&T> {
        self.chunks.get(i / CHUNK)?.get(i % CHUNK)
    }

    /// Indexes like a slice.
    pub fn make_mut(&mut self, i: usize) -> &mut T {
        &mut Arc::make_mut(&mut self.chunks[i / CHUNK])[i % CHUNK]
    }

    pub fn push(&mut self, value: T) {
        if self.len.is_multiple_of(CHUNK) {
            self.chunks.push(Arc::new(Vec::with_capacity(CHUNK)));
        }
        if let Some(last) = self.chunks.last_mut() {
            Arc::make_mut(last).push(value);
        }
        self.len += 1;
    }

    /// Appends default values up to a length.
    pub fn resize(&mut self, len: usize)
    where
        T: Default,
    {
        while self.len < len {
            self.push(T::default());
        }
    }

    pub fn iter(&self) -> impl Iterator<Item = &T> {
        self.chunks.iter().flat_map(|chunk| chunk.iter())
    }
}

impl<T> Index<usize> for Chunked<T> {
    type Output = T;

    fn index(&self, i: usize) -> &T {
        &self.chunks[i / CHUNK][i % CHUNK]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_share_what_neither_changed() {
        let mut a = Chunked::default();
        for k in 0..3 * CHUNK + 5 {
            a.push(k);
        }
        let mut b = a.clone();
        *b.make_mut(CHUNK + 1) = 7;
        b.push(8);
        assert_eq!((a.len(), b.len()), (3 * CHUNK + 5, 3 * CHUNK + 6));
        assert_eq!((a[CHUNK + 1], b[CHUNK + 1], b.get(b.len())), (CHUNK + 1, 7, None));
        let shared: Vec<bool> = a.chunks.iter().zip(&b.chunks).map(|(a, b)| Arc::ptr_eq(a, b)).collect();
        assert_eq!(shared, [true, false, true, false]);
        assert!(a.iter().copied().eq(0..3 * CHUNK + 5));
    }
}
