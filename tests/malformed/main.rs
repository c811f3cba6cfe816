//! What nobody should send, and what comes of it. A table of spoiled inputs ([`table`]) says of each which error it
//! must be and which field that names; targets ([`fuzz`]) mutate good ones at random and hold what each parser
//! promises: it never panics, what it takes is valid, and what it takes is read again as it is written.
//!
//! ```sh
//! TOPONYM_FUZZ=100000 TOPONYM_SEED=7 cargo test --release -p toponym-tests --test malformed fuzz -- --nocapture
//! ```

#![allow(clippy::unwrap_used, reason = "a test says by a panic that it has failed")]

mod feed;
mod files;
mod fuzz;
mod fuzz_files;
mod fuzz_journal;
mod journals;
mod keys;
mod logs;
mod medium;
mod mutate;
mod seeds;
mod settings;
mod table;
mod wire_bincode;
mod wire_bytes;
mod wire_json;
