//! The smoother against definitions, dense solutions and itself.

mod deep;
mod dense;
mod exact;
mod particles;
mod robust;
mod saved;
mod script;
