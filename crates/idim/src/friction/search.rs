//! The search for the terms of each joint that predict motions held out.

use super::dictionary::{Dictionary, stribeck_speeds};
use super::{FrictionTerm, JointFriction, reversals};
use crate::columns::ModelColumns;
use crate::error::Error;
use crate::plan::SamplingPlan;
use crate::samples::Stretch;
use idim_model::Robot;
use rayon::prelude::{IntoParallelRefIterator, ParallelIterator};

/// The friction of a joint, and what else was tried with the held-out error of the joint, N·m.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Chosen {
    pub(crate) friction: JointFriction,
    pub(crate) tried: Vec<(JointFriction, f64)>,
}

/// A parameter must lower the held-out mean square by this share to be worth having.
const PRICE: f64 = 0.03;
/// Steps of one joint's search at most.
const STEPS: usize = 6;
/// The speed of reversal a search begins with, rad/s.
const FIRST_REVERSAL: f64 = 0.005;

/// The friction of every joint.
///
/// `wanted`: the terms to have; with `auto` the search starts from them and may add or take away any. Otherwise only
/// speeds left open are searched. Each joint in turn, others as they stand; errors on blocks held out, each parameter at
/// a price.
pub(crate) fn search(
    robot: &Robot,
    shared: &ModelColumns,
    stretches: &[Stretch],
    plan: &SamplingPlan,
    wanted: &[JointFriction],
    auto: bool,
) -> Result<Vec<Chosen>, Error> {
    let mut dictionary = Dictionary::new(robot, shared, stretches, plan, wanted, auto)?;
    let mut now: Vec<JointFriction> = wanted
        .iter()
        .enumerate()
        .map(|(j, w)| first(robot, j, w, stretches, plan))
        .collect();
    if let Some(squares) = dictionary.held_out(&now, None) {
        dictionary.sigma = squares.iter().map(|s| s.sqrt().max(1e-12)).collect();
    }
    let mut tried: Vec<Vec<(JointFriction, f64)>> = vec![Vec::new(); now.len()];
    for joint in 0..now.len() {
        for _ in 0..STEPS {
            let start = now[joint].clone();
            let mut options = vec![start.clone()];
            let next = moves(
                robot,
                joint,
                &now[joint],
                &wanted[joint],
                stretches,
                plan,
                auto,
            );
            options.extend(
                next.into_iter()
                    .filter(|m| tried[joint].iter().all(|(t, _)| t != m)),
            );
            let errors: Vec<Option<(f64, f64)>> = options
                .par_iter()
                .map(|option| {
                    let mut frictions = now.clone();
                    frictions[joint] = option.clone();
                    let squares = dictionary
                        .held_out(&frictions, Some(joint).filter(|_| *option != start))?;
                    Some((score(&squares, &frictions), squares[joint].sqrt()))
                })
                .collect();
            let mut best = (0, f64::INFINITY);
            for (k, error) in errors.iter().enumerate() {
                let (score, rms) = error.unwrap_or((f64::INFINITY, f64::INFINITY));
                if tried[joint].iter().all(|(t, _)| *t != options[k]) {
                    tried[joint].push((options[k].clone(), rms));
                }
                if score < best.1 {
                    best = (k, score);
                }
            }
            if best.0 == 0 {
                break;
            }
            now[joint] = options.swap_remove(best.0);
        }
    }
    let chosen = |(friction, tried)| Chosen { friction, tried };
    Ok(now.into_iter().zip(tried).map(chosen).collect())
}

fn score(squares: &[f64], frictions: &[JointFriction]) -> f64 {
    let size: usize = frictions.iter().map(JointFriction::size).sum();
    squares.iter().map(|s| s.ln()).sum::<f64>() + PRICE * size as f64
}

/// Where the search begins: open speeds get their first value.
fn first(
    robot: &Robot,
    joint: usize,
    wanted: &JointFriction,
    stretches: &[Stretch],
    plan: &SamplingPlan,
) -> JointFriction {
    let mut friction = wanted.clone();
    if friction.reversal.is_none() {
        friction.reversal = Some(crate::columns::reversal_of(robot, joint, FIRST_REVERSAL));
    }
    for term in &mut friction.terms {
        if matches!(term, FrictionTerm::Stribeck(v) if v.is_nan()) {
            *term = FrictionTerm::Stribeck(stribeck_speeds(joint, stretches, plan)[2]);
        }
    }
    friction
}

/// One step from a choice: another speed, one term more, one less.
fn moves(
    robot: &Robot,
    joint: usize,
    now: &JointFriction,
    wanted: &JointFriction,
    stretches: &[Stretch],
    plan: &SamplingPlan,
    auto: bool,
) -> Vec<JointFriction> {
    let mut out = Vec::new();
    if wanted.reversal.is_none() {
        out.extend(reversals(robot, joint).map(|v| JointFriction {
            reversal: Some(v),
            ..now.clone()
        }));
    }
    let speeds = stribeck_speeds(joint, stretches, plan).map(FrictionTerm::Stribeck);
    let stribeck = |t: &FrictionTerm| matches!(t, FrictionTerm::Stribeck(_));
    let open = |t: &FrictionTerm| matches!(t, FrictionTerm::Stribeck(v) if v.is_nan());
    if auto || wanted.terms.iter().any(open) {
        for (k, _) in now.terms.iter().enumerate().filter(|(_, t)| stribeck(t)) {
            out.extend(speeds.map(|speed| {
                let mut other = now.clone();
                other.terms[k] = speed;
                other
            }));
        }
    }
    if auto {
        use FrictionTerm::{Asymmetric, Cubic, Load, Root};
        let fixed = [Asymmetric, Cubic, Root, Load];
        let has_stribeck = now.terms.iter().any(stribeck);
        let more = fixed.into_iter().filter(|t| !now.terms.contains(t));
        let speeds = speeds.into_iter().filter(|_| !has_stribeck);
        out.extend(more.chain(speeds).map(|term| {
            let mut other = now.clone();
            other.terms.push(term);
            other
        }));
        for k in 0..now.terms.len() {
            let mut other = now.clone();
            other.terms.remove(k);
            out.push(other);
        }
        let flags: [fn(&mut JointFriction) -> &mut bool; 3] =
            [|f| &mut f.viscous, |f| &mut f.coulomb, |f| &mut f.offset];
        out.extend(flags.map(|flag| {
            let mut other = now.clone();
            let flag = flag(&mut other);
            *flag = !*flag;
            other
        }));
    }
    out
}
