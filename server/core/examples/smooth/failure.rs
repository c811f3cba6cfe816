//! Why a run stopped, and what to do about it.

use std::io;
use toponym_core::smoothing::SmoothError;

/// Why a run stopped.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    #[error("cannot read {file}: {source}; give a g2o file, plain or gzip")]
    Read { file: String, source: io::Error },
    #[error(
        "{file}, line {line}: {what}; correct or remove the line, which reads \
         EDGE_SE2 i j x y yaw I11 I12 I13 I22 I23 I33"
    )]
    Edge { file: String, line: usize, what: String },
    #[error("{file} has no EDGE_SE2 line; give a planar pose graph in g2o format")]
    NoEdges { file: String },
    #[error("{file}, at the edge of line {line}: {source}; correct or remove that line")]
    Smooth { file: String, line: usize, source: SmoothError },
    #[error("cannot write {file}: {source}")]
    Write { file: String, source: io::Error },
    #[error("cannot write the report: {0}")]
    Report(serde_json::Error),
}
