//! The room a robot takes up: capsules on its links, the ground, and what may touch.

use super::Robot;
use crate::error::Error;
use crate::pose::Pose;
use nalgebra::Vector3;

/// All points within `radius` of the segment between two ends; a ball where they coincide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capsule {
    /// The ends of the axis, m.
    pub ends: [Vector3<f64>; 2],
    /// m.
    pub radius: f64,
}

impl Capsule {
    /// The same body seen from another frame.
    #[must_use]
    pub fn expressed_in(&self, to_from_here: &Pose) -> Self {
        let moved = |p: Vector3<f64>| to_from_here.rotation * p + to_from_here.translation;
        Self {
            ends: self.ends.map(moved),
            radius: self.radius,
        }
    }
}

/// A capsule and what carries it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkCapsule {
    /// Index of the link; `None` for the base.
    pub link: Option<usize>,
    /// In the frame of that link (the base frame).
    pub capsule: Capsule,
}

/// What a motion must not run into.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Shapes {
    /// Bodies of the robot, and obstacles that stand on the base.
    pub capsules: Vec<LinkCapsule>,
    /// Height of the ground, z in the base frame, m.
    pub ground: Option<f64>,
    /// Pairs of links (or `base`, `ground`) that may come as near as they like.
    pub may_touch: Vec<[String; 2]>,
}

impl Robot {
    /// What a motion must not run into; empty where the file says nothing.
    pub fn shapes(&self) -> &Shapes {
        &self.shapes
    }

    /// The same robot with these shapes.
    ///
    /// # Errors
    /// A link that the robot does not have, a radius that is not above zero, a number that is not finite.
    pub fn with_shapes(mut self, shapes: Shapes) -> Result<Self, Error> {
        for c in &shapes.capsules {
            let name = match c.link {
                None => "base".to_owned(),
                Some(link) => {
                    assert!(link < self.n_joints(), "a capsule on link {link}");
                    self.links[link].name.clone()
                }
            };
            let place = || format!("capsule of link {name}");
            let Capsule { ends, radius } = c.capsule;
            if !ends.iter().all(|e| e.iter().all(|v| v.is_finite())) {
                return Err(Error::robot(
                    place(),
                    "an end that is not finite",
                    "give finite coordinates, m",
                ));
            }
            if !(radius > 0.0 && radius.is_finite()) {
                return Err(Error::robot(
                    place(),
                    format!("radius {radius}"),
                    "it must be above zero, m",
                ));
            }
        }
        if let Some(height) = shapes.ground
            && !height.is_finite()
        {
            return Err(Error::robot("ground", format!("{height}"), "give its z, m"));
        }
        self.shapes = shapes;
        Ok(self)
    }

    /// Capsules of a link that becomes part of its parent (`None`: the base) when it is held.
    pub(super) fn pass_capsules_on(
        &mut self,
        held: usize,
        parent: Option<usize>,
        parent_from_link: &Pose,
    ) {
        for c in &mut self.shapes.capsules {
            match c.link {
                Some(link) if link == held => {
                    c.link = parent;
                    c.capsule = c.capsule.expressed_in(parent_from_link);
                }
                Some(link) if link > held => c.link = Some(link - 1),
                _ => {}
            }
        }
    }
}
