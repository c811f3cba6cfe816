//! Graphs as they are scored, wherever they come from.

use serde::Deserialize;
use std::collections::BTreeMap;
use toponym_core::Pose2;
use toponym_core::answers::query::{self, GraphAnswer, WhereAnswer};

/// The posterior at one moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Graphs {
    /// Vertices of all graphs, in order of time.
    pub places: Vec<Place>,
    /// Distinct graphs, the best first.
    pub particles: Vec<Particle>,
}

/// A vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Place {
    /// Stamp of its first scan.
    pub stamp_s: f64,
    /// Its likeliest name.
    pub name: Option<String>,
}

/// A distinct graph.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Particle {
    /// All sum to one with what the mapper calls unresolved.
    pub weight: f64,
    /// Loop edges.
    pub edges: Vec<Edge>,
    /// Of each place, in this graph's own map.
    pub poses: Vec<Pose2>,
}

/// A loop edge between two places, by index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Older place.
    pub i: usize,
    /// Newer place.
    pub j: usize,
    /// Measured transform.
    pub i_from_j: Pose2,
}

/// An answered question.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// As asked.
    pub question: String,
    /// Probability that it is nowhere in the map.
    pub p_none: f64,
    /// Where it may be, the likeliest first.
    pub candidates: Vec<Candidate>,
}

/// Where something may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// In the best graph's map.
    pub at_m: [f64; 2],
    /// Probability that this is meant.
    pub probability: f64,
    /// Probability that the name applies here.
    pub p_is: f64,
}

impl Graphs {
    /// Of a mapper's answer.
    pub fn of(graph: GraphAnswer) -> Self {
        let index: BTreeMap<_, usize> = graph.places.iter().enumerate().map(|(k, p)| (p.id, k)).collect();
        let edge = |e: &toponym_core::answers::query::EdgeView| {
            Some(Edge { i: *index.get(&e.i)?, j: *index.get(&e.j)?, i_from_j: e.i_from_j })
        };
        let particles = graph.particles.into_iter().map(|p| Particle {
            weight: p.weight,
            edges: p.edges.iter().filter_map(edge).collect(),
            poses: p.poses,
        });
        let places = graph.places.iter().map(|p| Place {
            stamp_s: p.stamp_ns as f64 * 1e-9,
            name: p.labels.first().map(|l| l.0.clone()),
        });
        Self { places: places.collect(), particles: particles.collect() }.sorted()
    }

    /// Stamps of the places.
    pub fn stamps_s(&self) -> Vec<f64> {
        self.places.iter().map(|p| p.stamp_s).collect()
    }

    fn sorted(mut self) -> Self {
        self.particles.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        self
    }
}

impl Answer {
    /// Of a mapper's answer.
    pub fn of(answer: &WhereAnswer) -> Self {
        let candidate = |c: &query::Candidate| Candidate {
            at_m: [c.pose.x_m, c.pose.y_m],
            probability: c.probability,
            p_is: c.p_is,
        };
        let candidates = answer.candidates.iter().map(candidate).collect();
        Self { question: answer.text.clone(), p_none: answer.p_none, candidates }
    }
}

/// What is read of a report as `toponym-server map --report` writes it; other fields are left alone.
#[derive(Debug, Deserialize)]
pub struct Report {
    places: Vec<ReportPlace>,
    particles: Vec<ReportParticle>,
    unresolved: Option<f64>,
    #[serde(default)]
    answers: Vec<ReportAnswer>,
    timing: Option<ReportTiming>,
}

#[derive(Debug, Deserialize)]
struct ReportPlace {
    id: u64,
    stamp_s: f64,
    #[serde(default)]
    labels: BTreeMap<String, f64>,
}

#[derive(Debug, Deserialize)]
struct ReportParticle {
    weight: f64,
    #[serde(default)]
    edges: Vec<ReportEdge>,
    poses: Vec<[f64; 3]>,
}

#[derive(Debug, Deserialize)]
struct ReportEdge {
    i: u64,
    j: u64,
    dx_m: f64,
    dy_m: f64,
    dyaw_rad: f64,
}

#[derive(Debug, Deserialize)]
struct ReportAnswer {
    question: String,
    p_none: f64,
    candidates: Vec<ReportCandidate>,
}

#[derive(Debug, Deserialize)]
struct ReportCandidate {
    probability: f64,
    p_is: Option<f64>,
    x_m: f64,
    y_m: f64,
}

#[derive(Debug, Deserialize)]
struct ReportTiming {
    cpu_s: Option<f64>,
    log_s: Option<f64>,
}

impl Report {
    /// Its graphs; the error says what does not fit together.
    pub fn graphs(&self) -> Result<Graphs, String> {
        let ids: BTreeMap<u64, usize> = self.places.iter().enumerate().map(|(k, p)| (p.id, k)).collect();
        if self.places.windows(2).any(|w| w[1].stamp_s < w[0].stamp_s) {
            return Err("places: their stamp_s must ascend".into());
        }
        let particles = self.particles.iter().enumerate().map(|(k, p)| {
            p.particle(&ids, self.places.len()).map_err(|why| format!("particles[{k}]: {why}"))
        });
        let places =
            self.places.iter().map(|p| Place { stamp_s: p.stamp_s, name: likeliest(&p.labels) }).collect();
        Ok(Graphs { places, particles: particles.collect::<Result<_, _>>()? }.sorted())
    }

    /// Its answers.
    pub fn answers(&self) -> Vec<Answer> {
        let answer = |a: &ReportAnswer| {
            let candidate = |c: &ReportCandidate| Candidate {
                at_m: [c.x_m, c.y_m],
                probability: c.probability,
                p_is: c.p_is.unwrap_or(c.probability),
            };
            let mut candidates: Vec<Candidate> = a.candidates.iter().map(candidate).collect();
            candidates.sort_by(|a, b| b.probability.total_cmp(&a.probability));
            Answer { question: a.question.clone(), p_none: a.p_none, candidates }
        };
        self.answers.iter().map(answer).collect()
    }

    /// Posterior mass of graphs that were dropped, if the report tells it.
    pub fn unresolved(&self) -> Option<f64> {
        self.unresolved
    }

    /// Processor time per second of log, if the report tells it.
    pub fn cpu_ms_per_s(&self) -> Option<f64> {
        let timing = self.timing.as_ref()?;
        Some(timing.cpu_s? * 1e3 / timing.log_s.filter(|s| *s > 0.0)?)
    }
}

impl ReportParticle {
    fn particle(&self, ids: &BTreeMap<u64, usize>, places: usize) -> Result<Particle, String> {
        if self.poses.len() != places {
            return Err(format!("{} poses for {places} places", self.poses.len()));
        }
        let place =
            |id: &u64| ids.get(id).copied().ok_or_else(|| format!("an edge of place {id}, which is none"));
        let edges = self.edges.iter().map(|e| {
            let i_from_j = Pose2::new(e.dx_m, e.dy_m, e.dyaw_rad);
            Ok::<_, String>(Edge { i: place(&e.i)?, j: place(&e.j)?, i_from_j })
        });
        Ok(Particle {
            weight: self.weight,
            edges: edges.collect::<Result<_, _>>()?,
            poses: self.poses.iter().map(|[x, y, yaw]| Pose2::new(*x, *y, *yaw)).collect(),
        })
    }
}

fn likeliest(labels: &BTreeMap<String, f64>) -> Option<String> {
    // Of two as likely the first by name, as a mapper sorts them.
    labels.iter().rev().max_by(|a, b| a.1.total_cmp(b.1)).map(|l| l.0.clone())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    fn report() -> Value {
        json!({
            "places": [{"id": 3, "stamp_s": 1.0, "labels": {"gym": 0.4, "hall": 0.4, "cafe": 0.2}},
                       {"id": 5, "stamp_s": 2.0}],
            "particles": [{"weight": 0.1, "poses": [[0, 0, 0], [1, 0, 0]]},
                          {"weight": 0.9, "poses": [[0, 0, 0], [2, 0, 0]],
                           "edges": [{"i": 3, "j": 5, "kind": "x", "dx_m": 2, "dy_m": 0, "dyaw_rad": 0}]}],
            "answers": [{"question": "where", "p_none": 0.25, "candidates":
                         [{"probability": 0.1, "x_m": 1, "y_m": 1}, {"probability": 0.6, "x_m": 2, "y_m": 1}]}]
        })
    }

    fn read(report: Value) -> Report {
        serde_json::from_value(report).unwrap()
    }

    #[test]
    fn a_report_is_read_with_the_best_graph_first_and_places_by_index() {
        let graphs = read(report()).graphs().unwrap();
        assert!(graphs.particles[0].weight > 0.5);
        assert_eq!(graphs.particles[0].edges[0], Edge { i: 0, j: 1, i_from_j: Pose2::new(2.0, 0.0, 0.0) });
        assert_eq!(graphs.places[0].name.as_deref(), Some("gym"));
        assert_eq!(graphs.places[1].name, None);
        let [x, y] = read(report()).answers()[0].candidates[0].at_m;
        assert!((x - 2.0).abs() < 1e-12 && (y - 1.0).abs() < 1e-12);
        assert_eq!(read(report()).unresolved(), None, "not every mapper tells");
        let mut told = report();
        told["unresolved"] = json!(0.25);
        assert_eq!(read(told).unresolved(), Some(0.25));
    }

    #[test]
    fn a_report_that_does_not_fit_together_says_where() {
        let mut short = report();
        short["particles"][1]["poses"] = json!([[0, 0, 0]]);
        assert_eq!(read(short).graphs().unwrap_err(), "particles[1]: 1 poses for 2 places");
        let mut lost = report();
        lost["particles"][1]["edges"][0]["j"] = json!(9);
        assert!(read(lost).graphs().unwrap_err().contains("place 9"));
        let mut back = report();
        back["places"][1]["stamp_s"] = json!(0.5);
        assert!(read(back).graphs().unwrap_err().contains("ascend"));
    }
}
