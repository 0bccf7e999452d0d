//! Predictors for other programs, compiled and run: the torques of the model, whatever columns it has.
#![allow(clippy::unwrap_used)]

use idim::predictor::{PredictedModel, predictor_c, predictor_rust};
use idim::{ExtraColumn, FrictionTerm, ModelColumns, Structure};
use idim_model::{
    Columns, DriveColumns, JointStates, KnownTorque, Model, ParameterKind, Robot,
    inverse_dynamics_batch, observation_matrix, random_states, robot_from_ron,
};
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

/// A bench with everything a robot file can have: sliding joints, distal frames, a branch, offsets, a tilted base, names
/// that end comments in one language or another.
const BENCH: &str = r#"(
    name: "bench */ \\", angles: Radians, gravity: (0.5, -1, -9.6), base: (xyz: (0, 0.1, 0.3), rpy: (0.2, 0.1, -0.3)),
    joints: Poses([
        (name: "a", frame: (xyz: (0.1, 0, 0.2), rpy: (0.3, 0, 0.5), axis: (0, 0.6, 0.8), offset: 0.4)),
        (name: "b", kind: Prismatic, frame: (xyz: (0, 0.2, 0), rpy: (0, 1, 0), axis: (1, 0, 0), offset: 0.1, link_xyz: (0.1, 0.2, 0), link_rpy: (1, 0, 0.2))),
        (name: "c\n*/ ??/", frame: (xyz: (0.3, 0, 0), rpy: (1, 0.4, 0), axis: (0, 0, 1), link_xyz: (0.2, 0, 0.1), link_rpy: (0, 0.7, 0))),
        (name: "d", parent: "b", frame: (xyz: (0, 0, 0.3), rpy: (0, 0, 1), axis: (0.8, 0, 0.6), offset: -0.3, link_xyz: (0, 0.1, 0))),
    ]),
)"#;

/// Agreement asked for, beside the largest torque.
const TOLERANCE: f64 = 1e-12;
/// Instants a predictor is asked for.
const INSTANTS: usize = 50;

/// A model and the instants at which it is asked.
struct Case {
    robot: Robot,
    columns: ModelColumns,
    values: Vec<f64>,
    reversal: Vec<f64>,
    load: Vec<[f64; 10]>,
    states: JointStates,
}

impl Case {
    fn new(robot: Robot, columns: ModelColumns, reversal: Vec<f64>) -> Self {
        let states = random_states(&robot, INSTANTS, 7);
        let values = (0..columns.len())
            .map(|k| (1.7 * k as f64).sin() + 0.1)
            .collect();
        Self {
            robot,
            columns,
            values,
            reversal,
            load: Vec::new(),
            states,
        }
    }

    /// The columns an identification of a robot file has, all of them estimated.
    fn of_file(robot: Robot, reversal: f64) -> Self {
        let all = Columns::standard(robot.n_joints(), DriveColumns::ALL);
        let columns = Structure::of_drives(&robot, all).base_model_columns();
        let reversal = vec![reversal; robot.n_joints()];
        Self::new(robot, columns, reversal)
    }

    fn model(&self) -> PredictedModel<'_> {
        PredictedModel {
            robot: &self.robot,
            columns: &self.columns,
            values: &self.values,
            reversal: &self.reversal,
            load: &self.load,
        }
    }

    /// Torques by the regressor and by each column's own equation, which share no code with the predictors.
    fn torque(&self) -> Vec<Vec<f64>> {
        let (n, standard) = (self.robot.n_joints(), &self.columns.standard);
        let w = observation_matrix(&Model::new(&self.robot), standard, &self.states);
        let flat: Vec<f64> = self.load.iter().flatten().copied().collect();
        let load = (!flat.is_empty())
            .then(|| inverse_dynamics_batch(&Model::new(&self.robot), &flat, &self.states));
        (0..INSTANTS)
            .map(|k| {
                let mut sum = vec![0.0; n];
                for (j, sum) in sum.iter_mut().enumerate() {
                    for (c, (p, value)) in standard.0.iter().zip(&self.values).enumerate() {
                        let entry = match p.kind {
                            ParameterKind::Fc if p.index == j => {
                                sign(self.states.qd(j)[k], self.reversal[j])
                            }
                            _ => w[(k * n + j, c)],
                        };
                        *sum += entry * value;
                    }
                }
                let extra = self.columns.extra.iter();
                for (column, value) in extra.zip(&self.values[standard.len()..]) {
                    let load = |j: usize| load.as_ref().unwrap()[j * INSTANTS + k];
                    self.add(column, *value, k, &load, &mut sum);
                }
                sum
            })
            .collect()
    }

    fn add(
        &self,
        column: &ExtraColumn,
        value: f64,
        k: usize,
        load: &dyn Fn(usize) -> f64,
        sum: &mut [f64],
    ) {
        match column {
            ExtraColumn::Motor { motor, kind, turns } => {
                let turned = |of: &dyn Fn(usize) -> f64| -> f64 {
                    turns.iter().enumerate().map(|(j, r)| r * of(j)).sum()
                };
                let speed = turned(&|j| self.states.qd(j)[k]);
                let course = match kind {
                    ParameterKind::Ia => turned(&|j| self.states.qdd(j)[k]),
                    ParameterKind::Fv => speed,
                    // Motors reverse over 0.01 rad/s where their joint is smoothed at all.
                    _ if self.reversal[*motor] > 0.0 => sign(speed, 0.01),
                    _ => sign(speed, 0.0),
                };
                for (sum, ratio) in sum.iter_mut().zip(turns) {
                    *sum += ratio * value * course;
                }
            }
            ExtraColumn::Known(torque) => {
                let j = torque.joint();
                sum[j] += value * torque.at(self.states.q(j)[k]);
            }
            ExtraColumn::Friction { joint, term } => {
                let v = self.states.qd(*joint)[k];
                let s = sign(v, self.reversal[*joint]);
                sum[*joint] += value
                    * match term {
                        FrictionTerm::Asymmetric => v.abs(),
                        FrictionTerm::Cubic => v.powi(3),
                        FrictionTerm::Root => s * v.abs().sqrt(),
                        FrictionTerm::Stribeck(scale) => s * (-(v / scale).powi(2)).exp(),
                        FrictionTerm::Load => s * load(*joint).abs(),
                    };
            }
        }
    }

    /// The states as initialisers, `open` and `close` standing for the brackets of the language.
    fn rows(&self, open: char, close: char) -> String {
        let mut text = String::new();
        for k in 0..INSTANTS {
            let s = self.states.state(k);
            let row = |v: &[f64]| {
                let items: Vec<String> = v.iter().map(|x| format!("{x:?}")).collect();
                format!("{open}{}{close}", items.join(", "))
            };
            let (q, qd, qdd) = (row(&s.q), row(&s.qd), row(&s.qdd));
            let _ = write!(text, "{open}{q}, {qd}, {qdd}{close},");
        }
        text
    }

    #[track_caller]
    fn check<'a>(&self, name: &str, lines: &mut impl Iterator<Item = &'a str>) {
        let truth = self.torque();
        let largest = truth.iter().flatten().fold(0.0_f64, |a, v| a.max(v.abs()));
        for truth in &truth {
            let words = lines.next().unwrap().split_whitespace();
            let found: Vec<f64> = words.map(|w| w.parse().unwrap()).collect();
            assert_eq!(found.len(), truth.len());
            for (a, b) in found.iter().zip(truth) {
                let near = (a - b).abs() <= TOLERANCE * largest;
                assert!(near, "{name}: {a} instead of {b}, largest {largest}");
            }
        }
    }
}

fn sign(speed: f64, reversal: f64) -> f64 {
    match reversal {
        0.0 => f64::from(i8::from(speed > 0.0) - i8::from(speed < 0.0)),
        v => (speed / v).tanh(),
    }
}

/// The bench with every column there is: coupled motors, one of a sliding joint; a torque by table, one by formula; each
/// friction term on a joint that turns and on one that slides.
fn bench() -> Case {
    let robot = robot_from_ron(BENCH).unwrap();
    let motor = |motor, turns: [f64; 4]| {
        let kinds = [ParameterKind::Ia, ParameterKind::Fv, ParameterKind::Fc];
        kinds.map(|kind| ExtraColumn::Motor {
            motor,
            kind,
            turns: turns.to_vec(),
        })
    };
    let mut extra: Vec<ExtraColumn> = motor(1, [0.5, 1.0, 0.0, 0.0]).into();
    extra.extend(motor(2, [0.0, -1.5, 1.0, 0.25]));
    let table = vec![[-1.0, 4.0], [-0.5, -1.0], [0.2, 0.5], [1.5, 2.0]];
    extra.push(ExtraColumn::Known(
        KnownTorque::from_table("spring */ \\", 1, table).unwrap(),
    ));
    let quantities = [
        ("fn", "sqrt(0.05 + 0.04 * cos(q)) - PI"),
        ("unused", "2"),
        (
            "int",
            "atan2(fn, q) + min(q, 0.3) * max(fn, q) - 3 / q / 2 * fn",
        ),
        (
            "α",
            "signum(q) * fract(3 * q) - floor(q) + round(q) - ceil(fn) * trunc(2 * q)",
        ),
    ]
    .map(|(name, text)| (name.to_owned(), text.to_owned()));
    let torque = "-int^2 + abs(q)^-0.5 * exp(-fn) + ln(2 + q^2) + log2(4 + fn) + log10(9 + q^2) + cbrt(q) \
        + sinh(q) * cosh(q) - tanh(q) + asinh(q) + acosh(1 + q^2) + atanh(q / 9) + tan(q / 3) \
        + asin(q / 9) - acos(q / 9) + atan(fn) + α + e";
    extra.push(ExtraColumn::Known(
        KnownTorque::from_formula("spring", 2, &quantities, torque).unwrap(),
    ));
    let terms = [
        FrictionTerm::Asymmetric,
        FrictionTerm::Cubic,
        FrictionTerm::Root,
        FrictionTerm::Stribeck(0.4),
        FrictionTerm::Load,
    ];
    for joint in [0, 1] {
        extra.extend(terms.map(|term| ExtraColumn::Friction { joint, term }));
    }
    let columns = ModelColumns {
        standard: Columns::standard(4, DriveColumns::ALL),
        extra,
    };
    // Coulomb torques change sign over these speeds.
    let mut case = Case::new(robot, columns, vec![0.05, 0.005, 0.0, 0.3]);
    // The rigid body that loads the gears is that of a fit before: another one.
    case.load = (0..4)
        .map(|link| std::array::from_fn(|k| (1.1 * (10 * link + k) as f64).cos()))
        .collect();
    case
}

fn cases() -> Vec<(&'static str, Case)> {
    let tx40 = robot_from_ron(idim_fixtures::TX40).unwrap();
    let held = tx40.hold_joints(&[("joint_2".into(), 0.7)]).unwrap();
    let kr300 = robot_from_ron(idim_fixtures::KR300).unwrap();
    vec![
        ("bench", bench()),
        ("tx40", Case::of_file(tx40, 0.005)),
        ("tx40_held", Case::of_file(held, 0.0)),
        ("kr300", Case::of_file(kr300, 0.005)),
    ]
}

/// Compiles and runs; `None` where the compiler is not there.
fn compiled(folder: &Path, compiler: &str, arguments: &[&str]) -> Option<String> {
    let built = Command::new(compiler)
        .args(arguments)
        .current_dir(folder)
        .output();
    let Ok(built) = built else {
        eprintln!("skipped: no {compiler} here, so nobody compiles the predictors");
        return None;
    };
    let said = String::from_utf8_lossy(&built.stderr);
    assert!(built.status.success(), "{said}");
    assert!(said.is_empty(), "warnings: {said}");
    let ran = Command::new(folder.join("predict")).output().unwrap();
    assert!(ran.status.success());
    Some(String::from_utf8(ran.stdout).unwrap())
}

#[test]
fn identity_rust_predictors_are_the_models() {
    let (cases, folder) = (cases(), tempfile::tempdir().unwrap());
    let mut main = String::from("#![forbid(unsafe_code)]\n");
    let mut calls = String::new();
    for (name, case) in &cases {
        let source = folder.path().join(format!("{name}.rs"));
        std::fs::write(source, predictor_rust(&case.model())).unwrap();
        let n = case.robot.n_joints();
        let _ = writeln!(
            main,
            "mod {name};\nstatic S_{}: [[[f64; {n}]; 3]; {INSTANTS}] = [{}];",
            name.to_uppercase(),
            case.rows('[', ']')
        );
        let _ = writeln!(
            calls,
            "for s in &S_{} {{ for t in {name}::torque(&s[0], &s[1], &s[2]) {{ print!(\"{{t:e}} \"); }} println!(); }}",
            name.to_uppercase()
        );
    }
    let _ = writeln!(main, "fn main() {{\n{calls}}}");
    std::fs::write(folder.path().join("main.rs"), main).unwrap();
    let arguments = ["--edition", "2021", "-O", "main.rs", "-o", "predict"];
    if let Some(printed) = compiled(folder.path(), "rustc", &arguments) {
        let mut lines = printed.lines();
        for (name, case) in &cases {
            case.check(name, &mut lines);
        }
    }
}

#[test]
fn identity_c_predictors_are_the_models() {
    for (name, case) in cases() {
        let folder = tempfile::tempdir().unwrap();
        let (n, rows) = (case.robot.n_joints(), case.rows('{', '}'));
        std::fs::write(
            folder.path().join("predictor.c"),
            predictor_c(&case.model()),
        )
        .unwrap();
        let main = format!(
            "#include <stdio.h>\nvoid idim_torque(const double q[{n}], const double qd[{n}], const double qdd[{n}], double out[{n}]);\nstatic const double s[{INSTANTS}][3][{n}] = {{{rows}}};\nint main(void) {{ for (int k = 0; k < {INSTANTS}; k++) {{ double t[{n}]; idim_torque(s[k][0], s[k][1], s[k][2], t); for (int j = 0; j < {n}; j++) printf(\"%.17g \", t[j]); printf(\"\\n\"); }} return 0; }}"
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
            case.check(name, &mut printed.lines());
        }
    }
}
