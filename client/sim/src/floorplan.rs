//! Reads the floor plans of the KTH campus data set's XML format: spaces with their contours as
//! line segments (walls, windows, portals), and the scale of the drawing.

use crate::geom::{Point, Segment, distance_m};
use roxmltree::{Document, Node};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// A plan larger than this has a wrong scale.
const EXTENT_MAX_M: f64 = 400.0;

/// Why a plan can't be used.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// The file can't be read.
    #[error("{file}: {source}")]
    Io {
        /// The file.
        file: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// It is no floor plan, or one that makes no sense.
    #[error("{file}:{line}:{column}: {why}")]
    Content {
        /// The file.
        file: PathBuf,
        /// From 1.
        line: u32,
        /// From 1.
        column: u32,
        /// What is wrong.
        why: String,
    },
}

/// What a piece of a contour is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Edge {
    /// A wall.
    Wall,
    /// A wall of glass, or with some in it.
    Window,
    /// An opening to the space of that name.
    Portal(String),
}

/// A room, a corridor, a shaft.
#[derive(Clone, Debug, PartialEq)]
pub struct Space {
    /// Unlike any other's.
    pub name: String,
    /// What it is for, as the drawing says: may be empty.
    pub category: String,
    /// Its contour in order, metres.
    pub contour: Vec<(Segment, Edge)>,
}

/// A floor plan.
#[derive(Clone, Debug, PartialEq)]
pub struct FloorPlan {
    /// Spaces that have a contour, at least one.
    pub spaces: Vec<Space>,
}

/// What is wrong, and where in the text.
type Wrong = (usize, String);

impl FloorPlan {
    /// Reads a file.
    ///
    /// # Errors
    /// If it can't be read or is not a plan; the error says where.
    pub fn read(file: &Path) -> Result<Self, PlanError> {
        let text =
            std::fs::read_to_string(file).map_err(|source| PlanError::Io { file: file.into(), source })?;
        Self::parse(&text, file)
    }

    /// Parses the text of `file`.
    ///
    /// # Errors
    /// If it is not a plan; the error says where.
    pub fn parse(text: &str, file: &Path) -> Result<Self, PlanError> {
        let content = |line, column, why| PlanError::Content { file: file.into(), line, column, why };
        let document = Document::parse(text).map_err(|e| {
            // The place stands before the reason already.
            let (at, why) = (e.pos(), e.to_string());
            content(at.row, at.col, why.trim_end_matches(&format!(" at {at}")).to_owned())
        })?;
        plan(document.root_element()).map_err(|(at, why)| {
            let at = document.text_pos_at(at);
            content(at.row, at.col, why)
        })
    }
}

fn plan(root: Node<'_, '_>) -> Result<FloorPlan, Wrong> {
    let wrong = |why: &str| (root.range().start, why.to_owned());
    if !root.has_tag_name("floor") {
        return Err(wrong(&format!(
            "not a floor plan: begins with <{}>, not <floor>",
            root.tag_name().name()
        )));
    }
    let scale = root.children().find(|n| n.has_tag_name("Scale"));
    let scale = scale.ok_or_else(|| wrong("has no <Scale>: how long is a unit of the drawing?"))?;
    let length = |name| match number(scale, name)? {
        length if length > 0.0 => Ok(length),
        length => Err((scale.range().start, format!("{name} is {length}, must be above 0"))),
    };
    let unit_m = length("RealDistance")? / length("PixelDistance")?;
    let (mut spaces, mut names) = (Vec::new(), BTreeSet::new());
    for node in root.children().filter(|n| n.has_tag_name("space")) {
        let space = space(node, unit_m)?;
        if !names.insert(space.name.clone()) {
            let why = format!("space {:?} comes twice: where do portals to it lead?", space.name);
            return Err((node.range().start, why));
        }
        if !space.contour.is_empty() {
            spaces.push(space);
        }
    }
    if spaces.is_empty() {
        return Err(wrong("no <space> in it has a contour: there is nothing to drive on"));
    }
    let ends = || spaces.iter().flat_map(|s| &s.contour).flat_map(|(line, _)| [line.a, line.b]);
    for k in 0..2 {
        let (low, high) =
            ends().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[k]), h.max(p[k])));
        if high - low > EXTENT_MAX_M {
            let why = format!("the plan is {:.0} m wide, at most {EXTENT_MAX_M} m are taken", high - low);
            return Err((scale.range().start, format!("{why}: is the scale right?")));
        }
    }
    Ok(FloorPlan { spaces })
}

fn space(node: Node<'_, '_>, unit_m: f64) -> Result<Space, Wrong> {
    let name = attribute(node, "name")?.to_owned();
    let category = node.attribute("type").unwrap_or_default().trim().to_owned();
    let mut contour = Vec::new();
    for contour_node in node.children().filter(|n| n.has_tag_name("contour")) {
        for line in contour_node.children().filter(|n| n.has_tag_name("linesegment")) {
            contour.push((segment(line, unit_m)?, edge(line)?));
        }
    }
    if (1..3).contains(&contour.len()) {
        let why = format!("the contour of space {name:?} has {} segments, needs 3", contour.len());
        return Err((node.range().start, why));
    }
    Ok(Space { name, category, contour })
}

fn segment(line: Node<'_, '_>, unit_m: f64) -> Result<Segment, Wrong> {
    let end = |x, y| -> Result<Point, Wrong> { Ok([number(line, x)? * unit_m, number(line, y)? * unit_m]) };
    Ok(Segment { a: end("x1", "y1")?, b: end("x2", "y2")? })
}

fn edge(line: Node<'_, '_>) -> Result<Edge, Wrong> {
    match attribute(line, "type")? {
        "Wall" => Ok(Edge::Wall),
        "Window" => Ok(Edge::Window),
        "Portal" => Ok(Edge::Portal(line.attribute("target").unwrap_or_default().to_owned())),
        other => Err((line.range().start, format!("type is {other:?}, must be Wall, Window or Portal"))),
    }
}

fn attribute<'a>(node: Node<'a, '_>, name: &str) -> Result<&'a str, Wrong> {
    let missing = || (node.range().start, format!("<{}> has no {name}", node.tag_name().name()));
    node.attribute(name).ok_or_else(missing)
}

fn number(node: Node<'_, '_>, name: &str) -> Result<f64, Wrong> {
    let text = attribute(node, name)?;
    let value = text.trim().parse().ok().filter(|v: &f64| v.is_finite());
    value.ok_or_else(|| (node.range().start, format!("{name} is {text:?}, must be a number")))
}

impl Space {
    /// The contour closed: wherever a piece does not begin where the last one ended, with a wall
    /// in between.
    pub fn closed(&self) -> Vec<(Segment, Edge)> {
        let next = self.contour.iter().cycle().skip(1);
        let mut closed = Vec::with_capacity(self.contour.len());
        for ((line, edge), (after, _)) in self.contour.iter().zip(next) {
            closed.push((*line, edge.clone()));
            if distance_m(line.b, after.a) > 1e-6 {
                closed.push((Segment { a: line.b, b: after.a }, Edge::Wall));
            }
        }
        closed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storey::tests::TWO_ROOMS;

    fn parsed(text: &str) -> Result<FloorPlan, String> {
        FloorPlan::parse(text, Path::new("p.xml")).map_err(|e| e.to_string())
    }

    #[test]
    fn a_plan_is_read_in_metres() {
        let plan = parsed(TWO_ROOMS).unwrap();
        let names: Vec<_> = plan.spaces.iter().map(|s| (s.name.as_str(), s.category.as_str())).collect();
        assert_eq!(names, [("a", "KONTOR"), ("b", "KORRIDOR")]);
        let (line, edge) = &plan.spaces[0].contour[1];
        assert_eq!((line.a, line.b), ([4.0, 0.0], [4.0, 1.0]));
        assert_eq!(*edge, Edge::Wall);
        assert_eq!(plan.spaces[0].contour[2].1, Edge::Portal("b".into()));
    }

    #[test]
    fn a_broken_plan_is_refused_with_the_place_and_the_reason() {
        for (from, to, place, why) in [
            ("</floor>", "</flor>", "p.xml:22:1: ", "expected 'floor' tag"),
            ("</floor>", "", "p.xml:1:1: ", "root node"),
            (r#"RealDistance="4""#, r#"RealDistance="0""#, "p.xml:2:", "RealDistance is 0, must be above 0"),
            (r#"RealDistance="4""#, "", "p.xml:2:", "<Scale> has no RealDistance"),
            (r#"RealDistance="4""#, r#"RealDistance="4e9""#, "p.xml:2:", "is the scale right?"),
            ("<Scale", "<Scala", "p.xml:1:1: ", "has no <Scale>"),
            (r#"x1="400""#, r#"x1="wide""#, "p.xml:6:", r#"x1 is "wide", must be a number"#),
            (r#"x1="400""#, r#"x1="inf""#, "p.xml:6:", r#"x1 is "inf", must be a number"#),
            (r#"type="Wall""#, r#"type="Hedge""#, "p.xml:5:", r#"type is "Hedge", must be"#),
            (r#"<space name="a""#, "<space", "p.xml:3:", "<space> has no name"),
            (r#"<space name="b""#, r#"<space name="a""#, "p.xml:12:", r#"space "a" comes twice"#),
        ] {
            let text = TWO_ROOMS.replacen(from, to, 1);
            assert_ne!(text, TWO_ROOMS);
            let error = parsed(&text).unwrap_err();
            assert!(error.starts_with(place) && error.contains(why), "{error}, not {place} … {why}");
        }
        let error = parsed("<html></html>").unwrap_err();
        assert!(error.contains("begins with <html>, not <floor>"), "{error}");
        let nothing = r#"<floor><Scale PixelDistance="1" RealDistance="1"/><space name="a"/></floor>"#;
        assert!(parsed(nothing).unwrap_err().contains("nothing to drive on"));
    }

    #[test]
    fn a_missing_file_is_named() {
        let error = FloorPlan::read(Path::new("no/such.xml")).unwrap_err().to_string();
        assert!(error.starts_with("no/such.xml: "), "{error}");
    }

    #[test]
    fn an_open_contour_is_closed_with_walls() {
        let mut space = parsed(TWO_ROOMS).unwrap().spaces.remove(0);
        let whole = space.closed().len();
        assert_eq!(whole, space.contour.len());
        space.contour.remove(0);
        assert_eq!(space.closed().len(), whole);
        assert_eq!(space.closed()[whole - 1].1, Edge::Wall);
    }
}
