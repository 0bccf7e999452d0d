//! The 6 × 10 map of a link's parameters to its wrench, entry by entry against an axis.

use crate::frame::{inner, shift};
use crate::kinematics::{LinkMotion, Screw};
use crate::lane::{Lane, V3, dot, read, write};

/// Form of an axis: parallel to z.
pub(crate) const ABOUT_Z: u8 = 0;
/// Form of an axis: no part along z.
pub(crate) const ACROSS: u8 = 1;
/// Form of an axis: any.
pub(crate) const ANY: u8 = 2;
/// Form of an axis: no angular part.
pub(crate) const SLIDE: u8 = 3;

/// The map of a link's ten parameters to its wrench, with what its entries share computed once.
///
/// Entries count as the parameters: the tensor's six, then `MX MY MZ M`. Axis: angular part `v`, linear part `f`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WrenchMap<T> {
    /// Angular acceleration, rad/s².
    pub(crate) wd: V3<T>,
    /// Acceleration of the frame's origin minus gravity, m/s².
    pub(crate) a: V3<T>,
    /// `[ω̇]× + [ω]×[ω]×`: force per first moment.
    b: [V3<T>; 3],
    /// `ωx ωy`, `ωx ωz`, `ωy ωz`.
    xy: T,
    xz: T,
    yz: T,
    /// `ωx² - ωy²`, `ωz² - ωx²`, `ωy² - ωz²`.
    x_y: T,
    z_x: T,
    y_z: T,
}

impl<T: Lane> WrenchMap<T> {
    #[inline(always)]
    pub(crate) fn new(m: &LinkMotion<T>) -> Self {
        let [x, y, z] = m.w;
        let [dx, dy, dz] = m.wd;
        let (xx, yy, zz) = (x * x, y * y, z * z);
        let (xy, xz, yz) = (x * y, x * z, y * z);
        Self {
            wd: m.wd,
            a: m.a,
            b: [
                [-(yy + zz), xy - dz, xz + dy],
                [xy + dz, -(xx + zz), yz - dx],
                [xz - dy, yz + dx, -(xx + yy)],
            ],
            xy,
            xz,
            yz,
            x_y: xx - yy,
            z_x: zz - xx,
            y_z: yy - zz,
        }
    }

    /// For a link that turns about z only.
    #[inline(always)]
    pub(crate) fn planar(m: &LinkMotion<T>) -> Self {
        let o = m.w[2].like(0.0);
        let zz = m.w[2] * m.w[2];
        let dz = m.wd[2];
        Self {
            wd: m.wd,
            a: m.a,
            b: [[-zz, -dz, o], [dz, -zz, o], [o, o, o]],
            xy: o,
            xz: o,
            yz: o,
            x_y: o,
            z_x: zz,
            y_z: -zz,
        }
    }

    /// Acceleration of a point fixed in the link.
    #[inline(always)]
    pub(crate) fn acceleration_at(&self, p: [f64; 3]) -> V3<T> {
        let mut a = self.a;
        for (c, &p) in p.iter().enumerate() {
            if p != 0.0 {
                for k in 0..3 {
                    a[k] = self.b[k][c].mul_add(a[k].like(p), a[k]);
                }
            }
        }
        a
    }

    /// Motion of the frame at this pose in the frame of the link's joint, whose motion is `m`, in its own axes.
    #[inline(always)]
    pub(crate) fn motion_at(
        &self,
        m: &LinkMotion<T>,
        rotation: &[[f64; 3]; 3],
        translation: [f64; 3],
    ) -> LinkMotion<T> {
        LinkMotion {
            w: inner(rotation, m.w),
            wd: inner(rotation, m.wd),
            a: inner(rotation, self.acceleration_at(translation)),
        }
    }

    /// To memory.
    #[inline(always)]
    pub(crate) fn write(&self, at: T::At, cells: &mut WrenchMap<T::Cell>) {
        write(at, self.wd, &mut cells.wd);
        write(at, self.a, &mut cells.a);
        for k in 0..3 {
            write(at, self.b[k], &mut cells.b[k]);
        }
        self.xy.write(at, &mut cells.xy);
        self.xz.write(at, &mut cells.xz);
        self.yz.write(at, &mut cells.yz);
        self.x_y.write(at, &mut cells.x_y);
        self.z_x.write(at, &mut cells.z_x);
        self.y_z.write(at, &mut cells.y_z);
    }
}

// The entries take from memory what they need: all of it at once fits no register file.
impl<C: Copy> WrenchMap<C> {
    /// All zero, in memory.
    pub(crate) fn cells(zero: C) -> Self {
        Self {
            wd: [zero; 3],
            a: [zero; 3],
            b: [[zero; 3]; 3],
            xy: zero,
            xz: zero,
            yz: zero,
            x_y: zero,
            z_x: zero,
            y_z: zero,
        }
    }

    /// Acceleration of a point fixed in the link, where it is known already which of its coordinates are zero.
    #[inline(always)]
    pub(crate) fn acceleration_where<T: Lane<Cell = C>>(
        &self,
        at: T::At,
        reaches: [bool; 3],
        p: [f64; 3],
    ) -> V3<T> {
        let mut a = read(at, &self.a);
        if reaches[0] {
            a = self.further(at, 0, p[0], a);
        }
        if reaches[1] {
            a = self.further(at, 1, p[1], a);
        }
        if reaches[2] {
            a = self.further(at, 2, p[2], a);
        }
        a
    }

    #[inline(always)]
    fn further<T: Lane<Cell = C>>(&self, at: T::At, c: usize, p: f64, a: V3<T>) -> V3<T> {
        let p = T::splat(at, p);
        [
            T::read(at, &self.b[0][c]).mul_add(p, a[0]),
            T::read(at, &self.b[1][c]).mul_add(p, a[1]),
            T::read(at, &self.b[2][c]).mul_add(p, a[2]),
        ]
    }

    /// Entry `k < 6` of a revolute axis of the given form.
    #[inline(always)]
    pub(crate) fn tensor_entry<T: Lane<Cell = C>, const FORM: u8>(
        &self,
        at: T::At,
        k: usize,
        [x, y, z]: V3<T>,
    ) -> T {
        let Self { wd, b, .. } = self;
        match (FORM, k) {
            (ABOUT_Z, 0) => -T::read(at, &self.xy),
            (ABOUT_Z, 1) => T::read(at, &self.x_y),
            (ABOUT_Z, 2) => -T::read(at, &b[1][2]),
            (ABOUT_Z, 3) => T::read(at, &self.xy),
            (ABOUT_Z, 4) => T::read(at, &b[0][2]),
            (ABOUT_Z, _) => T::read(at, &wd[2]),
            (ACROSS, 0) => x.mul_add(T::read(at, &wd[0]), y * T::read(at, &self.xz)),
            (ACROSS, 1) => y.mul_add(T::read(at, &b[2][1]), -(x * T::read(at, &b[2][0]))),
            (ACROSS, 2) => y.mul_add(T::read(at, &self.z_x), x * T::read(at, &b[1][0])),
            (ACROSS, 3) => y.mul_add(T::read(at, &wd[1]), -(x * T::read(at, &self.yz))),
            (ACROSS, 4) => x.mul_add(T::read(at, &self.y_z), -(y * T::read(at, &b[0][1]))),
            (ACROSS, _) => x.mul_add(T::read(at, &self.yz), -(y * T::read(at, &self.xz))),
            (_, 0) => x.mul_add(
                T::read(at, &wd[0]),
                y.mul_add(T::read(at, &self.xz), -(z * T::read(at, &self.xy))),
            ),
            (_, 1) => z.mul_add(
                T::read(at, &self.x_y),
                y.mul_add(T::read(at, &b[2][1]), -(x * T::read(at, &b[2][0]))),
            ),
            (_, 2) => y.mul_add(
                T::read(at, &self.z_x),
                x.mul_add(T::read(at, &b[1][0]), -(z * T::read(at, &b[1][2]))),
            ),
            (_, 3) => y.mul_add(
                T::read(at, &wd[1]),
                z.mul_add(T::read(at, &self.xy), -(x * T::read(at, &self.yz))),
            ),
            (_, 4) => x.mul_add(
                T::read(at, &self.y_z),
                z.mul_add(T::read(at, &b[0][2]), -(y * T::read(at, &b[0][1]))),
            ),
            (_, _) => z.mul_add(
                T::read(at, &wd[2]),
                x.mul_add(T::read(at, &self.yz), -(y * T::read(at, &self.xz))),
            ),
        }
    }

    /// Entry `k >= 6` of a revolute axis with linear part `f`; about z, that part lies across z.
    #[inline(always)]
    pub(crate) fn moment_entry<T: Lane<Cell = C>, const FORM: u8>(
        &self,
        at: T::At,
        k: usize,
        [x, y, z]: V3<T>,
        f: V3<T>,
    ) -> T {
        let Self { a, b, .. } = self;
        if FORM == ABOUT_Z {
            return match k {
                6 => f[0].mul_add(
                    T::read(at, &b[0][0]),
                    f[1].mul_add(T::read(at, &b[1][0]), T::read(at, &a[1])),
                ),
                7 => f[0].mul_add(
                    T::read(at, &b[0][1]),
                    f[1].mul_add(T::read(at, &b[1][1]), -T::read(at, &a[0])),
                ),
                8 => f[0].mul_add(T::read(at, &b[0][2]), f[1] * T::read(at, &b[1][2])),
                _ => f[0].mul_add(T::read(at, &a[0]), f[1] * T::read(at, &a[1])),
            };
        }
        let force = self.force_entry(at, k, f);
        match (FORM, k) {
            (ACROSS, 6) => (-y).mul_add(T::read(at, &a[2]), force),
            (ACROSS, 7) => x.mul_add(T::read(at, &a[2]), force),
            (SLIDE, _) => force,
            (_, 6) => z.mul_add(T::read(at, &a[1]), (-y).mul_add(T::read(at, &a[2]), force)),
            (_, 7) => x.mul_add(T::read(at, &a[2]), (-z).mul_add(T::read(at, &a[0]), force)),
            (_, 8) => y.mul_add(T::read(at, &a[0]), (-x).mul_add(T::read(at, &a[1]), force)),
            (_, _) => force,
        }
    }

    /// Entry `k >= 6` of a slide along `f`.
    #[inline(always)]
    pub(crate) fn force_entry<T: Lane<Cell = C>>(&self, at: T::At, k: usize, f: V3<T>) -> T {
        match k {
            6..9 => {
                let c = k - 6;
                let [x, y, z] = [&self.b[0][c], &self.b[1][c], &self.b[2][c]];
                let z = f[2] * T::read(at, z);
                f[0].mul_add(T::read(at, x), f[1].mul_add(T::read(at, y), z))
            }
            _ => dot(f, read(at, &self.a)),
        }
    }
}

impl<T: Lane> Screw<T> {
    /// This motion at a frame that moves with the link.
    #[inline(always)]
    pub(crate) fn at(&self, rotation: &[[f64; 3]; 3], translation: [f64; 3]) -> Self {
        Self {
            angular: inner(rotation, self.angular),
            linear: inner(rotation, shift(translation, self.linear, self.angular)),
        }
    }
}
