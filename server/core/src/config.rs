//! Every setting with its default beside it. One configuration is meant to serve every building.

use serde::{Deserialize, Serialize};

/// Rules by which sentences are taken in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Rules {
    /// All that is understood, weighing particles, grounded again as the map grows.
    #[default]
    Toponym,
    /// The paper's own, for comparison: names and plain relations, grounded once by σ(−d / 30 m); no
    /// weights, no second thoughts.
    Paper,
}

impl Rules {
    /// Whether sentences are taken in as the paper does.
    pub fn by_paper(self) -> bool {
        self == Self::Paper
    }
}

/// Settings of a [`crate::Mapper`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Particles.
    pub particles: u32,
    /// Seed of every random draw.
    pub seed: u64,
    /// Whether sentences are listened to at all.
    pub language: bool,
    /// By whose rules sentences are taken in.
    pub rules: Rules,
    /// Whether names propose edges, eqs. (8–9).
    pub semantic_edges: bool,
    /// Whether older places are looked at at all: without, the map is the front end's.
    pub loops: bool,
    /// Path between successive places.
    pub place_spacing_m: f64,
    /// γ of eq. (6).
    pub gamma_per_m2: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            particles: 30,
            seed: 1,
            language: true,
            rules: Rules::Toponym,
            semantic_edges: true,
            loops: true,
            place_spacing_m: 1.0,
            gamma_per_m2: 0.2,
        }
    }
}
