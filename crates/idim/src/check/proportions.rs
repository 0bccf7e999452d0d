//! Sizes a reading gives torques and motions, against what arms have: a factor that no other joint feels still makes a
//! drive or a motion of a size that no arm has beside its neighbours.

use super::rows::Samples;
use idim_model::Robot;

/// Factor by which the torque of the next joint outward may be larger, and smaller, before its size is out of proportion:
/// the wrist of a PUMA 560 has a thirtieth of its elbow's, the shoulder of a UR10 three times its pan's.
const TORQUES: [f64; 2] = [10.0, 30.0];
/// Range of a joint in motion, rad or m: two turns each way are the most wrists have.
const RANGES: [f64; 2] = [0.1, 8.0 * std::f64::consts::PI];

/// Which joints have a size to compare.
#[derive(Debug, Clone)]
pub(crate) struct Proportions {
    /// Range of each joint as recorded, rad or m.
    range: Vec<f64>,
    /// Neighbours of one kind that both move: their torques are of one order of size.
    neighbours: Vec<(usize, usize)>,
}

impl Proportions {
    pub(crate) fn new(samples: &[Samples], robot: &Robot) -> Self {
        let joints = robot.joints();
        let widest = |j: usize| samples.iter().map(|s| s.range(j)).fold(0.0, f64::max);
        let range: Vec<f64> = (0..joints.len()).map(widest).collect();
        let moves = |j: usize| range[j] > RANGES[0];
        let neighbours = (0..joints.len().saturating_sub(1))
            .filter(|&j| joints[j].kind == joints[j + 1].kind && moves(j) && moves(j + 1))
            .map(|j| (j, j + 1))
            .collect();
        Self { range, neighbours }
    }

    /// Logarithms of what torques with these standard deviations exceed, summed.
    pub(crate) fn of_torques(&self, size: &[f64]) -> f64 {
        let [larger, smaller] = TORQUES;
        let beyond = self.neighbours.iter().map(|&(inner, outer)| {
            let ratio = (size[inner] / size[outer]).ln();
            (ratio - smaller.ln()).max(-ratio - larger.ln()).max(0.0)
        });
        // A torque that never changes has no size.
        beyond.filter(|b| b.is_finite()).sum()
    }

    /// Logarithms of what motions exceed, or fall short of, when positions are read otherwise: `change[joint · n + column]`.
    /// A joint that rests as it was recorded tells no size.
    pub(crate) fn of_positions(&self, change: &[f64]) -> f64 {
        let [low, high] = RANGES;
        let moving = change.chunks_exact(self.range.len()).filter_map(|row| {
            let column = row.iter().position(|by| *by != 0.0)?;
            let recorded = self.range[column];
            (recorded > low).then(|| row[column].abs() * recorded)
        });
        moving
            .map(|range| (low / range).max(range / high).max(1.0).ln())
            .sum()
    }
}
