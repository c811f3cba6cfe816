use super::*;
use crate::map::{self, MapArgs};
use clap::Parser;
use serde_json::Value;
use std::collections::BTreeSet;
use toponym_core::Pose2;
use toponym_core::answers::query::Grid;
use toponym_sim::{Scenario, write::write_folder};

#[derive(Parser)]
struct MapCli {
    #[command(flatten)]
    map: MapArgs,
}

#[derive(Parser)]
struct ExportCli {
    #[command(flatten)]
    export: ExportArgs,
}

/// The demo's tour up to a stop, mapped and exported; gone at the end of the test.
struct Exported(PathBuf);

impl Exported {
    fn new(name: &str, options: &[&str]) -> Self {
        let folder = std::env::temp_dir().join(format!("toponym-export-{name}-{}", std::process::id()));
        let mut scenario = Scenario::demo(1);
        scenario.tour.truncate(4);
        write_folder(&scenario.run().unwrap(), &folder).unwrap();
        let path = |name: &str| folder.join(name).display().to_string();
        let (log, narration, saved) = (path("sim.clf"), path("narration.jsonl"), path("a.map"));
        let cli = MapCli::parse_from(["map", &log, "--narration", &narration, "--save-map", &saved]);
        map::run(&cli.map).unwrap();
        let out = path("out");
        let export = ["export", &saved, &out].into_iter().chain(options.iter().copied());
        run(&ExportCli::parse_from(export).export).unwrap();
        Self(folder)
    }

    fn names(&self) -> BTreeSet<String> {
        let entries = std::fs::read_dir(self.0.join("out")).unwrap();
        entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect()
    }

    fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.join("out").join(name)).unwrap()
    }

    fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.text(name)).unwrap()
    }
}

impl Drop for Exported {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).unwrap();
    }
}

/// As `nav2_map_server` reads a map in mode trinary or scale: each pixel's occupancy, the lowest row first.
fn as_nav2_reads(yaml: &str, pgm: &[u8]) -> (usize, Vec<i8>) {
    let value = |key: &str| -> f64 {
        let line = yaml.lines().find_map(|l| l.strip_prefix(key)).unwrap();
        line.trim_start_matches(':').trim().parse().unwrap()
    };
    let (occupied, free) = (value("occupied_thresh"), value("free_thresh"));
    let mut lines = pgm.splitn(4, |b| *b == b'\n');
    assert_eq!(lines.next(), Some(&b"P5"[..]));
    let size = String::from_utf8(lines.next().unwrap().to_vec()).unwrap();
    let (width, height) = size.split_once(' ').unwrap();
    let (width, height): (usize, usize) = (width.parse().unwrap(), height.parse().unwrap());
    assert_eq!(lines.next(), Some(&b"255"[..]));
    let pixels = lines.next().unwrap();
    assert_eq!(pixels.len(), width * height);
    let cell = |&shade: &u8| {
        let p = f64::from(255 - shade) / 255.0;
        if p >= occupied {
            100
        } else if p <= free {
            0
        } else if yaml.contains("mode: scale") {
            ((p - free) / (occupied - free) * 100.0).round() as i8
        } else {
            -1
        }
    };
    (width, pixels.chunks_exact(width).rev().flatten().map(cell).collect())
}

#[test]
fn nav2_reads_what_is_known_pixel_by_pixel() {
    let cells: Vec<i8> = [-1, 0, 10, 49, 50, 64, 65, 100].into();
    let map_from_grid = Pose2::new(-1.5, 2.0, 0.0);
    let grid = Grid { resolution_m: 0.1, width: 4, height: 2, map_from_grid, cells };
    let [(_, yaml), (_, pgm)] = nav2::files(&grid);
    let yaml = String::from_utf8(yaml).unwrap();
    assert_eq!(as_nav2_reads(&yaml, &pgm), (4, vec![-1, 0, 0, 0, -1, -1, 100, 100]));
    assert!(yaml.contains("origin: [-1.500000, 2.000000, 0.0]\n") && yaml.contains("resolution: 0.1\n"));
}

#[test]
fn nav2_reads_masks_of_rooms_by_name_and_of_no_other() {
    let exported = Exported::new("masks", &["--masks", "--keep-out", "gym", "--slow", "kitchen=30%"]);
    let read = |name: &str| {
        let pgm = std::fs::read(exported.0.join("out").join(format!("{name}.pgm"))).unwrap();
        as_nav2_reads(&exported.text(&format!("{name}.yaml")), &pgm).1
    };
    let (out, slow) = (read("keepout_mask"), read("speed_mask"));
    let of = |cells: &[i8], value: i8| cells.iter().filter(|c| **c == value).count();
    let (forbidden, limited) = (of(&out, 100), of(&slow, 70));
    assert!(forbidden > 1000 && limited > 1000, "{forbidden} cells, {limited}");
    assert_eq!((forbidden + of(&out, 0), limited + of(&slow, 0)), (out.len(), slow.len()));
    assert!(out.iter().zip(&slow).all(|(out, slow)| *out == 0 || *slow == 0), "two rooms");
    let mut values = (0..=100_u8).collect::<Vec<_>>();
    let grid = Grid {
        resolution_m: 0.1,
        width: 101,
        height: 1,
        map_from_grid: Pose2::default(),
        cells: vec![0; 101],
    };
    let [(_, yaml), (_, pgm)] = nav2::picture(&grid, "scale", ["m.yaml", "m.pgm"], &values);
    let back = as_nav2_reads(&String::from_utf8(yaml).unwrap(), &pgm).1;
    assert_eq!(back, values.drain(..).map(|v| v as i8).collect::<Vec<_>>());
    for wrong in ["kitchen", "kitchen=0", "kitchen=101", "=50x"] {
        assert!(super::masks::slow(wrong).is_err(), "{wrong}");
    }
}

#[test]
fn a_route_graph_hangs_together_and_leads_from_name_to_name() {
    let exported = Exported::new("route", &["--route-graph"]);
    assert_eq!(exported.names(), BTreeSet::from(["route.geojson".to_owned()]));
    let graph = exported.json("route.geojson");
    let features = graph["features"].as_array().unwrap();
    let of = |kind: &str| features.iter().filter(move |f| f["geometry"]["type"] == *kind).collect::<Vec<_>>();
    let (nodes, edges) = (of("Point"), of("MultiLineString"));
    let ids: BTreeSet<u64> = features.iter().map(|f| f["properties"]["id"].as_u64().unwrap()).collect();
    assert_eq!(ids.len(), features.len(), "ids are unique");
    let at = |id: &Value| nodes.iter().find(|n| n["properties"]["id"] == *id).unwrap();
    let mut reached = BTreeSet::from([nodes[0]["properties"]["id"].as_u64().unwrap()]);
    for _ in 0..nodes.len() {
        for edge in &edges {
            let p = &edge["properties"];
            let line = &edge["geometry"]["coordinates"][0];
            assert_eq!(line[0], at(&p["startid"])["geometry"]["coordinates"]);
            assert_eq!(line[1], at(&p["endid"])["geometry"]["coordinates"]);
            assert!(p["metadata"]["clearance_m"].as_f64().unwrap() > 0.0);
            if reached.contains(&p["startid"].as_u64().unwrap()) {
                reached.insert(p["endid"].as_u64().unwrap());
            }
        }
    }
    assert_eq!(reached.len(), nodes.len(), "all nodes can be reached");
    let classes: BTreeSet<&str> =
        nodes.iter().filter_map(|n| n["properties"]["metadata"]["class"].as_str()).collect();
    assert!(["gym", "kitchen", "doorway"].iter().all(|c| classes.contains(c)), "{classes:?}");
}

#[test]
fn a_bag_of_the_map_has_it_all_and_is_read_back() {
    let exported = Exported::new("mcap", &["--mcap"]);
    let mut bag = toponym_ros::bag::Bag::open(&exported.0.join("out/map.mcap")).unwrap();
    let (mut count, mut sentences) = (std::collections::BTreeMap::new(), Vec::new());
    while let Some(raw) = bag.next() {
        let topic = &bag.topics()[raw.topic];
        assert!(topic.is_cdr);
        *count.entry(topic.name.clone()).or_insert(0) += 1;
        match topic.name.as_str() {
            "/map" => {
                let map: toponym_ros::msg::OccupancyGrid = toponym_ros::cdr::read(&raw.data).unwrap();
                assert_eq!(map.data.len(), (map.info.width * map.info.height) as usize);
            }
            "/speech" => {
                let text: toponym_ros::msg::StringMsg = toponym_ros::cdr::read(&raw.data).unwrap();
                sentences.push(text.data);
            }
            _ => {}
        }
    }
    let once = ["/map", "/toponym/markers", "/toponym/path"].map(|topic| count[topic]);
    assert_eq!(once, [1, 1, 1]);
    assert!(count["/tf"] > 10 && count["/toponym/places"] > 10, "{count:?}");
    assert!(sentences.iter().any(|s| s.contains("gym")), "{sentences:?}");
}

/// What of a schema is used here: types, required fields, items, constants.
fn conforms(value: &Value, schema: &Value, path: &str) {
    let is = match schema["type"].as_str() {
        Some("object") => value.is_object(),
        Some("array") => value.is_array(),
        Some("string") => value.is_string(),
        Some("integer") => value.is_i64() || value.is_u64(),
        Some("number") => value.is_number(),
        Some("boolean") => value.is_boolean(),
        _ => true,
    };
    assert!(is, "{path}: {value}");
    assert!(schema["const"].is_null() || schema["const"] == *value, "{path}: {value}");
    assert!(schema["enum"].as_array().is_none_or(|all| all.contains(value)), "{path}: {value}");
    for name in schema["required"].as_array().into_iter().flatten() {
        assert!(!value[name.as_str().unwrap()].is_null(), "{path}.{name}");
    }
    for (name, inner) in value.as_object().into_iter().flatten() {
        conforms(inner, &schema["properties"][name], &format!("{path}.{name}"));
    }
    for (k, inner) in value.as_array().into_iter().flatten().enumerate() {
        conforms(inner, &schema["items"], &format!("{path}[{k}]"));
    }
}

#[test]
fn all_forms_are_written_and_are_of_one_map() {
    let exported = Exported::new("all", &[]);
    let names = [
        "graph.g2o",
        "map.json",
        "map.mcap",
        "map.pgm",
        "map.schema.json",
        "map.yaml",
        "rooms.geojson",
        "route.geojson",
    ];
    assert_eq!(exported.names().into_iter().collect::<Vec<_>>(), names);
    let (map, rooms) = (exported.json("map.json"), exported.json("rooms.geojson"));
    conforms(&map, &exported.json("map.schema.json"), "map");
    let sentences = map["sentences"].as_array().unwrap();
    assert!(sentences.len() >= 4 && sentences.iter().all(|s| s["stands"] == true), "{sentences:?}");
    let polygons: Vec<&Value> =
        rooms["features"].as_array().unwrap().iter().filter(|f| f["geometry"]["type"] == "Polygon").collect();
    assert_eq!(polygons.len(), map["regions"].as_array().unwrap().len());
    for polygon in polygons {
        for ring in polygon["geometry"]["coordinates"].as_array().unwrap() {
            let ring = ring.as_array().unwrap();
            assert!(ring.len() >= 4 && ring.first() == ring.last());
        }
    }
    let g2o = exported.text("graph.g2o");
    let count = |word: &str| g2o.lines().filter(|l| l.starts_with(word)).count();
    let places = map["places"].as_array().unwrap().len();
    let vertices = count("VERTEX_SE2");
    assert!((places - 4..=places).contains(&vertices) && count("FIX") == 1, "{vertices} of {places}");
    assert!(count("EDGE_SE2") >= vertices - 1, "{}", count("EDGE_SE2"));
    assert!(g2o.lines().filter(|l| l.starts_with("EDGE")).all(|l| l.split(' ').count() == 12));
}
