//! Maps in the messages that RViz, Nav2, Foxglove and rerun show.

use crate::msg::{
    self, Color, Header, MapMetaData, Marker, MarkerArray, OccupancyGrid, PointCloud2, PointField,
    Quaternion, Vector3,
};
use toponym::{ClientError, Planner};
use toponym_proto::Pose;
use toponym_proto::answer::GraphReply;
use toponym_proto::regions::RegionsReply;

/// Names less likely are not shown.
const NAMED_MIN: f64 = 0.3;
/// Height of names, metres.
const TEXT_M: f64 = 0.5;
const LINE_STRIP: i32 = 4;
const LINE_LIST: i32 = 5;
const SPHERE_LIST: i32 = 7;
const TEXT: i32 = 9;
const DELETE_ALL: i32 = 3;
/// Blue and orange of a palette that the colour-blind tell apart.
const OUTLINE: Color = Color { r: 0.0, g: 0.45, b: 0.7, a: 1.0 };
const NAME: Color = Color { r: 0.1, g: 0.1, b: 0.1, a: 1.0 };
const PLACE: Color = Color { r: 0.5, g: 0.5, b: 0.5, a: 0.8 };
const LOOP: Color = Color { r: 0.9, g: 0.6, b: 0.0, a: 1.0 };

/// `sensor_msgs/msg/PointField::FLOAT32`
const FLOAT32: u8 = 7;

/// A turn about the upright axis.
pub fn about_z(yaw_rad: f64) -> Quaternion {
    let (z, w) = (0.5 * yaw_rad).sin_cos();
    Quaternion { x: 0.0, y: 0.0, z, w }
}

/// A pose on the floor, in ROS's words.
pub fn posed(pose: &Pose) -> msg::Pose {
    let position = Vector3 { x: pose.x_m, y: pose.y_m, z: 0.0 };
    msg::Pose { position, orientation: about_z(pose.yaw_rad) }
}

/// Cells as ROS has them: −1 unknown, 0 free … 100 occupied, rows from the lowest y.
pub fn occupancy(
    header: &Header,
    resolution_m: f64,
    (width, height): (usize, usize),
    map_from_grid: &Pose,
    cells: Vec<i8>,
) -> OccupancyGrid {
    let info = MapMetaData {
        map_load_time: header.stamp,
        resolution: resolution_m as f32,
        width: width as u32,
        height: height as u32,
        origin: posed(map_from_grid),
    };
    OccupancyGrid { header: header.clone(), info, data: cells }
}

/// A map as its server has it now: cells of this edge, and markers.
///
/// # Errors
/// If there is no such map, or no answer in time.
pub async fn map_as_shown(
    planner: &Planner,
    header: &Header,
    resolution_m: f64,
) -> Result<(OccupancyGrid, MarkerArray), ClientError> {
    let grid = planner.grid(resolution_m).await?;
    let (size, cells) = ((grid.width, grid.height), grid.cells()?);
    let map = occupancy(header, grid.resolution_m, size, &grid.map_from_grid, cells);
    Ok((map, markers(header, &planner.regions().await?, &planner.graph().await?)))
}

/// Points on the floor's level, x and y.
pub fn points(header: &Header, points_m: impl Iterator<Item = [f32; 2]>) -> PointCloud2 {
    const STEP: u32 = 12;
    let data: Vec<u8> = points_m.flat_map(|[x, y]| [x, y, 0.0]).flat_map(f32::to_le_bytes).collect();
    let width = data.len() as u32 / STEP;
    let field =
        |(k, name): (u32, &str)| PointField { name: name.into(), offset: 4 * k, datatype: FLOAT32, count: 1 };
    PointCloud2 {
        header: header.clone(),
        height: 1,
        width,
        fields: (0..).zip(["x", "y", "z"]).map(field).collect(),
        is_bigendian: false,
        point_step: STEP,
        row_step: STEP * width,
        data,
        is_dense: true,
    }
}

/// Rooms by their outlines and names, places, and what closes loops.
pub fn markers(header: &Header, regions: &RegionsReply, graph: &GraphReply) -> MarkerArray {
    let mark = |ns: &str, id: u64, kind, color| Marker {
        header: header.clone(),
        ns: ns.into(),
        id: id as i32,
        kind,
        color,
        pose: posed(&Pose::default()),
        ..Marker::default()
    };
    let point = |x: f64, y: f64| Vector3 { x, y, z: 0.0 };
    let wide = |m: f64| Vector3 { x: m, y: m, z: m };
    let mut all = vec![Marker { action: DELETE_ALL, ..mark("", 0, TEXT, NAME) }];
    for region in &regions.regions {
        let mut points: Vec<Vector3> = region.polygon_m.iter().map(|p| point(p[0], p[1])).collect();
        points.extend(points.first().copied());
        let outline = mark("rooms", region.id, LINE_STRIP, OUTLINE);
        all.push(Marker { scale: wide(0.06), points, ..outline });
        let Some(name) = region.names.first().filter(|name| name.p >= NAMED_MIN) else { continue };
        let Some((x, y)) = middle(&region.polygon_m) else { continue };
        let mut text = mark("names", region.id, TEXT, NAME);
        text.pose.position = Vector3 { x, y, z: 0.3 };
        all.push(Marker { scale: wide(TEXT_M), text: format!("{} {:.2}", name.label, name.p), ..text });
    }
    let at: std::collections::BTreeMap<u64, Vector3> =
        graph.places.iter().map(|p| (p.id, point(p.x_m, p.y_m))).collect();
    let places = mark("places", 0, SPHERE_LIST, PLACE);
    all.push(Marker { scale: wide(0.12), points: at.values().copied().collect(), ..places });
    let edges = graph.particles.first().map_or(&[][..], |best| &best.edges);
    let ends = edges.iter().filter_map(|e| Some([*at.get(&e.i)?, *at.get(&e.j)?]));
    let loops = mark("loops", 0, LINE_LIST, LOOP);
    all.push(Marker { scale: wide(0.04), points: ends.flatten().collect(), ..loops });
    MarkerArray { markers: all }
}

/// The mean of the corners.
fn middle(polygon_m: &[[f64; 2]]) -> Option<(f64, f64)> {
    let n = polygon_m.len() as f64;
    let sum = |k: usize| polygon_m.iter().map(|p| p[k]).sum::<f64>();
    (!polygon_m.is_empty()).then(|| (sum(0) / n, sum(1) / n))
}
