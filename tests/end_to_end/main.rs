//! End-to-end tests over the real path.
#[test]
fn placeholder() {}
