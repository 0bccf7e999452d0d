//! How many parameters the motors of known arms can feel, and what the papers call them.
#![allow(clippy::unwrap_used)]

use idim::{KeepOrder, Structure};
use idim_fixtures::{
    CRS_A460, PANDA_URDF, PLANAR2R, PLANAR2R_HORIZONTAL, PUMA3R, PUMA560, PUMA560_URDF, TX40,
    UR5_URDF,
};
use idim_model::{DriveColumns, Robot, robot_from_ron, robot_from_urdf};

fn rigid(robot: &Robot) -> Structure {
    Structure::of_torque(robot, DriveColumns::NONE, KeepOrder::Links)
        .decided()
        .unwrap()
}

fn rank(robot: &Robot) -> usize {
    rigid(robot).reduction.rank()
}

#[test]
fn oracle_known_arms_have_their_number_of_base_parameters() {
    let ron = |text| robot_from_ron(text).unwrap();
    let urdf = |text| robot_from_urdf(text).unwrap();
    assert_eq!(rank(&urdf(UR5_URDF)), 36, "any UR");
    assert_eq!(
        rank(&urdf(PANDA_URDF)),
        43,
        "any 7R with a vertical first axis"
    );
    assert_eq!(
        rank(&urdf(PUMA560_URDF)),
        36,
        "a PUMA with angles of nine digits"
    );
    assert_eq!(rank(&ron(PUMA560)), 36);
    assert_eq!(rank(&ron(TX40)), 36);
    assert_eq!(rank(&ron(PLANAR2R)), 6, "planar 2R, vertical");
    assert_eq!(rank(&ron(PLANAR2R_HORIZONTAL)), 4, "planar 2R, horizontal");
}

#[test]
fn oracle_shared_urdf_files_have_their_number_of_base_parameters() {
    let Some(shared) = idim_fixtures::shared_dir() else {
        eprintln!("skipped: no recorded data (set IDIM_DATA)");
        return;
    };
    for file in ["ur10/ur10.urdf", "staubli-tx40/tx40.urdf"] {
        let text = std::fs::read_to_string(shared.join("data").join(file)).unwrap();
        assert_eq!(rank(&robot_from_urdf(&text).unwrap()), 36, "{file}");
    }
}

/// Gautier & Khalil, papers and closed form: ZZR1 = ZZ1 + YY2 + YY3 + 2 R3 MZ3 + (D3² + R3²) M3, and so on.
#[test]
fn oracle_gautier_khalil_names_and_closed_form_relations() {
    let robot = robot_from_ron(PUMA3R).unwrap();
    let structure = Structure::of_energy(&robot, KeepOrder::Links)
        .decided()
        .unwrap();
    let names = structure.base_names();
    let printed = [
        "ZZR1", "XXR2", "XY2", "XZR2", "YZ2", "ZZR2", "MXR2", "MY2", "XXR3", "XY3", "XZ3", "YZ3",
        "ZZ3", "MX3", "MY3",
    ];
    assert_eq!(names, printed);
    assert_eq!(structure.reduction.unidentifiable.len(), 11);
    let (d3, r3) = (0.5, 0.2);
    let expected: [(usize, &[(&str, f64)]); 6] = [
        (
            0,
            &[
                ("ZZ1", 1.0),
                ("YY2", 1.0),
                ("YY3", 1.0),
                ("MZ3", 2.0 * r3),
                ("M3", d3 * d3 + r3 * r3),
            ],
        ),
        (1, &[("XX2", 1.0), ("YY2", -1.0), ("M3", -d3 * d3)]),
        (3, &[("XZ2", 1.0), ("MZ3", -d3), ("M3", -d3 * r3)]),
        (5, &[("ZZ2", 1.0), ("M3", d3 * d3)]),
        (6, &[("MX2", 1.0), ("M3", d3)]),
        (8, &[("XX3", 1.0), ("YY3", -1.0)]),
    ];
    let all = structure.names();
    for base in 0..15 {
        let alone = [(all[structure.reduction.base[base]].as_str(), 1.0)];
        let terms = expected
            .iter()
            .find(|e| e.0 == base)
            .map_or(&alone[..], |e| e.1);
        for (column, name) in all.iter().enumerate() {
            let wanted = terms.iter().find(|t| t.0 == name).map_or(0.0, |t| t.1);
            let got = structure.reduction.regrouping[(base, column)];
            assert!(
                (got - wanted).abs() < 1e-12,
                "{}: {name} has {got}, wants {wanted}",
                names[base]
            );
        }
    }
}

/// Radkhah, Kulić & Croft, section IV.C: 9, 15 and 36 (and 21 taken literally), with their lists.
#[test]
fn oracle_crs_categories() {
    let robot = robot_from_ron(CRS_A460).unwrap();
    let structure = Structure::of_torque(&robot, DriveColumns::NONE, KeepOrder::MassFirst)
        .decided()
        .unwrap();
    let names = structure.names();
    let pick = |list: &[usize]| {
        list.iter()
            .map(|&k| names[k].as_str())
            .collect::<Vec<_>>()
            .join(" ")
    };
    let r = &structure.reduction;
    assert_eq!(
        pick(&r.unidentifiable),
        "m1 mx1 my1 mz1 Ixx1 Izz1 Ixy1 Ixz1 Iyz1"
    );
    assert_eq!(
        pick(&r.combined),
        "Iyy2 Izz2 Ixz2 m3 my3 Izz3 m4 my4 Izz4 m5 my5 Izz5 m6 mz6 Iyy6"
    );
    assert_eq!((r.identifiable_alone.len(), r.base.len()), (21, 36));
}

#[test]
fn identity_a_held_joint_leaves_the_structure_of_the_shorter_arm() {
    let panda = robot_from_urdf(PANDA_URDF).unwrap();
    let held = panda.lock(6, 0.3);
    assert_eq!(
        rank(&held),
        36,
        "a 7R with its last joint held is a 6R with a vertical first axis"
    );
}
