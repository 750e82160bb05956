//! Input and output of a step.
//!
//! Main types: [`Motion`], [`Response`], [`ForceResponse`]. Uses regime and math.

use crate::math::Scalar;
use crate::{Regime, Status};

/// Motion of the plane in one step.
///
/// The slide is an increment because an absolute one would lose microns in 32 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Motion<T = f32> {
    /// Depth at the end of the step, mm, positive into the finger; 0 or less is no contact.
    pub depth_mm: T,
    /// Slide of the plane against the finger's base during the step, mm: motion of a plane at its foot, the point under first touch, or of
    /// the apex of a curved body.
    pub slide_increment_mm: [T; 2],
    /// Turn of the plane about its normal through the foot, or of a curved body through its apex, during the step, rad: counter-clockwise
    /// seen from the finger. Only a contact with spin ([`crate::SpinState`]) follows it; another flags it.
    pub spin_increment_rad: T,
    /// Length of the step, s, > 0. Without tissue that relaxes the law is rate-independent.
    pub dt_s: T,
}

/// Forces that the plane exerts on the finger, and the margin to full slip.
///
/// Outside this crate it is made from [`Response::default`], whose fields can be set.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Response<T = f32> {
    /// Force along the normal, N. Negative where stuck flanks of a curved body pull; never on a plane.
    pub normal_force_n: T,
    /// Force along x and y, N; friction points along the body's motion. On a curved body the pressure on its slopes is part of it.
    pub friction_n: [T; 2],
    /// Friction alone along x and y, N: the sum of the tangential tractions. On a plane the force along x and y.
    pub tangential_friction_n: [T; 2],
    /// Stuck area over contact area: 1 in a fresh contact, 0 in full slip and without contact.
    pub stick_ratio: T,
    /// Largest friction in the direction of the present one, N.
    pub friction_limit_n: T,
    /// 1 less the share of its limit that friction uses, 0 to 1. With spin the load is friction and its moment together. 0 without
    /// contact, which holds no load: a grip controller then closes.
    pub slip_margin: T,
    /// The margin that is left when the tissue has relaxed at the present depth, if the load stays: 0 to 1, 0 where the load slips before.
    /// The slip margin itself where nothing relaxes. Within 2 % of the load's share of the limit after a hold.
    pub slip_margin_relaxed: T,
    /// Moment about the plane's normal through the point under first touch, N mm, positive as the plane turns the finger
    /// counter-clockwise seen from above. Without spin that of friction along y alone.
    pub spin_moment_n_mm: T,
    /// Moments M_x and M_y of all forces through the point under first touch, N mm.
    pub tilt_moment_n_mm: [T; 2],
    /// Centre of pressure along x and y from the point under first touch, mm: M_x = N y, M_y = −N x. A pad gives 0 where the normal
    /// force is not positive.
    pub pressure_centre_mm: [T; 2],
    /// Contact area, mm².
    pub contact_area_mm2: T,
    /// Half-width of the 95 % band of the normal force, N.
    pub band_normal_n: T,
    /// Half-width of the 95 % band of each friction component, N.
    pub band_friction_n: T,
    /// Regime of the contact as a whole.
    pub regime: Regime,
    /// Flags that qualify the response.
    pub status: Status,
}

impl Response {
    /// The response without contact.
    pub const IN_THE_AIR: Self = Self {
        normal_force_n: 0.0,
        friction_n: [0.0; 2],
        tangential_friction_n: [0.0; 2],
        stick_ratio: 0.0,
        friction_limit_n: 0.0,
        slip_margin: 0.0,
        slip_margin_relaxed: 0.0,
        spin_moment_n_mm: 0.0,
        tilt_moment_n_mm: [0.0; 2],
        pressure_centre_mm: [0.0; 2],
        contact_area_mm2: 0.0,
        band_normal_n: 0.0,
        band_friction_n: 0.0,
        regime: Regime::NoContact,
        status: Status::OK,
    };
}

impl<T: Scalar> Response<T> {
    /// The same on a plane: all force along it is friction, and the normal force acts at its centre.
    #[inline(always)]
    pub(crate) fn on_plane(self) -> Self {
        let (normal, [x, y]) = (self.normal_force_n, self.pressure_centre_mm);
        Self { tangential_friction_n: self.friction_n, tilt_moment_n_mm: [normal * y, -(normal * x)], ..self }
    }
}

/// The part of a [`Response`] that needs no history of slip; see [`crate::ModelOf::step_forces`]. Its fields are those of the response.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ForceResponse<T = f32> {
    /// Normal force, N, >= 0.
    pub normal_force_n: T,
    /// Friction along x and y, N.
    pub friction_n: [T; 2],
    /// Largest friction in the direction of the present one, N; 0 without contact.
    pub friction_limit_n: T,
    /// 1 less the share of its limit that the load uses, 0 to 1; 0 without contact.
    pub slip_margin: T,
    /// Moment about the plane's normal through the point under first touch, N mm.
    pub spin_moment_n_mm: T,
    /// Centre of pressure along x and y from the point under first touch, mm.
    pub pressure_centre_mm: [T; 2],
    /// Contact area, mm².
    pub contact_area_mm2: T,
    /// Flags that qualify the response.
    pub status: Status,
}

impl<T> From<Response<T>> for ForceResponse<T> {
    #[inline(always)]
    fn from(response: Response<T>) -> Self {
        Self {
            normal_force_n: response.normal_force_n,
            friction_n: response.friction_n,
            friction_limit_n: response.friction_limit_n,
            slip_margin: response.slip_margin,
            spin_moment_n_mm: response.spin_moment_n_mm,
            pressure_centre_mm: response.pressure_centre_mm,
            contact_area_mm2: response.contact_area_mm2,
            status: response.status,
        }
    }
}
