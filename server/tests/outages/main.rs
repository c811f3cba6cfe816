//! What robots and guides must not notice of their server and of the network: ends, cuts, restarts. Against the real
//! server, in a process of its own.

#![allow(clippy::unwrap_used)]

mod cut;
mod drive;
mod flood;
mod journals;
mod kill;
mod load;
mod said;
mod soak;
mod spool;
mod users;
