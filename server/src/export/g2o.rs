//! The best graph as g2o's text: `VERTEX_SE2 id x y θ`, `EDGE_SE2 i j dx dy dθ` and the upper triangle of the information.

use std::fmt::Write as _;
use toponym_core::Snapshot;

/// Vertices by their places' ids, of places that are left behind, the first fixed; the chain, then loop edges.
pub fn text(snapshot: &Snapshot) -> String {
    let places = snapshot.places();
    let mut text = String::new();
    // Writing to a string cannot fail.
    for place in &places[..snapshot.left_behind()] {
        let p = place.pose;
        let _ = writeln!(text, "VERTEX_SE2 {} {:.9} {:.9} {:.9}", place.id, p.x_m, p.y_m, p.yaw_rad);
    }
    if let Some(first) = places.first() {
        let _ = writeln!(text, "FIX {}", first.id);
    }
    for c in snapshot.constraints() {
        let (i, j, d, w) = (places[c.i as usize].id, places[c.j as usize].id, c.i_from_j, c.information);
        let _ = write!(text, "EDGE_SE2 {i} {j} {:.9} {:.9} {:.9}", d.x_m, d.y_m, d.yaw_rad);
        for (row, column) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)] {
            let _ = write!(text, " {:.9e}", w[(row, column)]);
        }
        text.push('\n');
    }
    text
}
