//! Plain numbers that go in and come out.

use fingerpad::{Motion, Regime, Response, Status};

/// No contact: the value of `regime` in a response.
pub const FINGERPAD_NO_CONTACT: u32 = 0;
/// The whole contact sticks: stick ratio at least 0.99.
pub const FINGERPAD_STICK: u32 = 1;
/// Part of the contact slips.
pub const FINGERPAD_PARTIAL_SLIP: u32 = 2;
/// The whole contact slips: stick ratio at most 0.01.
pub const FINGERPAD_SLIP: u32 = 3;

/// Flag of `status`: a number of the motion was NaN or infinite; the step was taken as if that axis stood still.
pub const FINGERPAD_STATUS_BAD_INPUT: u32 = 2;
/// Flag of `status`: the time step was not a positive number.
pub const FINGERPAD_STATUS_BAD_TIME_STEP: u32 = 4;
/// Flag of `status`: deeper than the model was fitted; the answer is that of the largest depth.
pub const FINGERPAD_STATUS_DEPTH_ABOVE_RANGE: u32 = 8;
/// Flag of `status`: the slide of one step exceeded 64 mm, or the spin 8 rad, and was cut to that.
pub const FINGERPAD_STATUS_LARGE_INCREMENT: u32 = 16;
/// Flag of `status`: a driven step or a grip could not reach the force asked for.
pub const FINGERPAD_STATUS_LOAD_NOT_REACHED: u32 = 32;
/// Flag of `status`: the motion spins and the state does not know spin; the step was taken without it.
pub const FINGERPAD_STATUS_SPIN_IGNORED: u32 = 64;
/// Flag of `status`: the state had a value that is not a number and was reset; the forces are those of a fresh contact.
pub const FINGERPAD_STATUS_MEMORY_LOST: u32 = 128;
/// Flag of `status`: an effect led beyond its range and was held there.
pub const FINGERPAD_STATUS_EFFECT_HELD: u32 = 256;
/// Flag of `status`: a pose beyond those that the model was fitted in; the answer is that of the nearest of them.
pub const FINGERPAD_STATUS_POSE_OUT_OF_RANGE: u32 = 512;
/// Flag of `status`: a pad did not come to equilibrium within the rounds of a step; the answer is that of the last round.
pub const FINGERPAD_STATUS_NOT_CONVERGED: u32 = 1024;
/// Flag of `status`: the body is too sharp for the patches of a pad; the answer is that of a body with the least radius that they see.
pub const FINGERPAD_STATUS_BODY_TOO_SHARP: u32 = 2048;
/// Flag of `status`: a contact in frames began inside the body; its depth counts from where it began.
pub const FINGERPAD_STATUS_BEGAN_INSIDE: u32 = 4096;
/// Flag of `status`: a contact in frames reaches beyond the edge of its face, where the model has a face as well.
pub const FINGERPAD_STATUS_BEYOND_EDGE: u32 = 8192;

const _: () = {
    assert!(FINGERPAD_STATUS_BEGAN_INSIDE == Status::BEGAN_INSIDE.0);
    assert!(FINGERPAD_STATUS_BEYOND_EDGE == Status::BEYOND_EDGE.0);
    assert!(FINGERPAD_STATUS_BAD_INPUT == Status::BAD_INPUT.0);
    assert!(FINGERPAD_STATUS_BAD_TIME_STEP == Status::BAD_TIME_STEP.0);
    assert!(FINGERPAD_STATUS_DEPTH_ABOVE_RANGE == Status::DEPTH_ABOVE_RANGE.0);
    assert!(FINGERPAD_STATUS_LARGE_INCREMENT == Status::LARGE_INCREMENT.0);
    assert!(FINGERPAD_STATUS_LOAD_NOT_REACHED == Status::LOAD_NOT_REACHED.0);
    assert!(FINGERPAD_STATUS_SPIN_IGNORED == Status::SPIN_IGNORED.0);
    assert!(FINGERPAD_STATUS_MEMORY_LOST == Status::MEMORY_LOST.0);
    assert!(FINGERPAD_STATUS_EFFECT_HELD == Status::EFFECT_HELD.0);
    assert!(FINGERPAD_STATUS_POSE_OUT_OF_RANGE == Status::POSE_OUT_OF_RANGE.0);
    assert!(FINGERPAD_STATUS_NOT_CONVERGED == Status::NOT_CONVERGED.0);
    assert!(FINGERPAD_STATUS_BODY_TOO_SHARP == Status::BODY_TOO_SHARP.0);
};

/// What the plane does in one step.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_motion {
    /// Depth at the end of the step, mm, positive into the finger; 0 or less is no contact.
    pub depth_mm: f32,
    /// Slide of the plane along x during the step, mm.
    pub slide_x_mm: f32,
    /// Slide of the plane along y during the step, mm.
    pub slide_y_mm: f32,
    /// Turn of the plane about its normal through the point under first touch during the step, rad, counter-clockwise seen
    /// from the finger. Only a contact with spin follows it; another flags it.
    pub spin_rad: f32,
    /// Length of the step, s.
    pub dt_s: f32,
}

/// Forces that the plane exerts on the finger, and how far the contact is from slipping.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_response {
    /// Force along the normal, N. Negative where stuck flanks of a curved body pull.
    pub normal_force_n: f32,
    /// Force along x, N; friction points along the body's motion. On a curved body the pressure on its slopes is part of it.
    pub friction_x_n: f32,
    /// Force along y, N.
    pub friction_y_n: f32,
    /// Friction alone along x, N: the sum of the tangential tractions. On a plane the force along x.
    pub tangential_friction_x_n: f32,
    /// Friction alone along y, N.
    pub tangential_friction_y_n: f32,
    /// Stuck area over contact area: 1 in a fresh contact, 0 in full slip and without contact.
    pub stick_ratio: f32,
    /// Largest friction in the direction of the present one, N.
    pub friction_limit_n: f32,
    /// 1 less the share of its limit that friction uses; with spin the load is friction and its moment. 0 without contact.
    pub slip_margin: f32,
    /// The margin that is left when the tissue has relaxed at the present depth, if the load stays: 0 where the load slips before.
    /// The slip margin itself where nothing relaxes.
    pub slip_margin_relaxed: f32,
    /// Moment about the plane's normal through the point under first touch, N mm; without spin that of friction along y alone.
    pub spin_moment_n_mm: f32,
    /// Moment of all forces about x through the point under first touch, N mm.
    pub tilt_moment_x_n_mm: f32,
    /// Moment of all forces about y through the point under first touch, N mm.
    pub tilt_moment_y_n_mm: f32,
    /// Centre of pressure along x from the point under first touch, mm; 0 where the normal force is not positive.
    pub pressure_centre_x_mm: f32,
    /// Centre of pressure along y from the point under first touch, mm.
    pub pressure_centre_y_mm: f32,
    /// Contact area, mm².
    pub contact_area_mm2: f32,
    /// Half-width of the 95 % band of the normal force, N.
    pub band_normal_n: f32,
    /// Half-width of the 95 % band of each friction component, N.
    pub band_friction_n: f32,
    /// FINGERPAD_NO_CONTACT, FINGERPAD_STICK, FINGERPAD_PARTIAL_SLIP or FINGERPAD_SLIP.
    pub regime: u32,
    /// Flags FINGERPAD_STATUS_..., 0 for none.
    pub status: u32,
}

impl From<fingerpad_motion> for Motion {
    #[inline(always)]
    fn from(motion: fingerpad_motion) -> Self {
        let fingerpad_motion { depth_mm, slide_x_mm, slide_y_mm, spin_rad, dt_s } = motion;
        Self { depth_mm, slide_increment_mm: [slide_x_mm, slide_y_mm], spin_increment_rad: spin_rad, dt_s }
    }
}

impl From<Motion> for fingerpad_motion {
    fn from(motion: Motion) -> Self {
        let [slide_x_mm, slide_y_mm] = motion.slide_increment_mm;
        let (depth_mm, spin_rad, dt_s) = (motion.depth_mm, motion.spin_increment_rad, motion.dt_s);
        Self { depth_mm, slide_x_mm, slide_y_mm, spin_rad, dt_s }
    }
}

impl From<Response> for fingerpad_response {
    #[inline(always)]
    fn from(r: Response) -> Self {
        Self {
            normal_force_n: r.normal_force_n,
            friction_x_n: r.friction_n[0],
            friction_y_n: r.friction_n[1],
            tangential_friction_x_n: r.tangential_friction_n[0],
            tangential_friction_y_n: r.tangential_friction_n[1],
            stick_ratio: r.stick_ratio,
            friction_limit_n: r.friction_limit_n,
            slip_margin: r.slip_margin,
            slip_margin_relaxed: r.slip_margin_relaxed,
            spin_moment_n_mm: r.spin_moment_n_mm,
            tilt_moment_x_n_mm: r.tilt_moment_n_mm[0],
            tilt_moment_y_n_mm: r.tilt_moment_n_mm[1],
            pressure_centre_x_mm: r.pressure_centre_mm[0],
            pressure_centre_y_mm: r.pressure_centre_mm[1],
            contact_area_mm2: r.contact_area_mm2,
            band_normal_n: r.band_normal_n,
            band_friction_n: r.band_friction_n,
            regime: r.regime as u32,
            status: r.status.0,
        }
    }
}

/// What is read of a response by effects and events: all but bands, area and centre.
pub fn read_back(r: &fingerpad_response) -> Option<Response> {
    let regime = match r.regime {
        FINGERPAD_NO_CONTACT => Regime::NoContact,
        FINGERPAD_STICK => Regime::Stick,
        FINGERPAD_PARTIAL_SLIP => Regime::PartialSlip,
        FINGERPAD_SLIP => Regime::Slip,
        _ => return None,
    };
    let mut response = Response::IN_THE_AIR;
    response.normal_force_n = r.normal_force_n;
    response.friction_n = [r.friction_x_n, r.friction_y_n];
    response.stick_ratio = r.stick_ratio;
    response.regime = regime;
    Some(response)
}
