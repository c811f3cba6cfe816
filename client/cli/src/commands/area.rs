//! `toponym area` and `import`: what somebody at a desk knows of parts of a map.

use super::mend::{At, mended};
use super::{Failure, exit};
use serde::Deserialize;
use std::path::PathBuf;
use toponym::{Connection, Planner};
use toponym_proto::Mend;
use toponym_proto::regions::{Area, Region, RegionsReply};

/// A room bears a name that is rather its own than not.
const CALLED_MIN: f64 = 0.5;
/// Corners that are nearer to each other are the same.
const SAME_M: f64 = 0.05;

/// Arguments of `area`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  toponym area --name lab --corners '0,0 4,0 4,3 0,3'        this polygon is the lab
  toponym area --forbidden --room lab                        robots keep out of the lab
  toponym area --name lab --instead --room office --room den both rooms are the lab, and nothing else
  toponym area --name 'lab two' --instead --corners '…'      one part of what was the lab is lab two

Places that a robot was in get names; the area moves with the map. `toponym rooms --json` lists areas with their ids, and
`toponym undo ID` takes one back.")]
pub struct AreaArgs {
    /// Corners in the map, metres.
    #[arg(long, value_name = "X,Y X,Y …", value_parser = corners, allow_hyphen_values = true, required_unless_present = "room")]
    corners: Option<Corners>,
    /// The outline of the room of this name; may be given again.
    #[arg(long, value_name = "NAME", conflicts_with = "corners")]
    room: Vec<String>,
    /// What it is called.
    #[arg(long, required_unless_present = "forbidden")]
    name: Option<String>,
    /// What was said to be there so far is not so.
    #[arg(long, requires = "name")]
    instead: bool,
    /// Robots keep out: no way that is told leads through it, and `export --masks` has it.
    #[arg(long)]
    forbidden: bool,
    #[command(flatten)]
    at: At,
}

/// Corners of a polygon, metres.
#[derive(Clone, Debug)]
struct Corners(Vec<[f64; 2]>);

fn corners(text: &str) -> Result<Corners, String> {
    let corner = |pair: &str| {
        let (x, y) = pair.split_once(',')?;
        Some([x.parse().ok()?, y.parse().ok()?])
    };
    let all: Option<Vec<[f64; 2]>> = text.split_whitespace().map(corner).collect();
    let all = all.filter(|all| all.len() >= 3);
    all.map(Corners).ok_or_else(|| "give three corners or more, such as '0,0 4,0 4,3 0,3'".to_owned())
}

pub async fn area(to: &Connection, site: &str, args: &AreaArgs) -> Result<u8, Failure> {
    let session = to.open().await?;
    let planner = Planner::new(&session, site, &args.at.map, args.at.timeout)?;
    let rooms = if args.room.is_empty() { Vec::new() } else { planner.regions().await?.regions };
    let mut polygons: Vec<_> = args.corners.iter().map(|corners| corners.0.clone()).collect();
    for name in &args.room {
        let Some(region) = called(&rooms, name) else {
            println!("no room is rather {name:?} than something else: `toponym rooms` lists their names");
            return Ok(exit::NOT_KNOWN);
        };
        polygons.push(region.line_m());
    }
    let mut code = exit::FOUND;
    for polygon_m in polygons {
        code = code
            .max(mended(&planner, &drawn(polygon_m, args.name.clone(), args.instead, args.forbidden)).await?);
    }
    Ok(code)
}

fn drawn(polygon_m: Vec<[f64; 2]>, name: Option<String>, instead: bool, forbidden: bool) -> Mend {
    Mend::Area { id: toponym::guide::sentence("").id, polygon_m, name, instead, forbidden }
}

/// The room that most likely bears a name.
fn called<'a>(regions: &'a [Region], name: &str) -> Option<&'a Region> {
    let p = |r: &Region| r.names.iter().find(|n| n.label.eq_ignore_ascii_case(name)).map_or(0.0, |n| n.p);
    regions.iter().max_by(|a, b| p(a).total_cmp(&p(b))).filter(|r| p(r) >= CALLED_MIN)
}

/// Arguments of `import`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  toponym import map.json

FILE is what `toponym-server export --json` wrote, of this map or of one with the same coordinates, or one like it by hand:
  {\"areas\": [{\"name\": \"lab\", \"forbidden\": true, \"polygon_m\": [[0, 0], [4, 0], [4, 3]]}]}
Each of its areas, and each room with the name that it rather bears than not, is told to the map as `toponym area` does. Exit code
1 if one of them was refused.")]
pub struct ImportArgs {
    /// Names and areas, JSON.
    file: PathBuf,
    #[command(flatten)]
    at: At,
}

/// What is read of it.
#[derive(Deserialize)]
struct Names {
    #[serde(default)]
    areas: Vec<Named>,
    #[serde(default)]
    regions: Vec<Region>,
}

#[derive(Deserialize)]
struct Named {
    #[serde(default)]
    name: Option<String>,
    #[serde(default)]
    forbidden: bool,
    polygon_m: Vec<[f64; 2]>,
}

pub async fn import(to: &Connection, site: &str, args: &ImportArgs) -> Result<u8, Failure> {
    let text = std::fs::read_to_string(&args.file);
    let text = text.map_err(|e| Failure::Unreadable(format!("{}: {e}", args.file.display())))?;
    let names = read(&text).map_err(|e| Failure::Unreadable(format!("{}: {e}", args.file.display())))?;
    let session = to.open().await?;
    let planner = Planner::new(&session, site, &args.at.map, args.at.timeout)?;
    // Names told before are no reason to tell them twice.
    let known = planner.regions().await?;
    let (mut told, mut code) = (0, exit::FOUND);
    for (polygon_m, name, forbidden) in names {
        if is_known(&known, &polygon_m, name.as_ref(), forbidden) {
            continue;
        }
        code = code.max(mended(&planner, &drawn(polygon_m, name, false, forbidden)).await?);
        told += 1;
    }
    println!("{told} areas told");
    Ok(code)
}

/// A polygon, its name, and whether robots keep out.
type Told = (Vec<[f64; 2]>, Option<String>, bool);

fn read(text: &str) -> Result<Vec<Told>, serde_json::Error> {
    let Names { areas, regions } = serde_json::from_str(text)?;
    let rooms = regions.into_iter().filter_map(|room| {
        let name = room.names.first().filter(|name| name.p >= CALLED_MIN)?.label.clone();
        Some((room.line_m(), Some(name), false))
    });
    Ok(rooms.chain(areas.into_iter().map(|a| (a.polygon_m, a.name, a.forbidden))).collect())
}

/// Whether the map has it already: lines that are drawn again differ by how places have moved meanwhile.
fn is_known(known: &RegionsReply, polygon_m: &[[f64; 2]], name: Option<&String>, forbidden: bool) -> bool {
    let is_line = |line: &[[f64; 2]]| {
        let near = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).hypot(a[1] - b[1]) < SAME_M;
        line.len() == polygon_m.len() && line.iter().zip(polygon_m).all(near)
    };
    let is_name = |label: &str| name.is_some_and(|name| name.eq_ignore_ascii_case(label));
    let bears = |r: &Region| r.names.first().is_some_and(|n| is_name(&n.label) && n.p >= CALLED_MIN);
    let is_room = !forbidden && known.regions.iter().any(|r| bears(r) && is_line(&r.line_m()));
    let is_area = |a: &Area| {
        let same = a.name.as_deref().map_or(name.is_none(), is_name);
        same && a.forbidden == forbidden && is_line(&a.polygon_m)
    };
    is_room || known.areas.iter().any(is_area)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_of_what_was_exported_and_of_what_was_written_by_hand() {
        let exported = r#"{"version": 1, "places": [], "areas": [{"id": "a", "name": null, "forbidden": true, "polygon_m": [[0, 0], [1, 0], [1, 1]]}],
            "regions": [
                {"id": 3, "kind": "room", "area_m2": 4, "holes_m": [], "doorways": [], "places": [3],
                 "polygon_m": [[2, 0], [4, 0], [4, 2]], "names": [{"label": "lab", "p": 0.9}, {"label": "den", "p": 0.1}]},
                {"id": 4, "kind": "room", "area_m2": 4, "holes_m": [], "doorways": [], "places": [4],
                 "polygon_m": [[5, 0], [6, 0], [6, 2]], "names": [{"label": "den", "p": 0.4}]}]}"#;
        let lab = (vec![[2.0, 0.0], [4.0, 0.0], [4.0, 2.0]], Some("lab".to_owned()), false);
        let out = (vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], None, true);
        assert_eq!(read(exported).unwrap(), [lab, out]);
        let by_hand = r#"{"areas": [{"name": "lab", "polygon_m": [[0, 0], [4, 0], [4, 3]]}]}"#;
        assert_eq!(read(by_hand).unwrap().len(), 1);
        assert!(read("7").is_err() && read(r#"{"areas": [{"name": "lab"}]}"#).is_err());
    }

    #[test]
    fn corners_are_pairs() {
        assert_eq!(corners("0,0 4,-1.5 4,3").unwrap().0, [[0.0, 0.0], [4.0, -1.5], [4.0, 3.0]]);
        for wrong in ["", "0,0 1,1", "0,0 1,1 2", "a,b c,d e,f"] {
            assert!(corners(wrong).is_err(), "{wrong:?}");
        }
    }
}
