//! Constant rotations and poses with their structure found out.

use crate::lane::{Lane, V3, dot, like};
use crate::parameter::InertialParameters;
use crate::pose::Pose;
use nalgebra::Matrix3;

/// Entries of a rotation this close to 0 or ±1 are what the maker meant: rounding of an angle, not a tilt.
const EXACT: f64 = 4.0 * f64::EPSILON;

/// The nearest integer where the number is within rounding of it.
pub(crate) fn clean(x: f64) -> f64 {
    let near = x.round();
    if (x - near).abs() < EXACT { near } else { x }
}

/// Rotation about z with this cosine and sine, up to their common length; exact at quarter turns.
pub(crate) fn about_z(c: f64, s: f64) -> Matrix3<f64> {
    let length = c.hypot(s);
    let (c, s) = (clean(c / length), clean(s / length));
    // Where one is exact the other is, too.
    let (c, s) = match (c.abs() == 1.0, s.abs() == 1.0) {
        (true, _) => (c, 0.0),
        (_, true) => (0.0, s),
        _ => (c, s),
    };
    Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
}

/// A rotation the kernels know to be simple, or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Rotation {
    /// None at all.
    None,
    /// About x by +90°.
    Quarter,
    /// About x.
    AboutX { c: f64, s: f64 },
    /// Row-major matrix.
    General([[f64; 3]; 3]),
}

/// A constant pose from a joint frame to the next.
#[derive(Debug, Clone)]
pub(crate) struct Fixed {
    pub(crate) rotation: Rotation,
    pub(crate) translation: [f64; 3],
    /// Which components of the translation are other than zero.
    pub(crate) reaches: [bool; 3],
}

impl Rotation {
    /// `Rᵀ v`: a vector of the outer frame in the inner one.
    #[inline(always)]
    pub(crate) fn inward<T: Lane>(&self, v: V3<T>) -> V3<T> {
        match *self {
            Self::None => v,
            Self::Quarter => [v[0], v[2], -v[1]],
            Self::AboutX { c, s } => {
                let (c, s) = (v[0].like(c), v[0].like(s));
                [
                    v[0],
                    c.mul_add(v[1], s * v[2]),
                    c.mul_add(v[2], -(s * v[1])),
                ]
            }
            Self::General(r) => columns_times(&r, v),
        }
    }

    /// `R v`: a vector of the inner frame in the outer one.
    #[inline(always)]
    pub(crate) fn outward<T: Lane>(&self, v: V3<T>) -> V3<T> {
        match *self {
            Self::None => v,
            Self::Quarter => [v[0], -v[2], v[1]],
            Self::AboutX { c, s } => {
                let (c, s) = (v[0].like(c), v[0].like(s));
                [
                    v[0],
                    c.mul_add(v[1], -(s * v[2])),
                    c.mul_add(v[2], s * v[1]),
                ]
            }
            Self::General(r) => rows_times(&r, v),
        }
    }
}

impl Fixed {
    pub(crate) fn new(pose: &Pose) -> Self {
        let r = pose.rotation.map(clean);
        let about_x = [(0, 1), (0, 2), (1, 0), (2, 0)]
            .iter()
            .all(|&e| r[e] == 0.0);
        let rotation = if about_x && r[(0, 0)] == 1.0 {
            match (r[(1, 1)], r[(2, 1)]) {
                (1.0, _) => Rotation::None,
                (_, 1.0) => Rotation::Quarter,
                (c, s) => Rotation::AboutX { c, s },
            }
        } else {
            Rotation::General(rows(&r))
        };
        Self {
            rotation,
            translation: pose.translation.into(),
            reaches: [0, 1, 2].map(|k| pose.translation[k] != 0.0),
        }
    }

    /// Whether there is a translation at all.
    #[inline(always)]
    pub(crate) fn has_translation(&self) -> bool {
        self.translation != [0.0; 3]
    }

    /// The translation in every sample.
    #[inline(always)]
    pub(crate) fn translation<T: Lane>(&self, lane: T) -> V3<T> {
        like(lane, self.translation)
    }
}

fn rows(r: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| r[(i, j)]))
}

#[inline(always)]
fn columns_times<T: Lane>(r: &[[f64; 3]; 3], v: V3<T>) -> V3<T> {
    [
        dot(like(v[0], [r[0][0], r[1][0], r[2][0]]), v),
        dot(like(v[0], [r[0][1], r[1][1], r[2][1]]), v),
        dot(like(v[0], [r[0][2], r[1][2], r[2][2]]), v),
    ]
}

#[inline(always)]
fn rows_times<T: Lane>(r: &[[f64; 3]; 3], v: V3<T>) -> V3<T> {
    [
        dot(like(v[0], r[0]), v),
        dot(like(v[0], r[1]), v),
        dot(like(v[0], r[2]), v),
    ]
}

/// `w × p + v` with a constant `p`: zero components cost nothing.
#[inline(always)]
pub(crate) fn shift<T: Lane>(p: [f64; 3], v: V3<T>, w: V3<T>) -> V3<T> {
    shift_where([p[0] != 0.0, p[1] != 0.0, p[2] != 0.0], p, v, w)
}

/// The same where it is known already which components are zero.
#[inline(always)]
pub(crate) fn shift_where<T: Lane>(reaches: [bool; 3], p: [f64; 3], v: V3<T>, w: V3<T>) -> V3<T> {
    let mut out = v;
    let [px, py, pz] = p;
    if reaches[0] {
        let p = w[0].like(px);
        out[1] = w[2].mul_add(p, out[1]);
        out[2] = (-w[1]).mul_add(p, out[2]);
    }
    if reaches[1] {
        let p = w[0].like(py);
        out[0] = (-w[2]).mul_add(p, out[0]);
        out[2] = w[0].mul_add(p, out[2]);
    }
    if reaches[2] {
        let p = w[0].like(pz);
        out[0] = w[1].mul_add(p, out[0]);
        out[1] = (-w[0]).mul_add(p, out[1]);
    }
    out
}

/// What is added to a revolute joint's position: whole quarter turns, kept exact, and the rest, rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Offset {
    pub(crate) quarters: u64,
    pub(crate) rest: f64,
}

impl Offset {
    pub(crate) fn new(about_z: &Matrix3<f64>) -> Self {
        let (c, s) = (clean(about_z[(0, 0)]), clean(about_z[(1, 0)]));
        let whole = |quarters| Self {
            quarters,
            rest: 0.0,
        };
        match (c, s) {
            (1.0, _) => whole(0),
            (_, 1.0) => whole(1),
            (-1.0, _) => whole(2),
            (_, -1.0) => whole(3),
            _ => Self {
                quarters: 0,
                rest: s.atan2(c),
            },
        }
    }
}

/// The link's frame in its joint's frame.
#[derive(Debug, Clone)]
pub(crate) enum LinkPose {
    /// Same origin, axes along each other: the link's parameter `k` is, with this sign, this one of the joint frame.
    Along([(usize, f64); 10]),
    /// Anywhere.
    Posed {
        rotation: [[f64; 3]; 3],
        translation: [f64; 3],
        pose: Pose,
    },
}

impl LinkPose {
    pub(crate) fn new(pose: &Pose) -> Self {
        let r = pose.rotation.map(clean);
        let signed = |k: usize| {
            (0..3)
                .find(|&j| r[(k, j)].abs() == 1.0)
                .map(|j| (j, r[(k, j)]))
        };
        if pose.translation.iter().all(|&x| x == 0.0)
            && let (Some(x), Some(y), Some(z)) = (signed(0), signed(1), signed(2))
        {
            return Self::Along(permutation([x, y, z]));
        }
        Self::Posed {
            rotation: rows(&r),
            translation: pose.translation.into(),
            pose: Pose {
                rotation: r,
                translation: pose.translation,
            },
        }
    }

    /// Ten parameters of the link frame in the joint frame.
    pub(crate) fn parameters(&self, ten: &[f64]) -> [f64; 10] {
        match self {
            Self::Along(_) => {
                let mut out = [0.0; 10];
                for (k, &x) in ten.iter().enumerate() {
                    let (to, sign) = self.entry(k);
                    out[to] = sign * x;
                }
                out
            }
            Self::Posed { pose, .. } => {
                let ten = InertialParameters(std::array::from_fn(|k| ten[k]));
                ten.expressed_in(pose).0
            }
        }
    }

    /// Where the link's parameter `k` of the ten stands among those of the joint frame, and with which sign.
    ///
    /// The parameter's own place for a link that is not along its joint's axes.
    pub(crate) fn entry(&self, k: usize) -> (usize, f64) {
        match self {
            Self::Along(entries) => entries[k],
            Self::Posed { .. } => (k, 1.0),
        }
    }
}

/// Where the ten parameters go when link axis `axes[k].0`, times the sign, is joint axis `k`.
fn permutation(axes: [(usize, f64); 3]) -> [(usize, f64); 10] {
    // Link axis j is joint axis `to[j]`.
    let mut to = [(0, 1.0); 3];
    for (k, &(j, sign)) in axes.iter().enumerate() {
        to[j] = (k, sign);
    }
    std::array::from_fn(|k| match k {
        0..6 => {
            let [i, j] = TENSOR[k];
            (TENSOR_PLACE[to[i].0][to[j].0], to[i].1 * to[j].1)
        }
        6..9 => (6 + to[k - 6].0, to[k - 6].1),
        _ => (9, 1.0),
    })
}

/// Row and column of the tensor for each of the six.
const TENSOR: [[usize; 2]; 6] = [[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]];
const TENSOR_PLACE: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

/// `Rᵀ v` of a row-major rotation: a vector in the inner frame.
#[inline(always)]
pub(crate) fn inner<T: Lane>(r: &[[f64; 3]; 3], v: V3<T>) -> V3<T> {
    columns_times(r, v)
}

/// `R v`.
#[inline(always)]
pub(crate) fn outer<T: Lane>(r: &[[f64; 3]; 3], v: V3<T>) -> V3<T> {
    rows_times(r, v)
}
