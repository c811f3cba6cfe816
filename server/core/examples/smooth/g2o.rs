//! A pose graph in the order in which a robot meets it, read from the EDGE_SE2 lines of a g2o file.

use crate::failure::Failure;
use flate2::bufread::MultiGzDecoder;
use nalgebra::{Matrix3, Vector3};
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::ops::Range;
use std::path::Path;
use toponym_core::Pose2;
use toponym_core::smoothing::Factor;

const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// A measured relative pose, and where the file says so.
pub struct Edge {
    pub i: u32,
    pub j: u32,
    pub i_from_j: Pose2,
    pub information: Matrix3<f64>,
    pub line: usize,
}

impl Edge {
    pub fn factor(&self) -> Factor {
        Factor { i: self.i, j: self.j, i_from_j: self.i_from_j, information: self.information }
    }

    /// `eᵀ I e` with `e = (R(z)ᵀ(t − t_z), wrap(yaw − yaw_z))`, t and yaw being j's in frame i: the
    /// chart that g2o and GTSAM use, without the logarithm of the smoother's own cost, so that the
    /// numbers compare.
    fn chi2(&self, poses: &[Pose2]) -> f64 {
        let i_from_j = poses[self.i as usize].between(&poses[self.j as usize]);
        let e = self.i_from_j.between(&i_from_j);
        let e = Vector3::new(e.x_m, e.y_m, e.yaw_rad);
        e.dot(&(self.information * e))
    }
}

/// Poses 0..n and the edges among them, sorted by their newer pose and otherwise as in the file.
pub struct Graph {
    /// As given, for messages.
    pub file: String,
    pub edges: Vec<Edge>,
    /// The file's number of each pose, ascending.
    ids: Vec<u64>,
    /// Where the edges of each pose to older ones begin, and at last the number of edges.
    starts: Vec<usize>,
}

impl Graph {
    /// From a g2o file, plain or gzip: its first bytes tell.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let file = path.display().to_string();
        let unreadable = |source| Failure::Read { file: file.clone(), source };
        let mut reader = BufReader::new(File::open(path).map_err(unreadable)?);
        if reader.fill_buf().map_err(unreadable)?.starts_with(&GZIP_MAGIC) {
            Self::parse(file, BufReader::new(MultiGzDecoder::new(reader)))
        } else {
            Self::parse(file, reader)
        }
    }

    fn parse(file: String, reader: impl BufRead) -> Result<Self, Failure> {
        let mut raw = Vec::new();
        for (n, text) in reader.lines().enumerate() {
            let line = n + 1;
            let text = match text {
                Ok(text) => text,
                // Bytes that are not text may stand in a line that is not ours.
                Err(e) if e.kind() == io::ErrorKind::InvalidData => continue,
                Err(source) => return Err(Failure::Read { file, source }),
            };
            match parse_edge(&text) {
                None => {}
                Some(Ok(edge)) => raw.push((line, edge)),
                Some(Err(what)) => return Err(Failure::Edge { file, line, what }),
            }
        }
        if raw.is_empty() {
            return Err(Failure::NoEdges { file });
        }
        Ok(Self::arrange(file, &raw))
    }

    /// Numbers the poses 0..n, which keeps their order, and sorts the edges by their newer one.
    fn arrange(file: String, raw: &[(usize, RawEdge)]) -> Self {
        let mut ids: Vec<u64> = raw.iter().flat_map(|(_, e)| [e.i, e.j]).collect();
        ids.sort_unstable();
        ids.dedup();
        let index = |id: u64| ids.partition_point(|&other| other < id) as u32;
        let mut edges: Vec<Edge> = raw
            .iter()
            .map(|(line, e)| {
                let [x, y, yaw, a, b, c, d, f, g] = e.numbers;
                Edge {
                    i: index(e.i),
                    j: index(e.j),
                    i_from_j: Pose2::new(x, y, yaw),
                    information: Matrix3::new(a, b, c, b, d, f, c, f, g),
                    line: *line,
                }
            })
            .collect();
        edges.sort_by_key(|e| e.i.max(e.j));
        let starts =
            (0..=ids.len()).map(|k| edges.partition_point(|e| (e.i.max(e.j) as usize) < k)).collect();
        Self { file, edges, ids, starts }
    }

    /// The file's name without its folders.
    pub fn name(&self) -> String {
        let name = Path::new(&self.file).file_name();
        name.map_or_else(|| self.file.clone(), |name| name.to_string_lossy().into_owned())
    }

    /// Number of poses.
    pub fn poses(&self) -> usize {
        self.ids.len()
    }

    /// The edge that pose k starts from, to an older one: the first in the file.
    pub fn first(&self, k: usize) -> Option<&Edge> {
        self.edges[self.starts[k]..self.starts[k + 1]].first()
    }

    /// Which edges are pose k's others to older ones.
    pub fn loops(&self, k: usize) -> Range<usize> {
        let end = self.starts[k + 1];
        (self.starts[k] + 1).min(end)..end
    }

    /// The file's numbers of the poses that have no edge to an older one, but for the very first.
    pub fn detached(&self) -> impl Iterator<Item = u64> {
        (1..self.poses()).filter(|&k| self.first(k).is_none()).map(|k| self.ids[k])
    }

    /// The line to blame when an update with pose k fails: of its newest edge, or else the first that
    /// names it.
    pub fn line(&self, k: usize) -> usize {
        let newest = self.edges[self.starts[k]..self.starts[k + 1]].last();
        let named = || self.edges.iter().find(|e| e.i as usize == k || e.j as usize == k);
        newest.or_else(named).map_or(0, |e| e.line)
    }

    /// χ² of the edges for whose index `holds` is true.
    pub fn chi2(&self, poses: &[Pose2], holds: impl Fn(usize) -> bool) -> f64 {
        self.edges.iter().enumerate().filter(|(at, _)| holds(*at)).map(|(_, e)| e.chi2(poses)).sum()
    }
}

/// An edge with the file's numbers of its poses; x, y, yaw, and I by rows of its upper triangle.
#[derive(Debug, PartialEq)]
struct RawEdge {
    i: u64,
    j: u64,
    numbers: [f64; 9],
}

/// None of a line that is not an edge, or what is wrong with it.
fn parse_edge(text: &str) -> Option<Result<RawEdge, String>> {
    let mut words = text.split_whitespace();
    (words.next() == Some("EDGE_SE2")).then(|| parse_numbers(words))
}

fn parse_numbers<'a>(mut words: impl Iterator<Item = &'a str>) -> Result<RawEdge, String> {
    let mut next = |what: &str| words.next().ok_or_else(|| format!("{what} is missing"));
    let mut pose = |what| {
        let word = next(what)?;
        word.parse::<u64>().map_err(|_| format!("{what} is `{word}`, not the number of a pose"))
    };
    let (i, j) = (pose("i")?, pose("j")?);
    if i == j {
        return Err(format!("an edge from pose {i} to itself"));
    }
    let mut numbers = [0.0; 9];
    let names = ["x", "y", "yaw", "I11", "I12", "I13", "I22", "I23", "I33"];
    for (number, what) in numbers.iter_mut().zip(names) {
        let word = next(what)?;
        *number = match word.parse::<f64>() {
            Ok(value) if value.is_finite() => value,
            _ => return Err(format!("{what} is `{word}`, not a finite number")),
        };
    }
    Ok(RawEdge { i, j, numbers })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn graph(text: &str) -> Result<Graph, Failure> {
        Graph::parse("g".into(), text.as_bytes())
    }

    #[test]
    fn gaps_close_and_edges_follow_their_newer_pose() {
        let g = graph(
            "VERTEX_SE2 3 0 0 0\nEDGE_SE2 9 7 1 2 3 4 5 6 7 8 9\nEDGE_SE2 3 9 1 0 0 1 0 0 1 0 1\n\
             EDGE_SE2 3 7 1 0 0 1 0 0 1 0 1\nEDGE_SE2 20 21 1 0 0 1 0 0 1 0 1\n",
        )
        .unwrap();
        let edges: Vec<_> = g.edges.iter().map(|e| (e.i, e.j, e.line)).collect();
        assert_eq!(edges, [(0, 1, 4), (2, 1, 2), (0, 2, 3), (3, 4, 5)]);
        assert_eq!(g.edges[1].information, Matrix3::new(4., 5., 6., 5., 7., 8., 6., 8., 9.));
        assert_eq!(g.first(2).map(|e| e.line), Some(2));
        assert_eq!((g.loops(0), g.loops(2), g.loops(3)), (0..0, 2..3, 3..3));
        assert_eq!(g.detached().collect::<Vec<_>>(), [20]);
        assert_eq!((g.line(2), g.line(3)), (3, 5));
    }

    #[test]
    fn a_bad_edge_is_refused_with_its_line() {
        for (bad, says) in [
            ("EDGE_SE2 0 1 1 0 0 1 0 0 1 0", "line 2: I33 is missing"),
            ("EDGE_SE2 0 x 1 0 0 1 0 0 1 0 1", "line 2: j is `x`"),
            ("EDGE_SE2 0 1 1 0 nan 1 0 0 1 0 1", "line 2: yaw is `nan`"),
            ("EDGE_SE2 4 4 1 0 0 1 0 0 1 0 1", "line 2: an edge from pose 4 to itself"),
        ] {
            let failure = graph(&format!("# comment\n{bad}\n")).err().unwrap().to_string();
            assert!(failure.contains(says), "{failure}");
        }
        assert!(matches!(graph("VERTEX_SE2 0 0 0 0\n"), Err(Failure::NoEdges { .. })));
    }

    #[test]
    fn chi2_is_that_of_the_chart() {
        let g = graph("EDGE_SE2 0 1 1 0 1.5707963267948966 4 0 0 9 0 1\n").unwrap();
        // Off by 1 m along the x of frame i, which is −y of the measured frame j.
        let poses = [Pose2::default(), Pose2::new(2.0, 0.0, std::f64::consts::FRAC_PI_2)];
        assert!((g.chi2(&poses, |_| true) - 9.0).abs() < 1e-12);
        assert!(g.chi2(&poses, |_| false).abs() < 1e-12);
    }
}
