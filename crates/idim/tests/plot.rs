//! The pictures: well-formed, labelled with units, small, the same every time, and safe against hostile names.
#![allow(clippy::unwrap_used)]

use idim::plot::{Part, TorqueRun, motion_plot, torque_plot};
use idim_model::{JointKind, robot_from_ron};
use idim_trajectory::{FourierSeries, Limits};
use roxmltree::Document;

/// A measured sine with ripple, the sine predicted; 70 % for training.
fn two_runs(joint: &str, kind: JointKind, n: usize) -> String {
    let time: Vec<f64> = (0..n).map(|k| k as f64 * 0.001).collect();
    let predicted: Vec<f64> = time.iter().map(|t| 40.0 * (2.0 * t).sin()).collect();
    let measured: Vec<f64> = time
        .iter()
        .zip(&predicted)
        .map(|(t, p)| p + 3.0 * (61.0 * t).sin())
        .collect();
    let cut = 7 * n / 10;
    let run = |part, range: std::ops::Range<usize>| TorqueRun {
        part,
        time: &time[range.clone()],
        measured: &measured[range.clone()],
        predicted: &predicted[range],
    };
    torque_plot(
        joint,
        kind,
        &[run(Part::Training, 0..cut), run(Part::Validation, cut..n)],
    )
}

fn texts(svg: &str) -> Vec<String> {
    let document = Document::parse(svg).expect("well-formed XML");
    let texts = document.descendants().filter(|n| n.has_tag_name("text"));
    texts
        .map(|n| n.text().unwrap_or_default().trim().to_owned())
        .collect()
}

fn has(texts: &[String], wanted: &str) -> bool {
    texts.iter().any(|t| t == wanted)
}

#[test]
fn identity_labels_carry_names_and_units() {
    let t = texts(&two_runs("shoulder", JointKind::Revolute, 5000));
    for wanted in [
        "shoulder",
        "torque / N·m",
        "residual / N·m",
        "time / s",
        "measured",
        "predicted",
        "held out",
    ] {
        assert!(has(&t, wanted), "{wanted} is missing in {t:?}");
    }
    let t = texts(&two_runs("lift", JointKind::Prismatic, 5000));
    assert!(has(&t, "force / N") && has(&t, "residual / N"), "{t:?}");
}

#[test]
fn identity_residual_is_the_ripple() {
    let t = texts(&two_runs("elbow", JointKind::Revolute, 50_000));
    // An amplitude of 3 has a root mean square of 3/sqrt(2).
    assert!(
        has(&t, "RMS 2.12 (training), 2.12 (validation) N·m"),
        "{t:?}"
    );
}

#[test]
fn regress_hostile_names_stay_text() {
    let name = "<script>alert(\"1\")</script>&'\u{1b}[2J\0";
    let svg = two_runs(name, JointKind::Revolute, 100);
    assert!(!svg.contains("<script"), "markup from a name");
    let t = texts(&svg);
    assert!(
        has(&t, "<script>alert(\"1\")</script>&'\u{fffd}[2J\u{fffd}"),
        "{t:?}"
    );
}

#[test]
fn identity_same_input_same_bytes_and_a_long_log_stays_small() {
    let svg = two_runs("wrist", JointKind::Revolute, 200_000);
    assert_eq!(svg, two_runs("wrist", JointKind::Revolute, 200_000));
    assert!(svg.len() < 100_000, "{} bytes", svg.len());
}

#[test]
fn regress_empty_constant_and_broken_data_still_make_a_picture() {
    let nothing = torque_plot("a", JointKind::Revolute, &[]);
    assert!(has(&texts(&nothing), "time / s"));
    let broken = [f64::NAN, 0.0, f64::INFINITY, 0.0];
    let run = TorqueRun {
        part: Part::Training,
        time: &[0.0, 1.0, 2.0, 3.0],
        measured: &broken,
        predicted: &[0.0; 4],
    };
    let svg = torque_plot("a", JointKind::Revolute, &[run]);
    assert!(has(&texts(&svg), "RMS 0 (training) N·m"));
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
}

#[test]
#[should_panic(expected = "have lengths [2, 1, 2]")]
fn regress_runs_of_different_lengths_are_a_bug_of_the_caller() {
    let run = TorqueRun {
        part: Part::Training,
        time: &[0.0, 1.0],
        measured: &[0.0],
        predicted: &[0.0; 2],
    };
    torque_plot("a", JointKind::Revolute, &[run]);
}

#[test]
fn identity_motion_shows_every_joint_against_its_limits() {
    let robot = robot_from_ron(idim_fixtures::PUMA3R).unwrap();
    let limits = Limits::new(vec![[-1.0, 1.0]; 3], vec![0.7; 3], vec![3.0; 3]).unwrap();
    let series = FourierSeries::new(
        0.6,
        vec![0.0; 3],
        vec![vec![0.2, 0.1]; 3],
        vec![vec![0.1, -0.2]; 3],
    )
    .unwrap();
    let time: Vec<f64> = (0..1000).map(|k| f64::from(k) * 0.01).collect();
    let svg = motion_plot(&robot, &limits, &time, &series.states(&time));
    let t = texts(&svg);
    for joint in 1..=3 {
        for (symbol, unit) in [("q", "rad"), ("q̇", "rad/s"), ("q̈", "rad/s²")] {
            assert!(
                has(&t, &format!("{symbol}{joint} / {unit}")),
                "{symbol}{joint}: {t:?}"
            );
        }
    }
    // One motion and two limits in each of nine panels.
    let drawn = |colour: &str| {
        svg.matches(&format!("stroke=\"{colour}\" stroke-width"))
            .count()
    };
    assert!(drawn("#B02030") >= 18 && drawn("#6B9AC4") >= 9);
    assert_eq!(
        svg,
        motion_plot(&robot, &limits, &time, &series.states(&time))
    );
}
