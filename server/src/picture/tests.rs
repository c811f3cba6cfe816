use super::names::NAME;
use super::view::MARGIN;
use super::*;
use toponym_core::answers::query::ParticleView;
use toponym_proto::regions::RegionName;

pub fn place(id: PlaceId, x: f64, y: f64, labels: &[(&str, f64)]) -> PlaceView {
    let labels = labels.iter().map(|(n, p)| ((*n).to_string(), *p)).collect();
    PlaceView { id, stamp_ns: 0, pose: Pose2::new(x, y, 0.0), labels }
}

pub fn region(id: u64, kind: &str, names: &[(&str, f64)], places: &[u64]) -> Region {
    Region {
        id,
        kind: kind.into(),
        names: names.iter().map(|(label, p)| RegionName { label: (*label).into(), p: *p }).collect(),
        area_m2: 1.0,
        polygon_m: vec![],
        holes_m: vec![],
        doorways: vec![],
        places: places.to_vec(),
    }
}

fn graph() -> GraphAnswer {
    let edge = EdgeView { i: 0, j: 1, kind: EdgeKind::Semantic, i_from_j: Pose2::default() };
    GraphAnswer {
        epoch: 0,
        rev: 0,
        places: vec![place(0, 1.0, 1.0, &[("gym", 0.9)]), place(1, 9.0, 1.0, &[])],
        particles: vec![ParticleView { weight: 1.0, edges: vec![edge], poses: vec![] }],
        unresolved: 0.0,
        differences: vec![],
        effective_sample_size: 1.0,
    }
}

/// 10 m by 4 m, free, with a wall along the top row; its corner at (−1, −1).
pub fn grid() -> Grid {
    let mut cells = vec![0; 100 * 40];
    cells[39 * 100..].fill(100);
    let map_from_grid = Pose2::new(-1.0, -1.0, 0.0);
    Grid { resolution_m: 0.1, width: 100, height: 40, map_from_grid, cells }
}

#[test]
fn things_are_where_they_belong() {
    let trajectory = [Pose2::new(1.5, 2.0, 0.0), Pose2::new(8.0, 2.0, 0.0)];
    let robot = Some(Pose2::new(8.0, 0.0, 0.0));
    let (grid, graph) = (grid(), graph());
    let canvas =
        draw(&Drawn { grid: &grid, graph: &graph, trajectory: &trajectory, regions: &[], robot }).canvas();
    let at = |x_m: f64, y_m: f64| {
        let (x, y) = ((x_m + 1.0) * 60.0, (4.0 - (y_m + 1.0)) * 60.0);
        canvas.pixel(Point::new(x as i32 + MARGIN, y as i32 + MARGIN)).unwrap()
    };
    assert_eq!(at(5.0, 2.0), TRAJECTORY);
    assert_eq!(at(1.5, 2.0), START);
    assert_eq!((at(8.0, 0.0), at(8.15, 0.0)), (END, END), "robot and its nose");
    assert_eq!(at(5.0, 1.0), kind_style(EdgeKind::Semantic).0);
    assert_eq!(at(9.0 - 1e-9, 1.0), PLACE);
    assert_eq!(at(5.0, 2.95), Rgb888::new(20, 20, 20), "wall");
    assert_eq!(at(5.0, 0.0), Rgb888::WHITE, "free");
    let name = (0..40).flat_map(|dx| (0..20).map(move |dy| (dx, dy)));
    let name = name.filter(|&(dx, dy)| at(0.7 + f64::from(dx) / 60.0, 0.9 + f64::from(dy) / 60.0) == NAME);
    assert!(name.count() > 20, "the name is written over its place");
}

#[test]
fn an_empty_map_and_a_huge_one_fit_too() {
    let none = GraphAnswer { places: vec![], particles: vec![], ..graph() };
    let empty = Grid { width: 0, height: 0, cells: vec![], ..grid() };
    let size = |grid: &Grid, graph: &GraphAnswer| {
        draw(&Drawn { grid, graph, trajectory: &[], regions: &[], robot: None }).size
    };
    assert!(size(&empty, &none).width >= 600);
    let far = GraphAnswer { places: vec![place(0, 0.0, 0.0, &[]), place(1, 900.0, 0.0, &[])], ..graph() };
    let size = size(&grid(), &far);
    assert!(size.width <= 2000 && size.height <= 2000, "{size:?}");
}

#[test]
fn of_edges_side_by_side_one_is_drawn() {
    let far = |k: u64| place(k, k as f64, 0.0, &[]);
    let edge = |i, j, kind| EdgeView { i, j, kind, i_from_j: Pose2::default() };
    let edges = vec![
        edge(0, 20, EdgeKind::Distance),
        edge(1, 21, EdgeKind::Distance),
        edge(1, 21, EdgeKind::Semantic),
        edge(0, 24, EdgeKind::Distance),
    ];
    let particles = vec![ParticleView { weight: 1.0, edges, poses: vec![] }];
    let graph = GraphAnswer { places: (0..30).map(far).collect(), particles, ..graph() };
    let places: BTreeMap<PlaceId, &PlaceView> = graph.places.iter().map(|p| (p.id, p)).collect();
    let drawn: Vec<_> = apart(&graph, &places).into_iter().map(|(k, a, b)| (k, a.x_m, b.x_m)).collect();
    let expected =
        [(EdgeKind::Distance, 0.0, 20.0), (EdgeKind::Distance, 0.0, 24.0), (EdgeKind::Semantic, 1.0, 21.0)];
    assert_eq!(drawn, expected);
}
