//! Limits, drives and inertial values between the file and the robot, both ways.

use super::format::{self, AngleUnit, Drive, Inertial, Limits, Number, Tensor};
use super::frames::radians;
use crate::parameter::InertialParameters;
use crate::robot::{Actuator, Capsule, JointKind, JointLimits};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

/// Angles of a revolute joint in the file's unit, lengths of a prismatic one in metres.
pub(super) fn limits(limits: Option<&Limits>, kind: JointKind, unit: AngleUnit) -> JointLimits {
    let Some(limits) = limits else {
        return JointLimits::default();
    };
    let coordinate = |v: Number| match kind {
        JointKind::Revolute => radians(unit, v.0),
        JointKind::Prismatic => v.0,
    };
    JointLimits {
        position: limits.position.map(|p| p.map(coordinate)),
        velocity: limits.velocity.map(coordinate),
        acceleration: limits.acceleration.map(coordinate),
        torque: limits.torque.map(f64::from),
    }
}

pub(super) fn actuator(drive: Option<&Drive>, kind: JointKind, unit: AngleUnit) -> Actuator {
    let Some(drive) = drive else {
        return Actuator::default();
    };
    Actuator {
        gear_ratio: drive.gear_ratio.map(f64::from),
        torque_constant: drive.torque_constant.map(f64::from),
        rotor_inertia: drive.rotor_inertia.map(f64::from),
        encoder_counts: drive.encoder_counts.map(f64::from),
        zero: drive.zero.map(|v| match kind {
            JointKind::Revolute => radians(unit, v.0),
            JointKind::Prismatic => v.0,
        }),
        viscous_friction: drive.viscous_friction.map(f64::from),
        coulomb_friction: drive.coulomb_friction.map(f64::from),
    }
}

pub(super) fn inertial(inertial: &Inertial) -> InertialParameters {
    match inertial {
        Inertial::CentreOfMass {
            mass,
            centre,
            inertia,
        } => {
            let Tensor {
                xx,
                yy,
                zz,
                xy,
                xz,
                yz,
            } = inertia;
            let [xx, xy, xz, yy, yz, zz] = [xx, xy, xz, yy, yz, zz].map(|v| v.0);
            let about_centre = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
            let centre = Vector3::from(centre.map(f64::from));
            InertialParameters::from_centre_of_mass(mass.0, centre, &about_centre)
        }
        Inertial::Standard {
            xx,
            xy,
            xz,
            yy,
            yz,
            zz,
            mx,
            my,
            mz,
            m,
        } => InertialParameters([xx, xy, xz, yy, yz, zz, mx, my, mz, m].map(|v| v.0)),
    }
}

pub(super) fn capsules(capsules: &[format::Capsule]) -> Vec<Capsule> {
    let point = |p: [Number; 3]| Vector3::from(p.map(f64::from));
    let capsule = |c: &format::Capsule| Capsule {
        ends: [point(c.from), point(c.to)],
        radius: c.radius.0,
    };
    capsules.iter().map(capsule).collect()
}

pub(super) fn capsule_to_file(capsule: &Capsule) -> format::Capsule {
    let [from, to] = capsule.ends.map(|e| [e.x, e.y, e.z].map(Number));
    format::Capsule {
        from,
        to,
        radius: Number(capsule.radius),
    }
}

/// The way back, in radians; `None` where nothing is stated.
pub(super) fn limits_to_file(limits: &JointLimits) -> Option<Limits> {
    let stated = *limits != JointLimits::default();
    stated.then(|| Limits {
        position: limits.position.map(|p| p.map(Number)),
        velocity: limits.velocity.map(Number),
        acceleration: limits.acceleration.map(Number),
        torque: limits.torque.map(Number),
    })
}

pub(super) fn actuator_to_file(
    actuator: &Actuator,
    coupled: BTreeMap<String, Number>,
) -> Option<Drive> {
    let stated = *actuator != Actuator::default() || !coupled.is_empty();
    stated.then(|| Drive {
        gear_ratio: actuator.gear_ratio.map(Number),
        torque_constant: actuator.torque_constant.map(Number),
        rotor_inertia: actuator.rotor_inertia.map(Number),
        encoder_counts: actuator.encoder_counts.map(Number),
        zero: actuator.zero.map(Number),
        coupled,
        viscous_friction: actuator.viscous_friction.map(Number),
        coulomb_friction: actuator.coulomb_friction.map(Number),
    })
}

pub(super) fn inertial_to_file(parameters: &InertialParameters) -> Inertial {
    let [xx, xy, xz, yy, yz, zz, mx, my, mz, m] = parameters.0.map(Number);
    Inertial::Standard {
        xx,
        xy,
        xz,
        yy,
        yz,
        zz,
        mx,
        my,
        mz,
        m,
    }
}
