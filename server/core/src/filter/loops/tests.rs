use super::*;
use crate::scan::place::Content;
use crate::track::places::{Chain, FrozenPlace, OpenPlace};
use nalgebra::Matrix3;

/// Places a metre apart along x.
pub(crate) fn straight(n: Vertex) -> Graph {
    let mut graph = Graph::default();
    for v in 0..n {
        let previous_from_this = Pose2::new(1.0, 0.0, 0.0);
        let chain = Chain {
            previous_from_this,
            information: Matrix3::identity(),
            broken: false,
            unseen: false,
            failed: 1e-4,
        };
        let path_m = f64::from(v);
        let front_from_place = Pose2::new(path_m, 0.0, 0.0);
        let open = OpenPlace { id: v.into(), stamp_ns: 0, front_from_place, path_m, chain };
        graph.add(FrozenPlace { open, content: Content::new(&[]) });
    }
    graph
}

#[test]
fn a_place_is_matched_with_few_others_and_with_those_that_words_name_first() {
    let mut graph = straight(60);
    let proposal = |i: Vertex| {
        let kind = if i == 3 { EdgeKind::Semantic } else { EdgeKind::Distance };
        Proposal { i, kind, probability: 0.01 * f64::from(i) }
    };
    match_new(&mut graph, 59, &(0..20).map(proposal).collect::<Vec<_>>());
    let matched: Vec<Vertex> = graph.memo.keys().map(|k| k.0).collect();
    assert_eq!(matched, [3, 13, 14, 15, 16, 17, 18, 19]);
}

#[test]
fn the_first_edge_that_counts_of_a_revisit_by_words_is_theirs() {
    let covariance = Matrix3::identity();
    let mode = Mode { i_from_j: Pose2::default(), covariance, score: 0.9, overlap: 0.6 };
    let next = |kind, support| {
        let mut fit = Fit::supported_by(0, mode, kind, support);
        fit.named = (kind == EdgeKind::Semantic).then_some((0, 20));
        fit.kind_of_next()
    };
    assert_eq!(next(EdgeKind::Semantic, 1), EdgeKind::Semantic);
    assert_eq!(next(EdgeKind::Semantic, 6), EdgeKind::Distance);
    assert_eq!(next(EdgeKind::Relocalisation, 6), EdgeKind::Relocalisation);
}
