//! The history of a run: a line of JSON per place, written as the places come.

use anyhow::{Context, Result};
use serde::Serialize;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use toponym_core::Effect;
use toponym_core::edge::{EdgeKind, PlaceId, Proposal};
use toponym_proto::stream::Stamp;

/// Writes the history file.
#[derive(Debug)]
pub struct History {
    path: PathBuf,
    out: BufWriter<File>,
    edges: Vec<Edge>,
    /// The first failure to write; told at the end.
    failed: Option<std::io::Error>,
}

/// What became of the step of one place.
#[derive(Serialize)]
struct Line<'a> {
    place: PlaceId,
    stamp_s: f64,
    proposed: &'a [Proposal],
    edges: Vec<Edge>,
    effective_sample_size: f64,
    weights: &'a [f64],
    unresolved: f64,
}

/// An edge that was measured.
#[derive(Debug, Serialize)]
struct Edge {
    i: PlaceId,
    j: PlaceId,
    kind: EdgeKind,
    /// Share of the posterior that took it.
    taken: f64,
    reason: String,
}

impl History {
    /// Begins the file anew.
    pub fn create(path: &Path) -> Result<Self> {
        let file = File::create(path).with_context(|| format!("--history {}", path.display()))?;
        let out = BufWriter::new(file);
        Ok(Self { path: path.to_owned(), out, edges: Vec::new(), failed: None })
    }

    /// Takes the next effect; a place's line is written when its step is over.
    pub fn note(&mut self, effect: &Effect) {
        match effect {
            Effect::EdgeAccepted { i, j, kind, weight, reason } => {
                let (i, j, kind, taken, reason) = (*i, *j, *kind, *weight, reason.clone());
                self.edges.push(Edge { i, j, kind, taken, reason });
            }
            Effect::EdgeRefused { i, j, kind, reason } => {
                let (i, j, kind, taken, reason) = (*i, *j, *kind, 0.0, reason.clone());
                self.edges.push(Edge { i, j, kind, taken, reason });
            }
            Effect::Weighed { place, stamp_ns, proposed, weights, unresolved, effective_sample_size } => {
                let line = Line {
                    place: *place,
                    stamp_s: Stamp { ns: *stamp_ns }.seconds(),
                    proposed,
                    edges: std::mem::take(&mut self.edges),
                    effective_sample_size: *effective_sample_size,
                    weights,
                    unresolved: *unresolved,
                };
                let written = serde_json::to_writer(&mut self.out, &line).map_err(std::io::Error::from);
                let written = written.and_then(|()| self.out.write_all(b"\n"));
                self.failed = self.failed.take().or(written.err());
            }
            _ => {}
        }
    }

    /// Ends the file.
    pub fn finish(mut self) -> Result<()> {
        let flushed = self.out.flush();
        self.failed.map_or(flushed, Err).with_context(|| format!("--history {}", self.path.display()))
    }
}
