//! How far each free cell is from what is not: the Euclidean distance transform in linear time (Felzenszwalb and
//! Huttenlocher 2012, "Distance transforms of sampled functions").

use super::raster::Raster;

/// Metres to the nearest cell that is not free; 0 there. The raster's edge is not free.
pub fn clearance(raster: &Raster) -> Vec<f32> {
    let (width, height) = (raster.width, raster.height);
    // Along its column, cells: down, then up.
    let mut far: Vec<u32> = raster.free.iter().map(|&free| free.into()).collect();
    for cell in width..far.len() {
        far[cell] *= far[cell - width] + 1;
    }
    for cell in (0..far.len()).rev() {
        let below = if cell / width + 1 < height { far[cell + width] } else { 0 };
        far[cell] = far[cell].min(below + 1);
    }
    let mut line = Envelope::default();
    let (mut squared, mut clearance) = (Vec::new(), Vec::with_capacity(far.len()));
    for row in far.chunks_exact(width) {
        // What lies behind what is not free changes nothing.
        for run in row.chunk_by(|a, b| (*a > 0) == (*b > 0)) {
            squared.clear();
            squared.extend(run.iter().map(|&far| f64::from(far).powi(2)));
            if run[0] > 0 {
                line.lower(&mut squared);
            }
            clearance.extend(squared.iter().map(|d| (d.sqrt() * raster.resolution_m) as f32));
        }
    }
    clearance
}

/// The lower envelope of parabolas along a line.
#[derive(Default)]
struct Envelope {
    at: Vec<usize>,
    from: Vec<f64>,
    values: Vec<f64>,
}

impl Envelope {
    /// In place of each value the least of `value(q) + (q − p)²`; both ends of the line count as 0 one step beyond.
    fn lower(&mut self, line: &mut [f64]) {
        let n = line.len() + 2;
        self.values.clear();
        self.values.push(0.0);
        self.values.extend_from_slice(line);
        self.values.push(0.0);
        self.at.clear();
        self.from.clear();
        let value = |values: &[f64], q: usize| values[q] + (q * q) as f64;
        for q in 0..n {
            loop {
                let Some(&last) = self.at.last() else {
                    self.from.push(f64::NEG_INFINITY);
                    break;
                };
                let cross = (value(&self.values, q) - value(&self.values, last)) / (2 * (q - last)) as f64;
                if cross <= self.from[self.from.len() - 1] {
                    self.at.pop();
                    self.from.pop();
                } else {
                    self.from.push(cross);
                    break;
                }
            }
            self.at.push(q);
        }
        let mut k = 0;
        for (p, out) in line.iter_mut().enumerate() {
            let p = (p + 1) as f64;
            while k + 1 < self.at.len() && self.from[k + 1] < p {
                k += 1;
            }
            *out = self.values[self.at[k]] + (p - self.at[k] as f64).powi(2);
        }
    }
}
