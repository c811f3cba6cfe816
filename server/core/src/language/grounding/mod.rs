//! From readings to places: a probability for every place, eqs. (13–16).

pub(crate) mod clause;
pub(crate) mod doors;
pub(crate) mod envelope;
pub(crate) mod factor;
pub(crate) mod footprint;
pub(crate) mod ground;
pub(crate) mod paper;
pub(crate) mod path_factors;
pub(crate) mod path_features;
pub(crate) mod path_weights;
pub(crate) mod place;
pub(crate) mod scales;
pub(crate) mod scene;
pub(crate) mod ways;
