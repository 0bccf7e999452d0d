//! How sets of points are taken down: powers, weights and when to stop, as found by trial on the arm of the paper.

/// How a set of points is taken down.
pub(crate) struct Schedule {
    /// One descent each: the power `2^k` of the norms that stand for the extreme eigenvalues, and the weight of the
    /// bound on the entries of `W`. Small weights let entries change sign, large ones hold them.
    pub(crate) phases: &'static [(u32, f64)],
    /// Descents at the last phase after the multipliers of that bound have moved.
    pub(crate) n_updates: usize,
    /// Times this is done, each time aiming lower, until `S` is held.
    pub(crate) n_attempts: usize,
    /// A descent stops when twenty iterations lower the logarithm by less.
    pub(crate) tolerance: f64,
    pub(crate) max_iterations: usize,
}

/// The three schedules of a search.
pub(crate) struct Schedules {
    /// From a random start: find the valley, no more.
    pub(crate) coarse: Schedule,
    /// From a disturbed good point.
    pub(crate) fine: Schedule,
    /// To the bottom: at `2^11` the norm of fifteen values is within 0.2 % of the largest.
    pub(crate) polish: Schedule,
}

/// Without a bound on the entries of `W`.
pub(crate) const FREE: Schedules = Schedules {
    coarse: Schedule {
        phases: &[(3, 0.0), (5, 0.0)],
        n_updates: 0,
        n_attempts: 0,
        tolerance: 1e-2,
        max_iterations: 300,
    },
    fine: Schedule {
        phases: &[(4, 0.0), (6, 0.0), (8, 0.0)],
        n_updates: 0,
        n_attempts: 0,
        tolerance: 2e-3,
        max_iterations: 300,
    },
    polish: Schedule {
        phases: &[(8, 0.0), (9, 0.0), (10, 0.0), (11, 0.0)],
        n_updates: 0,
        n_attempts: 0,
        tolerance: 1e-6,
        max_iterations: 3000,
    },
};

/// With `S` limited: a valley first, then the bound on the entries comes in slowly.
pub(crate) const LIMITED: Schedules = Schedules {
    coarse: Schedule {
        phases: &[
            (5, 0.0),
            (5, 0.005),
            (5, 0.01),
            (6, 0.02),
            (6, 0.04),
            (6, 0.08),
            (6, 0.16),
            (6, 0.32),
            (7, 1.0),
        ],
        n_updates: 4,
        n_attempts: 1,
        tolerance: 1e-3,
        max_iterations: 300,
    },
    fine: Schedule {
        phases: &[(6, 0.1), (6, 0.5), (7, 1.0)],
        n_updates: 4,
        n_attempts: 1,
        tolerance: 1e-3,
        max_iterations: 300,
    },
    polish: Schedule {
        phases: &[(8, 1.0), (9, 1.0), (10, 1.0)],
        n_updates: 8,
        n_attempts: 4,
        tolerance: 1e-4,
        max_iterations: 1000,
    },
};
