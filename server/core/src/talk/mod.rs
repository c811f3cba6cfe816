//! What sentences do to the posterior: step 3 of Algorithm 1, and the words' share of step 4.

mod describe;
pub mod ledger;
pub mod listen;
mod mend;
pub mod predictive;
mod take_in;
