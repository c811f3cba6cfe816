//! Lengths as said.

use serde::{Deserialize, Serialize};

/// A length as said.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Distance {
    /// In its unit.
    pub value: f64,
    /// Its unit.
    pub unit: Unit,
}

/// What lengths are said in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    /// Metres.
    Metre,
    /// Feet.
    Foot,
    /// Yards.
    Yard,
    /// Steps of a walking person.
    Step,
}

impl Distance {
    /// In metres.
    pub fn metres(self) -> f64 {
        // International foot and yard; a step of an adult who walks is some 0.75 m.
        self.value
            * match self.unit {
                Unit::Metre => 1.0,
                Unit::Foot => 0.3048,
                Unit::Yard => 0.9144,
                Unit::Step => 0.75,
            }
    }
}
