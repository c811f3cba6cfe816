//! Reads sentences that nobody foresaw: words get classes, groups are found, everything that they may say is
//! proposed, and a learned judge tells how likely it is said, given the whole sentence.
//!
//! ```text
//! text ─ tokens ─▶ words with classes ─ groups ─▶ nouns, relations, pointers
//!      ─ propose ─▶ acts that these may be part of ─ features, judge ─▶ probability of each ─ decide ─▶ analyses
//! ```
//!
//! What is read well counts although other words are not: an unread word is a feature of all that is proposed.
//! The words are data (`server/core/lexicon`); the judge's weights are learned by the example `reader`.

mod chunks;
pub mod decide;
pub mod features;
pub(super) mod forms;
pub mod groups;
pub mod judge;
pub mod kind;
pub mod lexicon;
mod made;
mod of_groups;
pub mod of_kinds;
pub mod propose;
pub mod read;
pub(crate) mod sound;
#[cfg(test)]
mod tests;
pub mod tokens;
