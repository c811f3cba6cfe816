//! Who may do what: users and their roles (`policy.toml`), as rules that Zenoh enforces, tried before anybody connects.
//!
//! ```text
//! policy.toml ─ Policy ─ rules ─► Zenoh: access_control, users and passwords
//!                          └─ trial: a router of its own with these rules; each role tries each operation
//! ```
//!
//! Zenoh checks each message against key expressions: it passes if one that the sender's subject was granted *includes*
//! the message's. Keys with a chunk `@…` are included by no `**`, so those of advanced publishers are granted beside.

mod certs;
mod policy;
mod rules;
pub mod trial;
mod users;

pub use certs::{CertArgs, make_certificate};
pub use policy::{Policy, PolicyError, Role, User, write_secret};
pub use rules::rules;
pub use users::{UserArgs, edit_users};
