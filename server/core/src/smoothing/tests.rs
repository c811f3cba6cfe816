//! The smoother against definitions, dense solutions and itself.

mod batch;
mod bounds;
mod deep;
mod dense;
mod evidence;
mod exact;
mod loosened;
mod particles;
mod parts;
mod rebased;
mod robust;
mod saved;
mod script;
