//! The model of an arm with a coupled wrist, a spring, a counterbalance and chosen friction, for other programs.
#![allow(clippy::unwrap_used)]

use idim::export::{Source, complete, exports};
use idim::{
    EstimationOptions, FrictionTerm, Identification, IdentifyOptions, LoadedRobot, SamplingOptions,
    identify, parse_friction,
};
use idim_measurement::Measurements;
use idim_model::{
    DriveColumns, JointStates, Model, Robot, inverse_dynamics_batch, random_states, robot_from_ron,
    robot_from_urdf,
};
use nalgebra::DMatrix;
use std::fmt::Write as _;
use std::process::Command;

/// Motor 4 also turns with joint 3, as in a coupled wrist; joint 2 has a spring by table, joint 3 a torque by formula.
const ARM: &str = r#"(
    name: "coupled arm", angles: Radians, gravity: (0, 0, -9.81),
    joints: ModifiedDh([
        (name: "j1", frame: (r: 0.3), actuator: (gear_ratio: 100, rotor_inertia: 5e-5),
         inertial: CentreOfMass(mass: 8, centre: (0.01, -0.02, -0.1), inertia: (xx: 0.1, yy: 0.11, zz: 0.05))),
        (name: "j2", frame: (alpha: -1.5707963267948966, d: 0.05), actuator: (gear_ratio: 120, rotor_inertia: 4e-5),
         inertial: CentreOfMass(mass: 6, centre: (0.2, 0.01, 0.05), inertia: (xx: 0.03, yy: 0.2, zz: 0.19))),
        (name: "j3", frame: (d: 0.4), actuator: (gear_ratio: 90, rotor_inertia: 2e-5),
         inertial: CentreOfMass(mass: 3, centre: (0.02, 0.08, 0.01), inertia: (xx: 0.03, yy: 0.01, zz: 0.03))),
        (name: "j4", frame: (alpha: -1.5707963267948966, r: 0.3), capsules: [(from: (0, 0, 0), to: (0, 0, 0.1), radius: 0.04)],
         actuator: (gear_ratio: 50, rotor_inertia: 3e-5, coupled: {"j3": 50}),
         inertial: CentreOfMass(mass: 1.2, centre: (0.04, 0.01, 0.06), inertia: (xx: 0.006, yy: 0.007, zz: 0.003))),
    ]),
    known_torques: [
        (name: "spring", joint: "j2", table: [(-2, 30), (-0.5, 5), (0.5, -4), (2, -25)]),
        (name: "balance", joint: "j3", with: [("arm", "0.1 + 0.02 * cos(2 * q)")], formula: "40 * arm * sin(2 * q) / sqrt(1 + arm^2)"),
    ],
)"#;

/// What the described torques are in truth.
const SCALES: [f64; 2] = [1.3, 0.8];
/// Viscous and Coulomb friction of the joints and, last, of motor 4.
const FRICTION: [[f64; 2]; 5] = [[3.0, 4.0], [4.0, 5.0], [2.0, 2.5], [0.5, 0.8], [0.4, 0.6]];
/// Speeds of the Coulomb torque's reversal: of the joints, of motors.
const REVERSAL: [f64; 2] = [0.02, 0.01];
const SAMPLES: usize = 3000;

fn states(robot: &Robot) -> JointStates {
    random_states(robot, SAMPLES, 5)
}

/// Torques of the arm: bodies, rotors through the transmission, friction, springs, and a ripple that nothing explains.
fn torque(robot: &Robot, states: &JointStates) -> Vec<Vec<f64>> {
    let bodies = robot.standard_parameters().unwrap();
    let rigid = inverse_dynamics_batch(&Model::new(robot), &bodies, states);
    let t = robot.transmission().unwrap();
    let rotor = DMatrix::from_fn(4, 4, |i, j| {
        let own = robot.joints()[i].actuator.rotor_inertia.unwrap();
        if i == j { own } else { 0.0 }
    });
    let rotors = t.transpose() * rotor * &t;
    let sign = |v: f64, over: f64| (v / over).tanh();
    (0..4)
        .map(|j| {
            (0..SAMPLES)
                .map(|k| {
                    let (q, qd) = (states.q(j)[k], states.qd(j)[k]);
                    let rotor: f64 = (0..4).map(|i| rotors[(j, i)] * states.qdd(i)[k]).sum();
                    let [viscous, coulomb] = FRICTION[j];
                    let mut sum = rigid[j * SAMPLES + k] + rotor;
                    sum += viscous * qd + coulomb * sign(qd, REVERSAL[0]);
                    if j >= 2 {
                        let turned = states.qd(2)[k] + states.qd(3)[k];
                        sum += FRICTION[4][0] * turned + FRICTION[4][1] * sign(turned, REVERSAL[1]);
                    }
                    for (known, scale) in robot.drives().known_torques.iter().zip(SCALES) {
                        if known.joint() == j {
                            sum += scale * known.at(q);
                        }
                    }
                    sum += [
                        0.0,
                        1.5 * sign(qd, REVERSAL[0]) * (-(qd / 0.4).powi(2)).exp(),
                        0.0,
                        0.0,
                    ][j];
                    sum + 0.05 * ((k * (j + 3)) as f64 * 1.618).sin()
                })
                .collect()
        })
        .collect()
}

/// The arm identified from a log of its own; friction as given.
fn identified(friction: &[&str]) -> (Robot, Identification) {
    let robot = robot_from_ron(ARM).unwrap();
    let states = states(&robot);
    let series = |of: fn(&JointStates, usize) -> &[f64]| {
        (0..4).map(|j| of(&states, j).to_vec()).collect::<Vec<_>>()
    };
    let log = Measurements {
        file: "simulated".into(),
        joints: robot.joints().iter().map(|j| j.name.clone()).collect(),
        time: (0..SAMPLES).map(|k| 0.01 * k as f64).collect(),
        q: series(JointStates::q),
        qd: Some(series(JointStates::qd)),
        qdd: Some(series(JointStates::qdd)),
        torque: torque(&robot, &states),
    };
    let loaded = LoadedRobot {
        described: robot.clone(),
        robot: robot.clone(),
    };
    let friction: Vec<String> = friction.iter().map(|f| (*f).to_owned()).collect();
    let options = IdentifyOptions {
        columns: DriveColumns::ALL,
        friction: parse_friction(&friction).unwrap(),
        sampling: SamplingOptions {
            as_recorded: true,
            ..SamplingOptions::default()
        },
        estimation: EstimationOptions::default(),
        seed: 1,
    };
    let found = identify(&loaded, vec![log], Vec::new(), &options).unwrap();
    (robot, found)
}

const TRUE_FRICTION: [&str; 2] = [
    "viscous,coulomb,offset,tanh:0.02",
    "j2=viscous,coulomb,offset,stribeck:0.4,tanh:0.02",
];

fn text<'a>(files: &'a [(String, String)], name: &str) -> &'a str {
    let found = files.iter().find(|f| f.0 == name);
    &found.unwrap_or_else(|| panic!("no {name}")).1
}

#[test]
fn identity_the_exported_predictor_predicts_what_the_identification_did() {
    // Load-dependent friction needs the bodies of the fit before beside those identified.
    let (robot, found) = identified(&[
        "viscous,coulomb,offset,tanh:0.02",
        "j2=viscous,coulomb,stribeck:0.4,load,cubic,tanh:0.02",
        "j3=viscous,coulomb,asymmetric,root,tanh:0.05",
    ]);
    let has = |term: FrictionTerm| {
        let own = |e: &idim::ExtraColumn| matches!(e, idim::ExtraColumn::Friction { term: t, .. } if *t == term);
        found.columns.extra.iter().any(own)
    };
    assert!(has(FrictionTerm::Load) && has(FrictionTerm::Root));
    let files = exports(&found, &robot);
    let folder = tempfile::tempdir().unwrap();
    let source = text(&files, "model/predictor.c");
    std::fs::write(folder.path().join("predictor.c"), source).unwrap();
    let states = states(&robot);
    let rows: Vec<String> = (0..200)
        .map(|k| {
            let s = states.state(k);
            let all = [s.q, s.qd, s.qdd].concat();
            let words: Vec<String> = all.iter().map(|v| format!("{v:?}")).collect();
            format!("{{{}}},", words.join(","))
        })
        .collect();
    let mut main = String::from("#include <stdio.h>\n#include \"predictor.c\"\n");
    let _ = write!(
        main,
        "static const double s[200][12] = {{{}}};\nint main(void) {{ for (int k = 0; k < 200; k++) {{ double t[4]; idim_torque(s[k], s[k] + 4, s[k] + 8, t); printf(\"%.17g %.17g %.17g %.17g\\n\", t[0], t[1], t[2], t[3]); }} return 0; }}",
        rows.concat()
    );
    std::fs::write(folder.path().join("main.c"), main).unwrap();
    let built = Command::new("cc")
        .args([
            "-std=c99", "-Wall", "-Wextra", "-Werror", "main.c", "-o", "predict", "-lm",
        ])
        .current_dir(folder.path())
        .status();
    let Ok(built) = built else {
        eprintln!("skipped: no cc here, so nobody compiles the predictor");
        return;
    };
    assert!(built.success());
    let ran = Command::new(folder.path().join("predict"))
        .output()
        .unwrap();
    let printed = String::from_utf8(ran.stdout).unwrap();
    let predicted = &found.predictions[0].predicted;
    let largest = predicted
        .iter()
        .flatten()
        .fold(0.0_f64, |a, v| a.max(v.abs()));
    assert_eq!(printed.lines().count(), 200);
    for (k, line) in printed.lines().enumerate() {
        for (j, word) in line.split_whitespace().enumerate() {
            let (a, b) = (word.parse::<f64>().unwrap(), predicted[j][k]);
            assert!((a - b).abs() <= 1e-12 * largest, "{a} instead of {b}");
        }
    }
}

#[test]
fn identity_a_completed_coupled_arm_reads_back_as_the_arm() {
    let (robot, found) = identified(&TRUE_FRICTION);
    let completion = complete(&found, &robot).unwrap();
    assert_eq!(completion.widened, 1.0);
    let files = exports(&found, &robot);
    let back = robot_from_ron(text(&files, "model/robot.ron")).unwrap();
    assert_eq!(back.drives().couplings, robot.drives().couplings);
    assert_eq!(back.shapes(), robot.shapes());
    // Known torques carry their scales.
    let known = robot.drives().known_torques.iter().zip(SCALES);
    for (described, scale) in known {
        let all = &back.drives().known_torques;
        let own = all.iter().find(|k| k.name() == described.name()).unwrap();
        for q in [-1.2, 0.3, 0.9] {
            let (a, b) = (own.at(q), scale * described.at(q));
            assert!(
                (a - b).abs() < 0.02 * described.at(1.0).abs(),
                "{a} for {b}"
            );
        }
    }
    // Bodies and rotors: the torques of the true arm but for the ripple, in both files.
    let rigid = |r: &Robot| {
        let bodies = r.standard_parameters().unwrap();
        inverse_dynamics_batch(&Model::new(r), &bodies, &states(&robot))
    };
    let urdf = robot_from_urdf(text(&files, "model/robot.urdf")).unwrap();
    let (truth, a, b) = (rigid(&robot), rigid(&back), rigid(&urdf));
    let largest = truth.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for k in 0..truth.len() {
        assert!((a[k] - b[k]).abs() < 1e-9 * largest);
        assert!((a[k] - truth[k]).abs() < 0.02 * largest);
    }
    for (j, (found, true_joint)) in back.joints().iter().zip(robot.joints()).enumerate() {
        let (found, truth) = (found.actuator, true_joint.actuator);
        let viscous = found.viscous_friction.unwrap();
        assert!((viscous - FRICTION[j][0]).abs() < 0.1, "{viscous}");
        // Joints 1 and 2 share their rotor's inertia with the links about the same axis.
        if j >= 2 {
            let ratio = found.rotor_inertia.unwrap() / truth.rotor_inertia.unwrap();
            assert!((ratio - 1.0).abs() < 0.1, "rotor {j}: {ratio}");
        }
    }
}

#[test]
fn regress_the_parameters_say_what_the_further_columns_are() {
    let (robot, found) = identified(&TRUE_FRICTION);
    let files = exports(&found, &robot);
    // Long texts are folded over lines.
    let folded = text(&files, "model/parameters.yaml").split_whitespace();
    let yaml = folded.collect::<Vec<_>>().join(" ");
    for words in [
        "extra_parameters:",
        "name: IaM4",
        "name: FvM4",
        "Coulomb friction of the motor of j4, which turns with j3 and j4",
        "name: Fs2",
        "v = 0.4 rad/s (Stribeck)",
        "name: spring",
        "unit: N·m·s/rad",
        "source: combination",
        "source: data",
    ] {
        assert!(yaml.contains(words), "`{words}` is not in {yaml}");
    }
    let completion = complete(&found, &robot).unwrap();
    let spring = completion.extra.iter().find(|e| e.0.name() == "spring");
    assert!(
        matches!(spring, Some((_, scale, Source::Data)) if (scale / SCALES[0] - 1.0).abs() < 0.02)
    );
    // What a robot file cannot hold stands beside it.
    for name in ["model/robot.ron", "model/robot.urdf"] {
        assert!(text(&files, name).contains("FcM4 "), "{name}");
    }
}
