//! The published numbers of both papers, recomputed.
#![allow(clippy::unwrap_used)]

use idim::simulate::{Differentiation, Disturbances, Experiment, Processing};
use idim::{KeepOrder, Structure, crs_a460};
use idim_excitation::series_conditioning;
use idim_model::{DriveColumns, Model, robot_from_ron};
use idim_trajectory::Limits;

/// Table I of Radkhah, Kulić & Croft: references computed independently, to all their digits.
#[test]
fn oracle_crs_table_1_condition_numbers() {
    let robot = robot_from_ron(idim_fixtures::CRS_A460).unwrap();
    let structure = Structure::of_torque(&robot, DriveColumns::NONE, KeepOrder::MassFirst);
    let series = crs_a460::table1().unwrap();
    for n_samples in [100, 1000] {
        let c = series_conditioning(
            &Model::new(&robot),
            &structure.base_columns(),
            &series,
            n_samples,
        );
        assert!(
            (c.raw.two_norm - 210.147_050_45).abs() < 5e-9,
            "{}",
            c.raw.two_norm
        );
        assert!(
            (c.equilibrated.two_norm - 56.132_208_93).abs() < 5e-9,
            "{}",
            c.equilibrated.two_norm
        );
        assert!((c.log_det - 80.264_243_82).abs() < 5e-9, "{}", c.log_det);
    }
    assert!(
        series
            .certificate(&Limits::from_robot(&robot).unwrap())
            .certified
    );
}

fn recover(disturbances: &Disturbances, processing: &Processing) -> f64 {
    let robot = robot_from_ron(idim_fixtures::CRS_A460).unwrap();
    let series = crs_a460::table1().unwrap();
    let structure = Experiment::structure(&robot, processing);
    let experiment = Experiment::new(&robot, &series).unwrap();
    let recovered = experiment
        .run(&structure, disturbances, processing, 7, 0)
        .unwrap();
    recovered.relative_norm_error(&recovered.weighted)
}

#[test]
fn identity_an_undisturbed_experiment_returns_the_truth() {
    let clean = Disturbances {
        encoders: false,
        torque_noise: 0.0,
        torque_constant: 0.0,
        friction: true,
        n_periods: 2,
    };
    let processing = Processing {
        friction: true,
        differentiation: Differentiation::Fourier,
    };
    assert!(recover(&clean, &processing) < 1e-8);
}

#[test]
fn regress_disturbances_of_the_paper_leave_less_than_a_percent() {
    let processing = Processing {
        friction: true,
        differentiation: Differentiation::Fourier,
    };
    assert!(recover(&Disturbances::STANDARD, &processing) < 1e-2);
}

#[test]
fn regress_unmodelled_friction_spoils_the_estimate() {
    let processing = Processing {
        friction: false,
        differentiation: Differentiation::Fourier,
    };
    assert!(recover(&Disturbances::STANDARD, &processing) > 0.1);
}
