//! Ridge logistic regression by iterated reweighted least squares, and the area under the ROC curve.

use toponym_core::language::FEATURES;

/// Ridge on weights of standardised features, in examples. Between 1 and 10 the areas hardly differ.
const RIDGE: f64 = 2.0;
/// A feature that varies less in the examples of a relation must not weigh much where it does vary.
const SPREAD_MIN: f64 = 0.1;
/// Newton steps; some eight are needed.
const STEPS: usize = 30;
/// Logits change by no more than this in a step.
const STEP_MAX: f64 = 5.0;

/// Weights of features as they are, and the constant.
#[derive(Clone)]
pub struct Model {
    /// Per feature.
    pub weights: [f64; FEATURES],
    /// The constant.
    pub bias: f64,
}

impl Model {
    /// The log-odds that the example is true.
    pub fn logit(&self, x: &[f64; FEATURES]) -> f64 {
        self.bias + x.iter().zip(&self.weights).map(|(x, w)| x * w).sum::<f64>()
    }

    /// Fits examples; true and false ones weigh the same in all.
    pub fn fit(rows: &[(&[f64; FEATURES], bool)]) -> Self {
        let (mean, spread) = moments(rows);
        let standard = |x: &[f64; FEATURES]| -> [f64; FEATURES + 1] {
            std::array::from_fn(|k| if k < FEATURES { (x[k] - mean[k]) / spread[k] } else { 1.0 })
        };
        let inputs: Vec<_> = rows.iter().map(|(x, _)| standard(x)).collect();
        let count = rows.len() as f64;
        let positive = rows.iter().filter(|r| r.1).count().max(1) as f64;
        let share = |y: bool| 0.5 * count / if y { positive } else { (count - positive).max(1.0) };
        let mut w = [0.0; FEATURES + 1];
        for _ in 0..STEPS {
            let mut gradient = [0.0; FEATURES + 1];
            let mut hessian = vec![[0.0; FEATURES + 1]; FEATURES + 1];
            for (x, &(_, y)) in inputs.iter().zip(rows) {
                let logit: f64 = x.iter().zip(&w).map(|(x, w)| x * w).sum();
                let p = 1.0 / (1.0 + (-logit.clamp(-30.0, 30.0)).exp());
                let (error, curvature) =
                    (share(y) * (f64::from(y) - p), share(y) * (p * (1.0 - p)).max(1e-9));
                for i in 0..=FEATURES {
                    gradient[i] += error * x[i];
                    for j in 0..=i {
                        hessian[i][j] += curvature * x[i] * x[j];
                    }
                }
            }
            for k in 0..FEATURES {
                gradient[k] -= RIDGE * w[k];
                hessian[k][k] += RIDGE;
            }
            let step = solve(hessian, &gradient);
            let largest = step.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
            let scale = (STEP_MAX / largest.max(STEP_MAX)).min(1.0);
            for (w, s) in w.iter_mut().zip(step) {
                *w += scale * s;
            }
        }
        let weights = std::array::from_fn(|k| w[k] / spread[k]);
        let bias = w[FEATURES] - (0..FEATURES).map(|k| weights[k] * mean[k]).sum::<f64>();
        Self { weights, bias }
    }
}

/// Mean and standard deviation of every feature.
fn moments(rows: &[(&[f64; FEATURES], bool)]) -> ([f64; FEATURES], [f64; FEATURES]) {
    let count = rows.len().max(1) as f64;
    let mean: [f64; FEATURES] = std::array::from_fn(|k| rows.iter().map(|(x, _)| x[k]).sum::<f64>() / count);
    let deviation =
        |k: usize| (rows.iter().map(|(x, _)| (x[k] - mean[k]).powi(2)).sum::<f64>() / count).sqrt();
    (mean, std::array::from_fn(|k| deviation(k).max(SPREAD_MIN)))
}

/// Solves H x = g by Cholesky; of H the lower triangle is given.
fn solve(mut h: Vec<[f64; FEATURES + 1]>, g: &[f64; FEATURES + 1]) -> [f64; FEATURES + 1] {
    let mut x = *g;
    for i in 0..h.len() {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| h[i][k] * h[j][k]).sum();
            h[i][j] = if i == j { (h[i][i] - dot).max(1e-12).sqrt() } else { (h[i][j] - dot) / h[j][j] };
        }
        x[i] = (x[i] - (0..i).map(|k| h[i][k] * x[k]).sum::<f64>()) / h[i][i];
    }
    for i in (0..h.len()).rev() {
        x[i] = (x[i] - (i + 1..h.len()).map(|k| h[k][i] * x[k]).sum::<f64>()) / h[i][i];
    }
    x
}

/// Probability that a true example scores above a false one; ties count half.
pub fn area_under_curve(scores: &[(f64, bool)]) -> f64 {
    let mut sorted = scores.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut below, mut area) = (0.0, 0.0);
    for tied in sorted.chunk_by(|a, b| a.0.total_cmp(&b.0).is_eq()) {
        let positive = tied.iter().filter(|s| s.1).count() as f64;
        let negative = tied.len() as f64 - positive;
        area += positive * (below + 0.5 * negative);
        below += negative;
    }
    let positive = sorted.iter().filter(|s| s.1).count() as f64;
    area / (positive * (sorted.len() as f64 - positive)).max(1.0)
}
