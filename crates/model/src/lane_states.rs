//! Eight samples at a time out of arrays that have all samples of a joint, then those of the next (joints × samples).

use crate::states::JointStates;
use crate::wide::F64x8;

/// Eight samples of every joint, the last sample repeated where there are fewer.
#[derive(Debug, Clone)]
pub(crate) struct LaneStates {
    q: Vec<F64x8>,
    qd: Vec<F64x8>,
    qdd: Vec<F64x8>,
}

impl LaneStates {
    pub(crate) fn new(n_joints: usize) -> Self {
        let zeros = vec![F64x8::ZERO; n_joints];
        Self {
            q: zeros.clone(),
            qd: zeros.clone(),
            qdd: zeros,
        }
    }

    /// Positions, velocities and accelerations, one lane a joint.
    #[inline]
    pub(crate) fn state(&self) -> [&[F64x8]; 3] {
        [&self.q, &self.qd, &self.qdd]
    }

    pub(crate) fn load(&mut self, states: &JointStates, first: usize) {
        pulp::Arch::new().dispatch(Load {
            lanes: self,
            states,
            first,
        });
    }

    #[inline(always)]
    fn load_here(&mut self, states: &JointStates, first: usize) {
        let lanes = [&mut self.q, &mut self.qd, &mut self.qdd];
        for (lanes, all) in lanes.into_iter().zip(states.arrays()) {
            for (lane, row) in lanes.iter_mut().zip(all.chunks_exact(states.n_samples())) {
                load(lane, row, first);
            }
        }
    }
}

/// Written with the registers the kernels read with: a wide read of narrow writes has to wait.
struct Load<'a> {
    lanes: &'a mut LaneStates,
    states: &'a JointStates,
    first: usize,
}

impl pulp::WithSimd for Load<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.lanes.load_here(self.states, self.first);
    }
}

/// All that is to be done between one block of eight samples and the next, of a reader that keeps many of them.
pub(crate) struct NextBlock<'a> {
    pub(crate) lanes: &'a mut LaneStates,
    pub(crate) states: &'a JointStates,
    /// One number a joint and sample, as the states; zero without them.
    pub(crate) observed: Option<&'a [f64]>,
    /// Where the observation of each joint goes.
    pub(crate) places: &'a [usize],
    pub(crate) cells: &'a mut [F64x8],
    pub(crate) first: usize,
    /// Sample from which on memory is asked for eight, if there are any.
    pub(crate) soon: usize,
}

impl NextBlock<'_> {
    pub(crate) fn load(self) {
        let arch = pulp::Arch::new();
        arch.dispatch(Next(self, Memory::new(arch)));
    }
}

struct Next<'a>(NextBlock<'a>, Memory);

impl pulp::WithSimd for Next<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self(block, memory) = self;
        let n_samples = block.states.n_samples();
        block.lanes.load_here(block.states, block.first);
        if let Some(y) = block.observed {
            for (&place, row) in block.places.iter().zip(y.chunks_exact(n_samples)) {
                load(&mut block.cells[place], row, block.first);
            }
        } else {
            for &place in block.places {
                block.cells[place] = F64x8::ZERO;
            }
        }
        if block.soon < n_samples {
            for all in block.states.arrays().into_iter().chain(block.observed) {
                memory.ask_for(&all[block.soon..], n_samples);
            }
        }
    }
}

/// Has memory bring numbers near, without waiting for them, where the machine's instructions are known.
#[derive(Clone, Copy)]
struct Memory {
    #[cfg(target_arch = "x86_64")]
    sse: Option<pulp::core_arch::x86::Sse>,
}

impl Memory {
    #[cfg(target_arch = "x86_64")]
    fn new(arch: pulp::Arch) -> Self {
        let sse = match arch {
            pulp::Arch::V4(simd) => Some(simd.sse),
            pulp::Arch::V3(simd) => Some(simd.sse),
            _ => None,
        };
        Self { sse }
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn new(_: pulp::Arch) -> Self {
        Self {}
    }

    /// The lines that begin at every `step`-th number.
    #[inline(always)]
    fn ask_for(self, all: &[f64], step: usize) {
        #[cfg(target_arch = "x86_64")]
        if let Some(sse) = self.sse {
            use std::arch::x86_64::_MM_HINT_T0;
            for x in all.iter().step_by(step) {
                sse._mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(x).cast());
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = (all, step);
    }
}

#[inline(always)]
fn load(lane: &mut F64x8, row: &[f64], first: usize) {
    if let Some(full) = row[first..].first_chunk::<8>() {
        // By the slice: an array of its own would go by way of the stack.
        lane.0.copy_from_slice(full);
    } else {
        *lane = eight(row, first);
    }
}

/// Eight consecutive numbers, the last one repeated where there are fewer.
#[inline(always)]
pub(crate) fn eight(x: &[f64], first: usize) -> F64x8 {
    let rest = &x[first..];
    if let Some(full) = rest.first_chunk::<8>() {
        return F64x8(*full);
    }
    let mut few = [rest[rest.len() - 1]; 8];
    few[..rest.len()].copy_from_slice(rest);
    F64x8(few)
}
