//! A robot as RON text.

use super::drives::{coupled_to_file, known_to_file, log_to_file};
use super::format::{AngleUnit, Entry, File, Joints, Kind, Number, PoseFrame};
use super::values::{actuator_to_file, capsule_to_file, inertial_to_file, limits_to_file};
use crate::pose::Pose;
use crate::robot::{Joint, JointKind, Link, Robot};
use nalgebra::Matrix3;
use ron::extensions::Extensions;
use ron::ser::PrettyConfig;

/// The robot as the text of a RON robot file, as general poses in radians.
///
/// `robot_from_ron(&robot_to_ron(&robot))` is the same robot to rounding: rotations pass through roll, pitch and yaw.
/// Inertial values are written about the origin of the link's frame; [`Robot::notes`] are not written.
pub fn robot_to_ron(robot: &Robot) -> String {
    let capsules_of = |link: Option<usize>| -> Vec<_> {
        let all = robot.shapes().capsules.iter();
        let own = all.filter(|c| c.link == link);
        own.map(|c| capsule_to_file(&c.capsule)).collect()
    };
    let entries = robot
        .joints()
        .iter()
        .zip(robot.links())
        .enumerate()
        .map(|(i, (joint, link))| Entry {
            capsules: capsules_of(Some(i)),
            ..entry(robot, i, joint, link)
        })
        .collect();
    let pairs = robot.shapes().may_touch.iter();
    let file = File {
        name: robot.name().to_owned(),
        about: None,
        angles: AngleUnit::Radians,
        gravity: robot
            .gravity()
            .as_slice()
            .try_into()
            .map_or([Number(0.0); 3], |g: [f64; 3]| g.map(Number)),
        base: None,
        log: log_to_file(robot.drives()),
        known_torques: known_to_file(robot),
        ground: robot.shapes().ground.map(Number),
        obstacles: capsules_of(None),
        may_touch: pairs.cloned().map(<(String, String)>::from).collect(),
        joints: Joints::Poses(entries),
    };
    let layout = PrettyConfig::new().struct_names(false).depth_limit(3);
    let options = ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
    let text = options.to_string_pretty(&file, layout);
    text.expect("plain structs of numbers and strings have a RON form")
}

fn entry(robot: &Robot, index: usize, joint: &Joint, link: &Link) -> Entry<PoseFrame> {
    // The base has the reserved name; a link of that name is found first.
    let parent = joint.parent.map_or_else(
        || super::BASE.to_owned(),
        |parent| robot.joints()[parent].name.clone(),
    );
    let (xyz, rpy) = xyz_rpy(&joint.parent_from_joint);
    let (link_xyz, link_rpy) = xyz_rpy(&joint.joint_from_link);
    Entry {
        name: joint.name.clone(),
        link: Some(link.name.clone()),
        parent: Some(parent),
        kind: match joint.kind {
            JointKind::Revolute => Kind::Revolute,
            JointKind::Prismatic => Kind::Prismatic,
        },
        frame: PoseFrame {
            xyz,
            rpy,
            axis: Some([joint.axis.x, joint.axis.y, joint.axis.z].map(Number)),
            offset: Number(joint.offset),
            link_xyz,
            link_rpy,
        },
        limits: limits_to_file(&joint.limits),
        actuator: actuator_to_file(&joint.actuator, coupled_to_file(robot, index)),
        inertial: link.inertial.as_ref().map(inertial_to_file),
        capsules: Vec::new(),
    }
}

fn xyz_rpy(pose: &Pose) -> ([Number; 3], [Number; 3]) {
    let t = pose.translation;
    (
        [t.x, t.y, t.z].map(Number),
        roll_pitch_yaw(&pose.rotation).map(Number),
    )
}

/// Angles of `Rz(yaw) Ry(pitch) Rx(roll)`, rad; roll is zero where pitch is ±π/2 and only their sum is defined.
fn roll_pitch_yaw(r: &Matrix3<f64>) -> [f64; 3] {
    let cos_pitch = r[(0, 0)].hypot(r[(1, 0)]);
    let pitch = (-r[(2, 0)]).atan2(cos_pitch);
    // Below this both sines and cosines of roll and yaw are rounding.
    if cos_pitch < 1e-12 {
        return [0.0, pitch, (-r[(0, 1)]).atan2(r[(1, 1)])];
    }
    let roll = r[(2, 1)].atan2(r[(2, 2)]);
    let yaw = r[(1, 0)].atan2(r[(0, 0)]);
    // Without the signs of zeros.
    [roll + 0.0, pitch + 0.0, yaw + 0.0]
}

#[cfg(test)]
mod tests {
    use super::roll_pitch_yaw;
    use crate::pose::Pose;
    use proptest::prelude::{prop_assert, proptest};

    proptest! {
        #[test]
        fn identity_rotation_survives_roll_pitch_yaw(
            roll in -3.0..3.0_f64, pitch in -3.0..3.0_f64, yaw in -3.0..3.0_f64,
        ) {
            let rotation = Pose::from_xyz_rpy([0.0; 3], [roll, pitch, yaw]).rotation;
            let back = Pose::from_xyz_rpy([0.0; 3], roll_pitch_yaw(&rotation)).rotation;
            prop_assert!((back - rotation).amax() < 1e-14);
        }
    }

    #[test]
    fn identity_right_angles_survive_exactly() {
        use std::f64::consts::{FRAC_PI_2, PI};
        let angles = [0.0, FRAC_PI_2, -FRAC_PI_2, PI];
        for roll in angles {
            for pitch in angles {
                for yaw in angles {
                    let rotation = Pose::from_xyz_rpy([0.0; 3], [roll, pitch, yaw]).rotation;
                    let back = Pose::from_xyz_rpy([0.0; 3], roll_pitch_yaw(&rotation)).rotation;
                    assert_eq!(back, rotation, "{roll} {pitch} {yaw}");
                }
            }
        }
    }
}
