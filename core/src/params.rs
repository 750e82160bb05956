//! The physical parameters of a model, public and checked.
//!
//! Main types: [`ParamsOf`], [`Node`], [`SpringParams`]. Becomes [`DataOf`] by [`ParamsOf::try_build`]. Uses data, table.

use crate::Error;
use crate::build::DataOf;
use crate::data::{NODES, SPRINGS, Spring};
use crate::math::Scalar;
use crate::spring::QuadraticStiffness;
use crate::table::{Line, Parabola, Row};

/// Parameters of the default model.
pub type Params = ParamsOf<SPRINGS, NODES>;

/// One spring of the bed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SpringParams<T = f32> {
    /// Its share of the tangential stiffness; all together are 1.
    pub stiffness_share: T,
    /// Growth of its slipping share of the area with the slip path since the last reversal: 0 (square) to 1 (fourth power).
    pub sharpness: T,
    /// With spin a spring is a pair: position of its centre along x from the point under first touch, mm.
    pub centre_mm: T,
    /// From the pair's middle to one of the two, mm.
    pub arm_mm: [T; 2],
}

/// The tables' values at one depth.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(bound(serialize = "T: serde::Serialize")))]
#[cfg_attr(feature = "serde", serde(bound(deserialize = "T: serde::Deserialize<'de> + Default + Copy")))]
pub struct Node<const M: usize = SPRINGS, T = f32> {
    /// Normal force without shear, N. Grows with depth.
    pub normal_force_n: T,
    /// Contact area without shear, mm². Grows with depth.
    pub contact_area_mm2: T,
    /// Change of the tangential stiffness along x and y with depth, N/mm².
    pub stiffness_slope_n_mm2: [T; 2],
    /// Slide along x from rest at which each spring begins to slip, mm; 0 where it does not touch. Grows with depth.
    #[cfg_attr(feature = "serde", serde(with = "crate::array"))]
    pub yield_slide_mm: [T; M],
    /// Friction in full slip along y over that along x, 0.5 to 2, leaving tilt and odd stiffness out.
    pub strength_ratio: T,
    /// Share by which a spring's limit along +x is above, along −x below its middle, −0.25 to 0.25.
    pub tilt_x: T,
    /// Slide along x that a depth increment amounts to, mm/mm, −1 to 1.
    pub press_coupling: T,
    /// Share of the contact area that each spring represents; normalised.
    #[cfg_attr(feature = "serde", serde(with = "crate::array"))]
    pub area_share: [T; M],
    /// Centre of pressure along x without shear, mm from the point under first touch.
    pub pressure_centre_mm: T,
    /// Limit of the moment under spin alone over that of all springs on their limit, 0.5 to 1. It is below 1 because the finger is in full
    /// slip before springs near the middle, whose arms are short, reach their limit.
    pub spin_limit_share: T,
    /// Half-width of the 95 % band of the normal force while everything sticks, N.
    pub band_normal_n: T,
}

impl<const M: usize, T: Scalar> Default for Node<M, T> {
    fn default() -> Self {
        let zero = T::of(0.0);
        Self {
            normal_force_n: zero,
            contact_area_mm2: zero,
            stiffness_slope_n_mm2: [zero; 2],
            yield_slide_mm: [zero; M],
            strength_ratio: T::of(1.0),
            tilt_x: zero,
            press_coupling: zero,
            area_share: [T::of(1.0); M],
            pressure_centre_mm: zero,
            spin_limit_share: T::of(1.0),
            band_normal_n: zero,
        }
    }
}

/// The physical parameters of a model with `M` springs and tables at `N` equidistant depths from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(bound(serialize = "T: serde::Serialize")))]
#[cfg_attr(feature = "serde", serde(bound(deserialize = "T: Scalar + serde::Deserialize<'de>")))]
pub struct ParamsOf<const M: usize, const N: usize, T = f32> {
    /// Depth of the last node, mm, 0.1 to 20.
    pub depth_max_mm: T,
    /// Stiffness of all springs together along x and y at depth 0, N/mm.
    pub stiffness_n_mm: [T; 2],
    /// The springs.
    #[cfg_attr(feature = "serde", serde(with = "crate::array"))]
    pub springs: [SpringParams<T>; M],
    /// The tables; node 0 is depth 0, where all forces are taken as 0.
    #[cfg_attr(feature = "serde", serde(with = "crate::array"))]
    pub nodes: [Node<M, T>; N],
    /// q of the springs' force k (u − q u²) along x, 1/mm: positive where the finger is softer while friction along x is
    /// positive. On the limit |q u| is at most 0.4.
    pub odd_per_mm: T,
    /// Growth of the contact area at full shear along +x, loss along −x, share, −0.5 to 0.5.
    pub area_tilt: T,
    /// Shift of the centre of pressure along x per friction along x, and along y per friction along y, mm/N.
    pub pressure_centre_per_n: [T; 2],
    /// c of the limit of friction f and moment m together, f² + m² + c |f| |m| = 1, both over their own limit, 0 to 1.
    pub spin_cross: T,
    /// c at touch and at the largest depth, −1 to 1: where the plane moves at an angle theta to x, the share S of the contact that
    /// slips is S (1 + c cos(2 theta) (1 − S)). Positive where slip spreads sooner along x than along y.
    pub slip_lead: [T; 2],
    /// Half-width of the 95 % band of the normal force at a stick ratio of 0.5 over that in full stick, 0 to 20.
    pub band_normal_middle: T,
    /// The same in full slip. The parabola through the three values interpolates between them and must be positive.
    pub band_normal_slip: T,
    /// Half-width of the 95 % band of each friction component in full stick, share of the friction limit, 0 to 10.
    pub band_friction_stick: T,
    /// The same at a stick ratio of 0.5.
    pub band_friction_middle: T,
    /// The same in full slip.
    pub band_friction_slip: T,
    /// beta of the local friction law tau = lambda sigma^beta, for retuning, −1 to 2.
    pub pressure_exponent: T,
    /// Pitch and roll of the finger in the pose that the model is of, degrees: 10 to 70, and −30 to 30.
    pub pose_deg: [T; 2],
}

/// Values of the tables at depth 0, where force, area and strength vanish, over those at the first node. They are above 0, so that all
/// quotients are finite.
const FLOOR: f32 = 1e-6;

/// Quantities at one node that follow from the parameters.
#[derive(Clone, Copy)]
struct Limits<T> {
    limit: T,
    ratio: T,
    shift: T,
    spin: T,
    centre: T,
}

impl<const M: usize, const N: usize, T: Scalar> ParamsOf<M, N, T> {
    /// Refuses parameters that are not finite, out of range, not monotone or not passive.
    pub fn validate(&self) -> Result<(), Error> {
        self.try_build().map(|_| ())
    }

    /// The numbers in the form that a step reads, checked.
    pub fn try_build(&self) -> Result<DataOf<M, N, T>, Error> {
        let data = self.build_unchecked();
        data.check()?;
        Ok(data)
    }

    /// The same without the check, for fits: their intermediate parameters may be invalid.
    pub fn build_unchecked(&self) -> DataOf<M, N, T> {
        const { assert!(M >= 1 && M <= 64 && N >= 3 && N <= 1024) };
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let last = T::of((N - 1) as f32);
        let cell = self.depth_max_mm / last;
        let mut data = DataOf {
            depth_max: self.depth_max_mm,
            cells_per_mm: last / self.depth_max_mm,
            odd: self.odd_per_mm,
            area_tilt: self.area_tilt,
            pressure_centre_per_n: self.pressure_centre_per_n,
            spin_cross: self.spin_cross,
            slip_lead: [self.slip_lead[0], (self.slip_lead[1] - self.slip_lead[0]) / last],
            gyration: zero,
            band_normal: parabola(self.band_normal_slip, self.band_normal_middle, one),
            band_friction: parabola(self.band_friction_slip, self.band_friction_middle, self.band_friction_stick),
            pressure_exponent: self.pressure_exponent,
            pose_deg: self.pose_deg,
            springs: [Spring::default(); M],
            rows: [Row::default(); N],
        };
        let all = self.springs.iter().fold(zero, |sum, s| sum + s.stiffness_share);
        for (spring, s) in data.springs.iter_mut().zip(&self.springs) {
            *spring = Spring {
                stiffness: s.stiffness_share / all,
                sharpness: s.sharpness,
                centre_mm: s.centre_mm,
                arm_mm: s.arm_mm,
            };
            let [x, y] = s.arm_mm;
            data.gyration += spring.stiffness * (x * x + y * y).sqrt();
        }
        let node = |index: usize| -> Node<M, T> {
            let touching = |mut node: Node<M, T>| {
                // A spring that does not touch represents no area.
                for (share, yield_slide) in node.area_share.iter_mut().zip(&node.yield_slide_mm) {
                    *share = if *yield_slide > zero { *share } else { zero };
                }
                node
            };
            let mut node = touching(self.nodes.get(index).copied().unwrap_or_default());
            if index == 0 {
                let first = touching(self.nodes.get(1).copied().unwrap_or_default());
                node.normal_force_n = T::of(FLOOR) * first.normal_force_n;
                node.contact_area_mm2 = T::of(FLOOR) * first.contact_area_mm2;
                node.yield_slide_mm = [zero; M];
                node.area_share = first.area_share;
            }
            node
        };
        // Stiffness and slide by pressing are integrals of the nodes' slopes.
        let mut stiffness = self.stiffness_n_mm;
        let mut press = zero;
        for (index, row) in data.rows.iter_mut().enumerate() {
            let (a, b) = (node(index), node((index + 1).min(N - 1)));
            let inside = if index + 1 < N { cell } else { zero };
            let integral = |value: T, left: T, right: T| Parabola::of_slopes(value, inside * left, inside * right);
            let [from_x, from_y] = stiffness;
            let ([left_x, left_y], [right_x, right_y]) = (a.stiffness_slope_n_mm2, b.stiffness_slope_n_mm2);
            let stiffness_x = integral(from_x, left_x, right_x);
            let stiffness_y = integral(from_y, left_y, right_y);
            let press_slide = integral(press, a.press_coupling, b.press_coupling);
            let here = stiffness;
            stiffness = [stiffness_x.at(one), stiffness_y.at(one)];
            press = press_slide.at(one);
            let mut left = self.limits(&data.springs, &a, here);
            let right = self.limits(&data.springs, &b, stiffness);
            if index == 0 {
                left = Limits { limit: T::of(FLOOR) * right.limit, spin: T::of(FLOOR) * right.spin, ..right };
            }
            let anisotropy = |node: &Node<M, T>, k: [T; 2]| k[1] / (k[0] * node.strength_ratio);
            let line = Line::between;
            let shares = |node: &Node<M, T>| {
                let all = node.area_share.iter().fold(zero, |sum, s| sum + *s);
                node.area_share.map(|share| share / (all + T::of(f32::MIN_POSITIVE)))
            };
            *row = Row {
                normal: line(a.normal_force_n, b.normal_force_n),
                area: line(a.contact_area_mm2, b.contact_area_mm2),
                stiffness_x,
                stiffness_y,
                press_slide,
                anisotropy: line(anisotropy(&a, here), anisotropy(&b, stiffness)),
                yield_shift: line(a.tilt_x, b.tilt_x),
                limit: line(left.limit, right.limit),
                limit_ratio: line(left.ratio, right.ratio),
                limit_shift: line(left.shift, right.shift),
                spin_limit: line(left.spin, right.spin),
                friction_centre: line(left.centre, right.centre),
                pressure_centre: line(a.pressure_centre_mm, b.pressure_centre_mm),
                band_normal: line(a.band_normal_n, b.band_normal_n),
                radius: lines(a.yield_slide_mm, b.yield_slide_mm),
                area_share: lines(shares(&a), shares(&b)),
            };
        }
        data
    }

    /// Friction and moment in full slip at one node, with its stiffness.
    fn limits(&self, springs: &[Spring<T>; M], node: &Node<M, T>, [kx, _]: [T; 2]) -> Limits<T> {
        let (zero, one, half) = (T::of(0.0), T::of(1.0), T::of(0.5));
        let odd = QuadraticStiffness(self.odd_per_mm);
        let wide = (one + node.tilt_x * node.tilt_x).sqrt();
        let (mut ahead, mut back, mut even, mut moment) = (zero, zero, zero, zero);
        for (spring, &radius) in springs.iter().zip(&node.yield_slide_mm) {
            ahead += spring.stiffness * odd.force(radius * (wide + node.tilt_x));
            back += spring.stiffness * odd.force(radius * (node.tilt_x - wide));
            even += spring.stiffness * radius;
            moment += spring.stiffness * radius * spring.centre_mm;
        }
        let centre = moment / (even + T::of(f32::MIN_POSITIVE));
        let spin = spin_of_springs(springs, node.yield_slide_mm, node.strength_ratio, centre);
        let limit = (ahead * -back).magnitude().sqrt();
        let safe = limit + T::of(f32::MIN_POSITIVE);
        Limits {
            limit: kx * limit,
            ratio: node.strength_ratio * (even / safe),
            shift: half * (ahead + back) / safe,
            spin: kx * (node.spin_limit_share * spin),
            centre,
        }
    }
}

/// Moment of all springs on their limits in spin about `centre`, over the stiffness, mm².
fn spin_of_springs<const M: usize, T: Scalar>(
    springs: &[Spring<T>; M],
    yield_slide_mm: [T; M],
    strength_ratio: T,
    centre: T,
) -> T {
    let mut spin = T::of(0.0);
    for (spring, radius) in springs.iter().zip(yield_slide_mm) {
        for sign in [T::of(1.0), T::of(-1.0)] {
            let x = spring.centre_mm + sign * spring.arm_mm[0] - centre;
            let y = sign * spring.arm_mm[1];
            // The limit's ellipse in the direction (−y, x) of the spin, times the lever.
            let across = x / strength_ratio;
            let square = x * x + y * y;
            let stretched = (y * y + across * across + T::of(1e-30)).sqrt();
            spin += T::of(0.5) * spring.stiffness * radius * square / stretched;
        }
    }
    spin
}

impl<const M: usize, const N: usize, T: Scalar> DataOf<M, N, T> {
    /// [`Node::spin_limit_share`] at the node of this index; 1 for a model without spin.
    pub fn spin_limit_share(&self, node: usize) -> T {
        // The values at the first node are small, those of the last row stand for no cell.
        let row = &self.rows[node.clamp(1, N - 2)];
        let strength_ratio = row.stiffness_y.value / (row.stiffness_x.value * row.anisotropy.value);
        let radii = row.radius.map(|line| line.value);
        let spin =
            row.stiffness_x.value * spin_of_springs(&self.springs, radii, strength_ratio, row.friction_centre.value);
        if spin > T::of(0.0) { row.spin_limit.value / spin } else { T::of(1.0) }
    }
}

/// Lines from each left value to its right one.
fn lines<const M: usize, T: Scalar>(left: [T; M], right: [T; M]) -> [Line<T>; M] {
    let mut lines = [Line::default(); M];
    for ((line, left), right) in lines.iter_mut().zip(left).zip(right) {
        *line = Line::between(left, right);
    }
    lines
}

/// The parabola over 0 to 1 through values at 0, 1/2 and 1: value at 0, factors of the variable and its square.
fn parabola<T: Scalar>(start: T, middle: T, end: T) -> [T; 3] {
    let [two, three, four] = [2.0, 3.0, 4.0].map(T::of);
    [start, four * middle - three * start - end, two * (start + end) - four * middle]
}
