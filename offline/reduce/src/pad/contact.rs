//! One step of a pad: the equilibrium of the bulk under what its patches bear.
//!
//! The patches are solved in closed form for a given bulk: the force along the normal from the overlap, the friction from the stretch
//! between skin and anchor, which the strength bounds. What is left is the bulk's coordinates, found by Newton's method on one energy.

use nalgebra::{Matrix3, Rotation2, Rotation3, SMatrix, SVector, Vector2, Vector3};

use super::{Law, MODES, Pad, Patch};

/// Change of the bulk's coordinates below which a step has converged, share of their size, and most iterations.
const CONVERGED: f64 = 1e-5;
const MOST_ITERATIONS: usize = 30;
/// Least size of the bulk's coordinates against which changes count, in roots of mJ.
const LEAST_SIZE: f64 = 1e-3;

type Bulk = SVector<f64, MODES>;

/// Where the plane is.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Axes of the plane in the finger's frame: pitch and roll.
    pub tilt: Rotation3<f64>,
    /// Depth from first touch in that pose, mm.
    pub depth_mm: f64,
    /// Place of the plane's material origin along its axes, mm.
    pub shift: Vector2<f64>,
    /// Spin, rad.
    pub spin: f64,
}

/// State of a contact: the bulk and where each patch is anchored on the body, in the body's material.
#[derive(Clone, Debug)]
pub struct Contact {
    bulk: Bulk,
    anchors: Vec<Vector2<f64>>,
    /// Used share of each patch's strength at the last step, for the stick ratio.
    last: Vec<f64>,
}

/// What a contact answers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Answer {
    /// Normal force, N.
    pub normal_n: f64,
    /// Friction along the plane's axes, N.
    pub friction_n: Vector2<f64>,
    /// Area, mm².
    pub area_mm2: f64,
    /// Stuck area over area.
    pub stick_ratio: f64,
    /// Sum of the strengths, N.
    pub strength_n: f64,
    /// Moment about the point under first touch of the neutral pose, along the plane's axes, N mm.
    pub moment_n_mm: Vector3<f64>,
    /// Energy stored, mJ.
    pub energy_mj: f64,
    /// Iterations.
    pub iterations: usize,
}

/// A patch in a state of the bulk.
struct Local {
    /// Force along the normal, N, and its slope over the overlap, N/mm.
    force: f64,
    slope: f64,
    /// Energy along the normal, mJ.
    energy: f64,
    /// Area in contact, mm², and strength, N.
    area: f64,
    strength: f64,
}

/// A patch in a pose: what does not change within a step.
struct Posed {
    /// Overlap of the undeformed patch, mm.
    overlap: f64,
    /// Spread of the gaps, mm, and the force at which all of it touches, N.
    spread: f64,
    flat: f64,
    /// Place along the plane's axes, undeformed, mm, less the plane's shift.
    place: Vector2<f64>,
    /// Stretch of the anchor: where it is now along the plane's axes, mm, less the plane's shift.
    anchor: Vector2<f64>,
    /// How the patch moves with the bulk along the plane's axes and its normal.
    modes: SMatrix<f64, 3, MODES>,
    /// From the finger's axes to those of the plane, scaled as the bulk's stiffness is.
    seen: Matrix3<f64>,
    /// From the middle of the pad, mm.
    arm: Vector3<f64>,
    compliance: [f64; 2],
}

/// How a patch moves with a bulk, along the plane's axes and its normal: displacement and its derivative over the bulk.
struct Moved {
    by: Vector3<f64>,
    modes: SMatrix<f64, 3, MODES>,
}

fn moved(pad: &Pad, law: &Law, posed: &[Posed], bulk: &Bulk) -> Vec<Moved> {
    let motion = pad.rigid * bulk;
    let of = |p: &Posed| {
        let (lift, slope) = law.lift(&motion, &p.arm);
        Moved { by: p.modes * bulk + p.seen * lift, modes: p.modes + p.seen * slope * pad.rigid }
    };
    posed.iter().map(of).collect()
}

impl Contact {
    /// A finger in the air.
    pub fn new(pad: &Pad) -> Self {
        Self {
            bulk: Bulk::zeros(),
            anchors: vec![Vector2::repeat(f64::NAN); pad.patches.len()],
            last: vec![0.0; pad.patches.len()],
        }
    }

    /// Moves the plane to a place.
    pub fn step(&mut self, pad: &Pad, law: &Law, place: &Place) -> Answer {
        let posed: Vec<Posed> = self.posed(pad, law, place);
        let mut bulk = self.bulk;
        let mut at = moved(pad, law, &posed, &bulk);
        let mut locals = locals(pad, law, &posed, &at);
        let mut strengths: Vec<f64> = locals.iter().map(|l| l.strength).collect();
        let mut iterations = 0;
        for _ in 0..MOST_ITERATIONS {
            iterations += 1;
            let (gradient, hessian) = derivatives(pad, law, &posed, &bulk, &at, &locals, &strengths);
            let Some(step) = hessian.cholesky().map(|c| c.solve(&gradient)) else { break };
            let energy = energy(pad, law, &posed, &bulk, &at, &locals, &strengths);
            let slope = gradient.dot(&step);
            let mut scale = 1.0;
            let mut next = bulk - step;
            let mut next_at = moved(pad, law, &posed, &next);
            let mut next_locals = self::locals(pad, law, &posed, &next_at);
            while scale > 1e-3 {
                let now = self::energy(pad, law, &posed, &next, &next_at, &next_locals, &strengths);
                if now <= energy - 1e-4 * scale * slope + 1e-14 {
                    break;
                }
                scale *= 0.5;
                next = bulk - step * scale;
                next_at = moved(pad, law, &posed, &next);
                next_locals = self::locals(pad, law, &posed, &next_at);
            }
            let way = (next - bulk).norm();
            bulk = next;
            at = next_at;
            locals = next_locals;
            let now: Vec<f64> = locals.iter().map(|l| l.strength).collect();
            let largest = now.iter().copied().fold(0.0, f64::max);
            let change = now.iter().zip(&strengths).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            strengths = now;
            if way < CONVERGED * bulk.norm().max(LEAST_SIZE) && change <= 1e-4 * largest {
                break;
            }
        }
        self.bulk = bulk;
        let mut answer = self.settle(pad, law, place, &posed, &at, &locals);
        answer.iterations = iterations;
        answer
    }

    fn posed(&self, pad: &Pad, law: &Law, place: &Place) -> Vec<Posed> {
        let normal = place.tilt * Vector3::z();
        let axes = place.tilt.inverse();
        let height = pad.height(&normal) + place.depth_mm;
        let spin = Rotation2::new(place.spin);
        let [across, along] = law.bulk.map(|stiffness| 1.0 / stiffness.sqrt());
        let of_patch = |(patch, anchor): (&Patch, &Vector2<f64>)| {
            let spread = law.spread * (normal.dot(&(patch.spread * normal))).max(1e-8).sqrt();
            let size = patch.area.sqrt();
            let flat = patch.area * (law.flattening[0] + law.flattening[1] * spread / size);
            let seen = axes * patch.middle;
            let scales = Matrix3::from_diagonal(&Vector3::new(across, across, along)) * axes.matrix();
            let modes = scales * patch.modes;
            let undeformed = seen.xy() - place.shift;
            let anchor = spin * anchor;
            Posed {
                overlap: height - seen.z,
                spread,
                flat,
                place: undeformed,
                anchor,
                modes,
                seen: scales,
                arm: patch.middle - pad.middle,
                compliance: [patch.compliance[0] * law.local[0], patch.compliance[1] * law.local[1]],
            }
        };
        pad.patches.iter().zip(&self.anchors).map(of_patch).collect()
    }

    /// Moves the anchors of what slips or is apart, and sums up.
    fn settle(
        &mut self,
        pad: &Pad,
        law: &Law,
        place: &Place,
        posed: &[Posed],
        moved: &[Moved],
        locals: &[Local],
    ) -> Answer {
        let unspin = Rotation2::new(-place.spin);
        let mut answer = Answer { energy_mj: bulk_energy(pad, law, &self.bulk), ..Answer::default() };
        let mut stuck_area = 0.0;
        for (k, ((p, local), m)) in posed.iter().zip(locals).zip(moved).enumerate() {
            let here = p.place + m.by.xy();
            if local.force <= 0.0 {
                self.anchors[k] = unspin * here;
                self.last[k] = 0.0;
                continue;
            }
            let stretch = if p.anchor.x.is_nan() { Vector2::zeros() } else { p.anchor - here };
            let mut force = stretch / p.compliance[1];
            let length = force.norm();
            let slips = length > local.strength * (1.0 + 1e-9);
            if slips {
                force *= local.strength / length;
                self.anchors[k] = unspin * (here + force * p.compliance[1]);
            } else if p.anchor.x.is_nan() {
                self.anchors[k] = unspin * here;
            }
            let used = (force.norm() / local.strength.max(1e-12)).min(1.0);
            let share = if slips {
                0.0
            } else if used >= self.last[k] - 1e-12 {
                1.0 - used.powf(law.onset)
            } else {
                1.0
            };
            self.last[k] = used;
            stuck_area += share * local.area;
            answer.normal_n += local.force;
            answer.friction_n += force;
            answer.area_mm2 += local.area;
            answer.strength_n += local.strength;
            answer.energy_mj += local.energy + 0.5 * p.compliance[1] * force.norm_squared();
            // Arms from the foot: the place along the plane's axes, in the plane.
            let arm = here + place.shift;
            answer.moment_n_mm +=
                Vector3::new(arm.y * local.force, -arm.x * local.force, arm.x * force.y - arm.y * force.x);
        }
        answer.stick_ratio = if answer.area_mm2 > 0.0 { stuck_area / answer.area_mm2 } else { 0.0 };
        answer
    }
}

/// All patches for a bulk.
fn locals(pad: &Pad, law: &Law, posed: &[Posed], moved: &[Moved]) -> Vec<Local> {
    let patches = pad.patches.iter().zip(posed).zip(moved);
    patches.map(|((patch, p), m)| local(patch, law, p, p.overlap - m.by.z)).collect()
}

/// A patch whose overlap is `overlap`, mm.
fn local(patch: &Patch, law: &Law, p: &Posed, overlap: f64) -> Local {
    let [compliance, _] = p.compliance;
    let over = overlap + p.spread;
    if over <= 0.0 {
        return Local { force: 0.0, slope: 0.0, energy: 0.0, area: 0.0, strength: 0.0 };
    }
    let (force, slope, energy);
    if overlap >= compliance * p.flat {
        force = overlap / compliance;
        slope = 1.0 / compliance;
        energy = force * overlap - 0.5 * compliance * force * force + 0.4 * p.spread * p.flat;
    } else {
        // compliance flat s^3 + spread s^2 = over, for the root s of the share that touches.
        let (a, b) = (compliance * p.flat, p.spread);
        let mut s: f64 = 1.0;
        for _ in 0..40 {
            let value = (a * s + b) * s * s - over;
            let step = value / ((3.0 * a * s + 2.0 * b) * s).max(1e-300);
            s = (s - step).max(0.0);
            if step.abs() < 1e-13 {
                break;
            }
        }
        force = p.flat * s * s * s;
        slope = 3.0 * p.flat * s / (3.0 * a * s + 2.0 * b);
        let dual = 0.5 * compliance * force * force + p.spread * (0.6 * force * s * s - force);
        energy = force * overlap - dual;
    }
    let [whole, at, exponent] = law.area;
    let area = whole * patch.area * (force / (at * p.flat)).min(1.0).powf(exponent);
    let [lambda, beta] = law.friction;
    let strength = if area > 0.0 { lambda * area.powf(1.0 - beta) * force.powf(beta) } else { 0.0 };
    Local { force, slope, energy, area, strength }
}

/// Energy of the bulk, mJ: linear at rest, and stiffer the more it is squashed.
fn bulk_energy(pad: &Pad, law: &Law, bulk: &Bulk) -> f64 {
    0.5 * bulk.norm_squared() + stiffening(pad, law, bulk).0
}

/// Energy of the stiffening, its slope over the mean squash, and the slope of that; the squash.
fn stiffening(pad: &Pad, law: &Law, bulk: &Bulk) -> (f64, f64, f64, f64) {
    let q = pad_squash(pad, bulk);
    let [rate, end] = law.stiffening;
    // rate q^3 / (1 + q / end): cubic at first, square later.
    let x = q / end;
    let d = 1.0 + x;
    let value = rate * q.powi(3) / d;
    let first = rate * q * q * (3.0 + 2.0 * x) / (d * d);
    let second = rate * q * (6.0 + 6.0 * x + 2.0 * x * x) / d.powi(3);
    (value, first, second, q)
}

/// Root mean square of the skin's displacement along its normal, mm.
fn pad_squash(pad: &Pad, bulk: &Bulk) -> f64 {
    let (mut sum, mut area) = (0.0, 0.0);
    for patch in &pad.patches {
        sum += patch.area * (patch.normal.transpose() * patch.modes * bulk)[0].powi(2);
        area += patch.area;
    }
    (sum / area).sqrt()
}

/// Energy with frozen strengths, mJ.
fn energy(
    pad: &Pad,
    law: &Law,
    posed: &[Posed],
    bulk: &Bulk,
    moved: &[Moved],
    locals: &[Local],
    strengths: &[f64],
) -> f64 {
    let mut sum = bulk_energy(pad, law, bulk);
    for (((p, local), strength), m) in posed.iter().zip(locals).zip(strengths).zip(moved) {
        sum += local.energy;
        if local.force > 0.0 && !p.anchor.x.is_nan() {
            let stretch = (p.anchor - p.place - m.by.xy()).norm();
            let c = p.compliance[1];
            sum += if stretch <= c * strength {
                0.5 * stretch * stretch / c
            } else {
                strength * stretch - 0.5 * strength * strength * c
            };
        }
    }
    sum
}

/// Gradient and Hessian of the energy over the bulk.
fn derivatives(
    pad: &Pad,
    law: &Law,
    posed: &[Posed],
    bulk: &Bulk,
    moved: &[Moved],
    locals: &[Local],
    strengths: &[f64],
) -> (Bulk, SMatrix<f64, MODES, MODES>) {
    let mut gradient = *bulk;
    let mut hessian = SMatrix::<f64, MODES, MODES>::identity();
    let (_, first, second, q) = stiffening(pad, law, bulk);
    if q > 1e-9 {
        let area: f64 = pad.patches.iter().map(|p| p.area).sum();
        let mut half = SMatrix::<f64, MODES, MODES>::zeros();
        for patch in &pad.patches {
            let row = patch.normal.transpose() * patch.modes;
            half += row.transpose() * row * (patch.area / area);
        }
        let slope = half * bulk / q;
        gradient += slope * first;
        hessian += half * (first / q) + slope * slope.transpose() * (second - first / q);
    }
    for (((p, local), &strength), m) in posed.iter().zip(locals).zip(strengths).zip(moved) {
        if local.force <= 0.0 {
            continue;
        }
        let along = m.modes.row(2);
        gradient -= along.transpose() * local.force;
        hessian += along.transpose() * along * local.slope;
        if p.anchor.x.is_nan() {
            continue;
        }
        let stretch = p.anchor - p.place - m.by.xy();
        let c = p.compliance[1];
        let length = stretch.norm();
        let across = m.modes.fixed_rows::<2>(0);
        if length <= c * strength {
            gradient -= across.transpose() * stretch / c;
            hessian += across.transpose() * across / c;
        } else {
            let direction = stretch / length;
            gradient -= across.transpose() * direction * strength;
            let turning = nalgebra::Matrix2::identity() - direction * direction.transpose();
            hessian += across.transpose() * turning * across * (strength / length);
        }
    }
    (gradient, hessian)
}
