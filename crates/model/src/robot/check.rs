//! What every robot must satisfy, whichever file it came from.

use super::{Joint, Link, Robot};
use crate::error::Error;
use std::collections::HashSet;

impl Robot {
    pub(super) fn check(&self) -> Result<(), Error> {
        if self.joints.is_empty() {
            return Err(Error::robot(
                &self.name,
                "no moving joint",
                "an arm needs at least one revolute or prismatic joint",
            ));
        }
        assert_eq!(self.joints.len(), self.links.len(), "one link per joint");
        if !self.gravity.iter().all(|g| g.is_finite()) {
            return Err(Error::robot(
                "gravity",
                format!("{:?}", self.gravity.as_slice()),
                "give three finite numbers in m/s², for example (0, 0, -9.81)",
            ));
        }
        let (mut joint_names, mut link_names) = (HashSet::new(), HashSet::new());
        for (i, (joint, link)) in self.joints.iter().zip(&self.links).enumerate() {
            if !joint_names.insert(&joint.name) {
                return Err(Error::robot(
                    format!("joint {}", joint.name),
                    "name used twice",
                    "rename one of them",
                ));
            }
            if !link_names.insert(&link.name) {
                return Err(Error::robot(
                    format!("link {}", link.name),
                    "name used twice",
                    "rename one of them",
                ));
            }
            if joint.parent.is_some_and(|p| p >= i) {
                return Err(Error::robot(
                    format!("joint {}", joint.name),
                    format!("parent link number {:?}", joint.parent.map(|p| p + 1)),
                    "a joint stands after the joint that moves its parent link",
                ));
            }
            joint.check()?;
            link.check()?;
        }
        Ok(())
    }
}

impl Joint {
    pub(crate) fn check(&self) -> Result<(), Error> {
        let place = format!("joint {}", self.name);
        let length = self.axis.norm();
        if !(length.is_finite() && length > 1e-9) {
            return Err(Error::robot(
                place,
                format!("axis {:?}", self.axis.as_slice()),
                "an axis needs a direction, for example (0, 0, 1)",
            ));
        }
        let poses = [&self.parent_from_joint, &self.joint_from_link];
        let finite = poses.iter().all(|p| {
            p.rotation
                .iter()
                .chain(p.translation.iter())
                .all(|v| v.is_finite())
        });
        if !finite || !self.offset.is_finite() {
            return Err(Error::robot(
                place,
                "a pose that is not finite",
                "give finite lengths and angles",
            ));
        }
        if let Some([low, high]) = self.limits.position
            && !(low < high && low.is_finite() && high.is_finite())
        {
            return Err(Error::robot(
                place,
                format!("position limits {low} to {high}"),
                "the lower limit must be below the upper one, both finite",
            ));
        }
        let positive = [
            ("velocity limit", self.limits.velocity),
            ("acceleration limit", self.limits.acceleration),
            ("torque limit", self.limits.torque),
            ("torque constant", self.actuator.torque_constant),
            ("encoder counts", self.actuator.encoder_counts),
        ];
        for (what, value) in positive {
            if let Some(v) = value
                && !(v > 0.0 && v.is_finite())
            {
                return Err(Error::robot(
                    place,
                    format!("{what} {v}"),
                    "it must be above zero; leave it out if not known",
                ));
            }
        }
        let not_negative = [
            ("rotor inertia", self.actuator.rotor_inertia),
            ("viscous friction", self.actuator.viscous_friction),
            ("Coulomb friction", self.actuator.coulomb_friction),
        ];
        for (what, value) in not_negative {
            if let Some(v) = value
                && !(v >= 0.0 && v.is_finite())
            {
                return Err(Error::robot(
                    place,
                    format!("{what} {v}"),
                    "it cannot be below zero",
                ));
            }
        }
        if let Some(v) = self.actuator.zero
            && !v.is_finite()
        {
            return Err(Error::robot(
                place,
                format!("zero {v}"),
                "give a finite number",
            ));
        }
        if let Some(v) = self.actuator.gear_ratio
            && !(v != 0.0 && v.is_finite())
        {
            return Err(Error::robot(
                place,
                format!("gear ratio {v}"),
                "it must be a number other than zero",
            ));
        }
        Ok(())
    }
}

impl Link {
    pub(crate) fn check(&self) -> Result<(), Error> {
        let Some(p) = &self.inertial else {
            return Ok(());
        };
        let place = format!("link {}", self.name);
        if !p.0.iter().all(|v| v.is_finite()) {
            return Err(Error::robot(
                place,
                "an inertial value that is not finite",
                "give finite numbers, or leave the inertial out",
            ));
        }
        if p.mass() < 0.0 {
            return Err(Error::robot(
                place,
                format!("mass {} kg", p.mass()),
                "a mass cannot be below zero; correct it, or leave the inertial out",
            ));
        }
        Ok(())
    }
}
