//! The parameters of the dynamic model, their names and their one order.

use crate::pose::Pose;
use nalgebra::{Matrix3, Matrix4, Vector3};
use std::fmt;

/// The ten standard inertial parameters of a link, about the origin of its frame and in its axes.
///
/// Order everywhere inside: `XX XY XZ YY YZ ZZ MX MY MZ M` (Gautier & Khalil); `XY` is the entry of the inertia
/// tensor, `-∫ x y dm`. Units kg·m², kg·m, kg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InertialParameters(pub [f64; 10]);

impl InertialParameters {
    /// A link without mass.
    pub const ZERO: Self = Self([0.0; 10]);

    /// From mass, centre of mass (m, link frame) and the inertia tensor about the centre of mass (kg·m², link axes).
    pub fn from_centre_of_mass(mass: f64, centre: Vector3<f64>, inertia: &Matrix3<f64>) -> Self {
        let about_origin = inertia + steiner(mass, &centre);
        Self::from_parts(mass, centre * mass, &about_origin)
    }

    /// From mass (kg), first moment (kg·m) and inertia tensor about the frame's origin (kg·m²).
    pub fn from_parts(mass: f64, first_moment: Vector3<f64>, i: &Matrix3<f64>) -> Self {
        let h = first_moment;
        Self([
            i[(0, 0)],
            i[(0, 1)],
            i[(0, 2)],
            i[(1, 1)],
            i[(1, 2)],
            i[(2, 2)],
            h.x,
            h.y,
            h.z,
            mass,
        ])
    }

    /// Mass, kg.
    pub fn mass(&self) -> f64 {
        self.0[9]
    }

    /// First moment `M s`, kg·m.
    pub fn first_moment(&self) -> Vector3<f64> {
        Vector3::new(self.0[6], self.0[7], self.0[8])
    }

    /// Inertia tensor about the origin of the link frame, kg·m².
    pub fn inertia(&self) -> Matrix3<f64> {
        let [xx, xy, xz, yy, yz, zz, ..] = self.0;
        Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }

    /// Inertia tensor about the centre of mass, kg·m²; not finite when the mass is zero.
    pub fn inertia_about_centre_of_mass(&self) -> Matrix3<f64> {
        let m = self.mass();
        self.inertia() - steiner(m, &(self.first_moment() / m))
    }

    /// Pseudo-inertia `[[Σ, h], [hᵀ, m]]` with `Σ = ½ tr(I)·1 - I`.
    ///
    /// A rigid body can have these parameters iff it is positive definite (Wensing, Kim & Slotine 2018).
    pub fn pseudo_inertia(&self) -> Matrix4<f64> {
        let i = self.inertia();
        let sigma = Matrix3::identity() * (0.5 * i.trace()) - i;
        let h = self.first_moment();
        let mut p = Matrix4::zeros();
        p.fixed_view_mut::<3, 3>(0, 0).copy_from(&sigma);
        p.fixed_view_mut::<3, 1>(0, 3).copy_from(&h);
        p.fixed_view_mut::<1, 3>(3, 0).copy_from(&h.transpose());
        p[(3, 3)] = self.mass();
        p
    }

    /// The same body expressed in another frame, `to_from_here`.
    #[must_use]
    pub fn expressed_in(&self, to_from_here: &Pose) -> Self {
        let (r, p) = (&to_from_here.rotation, &to_from_here.translation);
        let m = self.mass();
        let h = r * self.first_moment();
        let i = r * self.inertia() * r.transpose();
        // Parallel axes for a point that is not the centre of mass: I' = I + [p]ᵀ[h] + [h]ᵀ[p] + m [p]ᵀ[p].
        let (px, hx) = (p.cross_matrix(), h.cross_matrix());
        let i = i - px * hx - hx * px - px * px * m;
        Self::from_parts(m, h + p * m, &i)
    }

    /// Sum of two bodies in the same frame.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + other.0[k]))
    }
}

fn steiner(mass: f64, c: &Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * c.dot(c) - c * c.transpose()) * mass
}

/// What a column of the regressor multiplies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ParameterKind {
    /// Inertia tensor entry xx about the link frame's origin, kg·m².
    XX,
    /// Inertia tensor entry xy (`-∫ x y dm`), kg·m².
    XY,
    /// Inertia tensor entry xz, kg·m².
    XZ,
    /// Inertia tensor entry yy, kg·m².
    YY,
    /// Inertia tensor entry yz, kg·m².
    YZ,
    /// Inertia tensor entry zz, kg·m².
    ZZ,
    /// First moment x, kg·m.
    MX,
    /// First moment y, kg·m.
    MY,
    /// First moment z, kg·m.
    MZ,
    /// Mass, kg.
    M,
    /// Rotor inertia seen at the joint (gear ratio squared times the rotor's), kg·m².
    Ia,
    /// Viscous friction, N·m·s/rad.
    Fv,
    /// Coulomb friction, N·m.
    Fc,
    /// Constant torque (current sensor offset, asymmetric Coulomb friction), N·m.
    Offset,
}

impl ParameterKind {
    /// The ten inertial kinds in the standard order.
    pub const INERTIAL: [Self; 10] = [
        Self::XX,
        Self::XY,
        Self::XZ,
        Self::YY,
        Self::YZ,
        Self::ZZ,
        Self::MX,
        Self::MY,
        Self::MZ,
        Self::M,
    ];

    /// The kinds a drive adds to its joint, in order.
    pub const DRIVE: [Self; 4] = [Self::Ia, Self::Fv, Self::Fc, Self::Offset];

    /// Position within the ten inertial parameters, `None` for a drive's parameter.
    pub fn inertial_index(self) -> Option<usize> {
        // The inertial kinds come first, in the order of `INERTIAL`.
        Some(self as usize).filter(|&k| k < Self::INERTIAL.len())
    }

    /// SI unit of the parameter for a revolute joint.
    pub fn unit(self) -> &'static str {
        match self {
            Self::XX | Self::XY | Self::XZ | Self::YY | Self::YZ | Self::ZZ | Self::Ia => "kg·m²",
            Self::MX | Self::MY | Self::MZ => "kg·m",
            Self::M => "kg",
            Self::Fv => "N·m·s/rad",
            Self::Fc | Self::Offset => "N·m",
        }
    }
}

/// The words a parameter is printed in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Notation {
    /// `XX2 MX2 M2`, Gautier & Khalil.
    #[default]
    Gautier,
    /// `Ixx2 mx2 m2`, Radkhah, Kulić & Croft.
    Tensor,
}

/// Identity of one column: which kind, of which link or joint (0-based; names count from 1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Parameter {
    /// What the column multiplies.
    pub kind: ParameterKind,
    /// Link (inertial kinds) or joint (drive kinds), counted from 0.
    pub index: usize,
}

impl Parameter {
    /// Name with the number counted from 1, `MX2` or `mx2`.
    pub fn name(&self, notation: Notation) -> String {
        use ParameterKind as K;
        let word = match (notation, self.kind) {
            (Notation::Gautier, K::XX) => "XX",
            (Notation::Gautier, K::XY) => "XY",
            (Notation::Gautier, K::XZ) => "XZ",
            (Notation::Gautier, K::YY) => "YY",
            (Notation::Gautier, K::YZ) => "YZ",
            (Notation::Gautier, K::ZZ) => "ZZ",
            (Notation::Gautier, K::MX) => "MX",
            (Notation::Gautier, K::MY) => "MY",
            (Notation::Gautier, K::MZ) => "MZ",
            (Notation::Gautier, K::M) => "M",
            (Notation::Tensor, K::XX) => "Ixx",
            (Notation::Tensor, K::XY) => "Ixy",
            (Notation::Tensor, K::XZ) => "Ixz",
            (Notation::Tensor, K::YY) => "Iyy",
            (Notation::Tensor, K::YZ) => "Iyz",
            (Notation::Tensor, K::ZZ) => "Izz",
            (Notation::Tensor, K::MX) => "mx",
            (Notation::Tensor, K::MY) => "my",
            (Notation::Tensor, K::MZ) => "mz",
            (Notation::Tensor, K::M) => "m",
            (_, K::Ia) => "Ia",
            (_, K::Fv) => "Fv",
            (_, K::Fc) => "Fc",
            (_, K::Offset) => "off",
        };
        format!("{word}{}", self.index + 1)
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name(Notation::Gautier))
    }
}

/// Which drive columns stand beside the inertial ones.
// Each column is there or not, independently.
#[allow(clippy::struct_excessive_bools)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DriveColumns {
    /// `Ia · q̈`.
    pub rotor: bool,
    /// `Fv · q̇`.
    pub viscous: bool,
    /// `Fc · sign(q̇)`.
    pub coulomb: bool,
    /// A constant.
    pub offset: bool,
}

impl DriveColumns {
    /// No drive column: the rigid body alone.
    pub const NONE: Self = Self {
        rotor: false,
        viscous: false,
        coulomb: false,
        offset: false,
    };
    /// All four.
    pub const ALL: Self = Self {
        rotor: true,
        viscous: true,
        coulomb: true,
        offset: true,
    };
}

/// The columns of a regressor: which parameters, in which order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Columns(pub Vec<Parameter>);

impl Columns {
    /// All `10 n` inertial parameters, link by link in the standard order.
    pub fn inertial(n_joints: usize) -> Self {
        Self::standard(n_joints, DriveColumns::NONE)
    }

    /// Link by link: the ten inertial parameters, then the drive columns asked for.
    pub fn standard(n_joints: usize, drive: DriveColumns) -> Self {
        let mut columns = Vec::with_capacity(14 * n_joints);
        for index in 0..n_joints {
            let mut push = |kind| columns.push(Parameter { kind, index });
            ParameterKind::INERTIAL.into_iter().for_each(&mut push);
            let wanted = [drive.rotor, drive.viscous, drive.coulomb, drive.offset];
            for (kind, wanted) in ParameterKind::DRIVE.into_iter().zip(wanted) {
                if wanted {
                    push(kind);
                }
            }
        }
        Self(columns)
    }

    /// The columns at these positions, in this order.
    #[must_use]
    pub fn select(&self, positions: &[usize]) -> Self {
        Self(positions.iter().map(|&k| self.0[k]).collect())
    }

    /// Number of columns.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there is no column.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Names in order.
    pub fn names(&self, notation: Notation) -> Vec<String> {
        self.0.iter().map(|p| p.name(notation)).collect()
    }
}
