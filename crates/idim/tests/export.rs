//! What others get of a model: predictors that predict the same, robots that move the same, values that say where they are from.
#![allow(clippy::unwrap_used)]

use idim::export::{Source, complete, exports};
use idim::predictor::{PredictedModel, predictor_c, predictor_rust};
use idim::{Identification, IdentifyOptions, LoadedRobot, identify};
use idim_measurement::Measurements;
use idim_model::{
    Columns, DriveColumns, JointStates, Model, ParameterKind, Robot, inverse_dynamics_batch,
    observation_matrix, random_states, robot_from_ron, robot_from_urdf,
};
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

/// A bench with everything a robot file can have: sliding joints, distal frames, a branch, offsets, a tilted base.
const BENCH: &str = r#"(
    name: "bench", angles: Radians, gravity: (0.5, -1, -9.6), base: (xyz: (0, 0.1, 0.3), rpy: (0.2, 0.1, -0.3)),
    joints: Poses([
        (name: "a", frame: (xyz: (0.1, 0, 0.2), rpy: (0.3, 0, 0.5), axis: (0, 0.6, 0.8), offset: 0.4)),
        (name: "b", kind: Prismatic, frame: (xyz: (0, 0.2, 0), rpy: (0, 1, 0), axis: (1, 0, 0), offset: 0.1, link_xyz: (0.1, 0.2, 0), link_rpy: (1, 0, 0.2))),
        (name: "c", frame: (xyz: (0.3, 0, 0), rpy: (1, 0.4, 0), axis: (0, 0, 1), link_xyz: (0.2, 0, 0.1), link_rpy: (0, 0.7, 0))),
        (name: "d", parent: "b", frame: (xyz: (0, 0, 0.3), rpy: (0, 0, 1), axis: (0.8, 0, 0.6), offset: -0.3, link_xyz: (0, 0.1, 0))),
    ]),
)"#;

/// Coulomb torques change sign over these speeds.
const REVERSAL: [f64; 4] = [0.05, 0.005, 0.0, 0.3];
/// Agreement asked for, beside the largest torque.
const TOLERANCE: f64 = 1e-12;

/// Torques by the regressor, which shares no code with the predictors.
fn by_regressor(
    robot: &Robot,
    columns: &Columns,
    values: &[f64],
    states: &JointStates,
) -> Vec<Vec<f64>> {
    let w = observation_matrix(&Model::new(robot), columns, states);
    let n = robot.n_joints();
    (0..states.n_samples())
        .map(|k| {
            let torque = |j: usize| {
                let entry = |(c, p): (usize, &idim_model::Parameter)| match p.kind {
                    ParameterKind::Fc if p.index == j && REVERSAL[j] > 0.0 => {
                        (states.qd(j)[k] / REVERSAL[j]).tanh()
                    }
                    _ => w[(k * n + j, c)],
                };
                columns
                    .0
                    .iter()
                    .enumerate()
                    .zip(values)
                    .map(|(c, v)| entry(c) * v)
                    .sum()
            };
            (0..n).map(torque).collect()
        })
        .collect()
}

struct Question {
    robot: Robot,
    columns: Columns,
    values: Vec<f64>,
    states: JointStates,
}

fn question() -> Question {
    let robot = robot_from_ron(BENCH).unwrap();
    let columns = Columns::standard(4, DriveColumns::ALL);
    let values = (0..columns.len())
        .map(|k| (1.7 * k as f64).sin() + 0.1)
        .collect();
    let states = random_states(&robot, 50, 7);
    Question {
        robot,
        columns,
        values,
        states,
    }
}

impl Question {
    fn model(&self) -> PredictedModel<'_> {
        PredictedModel {
            robot: &self.robot,
            columns: &self.columns,
            values: &self.values,
            reversal: &REVERSAL,
        }
    }

    /// The states as initialisers, `open` and `close` standing for the brackets of the language.
    fn rows(&self, open: char, close: char) -> String {
        let mut text = String::new();
        for k in 0..self.states.n_samples() {
            let s = self.states.state(k);
            let row = |v: &[f64]| {
                v.iter()
                    .map(|x| format!("{x:?}"))
                    .collect::<Vec<_>>()
                    .join(", ")
            };
            let _ = writeln!(
                text,
                "{open}{open}{}{close}, {open}{}{close}, {open}{}{close}{close},",
                row(&s.q),
                row(&s.qd),
                row(&s.qdd)
            );
        }
        text
    }

    #[track_caller]
    fn check(&self, printed: &str) {
        let truth = by_regressor(&self.robot, &self.columns, &self.values, &self.states);
        let largest = truth.iter().flatten().fold(0.0_f64, |a, v| a.max(v.abs()));
        let lines: Vec<&str> = printed.lines().collect();
        assert_eq!(lines.len(), truth.len());
        for (line, truth) in lines.iter().zip(&truth) {
            let found: Vec<f64> = line
                .split_whitespace()
                .map(|w| w.parse().unwrap())
                .collect();
            assert_eq!(found.len(), truth.len());
            for (a, b) in found.iter().zip(truth) {
                assert!((a - b).abs() <= TOLERANCE * largest, "{a} instead of {b}");
            }
        }
    }
}

/// Compiles and runs; `None` where the compiler is not there.
fn compiled(folder: &Path, compiler: &str, arguments: &[&str]) -> Option<String> {
    let built = Command::new(compiler)
        .args(arguments)
        .current_dir(folder)
        .output();
    let Ok(built) = built else {
        eprintln!("skipped: no {compiler} here, so nobody compiles the predictor");
        return None;
    };
    assert!(
        built.status.success(),
        "{}",
        String::from_utf8_lossy(&built.stderr)
    );
    assert!(
        built.stderr.is_empty(),
        "warnings: {}",
        String::from_utf8_lossy(&built.stderr)
    );
    let ran = Command::new(folder.join("predict")).output().unwrap();
    assert!(ran.status.success());
    Some(String::from_utf8(ran.stdout).unwrap())
}

#[test]
fn identity_the_rust_predictor_is_the_model() {
    let (q, folder) = (question(), tempfile::tempdir().unwrap());
    std::fs::write(
        folder.path().join("predictor.rs"),
        predictor_rust(&q.model()),
    )
    .unwrap();
    let main = format!(
        "#![forbid(unsafe_code)]\nmod predictor;\nconst S: [[[f64; 4]; 3]; 50] = [{}];\nfn main() {{ for s in &S {{ let t = predictor::torque(&s[0], &s[1], &s[2]); println!(\"{{:e}} {{:e}} {{:e}} {{:e}}\", t[0], t[1], t[2], t[3]); }} }}",
        q.rows('[', ']')
    );
    std::fs::write(folder.path().join("main.rs"), main).unwrap();
    if let Some(printed) = compiled(
        folder.path(),
        "rustc",
        &["--edition", "2021", "-O", "main.rs", "-o", "predict"],
    ) {
        q.check(&printed);
    }
}

#[test]
fn identity_the_c_predictor_is_the_model() {
    let (q, folder) = (question(), tempfile::tempdir().unwrap());
    std::fs::write(folder.path().join("predictor.c"), predictor_c(&q.model())).unwrap();
    let main = format!(
        "#include <stdio.h>\nvoid idim_torque(const double q[4], const double qd[4], const double qdd[4], double out[4]);\nstatic const double s[50][3][4] = {{{}}};\nint main(void) {{ for (int k = 0; k < 50; k++) {{ double t[4]; idim_torque(s[k][0], s[k][1], s[k][2], t); printf(\"%.17g %.17g %.17g %.17g\\n\", t[0], t[1], t[2], t[3]); }} return 0; }}",
        q.rows('{', '}')
    );
    std::fs::write(folder.path().join("main.c"), main).unwrap();
    let arguments = [
        "-std=c99",
        "-O2",
        "-Wall",
        "-Wextra",
        "-ffp-contract=off",
        "main.c",
        "predictor.c",
        "-o",
        "predict",
        "-lm",
    ];
    if let Some(printed) = compiled(folder.path(), "cc", &arguments) {
        q.check(&printed);
    }
}

/// The arm of the tutorial, identified from a log of its own with a little noise.
fn tutorial_arm() -> (Robot, Identification) {
    let text = std::fs::read_to_string(
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/tutorials/arm.urdf"),
    )
    .unwrap();
    let robot = robot_from_urdf(&text).unwrap();
    let states = random_states(&robot, 2000, 3);
    let torque = inverse_dynamics_batch(
        &Model::new(&robot),
        &robot.standard_parameters().unwrap(),
        &states,
    );
    let n = states.n_samples();
    let series = |of: fn(&JointStates, usize) -> &[f64]| {
        (0..4).map(|j| of(&states, j).to_vec()).collect::<Vec<_>>()
    };
    let mut torque: Vec<Vec<f64>> = torque.chunks_exact(n).map(<[f64]>::to_vec).collect();
    for (j, t) in torque.iter_mut().enumerate() {
        let a = robot.joints()[j].actuator;
        for (k, t) in t.iter_mut().enumerate() {
            let v = states.qd(j)[k];
            let ripple = 0.3 * ((k * (j + 3)) as f64 * 1.618).sin();
            *t +=
                a.viscous_friction.unwrap() * v + a.coulomb_friction.unwrap() * v.signum() + ripple;
        }
    }
    let log = Measurements {
        file: "simulated".into(),
        joints: robot.joints().iter().map(|j| j.name.clone()).collect(),
        time: (0..n).map(|k| 0.01 * k as f64).collect(),
        q: series(JointStates::q),
        qd: Some(series(JointStates::qd)),
        qdd: Some(series(JointStates::qdd)),
        torque,
    };
    let loaded = LoadedRobot {
        described: robot.clone(),
        robot: robot.clone(),
    };
    let columns = DriveColumns {
        rotor: false,
        ..DriveColumns::ALL
    };
    let options = IdentifyOptions {
        columns,
        sampling: idim::SamplingOptions {
            as_recorded: true,
            ..idim::SamplingOptions::default()
        },
        seed: 1,
        ..IdentifyOptions::default()
    };
    let found = identify(&loaded, vec![log], Vec::new(), &options).unwrap();
    (robot, found)
}

#[test]
fn identity_completed_robots_move_as_the_data_say() {
    let (robot, found) = tutorial_arm();
    let files = exports(&found, &robot);
    let text = |name: &str| &files.iter().find(|f| f.0 == name).unwrap().1;
    let completion = complete(&found, &robot).unwrap();
    assert_eq!(completion.widened, 1.0);
    // The mass of the first link is felt by nobody, the last link's first moment by everybody.
    assert_eq!(
        (completion.sources[0][9], completion.sources[3][6]),
        (Source::Prior, Source::Data)
    );

    let states = random_states(&robot, 40, 11);
    let torque = |robot: &Robot| {
        inverse_dynamics_batch(
            &Model::new(robot),
            &robot.standard_parameters().unwrap(),
            &states,
        )
    };
    let ron = robot_from_ron(text("model/robot.ron")).unwrap();
    let urdf = robot_from_urdf(text("model/robot.urdf")).unwrap();
    let (truth, a, b) = (torque(&robot), torque(&ron), torque(&urdf));
    let largest = truth.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for k in 0..truth.len() {
        // The two files describe one robot; it is the true one but for the ripple.
        assert!(
            (a[k] - b[k]).abs() < 1e-9 * largest,
            "{} against {}",
            a[k],
            b[k]
        );
        assert!(
            (a[k] - truth[k]).abs() < 0.01 * largest,
            "{} instead of {}",
            a[k],
            truth[k]
        );
    }
    let friction = urdf.joints()[1].actuator;
    assert!(
        (friction.viscous_friction.unwrap() - 4.0).abs() < 0.1
            && (friction.coulomb_friction.unwrap() - 5.0).abs() < 0.1
    );
    let yaml = text("model/parameters.yaml");
    for words in [
        "schema: idim-parameters/1",
        "relation: ZZR1 = ",
        "source: prior",
        "source: combination",
        "viscous_friction:",
    ] {
        assert!(yaml.contains(words), "`{words}` is not in {yaml}");
    }
}
