//! End-to-end tests: a server in this process, clients over loopback, one binary for all.

#![allow(clippy::unwrap_used, reason = "a test says by a panic that it has failed")]

mod lifetime;
mod pages;
mod questions;
mod roles;
mod ros;
mod site;
mod streams;
mod words;
