//! The 6 × 10 map of a link's parameters to its wrench, entry by entry against an axis.

use crate::frame::{inner, shift};
use crate::kinematics::{LinkMotion, Screw};
use crate::lane::{Lane, V3, dot};

/// Form of an axis: parallel to z.
pub(crate) const ABOUT_Z: u8 = 0;
/// Form of an axis: no part along z.
pub(crate) const ACROSS: u8 = 1;
/// Form of an axis: any.
pub(crate) const ANY: u8 = 2;

/// The map of a link's ten parameters to its wrench, with what its entries share computed once.
///
/// Entries count as the parameters: the tensor's six, then `MX MY MZ M`. Axis: angular part `v`, linear part `f`.
pub(crate) struct WrenchMap<T> {
    m: LinkMotion<T>,
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
            m: *m,
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
            m: *m,
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
        let mut a = self.m.a;
        for (c, &p) in p.iter().enumerate() {
            if p != 0.0 {
                for k in 0..3 {
                    a[k] = self.b[k][c].mul_add(a[k].like(p), a[k]);
                }
            }
        }
        a
    }

    /// Motion of the frame at this pose in the link's joint frame, in its own axes.
    #[inline(always)]
    pub(crate) fn motion_at(
        &self,
        rotation: &[[f64; 3]; 3],
        translation: [f64; 3],
    ) -> LinkMotion<T> {
        LinkMotion {
            w: inner(rotation, self.m.w),
            wd: inner(rotation, self.m.wd),
            a: inner(rotation, self.acceleration_at(translation)),
        }
    }

    /// Entry `k < 6` of a revolute axis of the given form.
    #[inline(always)]
    pub(crate) fn tensor_entry<const FORM: u8>(&self, k: usize, [x, y, z]: V3<T>) -> T {
        let b = &self.b;
        let [dx, dy, dz] = self.m.wd;
        match (FORM, k) {
            (ABOUT_Z, 0) => -self.xy,
            (ABOUT_Z, 1) => self.x_y,
            (ABOUT_Z, 2) => -b[1][2],
            (ABOUT_Z, 3) => self.xy,
            (ABOUT_Z, 4) => b[0][2],
            (ABOUT_Z, _) => dz,
            (ACROSS, 0) => x.mul_add(dx, y * self.xz),
            (ACROSS, 1) => y.mul_add(b[2][1], -(x * b[2][0])),
            (ACROSS, 2) => y.mul_add(self.z_x, x * b[1][0]),
            (ACROSS, 3) => y.mul_add(dy, -(x * self.yz)),
            (ACROSS, 4) => x.mul_add(self.y_z, -(y * b[0][1])),
            (ACROSS, _) => x.mul_add(self.yz, -(y * self.xz)),
            (_, 0) => x.mul_add(dx, y.mul_add(self.xz, -(z * self.xy))),
            (_, 1) => z.mul_add(self.x_y, y.mul_add(b[2][1], -(x * b[2][0]))),
            (_, 2) => y.mul_add(self.z_x, x.mul_add(b[1][0], -(z * b[1][2]))),
            (_, 3) => y.mul_add(dy, z.mul_add(self.xy, -(x * self.yz))),
            (_, 4) => x.mul_add(self.y_z, z.mul_add(b[0][2], -(y * b[0][1]))),
            (_, _) => z.mul_add(dz, x.mul_add(self.yz, -(y * self.xz))),
        }
    }

    /// Entry `k >= 6` of a revolute axis with linear part `f`; about z, that part lies across z.
    #[inline(always)]
    pub(crate) fn moment_entry<const FORM: u8>(&self, k: usize, [x, y, z]: V3<T>, f: V3<T>) -> T {
        let [ax, ay, az] = self.m.a;
        let b = &self.b;
        if FORM == ABOUT_Z {
            return match k {
                6 => f[0].mul_add(b[0][0], f[1].mul_add(b[1][0], ay)),
                7 => f[0].mul_add(b[0][1], f[1].mul_add(b[1][1], -ax)),
                8 => f[0].mul_add(b[0][2], f[1] * b[1][2]),
                _ => f[0].mul_add(ax, f[1] * ay),
            };
        }
        let force = self.force_entry(k, f);
        match (FORM, k) {
            (ACROSS, 6) => (-y).mul_add(az, force),
            (ACROSS, 7) => x.mul_add(az, force),
            (_, 6) => z.mul_add(ay, (-y).mul_add(az, force)),
            (_, 7) => x.mul_add(az, (-z).mul_add(ax, force)),
            (_, 8) => y.mul_add(ax, (-x).mul_add(ay, force)),
            (_, _) => force,
        }
    }

    /// Entry `k >= 6` of a slide along `f`.
    #[inline(always)]
    pub(crate) fn force_entry(&self, k: usize, f: V3<T>) -> T {
        match k {
            6..9 => {
                let c = k - 6;
                let b = &self.b;
                f[0].mul_add(b[0][c], f[1].mul_add(b[1][c], f[2] * b[2][c]))
            }
            _ => dot(f, self.m.a),
        }
    }

    /// Entries 6 and 7 of the link's own axis; the last two are zero.
    #[inline(always)]
    pub(crate) fn own_moment_entry(&self, k: usize) -> T {
        if k == 6 { self.m.a[1] } else { -self.m.a[0] }
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
