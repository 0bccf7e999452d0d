//! Capsules of robot files: read, folded, written, refused.
#![allow(clippy::unwrap_used)]

use idim_model::{Capsule, Robot, robot_from_ron, robot_from_urdf, robot_to_ron};
use nalgebra::Vector3;

fn planar(extra: &str, fixed: &str) -> String {
    format!(
        "(
            name: \"arm\", angles: Degrees, gravity: (0, 0, -9.81), {extra}
            joints: Poses([
                (name: \"a\", frame: (axis: (0, 0, 1)), capsules: [(from: (0, 0, 0), to: (0.5, 0, 0), radius: 0.05)]),
                (name: \"b\", frame: (xyz: (0.5, 0, 0), axis: (0, 0, 1))),
                {fixed}
            ]),
        )"
    )
}

const TOOL: &str =
    "(name: \"t\", link: \"tool\", kind: Fixed, frame: (xyz: (0.4, 0, 0), rpy: (0, 0, 90)),
    capsules: [(from: (0, 0, 0), to: (0.1, 0, 0), radius: 0.02)]),";

#[test]
fn identity_capsules_of_fixed_links_move_to_what_carries_them() {
    let robot = robot_from_ron(&planar("ground: -0.5,", TOOL)).unwrap();
    let shapes = robot.shapes();
    assert_eq!(shapes.ground, Some(-0.5));
    assert_eq!(shapes.capsules.len(), 2);
    assert_eq!(shapes.capsules[1].link, Some(1));
    let [from, to] = shapes.capsules[1].capsule.ends;
    assert!((from - Vector3::new(0.4, 0.0, 0.0)).norm() < 1e-15);
    assert!((to - Vector3::new(0.4, 0.1, 0.0)).norm() < 1e-15);
    // A joint that is held passes its body on too: here to the base.
    let held = robot.hold_joints(&[("a".into(), 0.0)]).unwrap();
    let links: Vec<_> = held.shapes().capsules.iter().map(|c| c.link).collect();
    assert_eq!(links, [None, Some(0)]);
}

#[test]
fn identity_shapes_survive_writing_and_reading() {
    let extra = "ground: 0.1, may_touch: [(\"link1\", \"base\")], obstacles: [(from: (1, 0, 0), to: (1, 0, 1), radius: 0.1)],";
    for robot in [
        robot_from_ron(&planar(extra, "")).unwrap(),
        robot_from_ron(idim_fixtures::ARM7).unwrap(),
    ] {
        let back: Robot = robot_from_ron(&robot_to_ron(&robot)).unwrap();
        assert_eq!(back.shapes().ground, robot.shapes().ground);
        assert_eq!(back.shapes().may_touch, robot.shapes().may_touch);
        let sorted = |r: &Robot| {
            let mut all = r.shapes().capsules.clone();
            all.sort_by_key(|c| c.link);
            all
        };
        assert_eq!(sorted(&back), sorted(&robot));
    }
}

#[test]
fn regress_shapes_that_cannot_be_are_refused() {
    let refused = |extra: &str, word: &str| {
        let message = robot_from_ron(&planar(extra, "")).unwrap_err().to_string();
        assert!(message.contains(word), "`{word}` is not in: {message}");
    };
    refused(
        "obstacles: [(from: (0, 0, 0), to: (0, 0, 1), radius: 0)],",
        "radius 0",
    );
    refused("obstacles: [(from: (0, 0, 0), to: (0, 0, 1))],", "radius");
    refused("may_touch: [(\"lnk1\", \"link2\")],", "link1");
    refused("ground: NaN,", "finite");
}

/// Every corner and rim of a collision shape lies inside its capsule, some of them on its surface.
#[test]
fn oracle_collision_shapes_of_a_urdf_are_enclosed() {
    let urdf = "<robot name='r'>
        <link name='root'><collision><geometry><sphere radius='0.2'/></geometry></collision></link>
        <link name='a'>
            <collision><origin xyz='0 0 0.1' rpy='0 1.5707963267948966 0'/><geometry><cylinder radius='0.05' length='0.3'/></geometry></collision>
            <collision><geometry><box size='0.1 0.6 0.2'/></geometry></collision>
            <collision><geometry><mesh filename='a.stl'/></geometry></collision>
        </link>
        <joint name='j' type='revolute'><parent link='root'/><child link='a'/><axis xyz='0 0 1'/>
            <limit lower='-1' upper='1' velocity='1' effort='1'/></joint>
    </robot>";
    let robot = robot_from_urdf(urdf).unwrap();
    let all = &robot.shapes().capsules;
    assert_eq!(
        all.iter().map(|c| c.link).collect::<Vec<_>>(),
        [None, Some(0), Some(0)]
    );
    assert!(
        robot
            .notes()
            .iter()
            .any(|n| n.contains("meshes") && n.contains('a'))
    );
    let depth = |c: &Capsule, p: Vector3<f64>| {
        let [a, b] = c.ends;
        let along = (b - a).norm_squared();
        let t = if along > 0.0 {
            ((p - a).dot(&(b - a)) / along).clamp(0.0, 1.0)
        } else {
            0.0
        };
        c.radius - (p - a - (b - a) * t).norm()
    };
    assert_eq!(all[0].capsule.radius, 0.2);
    // The cylinder lies along x now.
    for (y, z) in [(0.05, 0.1), (0.0, 0.15), (0.03, 0.14)] {
        for x in [-0.15, 0.0, 0.15] {
            assert!(depth(&all[1].capsule, Vector3::new(x, y, z)).abs() < 1e-12);
        }
    }
    for x in [-0.05, 0.05] {
        for y in [-0.3, 0.3] {
            for z in [-0.1, 0.1] {
                assert!(depth(&all[2].capsule, Vector3::new(x, y, z)).abs() < 1e-12);
            }
        }
    }
    let flat = urdf.replace("0.1 0.6 0.2", "0.1 0 0.2");
    assert!(
        robot_from_urdf(&flat)
            .unwrap_err()
            .to_string()
            .contains("sides")
    );
}
