//! Robots that can be: the price of physicality and the most plausible one.
#![allow(clippy::unwrap_used)]

mod common;

use common::{normals, rng};
use faer::Mat;
use idim_estimation::{
    ConsistencyOptions, Error, Estimate, InformationFactor, LinkPrior, PhysicalEstimate,
    PhysicalProblem, PositivePrior, Solution, Verdict, chi_square_quantile, physically_consistent,
    solve,
};
use idim_model::{
    Columns, DriveColumns, InertialParameters, Model, Pose, Robot, observation_matrix,
    random_states, robot_from_ron,
};
use nalgebra::{Matrix3, Matrix4, Vector3};

/// The 3R arm with viscous friction: 11 columns a joint.
const VISCOUS: DriveColumns = DriveColumns {
    viscous: true,
    ..DriveColumns::NONE
};
const PER_LINK: usize = 11;

fn body(mass: f64, centre: [f64; 3], spread: f64) -> InertialParameters {
    let inertia =
        Matrix3::new(1.1, 0.1, -0.2, 0.1, 1.3, 0.05, -0.2, 0.05, 0.9) * (mass * spread * spread);
    InertialParameters::from_centre_of_mass(mass, Vector3::from(centre), &inertia)
}

fn truth() -> Vec<InertialParameters> {
    vec![
        body(12.0, [0.0, -0.05, -0.1], 0.15),
        body(17.0, [0.2, 0.01, 0.1], 0.2),
        body(5.0, [0.02, -0.1, 0.03], 0.1),
    ]
}

/// Beliefs off by tens of percent.
fn priors() -> Vec<LinkPrior> {
    let bodies = [
        body(9.0, [0.01, 0.0, -0.05], 0.2),
        body(20.0, [0.3, 0.0, 0.0], 0.15),
        body(4.0, [0.0, -0.06, 0.0], 0.13),
    ];
    bodies
        .iter()
        .enumerate()
        .map(|(link, prior)| LinkPrior {
            columns: std::array::from_fn(|k| PER_LINK * link + k),
            prior: *prior,
        })
        .collect()
}

fn frictions() -> Vec<PositivePrior> {
    (0..3)
        .map(|link| PositivePrior {
            column: PER_LINK * link + 10,
            prior: 2.0,
        })
        .collect()
}

fn standard(links: &[InertialParameters]) -> Vec<f64> {
    links
        .iter()
        .zip([3.0, 5.0, 0.4])
        .flat_map(|(link, viscous)| link.0.into_iter().chain([viscous]))
        .collect()
}

/// The base columns and `K`, from the combinations of columns that vanish.
fn reduction(all: &InformationFactor) -> (Vec<usize>, Mat<f64>) {
    let p = all.n_columns();
    let Solution::RankDeficient(outcome) = solve(all).unwrap() else {
        panic!("standard parameters are never all determined")
    };
    let free = |v: &[f64]| {
        (0..p)
            .find(|&j| {
                v[j] == 1.0
                    && outcome
                        .null_combinations
                        .iter()
                        .filter(|u| u[j] != 0.0)
                        .count()
                        == 1
            })
            .unwrap()
    };
    let dropped: Vec<(usize, &Vec<f64>)> = outcome
        .null_combinations
        .iter()
        .map(|v| (free(v), v))
        .collect();
    let base: Vec<usize> = (0..p)
        .filter(|j| dropped.iter().all(|(d, _)| d != j))
        .collect();
    // Column d = -Σ v_i column i, so β_i = π_i - Σ v_i π_d.
    let k = Mat::from_fn(base.len(), p, |i, j| {
        if base[i] == j {
            1.0
        } else {
            dropped
                .iter()
                .find(|(d, _)| *d == j)
                .map_or(0.0, |(_, v)| -v[base[i]])
        }
    });
    (base, k)
}

struct Experiment {
    all: InformationFactor,
    base: InformationFactor,
    k: Mat<f64>,
    fit: Estimate,
}

fn robot() -> Robot {
    robot_from_ron(idim_fixtures::PUMA3R).unwrap()
}

/// Simulated torques of `pi`, times `sign` joint by joint, with 0.3 N·m of noise.
fn experiment(pi: &[f64], sign: [f64; 3]) -> Experiment {
    let robot = robot();
    let columns = Columns::standard(3, VISCOUS);
    let w = observation_matrix(
        &Model::new(&robot),
        &columns,
        &random_states(&robot, 150, 5),
    );
    let mut rng = rng(6);
    let noise = normals(&mut rng, w.nrows());
    let mut all = InformationFactor::new(columns.len());
    for i in 0..w.nrows() {
        let row: Vec<f64> = w.row(i).iter().copied().collect();
        let torque: f64 = row.iter().zip(pi).map(|(w, p)| w * p).sum();
        all.push_rows(&row, &[sign[i % 3] * (torque + 0.3 * noise[i])])
            .unwrap();
    }
    let (columns, k) = reduction(&all);
    let base = all.select(&columns);
    let fit = solve(&base).unwrap().determined().unwrap();
    Experiment { all, base, k, fit }
}

fn consistent(x: &Experiment, links: &[LinkPrior], positive: &[PositivePrior]) -> PhysicalEstimate {
    let problem = PhysicalProblem {
        factor: &x.base,
        sigma: x.fit.sigma,
        regrouping: x.k.as_ref(),
        links,
        positive,
    };
    physically_consistent(&problem, &ConsistencyOptions::default()).unwrap()
}

#[test]
fn identity_a_real_robot_is_possible_and_found_inside_the_region() {
    let x = experiment(&standard(&truth()), [1.0; 3]);
    let outcome = consistent(&x, &priors(), &frictions());
    let b = x.k.nrows() as f64;
    assert_eq!(outcome.price.verdict, Verdict::Possible);
    assert!(
        outcome.price.lower_bound <= outcome.price.delta_chi_square
            && outcome.price.limit == chi_square_quantile(0.95, b)
    );
    let plausible = outcome.most_plausible.unwrap();
    // On the border of the 50 % region, as stated.
    let target = chi_square_quantile(0.5, b);
    assert!(
        (plausible.delta_chi_square / target - 1.0).abs() < 2e-3,
        "{} {target}",
        plausible.delta_chi_square
    );
    for robot in [&plausible, &outcome.closest] {
        for (link, eigenvalue) in robot.links.iter().zip(&robot.smallest_eigenvalue) {
            assert!(*eigenvalue > 0.0 && link.pseudo_inertia().cholesky().is_some());
        }
        assert!([10, 21, 32].iter().all(|&c| robot.standard[c] > 0.0));
        // Δχ² by its definition, from the covariance of the fit.
        let d: Vec<f64> = robot
            .base
            .iter()
            .zip(&x.fit.values)
            .map(|(a, b)| a - b)
            .collect();
        let r = x.base.parts().r;
        let chi: f64 = (0..d.len())
            .map(|i| ((0..d.len()).map(|j| r[(i, j)] * d[j]).sum::<f64>() / x.fit.sigma).powi(2))
            .sum();
        assert!(
            (chi / robot.delta_chi_square - 1.0).abs() < 1e-6,
            "{chi} {}",
            robot.delta_chi_square
        );
    }
    // The truth is one of the robots in the region's neighbourhood: nothing found is nearer the prior at its price.
    assert!(
        plausible.divergence.iter().sum::<f64>() < outcome.closest.divergence.iter().sum::<f64>()
    );
}

#[test]
fn identity_a_flipped_sign_is_contradicted_though_it_fits_as_well() {
    let right = experiment(&standard(&truth()), [1.0; 3]);
    let flipped = experiment(&standard(&truth()), [-1.0; 3]);
    assert!(
        (right.fit.relative_error() / flipped.fit.relative_error() - 1.0).abs() < 1e-9,
        "least squares cannot tell"
    );
    let outcome = consistent(&flipped, &priors(), &frictions());
    assert_eq!(outcome.price.verdict, Verdict::Contradicted);
    assert!(outcome.most_plausible.is_none());
    assert!(
        outcome.price.lower_bound > 100.0 * outcome.price.limit,
        "{:?}",
        outcome.price
    );
    assert!(outcome.price.delta_chi_square / outcome.price.lower_bound < 1.011);
}

#[test]
fn identity_the_path_is_stationary() {
    // Along any direction the objective at the most plausible robot grows: it is the minimiser for the weight it was found with,
    // so among robots of its price none is nearer the prior.
    let x = experiment(&standard(&truth()), [1.0; 3]);
    let (links, positive) = (priors(), frictions());
    let plausible = consistent(&x, &links, &positive).most_plausible.unwrap();
    let divergence = |pi: &[f64]| -> f64 {
        let bodies: f64 = links
            .iter()
            .map(|l| {
                let p0 = l.prior.pseudo_inertia();
                let p = InertialParameters(l.columns.map(|c| pi[c])).pseudo_inertia();
                let ratio = p0.try_inverse().unwrap() * p;
                ratio.trace() - ratio.determinant().ln() - 4.0
            })
            .sum();
        bodies
            + positive
                .iter()
                .map(|f| pi[f.column] / f.prior - (pi[f.column] / f.prior).ln() - 1.0)
                .sum::<f64>()
    };
    let chi = |pi: &[f64]| -> f64 {
        let parts = x.base.parts();
        let beta: Vec<f64> = (0..x.k.nrows())
            .map(|i| (0..pi.len()).map(|j| x.k[(i, j)] * pi[j]).sum())
            .collect();
        (0..beta.len())
            .map(|i| {
                (((0..beta.len())
                    .map(|j| parts.r[(i, j)] * beta[j])
                    .sum::<f64>()
                    - parts.z[i])
                    / x.fit.sigma)
                    .powi(2)
            })
            .sum()
    };
    // Gradients of both by differences along every parameter, in proportion to each other: that is the condition of Lagrange.
    let scale: Vec<f64> = plausible
        .standard
        .iter()
        .map(|v| 1e-6 * v.abs().max(1e-2))
        .collect();
    let slope = |f: &dyn Fn(&[f64]) -> f64, j: usize| {
        let at = |sign: f64| {
            let mut pi = plausible.standard.clone();
            pi[j] += sign * scale[j];
            f(&pi)
        };
        (at(1.0) - at(-1.0)) / 2.0
    };
    let (gd, gc): (Vec<f64>, Vec<f64>) = (0..33)
        .map(|j| (slope(&divergence, j), slope(&chi, j)))
        .unzip();
    let dot: f64 = gd.iter().zip(&gc).map(|(d, c)| d * c).sum();
    let size = |a: &[f64]| a.iter().map(|a| a * a).sum::<f64>().sqrt();
    let cosine = dot / size(&gd) / size(&gc);
    assert!((cosine + 1.0).abs() < 1e-5, "{cosine}");
}

#[test]
fn identity_the_answer_does_not_depend_on_the_frame_of_a_link() {
    let x = experiment(&standard(&truth()), [1.0; 3]);
    let pose = Pose::from_xyz_rpy([0.3, -0.1, 0.2], [0.4, 1.0, -0.7]);
    // π' = B π for link 1 (counted from 0), so K' = K B⁻¹.
    let mut back = Mat::<f64>::identity(33, 33);
    for k in 0..10 {
        let mut unit = [0.0; 10];
        unit[k] = 1.0;
        let image = InertialParameters(unit).expressed_in(&pose.inverse());
        (0..10).for_each(|i| back[(PER_LINK + i, PER_LINK + k)] = image.0[i]);
    }
    let mut links = priors();
    links[1].prior = links[1].prior.expressed_in(&pose);
    let moved = Experiment {
        k: &x.k * &back,
        all: x.all.clone(),
        base: x.base.clone(),
        fit: x.fit.clone(),
    };
    let (one, two) = (
        consistent(&x, &priors(), &frictions()),
        consistent(&moved, &links, &frictions()),
    );
    assert!((one.price.delta_chi_square / two.price.delta_chi_square - 1.0).abs() < 1e-5);
    let (one, two) = (one.most_plausible.unwrap(), two.most_plausible.unwrap());
    assert!(common::worst(&two.divergence, &one.divergence) < 1e-5);
    let expected = one.links[1].expressed_in(&pose);
    assert!(common::distance(&two.links[1].0, &expected.0) < 1e-5);
}

/// One body whose ten coordinates are measured directly: everything has a closed form in the eigenvalues of the measurement.
fn measured_body(p: &Matrix4<f64>, sigma: f64, region: f64) -> PhysicalEstimate {
    // Pseudo-inertia of the prior: the identity.
    let prior = InertialParameters([2.0, 0.0, 0.0, 2.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0]);
    assert!((prior.pseudo_inertia() - Matrix4::identity()).norm() < 1e-15);
    let entries = |p: &Matrix4<f64>| -> [f64; 10] {
        let r = 2_f64.sqrt();
        [
            p[(0, 0)],
            p[(1, 1)],
            p[(2, 2)],
            p[(3, 3)],
            r * p[(0, 1)],
            r * p[(0, 2)],
            r * p[(0, 3)],
            r * p[(1, 2)],
            r * p[(1, 3)],
            r * p[(2, 3)],
        ]
    };
    let images: Vec<[f64; 10]> = (0..10)
        .map(|k| {
            let mut unit = [0.0; 10];
            unit[k] = 1.0;
            entries(&InertialParameters(unit).pseudo_inertia())
        })
        .collect();
    let w: Vec<f64> = (0..100).map(|k| images[k % 10][k / 10]).collect();
    let mut factor = InformationFactor::new(10);
    factor.push_rows(&w, &entries(p)).unwrap();
    let k = Mat::<f64>::identity(10, 10);
    let links = [LinkPrior {
        columns: std::array::from_fn(|k| k),
        prior,
    }];
    let problem = PhysicalProblem {
        factor: &factor,
        sigma,
        regrouping: k.as_ref(),
        links: &links,
        positive: &[],
    };
    physically_consistent(
        &problem,
        &ConsistencyOptions {
            region,
            ..ConsistencyOptions::default()
        },
    )
    .unwrap()
}

fn measurement(eigenvalues: [f64; 4]) -> Matrix4<f64> {
    let q = Matrix4::from_fn(|i, j| ((i * 5 + j * 3) as f64).sin())
        .qr()
        .q();
    q * Matrix4::from_diagonal(&eigenvalues.into()) * q.transpose()
}

#[test]
fn oracle_closed_form_of_one_body() {
    // The nearest body cuts negative eigenvalues off: Δχ² = Σ min(λ, 0)²/σ².
    let sigma = 0.1;
    let outcome = measured_body(&measurement([3.0, 0.5, -0.4, -1.2]), sigma, 0.5);
    let least = (0.4_f64.powi(2) + 1.2_f64.powi(2)) / sigma / sigma;
    assert!(
        outcome.price.lower_bound <= least && least <= outcome.price.delta_chi_square,
        "{:?}",
        outcome.price
    );
    assert!((outcome.price.delta_chi_square / least - 1.0).abs() < 0.01);
    assert_eq!(outcome.price.verdict, Verdict::Contradicted);

    // On the path each eigenvalue q solves (q - λ)/(μ σ²) + 1 - 1/q = 0; the entry has Σ (q - λ)²/σ² = χ²_10,0.9.
    let lambda = [3.0, 0.5, 0.2, -0.1];
    let outcome = measured_body(&measurement(lambda), sigma, 0.9);
    let target = chi_square_quantile(0.9, 10.0);
    let on_path = |m: f64| lambda.map(|l| 0.5 * ((l - m) + ((l - m).powi(2) + 4.0 * m).sqrt()));
    let chi = |m: f64| {
        on_path(m)
            .iter()
            .zip(lambda)
            .map(|(q, l)| ((q - l) / sigma).powi(2))
            .sum::<f64>()
    };
    let (mut low, mut high) = (1e-9_f64, 1e3_f64);
    for _ in 0..200 {
        let middle = (low * high).sqrt();
        if chi(middle) < target {
            low = middle;
        } else {
            high = middle;
        }
    }
    let q = on_path(low);
    let divergence: f64 = q.iter().map(|q| q - q.ln() - 1.0).sum();
    let plausible = outcome.most_plausible.unwrap();
    assert!((plausible.delta_chi_square / target - 1.0).abs() < 2e-3);
    assert!(
        (plausible.divergence[0] / divergence - 1.0).abs() < 5e-3,
        "{} {divergence}",
        plausible.divergence[0]
    );
    let least = q.iter().copied().fold(f64::INFINITY, f64::min);
    assert!((plausible.smallest_eigenvalue[0] / least - 1.0).abs() < 5e-3);
}

#[test]
fn identity_a_prior_that_fits_is_the_answer() {
    let prior = InertialParameters([2.0, 0.0, 0.0, 2.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0]);
    let outcome = measured_body(&measurement([1.1, 0.9, 1.0, 1.05]), 0.5, 0.5);
    let plausible = outcome.most_plausible.unwrap();
    assert_eq!(outcome.price.verdict, Verdict::Possible);
    assert!(
        common::distance(&plausible.links[0].0, &prior.0) < 1e-14
            && plausible.divergence[0].abs() < 1e-14
    );
}

#[test]
fn priors_and_questions_that_make_no_sense_are_refused() {
    let x = experiment(&standard(&truth()), [1.0; 3]);
    let ask = |links: &[LinkPrior],
               positive: &[PositivePrior],
               sigma: f64,
               options: ConsistencyOptions| {
        physically_consistent(
            &PhysicalProblem {
                factor: &x.base,
                sigma,
                regrouping: x.k.as_ref(),
                links,
                positive,
            },
            &options,
        )
    };
    let usual = ConsistencyOptions::default();
    let mut thin = priors();
    // Triangle inequality violated: Ixx > Iyy + Izz about the centre of mass.
    thin[1].prior = InertialParameters::from_centre_of_mass(
        1.0,
        Vector3::zeros(),
        &Matrix3::from_diagonal(&Vector3::new(3.0, 1.0, 1.0)),
    );
    let outcome = ask(&thin, &frictions(), 0.3, usual);
    assert!(
        matches!(outcome, Err(Error::UnphysicalPrior { link: 1, eigenvalue }) if (eigenvalue + 0.5).abs() < 1e-9),
        "{outcome:?}"
    );
    let negative = [PositivePrior {
        column: 10,
        prior: -1.0,
    }];
    assert!(matches!(
        ask(&priors(), &negative, 0.3, usual),
        Err(Error::OutOfRange { .. })
    ));
    assert!(matches!(
        ask(&priors(), &frictions(), 0.0, usual),
        Err(Error::OutOfRange { .. })
    ));
    assert!(matches!(
        ask(
            &priors(),
            &frictions(),
            0.3,
            ConsistencyOptions {
                region: 1.0,
                ..usual
            }
        ),
        Err(Error::OutOfRange { .. })
    ));
    // Friction is determined and may be free; the parameters of the first link are not.
    assert!(ask(&priors(), &[], 0.3, usual).is_ok());
    assert!(
        matches!(ask(&priors()[1..], &frictions(), 0.3, usual), Err(Error::UndeterminedStandard { column }) if column < 10)
    );
}
