//! What a motion may do: position, velocity and acceleration of each joint.

use crate::error::Error;
use idim_model::Robot;

/// Limits of every joint: rad, rad/s, rad/s² (m for prismatic).
///
/// The points of a path and the path itself may have different limits: they are two values of this type.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Lowest and highest position.
    pub position: Vec<[f64; 2]>,
    /// Largest speed.
    pub velocity: Vec<f64>,
    /// Largest acceleration.
    pub acceleration: Vec<f64>,
}

impl Limits {
    /// Checks and keeps limits, one entry a joint.
    ///
    /// # Errors
    /// Lists of different lengths, a lowest position not below the highest, a speed or acceleration that is not
    /// above zero, a number that is not finite.
    pub fn new(
        position: Vec<[f64; 2]>,
        velocity: Vec<f64>,
        acceleration: Vec<f64>,
    ) -> Result<Self, Error> {
        let lengths = [position.len(), velocity.len(), acceleration.len()];
        if lengths[0] == 0 || lengths != [lengths[0]; 3] {
            return Err(Error::Limit {
                place: "limits".into(),
                met: format!(
                    "{} position, {} velocity, {} acceleration limits",
                    lengths[0], lengths[1], lengths[2]
                ),
                rule: "give one of each for every joint",
            });
        }
        for (j, &[low, high]) in position.iter().enumerate() {
            if !(low < high && low.is_finite() && high.is_finite()) {
                return Err(Error::Limit {
                    place: format!("joint {}", j + 1),
                    met: format!("position limits {low} to {high}"),
                    rule: "give two finite numbers, the lower one first",
                });
            }
        }
        for (what, values) in [("velocity", &velocity), ("acceleration", &acceleration)] {
            for (j, &v) in values.iter().enumerate() {
                if !(v > 0.0 && v.is_finite()) {
                    return Err(Error::Limit {
                        place: format!("joint {}", j + 1),
                        met: format!("{what} limit {v}"),
                        rule: "it must be finite and above zero",
                    });
                }
            }
        }
        Ok(Self {
            position,
            velocity,
            acceleration,
        })
    }

    /// The limits of a robot's description.
    ///
    /// # Errors
    /// A joint without a position, velocity or acceleration limit: there is no safe default for any of them.
    pub fn from_robot(robot: &Robot) -> Result<Self, Error> {
        let mut limits = Self {
            position: Vec::new(),
            velocity: Vec::new(),
            acceleration: Vec::new(),
        };
        for joint in robot.joints() {
            let missing = |limit| Error::MissingLimit {
                joint: joint.name.clone(),
                limit,
            };
            let stated = &joint.limits;
            limits
                .position
                .push(stated.position.ok_or_else(|| missing("position"))?);
            limits
                .velocity
                .push(stated.velocity.ok_or_else(|| missing("velocity"))?);
            limits
                .acceleration
                .push(stated.acceleration.ok_or_else(|| missing("acceleration"))?);
        }
        Self::new(limits.position, limits.velocity, limits.acceleration)
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.velocity.len()
    }

    /// Middle of the position range of a joint, rad.
    pub fn centre(&self, joint: usize) -> f64 {
        let [low, high] = self.position[joint];
        f64::midpoint(low, high)
    }

    /// Half of the position range of a joint, rad.
    pub fn half_range(&self, joint: usize) -> f64 {
        let [low, high] = self.position[joint];
        0.5 * (high - low)
    }

    /// The same limits times these fractions; positions shrink about the centre of their range.
    ///
    /// Gautier & Khalil 1991, section 5: points within smaller limits keep the path between them inside the full ones.
    ///
    /// # Panics
    /// If a fraction is not finite and above zero.
    #[must_use]
    #[track_caller]
    pub fn scaled(&self, position: f64, velocity: f64, acceleration: f64) -> Self {
        for fraction in [position, velocity, acceleration] {
            assert!(
                fraction > 0.0 && fraction.is_finite(),
                "fraction {fraction} is not above zero"
            );
        }
        let position = (0..self.n_joints())
            .map(|j| {
                let half = position * self.half_range(j);
                [self.centre(j) - half, self.centre(j) + half]
            })
            .collect();
        Self {
            position,
            velocity: self.velocity.iter().map(|v| velocity * v).collect(),
            acceleration: self.acceleration.iter().map(|a| acceleration * a).collect(),
        }
    }
}
