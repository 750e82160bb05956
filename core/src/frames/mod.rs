//! One finger against one rigid body, from the frames of both: a pose in, wrenches out.
//!
//! Main types: [`FrameContact`], [`Shape`], [`FrameResponse`], [`FramePatch`]; main trait: [`Finger`]. Uses pad, step and nalgebra.
//!
//! The **finger's frame** is fixed to the bone: x along the finger's long axis from proximal to distal, z out of the pad's surface into the
//! finger, y to complete a right-handed frame. A finger whose x axis is inclined by 30 degrees to a plane, tip down, has pitch 30. The origin
//! is the point at which a plane first touches in the neutral pose; the fitted heights of a pad have it there within 0.03 mm. The **body's frame** is that of its [`Shape`].
//!
//! A step finds the face of the shape that the finger meets, turns the change of the pose into depth, slide, spin, pitch and roll, advances
//! the model, and turns its response into a force and a moment on each of both. A curved face has its apex where the finger first touches
//! it, for as long as it does.
//!
//! **A contact begins near the surface.** A body may come into the finger otherwise than along its normal: a finger that arrives from the
//! side is 20 mm below a table's top at once. In the step in which a contact begins, its depth is therefore at most the distance that the
//! finger came closer in this step, and 1 mm; the surface then counts as that much lower, and the response is flagged. A finger that slides
//! on from one face to the next comes from the side too, but not from deep: where the surface counts as lower by no more than the depth of
//! the model, slip raises it again, with a tenth of the work of friction while all of the contact slips. So the contact stores no more than
//! the motion brings. The first step of all takes the pose as it is, up to the depth of the model.

mod face;
mod finger;
mod patches;
mod shape;

use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::math::{Elementary, Scalar};
use crate::{Error, Motion, Regime, Response, Status};

use face::{Chosen, Face, LAST_FACE, Site, Stand, choose, sum_of_magnitudes};
pub use finger::{Finger, Held, RoundBed};
pub use patches::FramePatch;
pub use shape::Shape;

/// Depth at which a contact begins at most, mm.
const BEGINS_MM: f32 = 1.0;
/// A contact that begins deeper by less is not flagged, mm.
const TOLERATED_MM: f32 = 0.01;
/// Share of the work of friction in slip that raises the surface of a contact that began inside the body.
const RAISES: f32 = 0.1;
/// Largest difference of a quaternion's square from 1.
const UNIT: f32 = 1e-3;
/// Largest sum of the magnitudes of a place's coordinates, mm.
const FARTHEST_MM: f32 = 1e9;

/// What a finger remembers of its contact with one body: the state `S` of its model, and poses of precision `R`.
///
/// Plain data: a copy restores an earlier state. It belongs to one finger and one body. Memory that was overwritten is found out where it
/// holds a number that is not finite, or that no step writes. The contact then starts again, flagged as [`Status::MEMORY_LOST`].
// Numbers throughout, so that any bits are one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct FrameContact<S, R = f64> {
    shape: Shape<R>,
    /// The finger in the body's frame at the last step, if there was one.
    site: Site<R>,
    was_placed: u32,
    /// Number of the face of the last step, 0 for none, and the normal at the apex of a round one.
    face: u32,
    apex: Vector3<R>,
    /// Place of the apex along the plane's axes from the foot; of a plane the place of the foot on it, mm.
    place: [R; 2],
    /// Cosine and sine of the angle of the finger within the face.
    direction: [R; 2],
    /// Place along a long face at which the contact began, mm.
    start: R,
    /// Slides, mm, and spin, rad, that the precision of the model left out so far.
    rest: [R; 3],
    /// How much lower the surface counts, because the contact began inside the body, mm.
    lower: R,
    state: S,
}

/// Force and moment about the origin of a frame, along its axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Wrench<T = f32> {
    /// Force, N.
    pub force_n: [T; 3],
    /// Moment, N mm.
    pub moment_n_mm: [T; 3],
}

/// Forces and state of a contact after a step.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FrameResponse<T = f32> {
    /// What the body exerts on the finger, in the finger's frame.
    pub on_finger: Wrench<T>,
    /// What the finger exerts on the body, in the body's frame.
    pub on_body: Wrench<T>,
    /// Depth of the body in the finger as the model has it, mm; 0 where the finger stands over no face.
    pub depth_mm: T,
    /// Pitch and roll of the finger against the face, degrees.
    pub pose_deg: [T; 2],
    /// The face: 0 for none; 1 for a plane, a sphere, an ellipsoid and an edge; of a box 1 to 6 for +x, +y, +z, −x, −y, −z and 7 to 18 for
    /// its edges; of a capsule and a cylinder 1 for the side, 2 and 3 for the ends at +z and −z.
    pub face: u8,
    /// The response of the model, along the axes of the face's plane.
    pub response: Response<T>,
}

impl<S: Clone, R: Elementary> FrameContact<S, R> {
    /// A finger without contact, and the shape of the body that it is to touch.
    ///
    /// # Errors
    /// [`Error::Curved`] if the finger's model touches flat faces alone; [`Error::Shape`] if `S` has too little room for the model.
    pub fn new<F: Finger<S>>(finger: &F, shape: Shape<R>) -> Result<Self, Error> {
        if !F::TOUCHES_CURVED && !shape.is_flat() {
            return Err(Error::Curved);
        }
        Ok(Self::of(shape, finger.fresh()?))
    }

    fn of(shape: Shape<R>, state: S) -> Self {
        let zero = R::of(0.0);
        Self {
            shape,
            site: Site { at: Vector3::zeros(), axes: Matrix3::identity() },
            was_placed: 0,
            face: 0,
            apex: Vector3::zeros(),
            place: [zero; 2],
            direction: [R::of(1.0), zero],
            start: zero,
            rest: [zero; 3],
            lower: zero,
            state,
        }
    }

    /// Ends the contact, and has the body count as another shape from the next step on: for a body that is known by its shape near the
    /// finger alone, such as a mesh. Place of the finger and strength factor are kept.
    ///
    /// * `moved`: pose of the new shape's frame in that of the old one, mm
    ///
    /// A curved shape (see [`Shape::is_flat`]) for a model that touches flat faces alone has no contact, flagged as [`Status::MEMORY_LOST`].
    pub fn reshape(&mut self, shape: Shape<R>, moved: &Isometry3<R>) {
        self.shape = shape;
        self.face = 0;
        match site_of(moved, &Matrix3::identity()) {
            // The old frame in the new one.
            Some(Site { at, axes }) => {
                self.site = Site { at: at + axes * self.site.at, axes: axes * self.site.axes };
            }
            None => self.was_placed = 0,
        }
    }

    /// Whether the numbers are such that a step may have left them: those that no step replaces without a flag.
    fn is_sound(&self) -> bool {
        let [x, y, turn] = self.rest;
        // One that is not finite gives NaN.
        let sum = self.apex.x + self.start + self.lower + x + y + turn;
        sum * R::of(0.0) == R::of(0.0) && self.face <= LAST_FACE
    }

    /// The state of the finger's model.
    pub fn state(&self) -> &S {
        &self.state
    }

    /// The same, to set the strength factor.
    pub fn state_mut(&mut self) -> &mut S {
        &mut self.state
    }

    /// Advances the contact by one step. Cannot fail, panic or allocate, whatever the input.
    ///
    /// * `body`: pose of the body in the finger's frame at the end of the step, mm
    /// * `dt_s`: length of the step, s
    ///
    /// A pose that is not finite, or whose quaternion is not of unit length, is flagged as [`Status::BAD_INPUT`] and not taken: the body
    /// stays where it was.
    pub fn step<F: Finger<S>>(&mut self, finger: &F, body: &Isometry3<R>, dt_s: F::Scalar) -> FrameResponse<F::Scalar> {
        let mut status = Status::OK;
        if !self.is_sound() {
            self.forget(finger);
            status = Status::MEMORY_LOST;
        }
        if !(self.shape.is_sound() && (F::TOUCHES_CURVED || self.shape.is_flat())) {
            return FrameResponse { response: only(Status::MEMORY_LOST), ..FrameResponse::default() };
        }
        let level = level_axes(finger.neutral_deg().map(R::near));
        let was_placed = self.was_placed != 0;
        let site = match site_of(body, &level) {
            Some(site) => site,
            None => {
                status = status.with(Status::BAD_INPUT);
                if !(was_placed && self.site.is_finite()) {
                    return FrameResponse { response: only(status), ..FrameResponse::default() };
                }
                self.site
            }
        };
        self.was_placed = 1;
        let touch = |tilt: [R; 2]| wide(&finger.hold(tilt.map(Scalar::near)).touch);
        let old = self.chosen().map(|chosen| (chosen, finger.in_contact(&self.state)));
        let Some(chosen) = choose(&self.shape, &site, old, &touch, F::TOUCHES_CURVED) else {
            self.leave(finger);
            self.site = site;
            return FrameResponse { response: only(status), ..FrameResponse::default() };
        };
        let face = chosen.face(&self.shape);
        let stand = face.stand(&site);
        let slip = self.motion(finger, chosen, &face, &stand);
        let tilt = [stand.pitch, stand.roll].map(Scalar::near);
        let held = finger.hold(tilt);
        let depth = self.depth(finger, &face, &stand, &held, was_placed, &site);
        self.site = site;
        let mut single = [F::Scalar::of(0.0); 3];
        for ((single, rest), slip) in single.iter_mut().zip(&mut self.rest).zip(slip) {
            let whole = slip + *rest;
            *single = Scalar::near(whole);
            *rest = whole - R::near(*single);
        }
        let motion = Motion {
            depth_mm: Scalar::near(depth),
            slide_increment_mm: [single[0], single[1]],
            spin_increment_rad: single[2],
            dt_s,
        };
        let mut response = finger.advance(&mut self.state, &face.body(), motion, held.pose_deg);
        let touches = response.regime != Regime::NoContact;
        response.status = response.status.with(status);
        if touches && self.lower > R::of(0.0) {
            response.status = response.status.with(Status::BEGAN_INSIDE);
            if response.regime == Regime::Slip {
                let ([along, across], [x, y]) = (response.tangential_friction_n, motion.slide_increment_mm);
                self.raise(
                    finger.depth_max_mm(),
                    along * x + across * y,
                    response.normal_force_n,
                    response.stick_ratio,
                );
            }
        }
        if touches && face.radius().is_some_and(|radius| depth > radius) {
            response.status = response.status.with(Status::DEPTH_ABOVE_RANGE);
        }
        if touches && is_beyond(&face, &stand, &response) {
            response.status = response.status.with(Status::BEYOND_EDGE);
        }
        // On a curved body the patches of a pad may touch a little later than its apex.
        if !finger.in_contact(&self.state) {
            self.lower = R::of(0.0);
            if !face.is_plane() {
                // In the air the apex of a round face goes along with the finger.
                self.leave(finger);
            }
        }
        let (on_finger, on_body) = if touches {
            wrenches(finger, &level, &stand, &held, tilt, motion.depth_mm, &site, &response)
        } else {
            Default::default()
        };
        FrameResponse {
            on_finger,
            on_body,
            depth_mm: motion.depth_mm,
            pose_deg: held.pose_deg,
            face: chosen.number,
            response,
        }
    }

    /// Starts again without contact, with the same shape and strength factor.
    #[cold]
    #[inline(never)]
    fn forget<F: Finger<S>>(&mut self, finger: &F) {
        finger.restart(&mut self.state);
        *self = Self::of(self.shape, self.state.clone());
    }

    /// The face of the last step.
    fn chosen(&self) -> Option<Chosen<R>> {
        (self.face != 0).then_some(Chosen { number: self.face as u8, apex: self.apex })
    }

    /// Ends the contact; the place of the body and the strength factor are kept.
    fn leave<F: Finger<S>>(&mut self, finger: &F) {
        finger.restart(&mut self.state);
        self.face = 0;
        self.lower = R::of(0.0);
    }

    /// Slides, mm, and spin, rad, since the last step on this face, and begins at another one.
    fn motion<F: Finger<S>>(&mut self, finger: &F, chosen: Chosen<R>, face: &Face<R>, stand: &Stand<R>) -> [R; 3] {
        let zero = R::of(0.0);
        let [cos, sin] = stand.direction;
        if self.chosen() != Some(chosen) {
            self.leave(finger);
            (self.face, self.apex) = (chosen.number.into(), chosen.apex);
            self.rest = [zero; 3];
            self.start = if face.is_long() { stand.foot[0] } else { zero };
            // A round body begins with its apex below the finger and its axes along the plane's; the first motion brings it to where it is.
            (self.place, self.direction) =
                if face.is_plane() { (stand.foot, stand.direction) } else { ([zero; 2], [R::of(1.0), zero]) };
        }
        let [u, v] = [stand.foot[0] - self.start, stand.foot[1]];
        let [old_cos, old_sin] = self.direction;
        // The face turns one way when the finger turns the other.
        let spin = -(old_cos * sin - old_sin * cos).atan2(old_cos * cos + old_sin * sin);
        self.direction = stand.direction;
        let [x, y] = self.place;
        if !face.is_plane() {
            self.place = [-(u * cos + v * sin), -(v * cos - u * sin)];
            return [self.place[0] - x, self.place[1] - y, spin];
        }
        self.place = stand.foot;
        // Along the axes halfway between both.
        let (half_sin, half_cos) = (R::of(0.5) * spin).sin_cos();
        let [cos, sin] = [cos * half_cos - sin * half_sin, sin * half_cos + cos * half_sin];
        let (u, v) = (u - x, v - y);
        [-(u * cos + v * sin), -(v * cos - u * sin), spin]
    }

    /// The depth of the face, with the rule of how a contact begins.
    fn depth<F: Finger<S>>(
        &mut self,
        finger: &F,
        face: &Face<R>,
        stand: &Stand<R>,
        held: &Held<F::Scalar>,
        was_placed: bool,
        site: &Site<R>,
    ) -> R {
        let normal = site.axes.tr_mul(&stand.axes[2]);
        let tilt = [stand.pitch, stand.roll].map(Scalar::near);
        let lowest = finger.lowest_mm(&normal.map(Scalar::near), tilt, held);
        let depth = R::near(lowest) - stand.height;
        if !finger.in_contact(&self.state) && depth > R::of(0.0) {
            let touch = wide(&held.touch);
            let most = if was_placed {
                let [then, now] = [&self.site, site].map(|site| face.depth_of(&(site.at + site.axes * touch)));
                (now - then).not_negative().at_most(R::of(BEGINS_MM))
            } else {
                R::near(finger.depth_max_mm())
            };
            let beyond = depth - most;
            self.lower = if beyond > R::of(TOLERATED_MM) { beyond } else { R::of(0.0) };
        }
        depth - self.lower
    }

    /// Raises the surface under a finger that slips, from the next step on. The energy that this stores is a tenth of what slip dissipated in
    /// this step, so that the contact yields none.
    ///
    /// * `work`: work of friction in this step, mJ
    /// * `normal`: normal force, N
    #[cold]
    #[inline(never)]
    fn raise<T: Scalar>(&mut self, depth_max: T, work: T, normal: T, stick_ratio: T) {
        if normal > T::of(0.0) && !(stick_ratio > T::of(0.0)) && self.lower <= R::near(depth_max) {
            let rise = R::near(T::of(RAISES) * work / normal);
            self.lower = (self.lower - rise.not_negative()).not_negative();
        }
    }
}

/// A response without contact.
fn only<T: Scalar>(status: Status) -> Response<T> {
    Response { status, ..Response::default() }
}

/// A vector in the precision of poses.
fn wide<T: Scalar, R: Scalar>(v: &Vector3<T>) -> Vector3<R> {
    v.map(R::near)
}

/// The level axes of a finger in its own frame, as columns: those of the plane in the neutral pose.
fn level_axes<R: Elementary>(neutral_deg: [R; 2]) -> Matrix3<R> {
    let [(ps, pc), (rs, rc)] = neutral_deg.map(|angle| (angle / R::of(180.0) * R::half_turn()).sin_cos());
    Matrix3::new(pc, -(ps * rs), -(ps * rc), R::of(0.0), rc, -rs, ps, pc * rs, pc * rc)
}

/// The finger in the frame of the body. None for a pose that is none.
///
/// * `level`: its level axes, see [`level_axes`]
fn site_of<R: Elementary>(body: &Isometry3<R>, level: &Matrix3<R>) -> Option<Site<R>> {
    let [i, j, k, w] = body.rotation.as_ref().coords.into();
    let place = body.translation.vector;
    let square = i * i + j * j + k * k + w * w;
    let is_unit = (square - R::of(1.0)).magnitude() <= R::of(UNIT);
    if !is_unit || !(sum_of_magnitudes(&place) <= R::of(FARTHEST_MM)) {
        return None;
    }
    let twice = R::of(2.0) / square;
    let one = R::of(1.0);
    let axes = Matrix3::new(
        one - twice * (j * j + k * k),
        twice * (i * j - k * w),
        twice * (i * k + j * w),
        twice * (i * j + k * w),
        one - twice * (i * i + k * k),
        twice * (j * k - i * w),
        twice * (i * k - j * w),
        twice * (j * k + i * w),
        one - twice * (i * i + j * j),
    );
    Some(Site { at: -axes.tr_mul(&place), axes: axes.tr_mul(level) })
}

/// Whether the contact, as a disk of its area about the centre of pressure, reaches beyond the edge of its face.
fn is_beyond<T: Elementary, R: Elementary>(face: &Face<R>, stand: &Stand<R>, response: &Response<T>) -> bool {
    let radius = R::near((response.contact_area_mm2 / T::half_turn()).magnitude().sqrt());
    let [cos, sin] = stand.direction;
    let [x, y] = response.pressure_centre_mm.map(R::near);
    face.ends_within([stand.foot[0] + x * cos - y * sin, stand.foot[1] + x * sin + y * cos], radius)
}

/// Force and moment on the finger in its frame, and on the body in its own.
// Out of line it costs nine instructions more.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "what a step has found, spelled out")]
fn wrenches<S, F: Finger<S>, R: Elementary>(
    finger: &F,
    level: &Matrix3<R>,
    stand: &Stand<R>,
    held: &Held<F::Scalar>,
    tilt: [F::Scalar; 2],
    depth: F::Scalar,
    site: &Site<R>,
    response: &Response<F::Scalar>,
) -> (Wrench<F::Scalar>, Wrench<F::Scalar>) {
    let [x, y] = response.friction_n;
    let [about_x, about_y] = response.tilt_moment_n_mm;
    let force = Vector3::new(x, y, response.normal_force_n);
    // The response is about the foot in the pose that the model follows.
    let foot = depth - finger.lowest_mm(&held.normal, held.tilt, held);
    let about_foot = Vector3::new(about_x, about_y, response.spin_moment_n_mm);
    let moment = about_origin(finger, held, tilt, foot, &force, about_foot);
    let (force, moment) = (in_body(stand, &force), in_body(stand, &moment));
    let on_body = Wrench { force_n: out(&-force), moment_n_mm: out(&-(moment + site.at.cross(&force))) };
    let own = |v: &Vector3<R>| level * site.axes.tr_mul(v);
    (Wrench { force_n: out(&own(&force)), moment_n_mm: out(&own(&moment)) }, on_body)
}

/// The moment about the finger's origin, along the axes of the plane, of a force with a moment about the foot.
///
/// * `foot`: height of the plane over the origin, mm
#[inline(always)]
fn about_origin<S, F: Finger<S>>(
    finger: &F,
    held: &Held<F::Scalar>,
    tilt: [F::Scalar; 2],
    foot: F::Scalar,
    force: &Vector3<F::Scalar>,
    about_foot: Vector3<F::Scalar>,
) -> Vector3<F::Scalar> {
    let moment = Vector3::new(about_foot.x - foot * force.y, about_foot.y + foot * force.x, about_foot.z);
    if held.follows == [true; 2] { moment } else { of_held_pose(finger, held, tilt, force.z, moment) }
}

/// A vector along the axes of the plane, in the frame of the body.
#[inline(always)]
fn in_body<T: Scalar, R: Elementary>(stand: &Stand<R>, v: &Vector3<T>) -> Vector3<R> {
    let [along, across, normal] = &stand.axes;
    let [x, y, z] = v.map(R::near).into();
    along * x + across * y + normal * z
}

/// A vector in the precision of the model.
fn out<T: Scalar, R: Scalar>(v: &Vector3<R>) -> [T; 3] {
    v.map(T::near).into()
}

/// The moment where the model holds an angle of the pose: as to this angle it is the derivative of depth alone, so that a pose beyond the
/// range of the model yields no energy either. Roll goes about the finger's own axis, which pitch inclines.
fn of_held_pose<S, F: Finger<S>>(
    finger: &F,
    held: &Held<F::Scalar>,
    tilt: [F::Scalar; 2],
    normal_n: F::Scalar,
    moment: Vector3<F::Scalar>,
) -> Vector3<F::Scalar> {
    let zero = F::Scalar::of(0.0);
    let by_held = finger.lowest_slopes_mm(held.tilt, held);
    let by_tilt = finger.lowest_slopes_mm(tilt, held);
    let (held_sin, held_cos) = held.tilt[0].sin_cos();
    let (sin, cos) = tilt[0].sin_cos();
    let followed =
        [moment.y + normal_n * by_held[0], held_cos * moment.x - held_sin * moment.z + normal_n * by_held[1]];
    let [pitch, roll] = [0, 1].map(|k| if held.follows[k] { followed[k] } else { zero } - normal_n * by_tilt[k]);
    Vector3::new((roll + sin * moment.z) / cos, pitch, moment.z)
}
