//! The margin to slip on a surface of unknown friction, from measured force and motion.

use fingerpad::margin::{Known, Margin, MarginObserver, Reading, Settings};
use fingerpad::{NODES, SPRINGS};

use crate::codes::{FINGERPAD_NOT_SET_UP, answer, code};
use crate::model::{fingerpad_model, loaded};
use crate::pointer::{check, exclusive, shared, write};

/// The finger does not touch: the value of `known` in a margin.
pub const FINGERPAD_KNOWN_NO_CONTACT: u32 = 0;
/// Nothing but the prior is known of the surface.
pub const FINGERPAD_KNOWN_PRIOR: u32 = 1;
/// Some surfaces are excluded.
pub const FINGERPAD_KNOWN_PART: u32 = 2;
/// The strength of the surface is known within its band.
pub const FINGERPAD_KNOWN_STRENGTH: u32 = 3;

/// Prior of surface and finger, errors of model and sensors, and what is asked. `fingerpad_margin_settings_default` gives the usual ones.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_margin_settings {
    /// Standard deviation of the logarithm of the strength factor, 0.05 to 1.
    pub strength: f32,
    /// Standard deviation of the finger's tangential stiffness, share, 0.01 to 0.3.
    pub stiffness: f32,
    /// Standard deviation of the model's friction, share of the limit, 0.001 to 0.5.
    pub model_error: f32,
    /// Mean of that error at 0, 1/4, 1/2, 3/4 of the limit and all of it, share of the model's friction, -0.2 to 0.2.
    pub curve: [f32; 5],
    /// Slide over which that error is correlated, over the slip length, 0.01 to 10.
    pub correlation: f32,
    /// Standard deviation of the model's stick ratio at a share of the limit, 0.005 to 1, for readings with a stick ratio.
    pub stick_error: f32,
    /// Error of friction that is gained while the normal force changes by a factor of e, share, 0 to 1.
    pub press_error: f32,
    /// Time constant of the force sensor, s, 0 to 1.
    pub force_lag_s: f32,
    /// Play of the measured slide, mm, 0 to 10.
    pub play_mm: f32,
    /// Drift of the measured slide, share of the slide, 0 to 0.5.
    pub drift: f32,
    /// Standard deviation of the zero of friction at first touch, N, 0 to 10.
    pub tare_n: f32,
    /// Its drift in a second, N, 0 to 10.
    pub tare_drift_n: f32,
    /// Probability of the band of strength and margin, 0.5 to 0.999.
    pub confidence: f32,
    /// Time ahead for which the chance of full slip is given, s, 0 to 10.
    pub ahead_s: f32,
}

/// Forces and motion as measured at the end of a step, with the covariance of their noise.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_margin_reading {
    /// Normal force of the surface on the finger, N.
    pub normal_force_n: f32,
    /// Friction along x, N.
    pub friction_x_n: f32,
    /// Friction along y, N.
    pub friction_y_n: f32,
    /// Slide of the surface along x since the last reading, mm.
    pub slide_x_mm: f32,
    /// Slide along y, mm.
    pub slide_y_mm: f32,
    /// Variance of the normal force, N^2.
    pub normal_variance_n2: f32,
    /// Covariance of friction, N^2: xx, yy, xy.
    pub friction_covariance_n2: [f32; 3],
    /// Covariance of the measured position (not of the slide), mm^2: xx, yy, xy.
    pub slide_covariance_mm2: [f32; 3],
    /// Share of the contact area that sticks, from the shear field of a tactile skin.
    pub stick_ratio: f32,
    /// Variance of its noise; 0 where it is not measured.
    pub stick_variance: f32,
    /// Time since the last reading, s.
    pub dt_s: f32,
}

/// What is known of the surface after a reading.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_margin {
    /// Strength factor of the surface.
    pub strength_factor: f32,
    /// Lower end of its band.
    pub strength_low: f32,
    /// Upper end of its band.
    pub strength_high: f32,
    /// Slip margin of the present friction, 0 to 1; 0 without contact.
    pub slip_margin: f32,
    /// Lower end of its band: 0 announces slip.
    pub margin_low: f32,
    /// Upper end of its band.
    pub margin_high: f32,
    /// Chance of full slip within the time ahead, at the present rates of the forces.
    pub slip_chance: f32,
    /// Tangential stiffness of the finger over that of the model.
    pub stiffness_factor: f32,
    /// 0 where nothing but the prior is known, 1 where all is.
    pub information: f32,
    /// FINGERPAD_KNOWN_NO_CONTACT and so on.
    pub known: u32,
    /// 1 if this reading made clear that the surface has changed: the strength starts again from its prior. Else 0.
    pub surface_changed: u32,
    /// FINGERPAD_STATUS_BAD_INPUT for an unsound number or covariance, FINGERPAD_STATUS_BAD_TIME_STEP for a clock that stands still,
    /// FINGERPAD_STATUS_DEPTH_ABOVE_RANGE for a normal force beyond the model; the bounds have then widened.
    pub status: u32,
}

/// Finds the margin to slip on an unknown surface. Set it up with `fingerpad_margin_init`. The model's file must stay where it is.
#[repr(C)]
pub struct fingerpad_margin_observer {
    opaque: [u64; 440],
}

/// Mark of an observer that was set up.
const SET_UP: u32 = 0x4650_4d4f;

/// What is inside of a `fingerpad_margin_observer`.
#[repr(C)]
struct Marked {
    mark: u32,
    observer: MarginObserver<'static, SPRINGS, NODES>,
}

const _: () = {
    assert!(size_of::<Marked>() <= size_of::<fingerpad_margin_observer>());
    assert!(align_of::<Marked>() <= align_of::<fingerpad_margin_observer>());
};

impl From<Settings> for fingerpad_margin_settings {
    fn from(s: Settings) -> Self {
        Self {
            strength: s.strength,
            stiffness: s.stiffness,
            model_error: s.model_error,
            curve: s.curve,
            correlation: s.correlation,
            stick_error: s.stick_error,
            press_error: s.press_error,
            force_lag_s: s.force_lag_s,
            play_mm: s.play_mm,
            drift: s.drift,
            tare_n: s.tare_n,
            tare_drift_n: s.tare_drift_n,
            confidence: s.confidence,
            ahead_s: s.ahead_s,
        }
    }
}

impl From<fingerpad_margin_settings> for Settings {
    fn from(s: fingerpad_margin_settings) -> Self {
        Self {
            strength: s.strength,
            stiffness: s.stiffness,
            model_error: s.model_error,
            curve: s.curve,
            correlation: s.correlation,
            stick_error: s.stick_error,
            press_error: s.press_error,
            force_lag_s: s.force_lag_s,
            play_mm: s.play_mm,
            drift: s.drift,
            tare_n: s.tare_n,
            tare_drift_n: s.tare_drift_n,
            confidence: s.confidence,
            ahead_s: s.ahead_s,
        }
    }
}

impl From<&fingerpad_margin_reading> for Reading {
    fn from(r: &fingerpad_margin_reading) -> Self {
        Self {
            normal_force_n: r.normal_force_n,
            friction_n: [r.friction_x_n, r.friction_y_n],
            slide_increment_mm: [r.slide_x_mm, r.slide_y_mm],
            normal_variance_n2: r.normal_variance_n2,
            friction_covariance_n2: r.friction_covariance_n2,
            slide_covariance_mm2: r.slide_covariance_mm2,
            stick_ratio: r.stick_ratio,
            stick_variance: r.stick_variance,
            dt_s: r.dt_s,
            ..Self::default()
        }
    }
}

impl From<Margin> for fingerpad_margin {
    fn from(m: Margin) -> Self {
        Self {
            strength_factor: m.strength_factor,
            strength_low: m.strength_low,
            strength_high: m.strength_high,
            slip_margin: m.slip_margin,
            margin_low: m.margin_low,
            margin_high: m.margin_high,
            slip_chance: m.slip_chance,
            stiffness_factor: m.stiffness_factor,
            information: m.information,
            known: match m.known {
                Known::NoContact => FINGERPAD_KNOWN_NO_CONTACT,
                Known::Prior => FINGERPAD_KNOWN_PRIOR,
                Known::Part => FINGERPAD_KNOWN_PART,
                Known::Strength => FINGERPAD_KNOWN_STRENGTH,
            },
            surface_changed: m.surface_changed.into(),
            status: m.status.0,
        }
    }
}

/// Surfaces within a factor of 2, stiffness within 15 %, the errors of the shipped model, sensors without lag, play and drift, a band of
/// 95 %, 50 ms ahead.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_margin_settings_default(settings: *mut fingerpad_margin_settings) -> i32 {
    // SAFETY: the caller's promise.
    answer(unsafe { write(settings, Settings::default().into()) })
}

/// An observer for a finger in the air. Returns FINGERPAD_OK, or FINGERPAD_RANGE for a setting out of its range, FINGERPAD_NULL,
/// FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP for the model; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_margin_init(
    model: *const fingerpad_model,
    settings: fingerpad_margin_settings,
    observer: *mut fingerpad_margin_observer,
) -> i32 {
    let init = || {
        // SAFETY: the caller's promise.
        let model = unsafe { loaded(model) }?.model;
        check(observer)?;
        let fresh = MarginObserver::new(&model, settings.into()).map_err(code)?;
        // SAFETY: the caller's promise; size and alignment were checked above.
        unsafe { write(observer.cast(), Marked { mark: SET_UP, observer: fresh }) }
    };
    answer(init())
}

/// Takes a reading and writes what is known after it. Any numbers may come in; see `status`.
///
/// Returns FINGERPAD_OK, or FINGERPAD_NULL, FINGERPAD_ALIGNMENT or FINGERPAD_NOT_SET_UP; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_margin_step(
    observer: *mut fingerpad_margin_observer,
    reading: *const fingerpad_margin_reading,
    margin: *mut fingerpad_margin,
) -> i32 {
    let step = || {
        // SAFETY: the caller's promise; the mark is a number whatever lies there.
        if *unsafe { shared(observer.cast::<u32>()) }? != SET_UP {
            return Err(FINGERPAD_NOT_SET_UP);
        }
        // SAFETY: the mark stands only where `fingerpad_margin_init` has written, or in a copy of that.
        let marked = unsafe { exclusive(observer.cast::<Marked>()) }?;
        // SAFETY: the caller's promise.
        let reading = unsafe { shared(reading) }?.into();
        check(margin)?;
        // SAFETY: the caller's promise.
        unsafe { write(margin, marked.observer.step(reading).into()) }
    };
    answer(step())
}
