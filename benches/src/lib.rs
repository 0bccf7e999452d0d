//! What the benchmarks share: robots, columns, states and a clock that leaves out other processes.

pub mod jobs;

use idim_base_params::{Reduction, ReductionOptions, TriangularFactor, reduce};
use idim_model::{
    Columns, DriveColumns, JointStates, Model, Robot, random_states, robot_from_urdf,
    visit_torque_regressor,
};

/// A robot, its model and the columns that can be told apart.
#[derive(Debug, Clone)]
pub struct Case {
    /// Name for the tables.
    pub name: &'static str,
    /// As described.
    pub robot: Robot,
    /// Its constants.
    pub model: Model,
    /// All inertial columns.
    pub standard: Columns,
    /// The base columns.
    pub base: Columns,
}

impl Case {
    /// The six-joint arm of the anchors: 36 base columns.
    ///
    /// # Panics
    /// If the robot file is broken.
    pub fn ur5() -> Self {
        Self::new("UR5", idim_fixtures::UR5_URDF)
    }

    /// The seven-joint arm of the anchors, fingers locked: 43 base columns.
    ///
    /// # Panics
    /// If the robot file is broken.
    pub fn panda() -> Self {
        Self::new("Panda", idim_fixtures::PANDA_URDF)
    }

    fn new(name: &'static str, urdf: &str) -> Self {
        let robot = robot_from_urdf(urdf).expect("a robot file of the fixtures");
        let model = Model::new(&robot);
        let standard = Columns::inertial(robot.n_joints());
        let base = base_columns(&robot, &model, &standard);
        Self {
            name,
            robot,
            model,
            standard,
            base,
        }
    }

    /// Base columns with viscous and Coulomb friction of every joint: 48 for the six-joint arm.
    pub fn with_friction(&self) -> Columns {
        let drive = DriveColumns {
            viscous: true,
            coulomb: true,
            ..DriveColumns::NONE
        };
        let mut columns = self.base.clone();
        let all = Columns::standard(self.robot.n_joints(), drive).0;
        columns.0.extend(
            all.into_iter()
                .filter(|p| p.kind.inertial_index().is_none()),
        );
        columns
    }

    /// Random states, always the same.
    pub fn states(&self, n_samples: usize) -> JointStates {
        random_states(&self.robot, n_samples, 3)
    }
}

/// Rank decision from 200 random states.
fn base_columns(robot: &Robot, model: &Model, columns: &Columns) -> Columns {
    let order: Vec<usize> = (0..columns.len()).collect();
    columns.select(&reduction(robot, model, columns, &order).base)
}

/// Base columns and regrouping from 200 random states: the job of the bench `reduce`.
pub fn reduction(robot: &Robot, model: &Model, columns: &Columns, order: &[usize]) -> Reduction {
    let mut factor = TriangularFactor::new(columns.len());
    let (n, p) = (robot.n_joints(), columns.len());
    let mut rows = vec![0.0; 8 * n * p];
    visit_torque_regressor(model, columns, &random_states(robot, 200, 1), |block| {
        let rows = &mut rows[..block.n_samples() * n * p];
        for (k, row) in rows.chunks_exact_mut(p).enumerate() {
            block.copy_row(k % n, k / n, row);
        }
        factor.push_rows(rows);
    });
    reduce(&factor, order, &ReductionOptions::default())
}

/// CPU seconds of this thread so far.
pub fn cpu_seconds() -> f64 {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    t.tv_sec as f64 + t.tv_nsec as f64 * 1e-9
}

/// Least and median CPU seconds of a call over `repetitions` calls, after one to warm up.
pub fn cpu_time(repetitions: usize, mut work: impl FnMut()) -> (f64, f64) {
    work();
    let mut seconds: Vec<f64> = (0..repetitions)
        .map(|_| {
            let start = cpu_seconds();
            work();
            cpu_seconds() - start
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    (seconds[0], seconds[repetitions / 2])
}
