//! The physical parameters of a model, public and checked.
//!
//! Main types: [`ParamsOf`], [`Node`], [`Slider`]. Becomes [`DataOf`] by [`ParamsOf::try_build`]. Uses data, table.

use crate::data::{ELEMENTS, Element, NODES};
use crate::error::Field;
use crate::math::sqrt;
use crate::table::{Line, Row};
use crate::{DataOf, Error};

/// Parameters of the default model.
pub type Params = ParamsOf<ELEMENTS, NODES>;

/// One elasto-slip element.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Slider {
    /// Slide at which it yields, relative to the others; 0.05 to 10 after normalisation.
    pub yield_position: f32,
    /// Its share of the strength; all together are 1.
    pub strength_share: f32,
}

/// The tables' values at one depth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Node {
    /// Normal force without shear, N. Grows with depth.
    pub normal_force_n: f32,
    /// Contact area without shear, mm². Grows with depth.
    pub contact_area_mm2: f32,
    /// Friction in full slip, N. Grows with depth.
    pub friction_limit_n: f32,
    /// Tangential stiffness along x while everything sticks, N/mm. Grows with depth.
    pub tangential_stiffness_n_mm: f32,
    /// Stiffness along y over that along x, 0.25 to 4.
    pub stiffness_ratio: f32,
    /// Friction in full slip along y over the mean of that along ±x, 0.5 to 2.
    pub strength_ratio: f32,
    /// Slide along x that a depth increment amounts to, mm/mm, −1 to 1.
    pub press_coupling: f32,
    /// Normal force that full slip along x adds or, if negative, takes off, N.
    pub normal_shear_x_n: f32,
    /// The same along y, N.
    pub normal_shear_y_n: f32,
    /// Share by which the limit along +x is above, along −x below that along y, −0.25 to 0.25.
    pub tilt_x: f32,
    /// Half-width of the 95 % band of the normal force while everything sticks, N.
    pub band_normal_n: f32,
}

/// The physical parameters of a model with `M` elements and tables at `N` equidistant depths from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ParamsOf<const M: usize, const N: usize> {
    /// Depth of the last node, mm, 0.1 to 20.
    pub depth_max_mm: f32,
    /// The elements, in the order in which they yield: the last one tells full slip.
    #[cfg_attr(feature = "serde", serde(with = "crate::array"))]
    pub sliders: [Slider; M],
    /// The tables; node 0 is depth 0, where all forces are taken as 0.
    #[cfg_attr(feature = "serde", serde(with = "crate::array"))]
    pub nodes: [Node; N],
    /// Share of the contact area that slips right after the slide turns back from full slip, 0 to 0.5.
    pub turn_slip: f32,
    /// Share of the way to the limit at which nothing would stick any more, 0.8 to 1.2; on the limit nothing does anyway.
    pub full_slip: f32,
    /// Elastic displacement along x beyond the linear one, per square of friction along x, mm/N²: positive where the finger
    /// is softer while friction along x is positive, and stiffer while it is negative. At most 0.25 slip lengths at the
    /// friction limit.
    pub odd_compliance_mm_n2: f32,
    /// Growth of the contact area at full shear along +x, loss along −x, share, −0.5 to 0.5.
    pub area_tilt: f32,
    /// Half-width of the 95 % band of the normal force at a stick ratio of 0.5 over that in full stick, 0 to 20.
    pub band_normal_middle: f32,
    /// The same in full slip; a parabola through the three goes between them and must stay positive.
    pub band_normal_slip: f32,
    /// Half-width of the 95 % band of each friction component in full stick, share of the friction limit, 0 to 10.
    pub band_friction_stick: f32,
    /// The same at a stick ratio of 0.5.
    pub band_friction_middle: f32,
    /// The same in full slip.
    pub band_friction_slip: f32,
    /// beta of the local friction law tau = lambda sigma^beta, for retuning, −1 to 2.
    pub pressure_exponent: f32,
}

/// Height of the tables at depth 0, where force, area, strength and stiffness vanish, over that at the first node.
/// Keeps every quotient a number.
const FLOOR: f32 = 1e-6;

impl<const M: usize, const N: usize> ParamsOf<M, N> {
    /// Refuses what is not finite, out of range, not monotone or not passive.
    pub fn validate(&self) -> Result<(), Error> {
        self.try_build().map(|_| ())
    }

    /// The numbers as a step reads them.
    ///
    /// Normalises the yield positions so that `tangential_stiffness_n_mm` is the stiffness of the sticking contact.
    pub fn try_build(&self) -> Result<DataOf<M, N>, Error> {
        const { assert!(M >= 1 && M <= 64 && N >= 3 && N <= 1024) };
        let mut data = DataOf {
            depth_max: self.depth_max_mm,
            cells_per_mm: (N - 1) as f32 / self.depth_max_mm,
            half_cell: 0.5 * self.depth_max_mm / (N - 1) as f32,
            half_turn_slip: 0.5 * self.turn_slip,
            slip_rate: 1.0 / self.full_slip,
            twice_odd: 2.0 * self.odd_compliance_mm_n2,
            area_tilt: self.area_tilt,
            band_normal: parabola(self.band_normal_slip, self.band_normal_middle, 1.0),
            band_friction: parabola(self.band_friction_slip, self.band_friction_middle, self.band_friction_stick),
            pressure_exponent: self.pressure_exponent,
            elements: [Element::default(); M],
            rows: [Row::default(); N],
        };
        let (mut strength, mut softness, mut energy) = (0.0, 0.0, 0.0);
        for slider in &self.sliders {
            strength += slider.strength_share;
            softness += slider.strength_share / slider.yield_position;
        }
        if !((strength - 1.0).abs() <= 1e-3) {
            return Err(Error::Range { what: Field::StrengthShare, index: M as u16, value: strength });
        }
        for (element, slider) in data.elements.iter_mut().zip(&self.sliders) {
            *element = Element {
                inverse_yield: strength / (slider.yield_position * softness),
                // A little below 1 in all, so that the resultant never exceeds the limit by rounding.
                strength: slider.strength_share / strength * (1.0 - 8e-6),
                energy: slider.strength_share / strength * (slider.yield_position * softness / strength),
            };
            energy += element.energy;
        }
        // Elastic energy in full slip over that of one element of the same stiffness and strength.
        let full = |along_y: bool, node: &Node| {
            let ratio = if along_y { node.strength_ratio * node.strength_ratio / node.stiffness_ratio } else { 1.0 };
            energy * ratio * node.friction_limit_n * node.friction_limit_n
        };
        let node = |index: usize| -> Node {
            let mut node = self.nodes.get(index).copied().unwrap_or_default();
            if index == 0 {
                let first = self.nodes.get(1).copied().unwrap_or_default();
                node.normal_force_n = FLOOR * first.normal_force_n;
                node.contact_area_mm2 = FLOOR * first.contact_area_mm2;
                node.friction_limit_n = FLOOR * first.friction_limit_n;
                node.tangential_stiffness_n_mm = FLOOR * first.tangential_stiffness_n_mm;
                // Shear adds as much per force as at the first node, which vanishes with the limit.
                node.normal_shear_x_n = FLOOR * FLOOR * first.normal_shear_x_n;
                node.normal_shear_y_n = FLOOR * FLOOR * first.normal_shear_y_n;
            }
            node
        };
        let per_newton = |added: f32, full: f32| if added == 0.0 { 0.0 } else { added / full };
        let normal_shear_x = |node: &Node| per_newton(node.normal_shear_x_n, full(false, node));
        let normal_shear_y = |node: &Node| per_newton(node.normal_shear_y_n, full(true, node));
        let stiffness_anisotropy = |node: &Node| sqrt(node.stiffness_ratio.max(0.0));
        let strength_anisotropy = |node: &Node| stiffness_anisotropy(node) / node.strength_ratio;
        let mut press_slide = 0.0;
        for (index, row) in data.rows.iter_mut().enumerate() {
            let (a, b) = (node(index), node((index + 1).min(N - 1)));
            *row = Row {
                normal: Line::between(a.normal_force_n, b.normal_force_n),
                area: Line::between(a.contact_area_mm2, b.contact_area_mm2),
                limit: Line::between(a.friction_limit_n, b.friction_limit_n),
                stiffness: Line::between(a.tangential_stiffness_n_mm, b.tangential_stiffness_n_mm),
                stiffness_anisotropy: Line::between(stiffness_anisotropy(&a), stiffness_anisotropy(&b)),
                strength_anisotropy: Line::between(strength_anisotropy(&a), strength_anisotropy(&b)),
                normal_shear_x: Line::between(normal_shear_x(&a), normal_shear_x(&b)),
                normal_shear_y: Line::between(normal_shear_y(&a), normal_shear_y(&b)),
                yield_shift: Line::between(a.tilt_x, b.tilt_x),
                band_normal: Line::between(a.band_normal_n, b.band_normal_n),
                press_coupling: Line::between(a.press_coupling, b.press_coupling),
                press_slide,
            };
            press_slide += a.press_coupling + b.press_coupling;
        }
        data.check()?;
        Ok(data)
    }
}

/// The parabola over 0 to 1 through values at 0, 1/2 and 1: value at 0, factors of the variable and its square.
fn parabola(start: f32, middle: f32, end: f32) -> [f32; 3] {
    [start, 4.0 * middle - 3.0 * start - end, 2.0 * (start + end) - 4.0 * middle]
}
