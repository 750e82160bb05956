//! The numbers of a model as a step reads them.
//!
//! Main types: [`DataOf`] (in flash), [`Spring`], [`ModelOf`] (ready to step). Uses table and tuning.

use bytemuck::{AnyBitPattern, Zeroable};

use crate::math::Scalar;
use crate::memory::Memory;
use crate::table::Row;
use crate::tuning::Units;
use crate::{Error, Motion, Relaxation, Response, StateOf, step};

/// Springs of the default model.
pub const SPRINGS: usize = 4;
/// Depths at which the tables of the default model are given.
pub const NODES: usize = 37;

/// The default model; see [`ModelOf`].
pub type Model<'a> = ModelOf<'a, SPRINGS, NODES>;
/// The numbers of the default model; see [`DataOf`].
pub type Data = DataOf<SPRINGS, NODES>;

/// One spring of the bed as the step reads it. With spin it is two of half the stiffness, at `centre ± arm`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Spring<T = f32> {
    /// Its share of the stiffness; all together are 1.
    pub stiffness: T,
    /// How its slipping share grows with the way since the last turn: 0 as the square, 1 as the fourth power.
    pub sharpness: T,
    /// Place of the pair along x from the point under first touch, mm.
    pub centre_mm: T,
    /// From the pair's centre to one of its springs, mm.
    pub arm_mm: [T; 2],
}

/// The numbers of a model as they lie in flash, made by [`crate::build::ParamsOf::try_build`] or read from a file.
///
/// Plain 32-bit floats throughout, so that a file can be used where it lies.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(bound(serialize = "T: serde::Serialize")))]
#[cfg_attr(feature = "serde", serde(bound(deserialize = "T: Scalar + serde::Deserialize<'de>")))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct DataOf<const M: usize, const N: usize, T = f32> {
    /// Largest depth of the tables, mm.
    pub depth_max: T,
    /// Cells of the tables per mm.
    pub cells_per_mm: T,
    /// [`crate::build::ParamsOf::odd_per_mm`].
    pub odd: T,
    /// Growth of the area at full shear along +x, share; the same is lost along −x.
    pub area_tilt: T,
    /// [`crate::build::ParamsOf::pressure_centre_per_n`].
    pub pressure_centre_per_n: [T; 2],
    /// [`crate::build::ParamsOf::spin_cross`].
    pub spin_cross: T,
    /// [`crate::build::ParamsOf::slip_lead`] at touch, and its change over a cell.
    pub slip_lead: [T; 2],
    /// Mean arm of the springs, mm.
    pub gyration: T,
    /// Half-width of the normal force's band over that of the table, a parabola in the stick ratio: in full slip,
    /// and the factors of the ratio and of its square.
    pub band_normal: [T; 3],
    /// Half-width of the band of friction over the strength, in the same form.
    pub band_friction: [T; 3],
    /// Exponent of the local friction law, for retuning.
    pub pressure_exponent: T,
    /// Pitch and roll of the pose that the model was fitted in, degrees.
    pub pose_deg: [T; 2],
    /// The springs.
    #[cfg_attr(feature = "serde", serde(with = "crate::array"))]
    pub springs: [Spring<T>; M],
    /// The tables.
    #[cfg_attr(feature = "serde", serde(with = "crate::array"))]
    pub rows: [Row<M, T>; N],
}

// SAFETY: `repr(C)` structs of 32-bit floats and arrays of them throughout: no padding, and any bits are a number.
#[allow(unsafe_code)]
unsafe impl<const M: usize, const N: usize> Zeroable for DataOf<M, N, f32> {}
// SAFETY: as above.
#[allow(unsafe_code)]
unsafe impl<const M: usize, const N: usize> AnyBitPattern for DataOf<M, N, f32> {}

/// A model ready to step: the numbers in flash, the units of the finger, see [`ModelOf::tuned`], and the branches of its tissue, see
/// [`ModelOf::with_relaxation`].
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ModelOf<'a, const M: usize, const N: usize, T = f32> {
    pub(crate) data: &'a DataOf<M, N, T>,
    pub(crate) units: Units<T>,
    /// The branches of the tissue; none where it does not relax.
    pub(crate) relaxation: Option<&'a Relaxation<T>>,
}

impl<'a, const M: usize, const N: usize, T: Scalar> ModelOf<'a, M, N, T> {
    /// The numbers the model reads.
    pub fn data(&self) -> &'a DataOf<M, N, T> {
        self.data
    }

    /// Largest depth for which the model was fitted, mm.
    pub fn depth_max_mm(&self) -> T {
        self.data.depth_max * self.units.length
    }

    /// Where friction in full slip acts at a depth, mm along x and y from the point under first touch. The moment about this
    /// point is the one that the slip margin counts beside friction: [`Response::spin_moment_n_mm`] less x F_y − y F_x.
    pub fn friction_centre_mm(&self, depth_mm: T) -> [T; 2] {
        let (row, t) = self.cell(depth_mm);
        [row.friction_centre.at(t) * self.units.length, T::of(0.0)]
    }

    /// [`step()`] as a method.
    #[inline]
    pub fn step<const P: usize, R: Memory<M, P, T>>(
        &self,
        state: &mut StateOf<M, P, T, R>,
        motion: Motion<T>,
    ) -> Response<T> {
        step(self, state, motion)
    }

    /// The same finger, whose tissue has these branches. A [`StateOf`] that relaxes ([`StateOf::relaxing`]) follows them; with another one the
    /// finger is that of the relaxed tissue, whatever the time step is.
    ///
    /// # Errors
    /// [`Error::Range`] for an exponent of the friction law outside 0 to 1, and for an odd stiffness with which the force of a spring on
    /// its limit would not rise at the pressure of a fast press ([`DataOf::check`]).
    pub fn with_relaxation(self, relaxation: &'a Relaxation<T>) -> Result<Self, Error> {
        if relaxation.is_some() {
            self.data.check_relaxation(relaxation)?;
        }
        Ok(self.with_relaxation_unchecked(relaxation))
    }

    /// The same without the check, for branches that passed it with these numbers.
    pub fn with_relaxation_unchecked(self, relaxation: &'a Relaxation<T>) -> Self {
        Self { relaxation: relaxation.is_some().then_some(relaxation), ..self }
    }

    /// The branches of its tissue; none where it does not relax.
    pub fn relaxation(&self) -> Option<&'a Relaxation<T>> {
        self.relaxation
    }

    /// Cells of the tables per mm of depth.
    #[inline(always)]
    pub(crate) fn cells_per_mm(&self) -> T {
        self.data.cells_per_mm * self.units.per_length
    }

    /// The row of the tables at `depth`, and the place within the cell (its end beyond the last node).
    pub(crate) fn cell(&self, depth: T) -> (&'a Row<M, T>, T) {
        let x = depth * self.cells_per_mm();
        let index = x.index().min(N - 2);
        (&self.data.rows[index], (x - T::of(index as f32)).at_most(T::of(1.0)))
    }
}

impl<const M: usize, const N: usize> DataOf<M, N> {
    /// The same numbers in another scalar: `f64` for the twin.
    pub fn cast<U: Scalar>(&self) -> DataOf<M, N, U> {
        let of = U::of;
        DataOf {
            depth_max: of(self.depth_max),
            cells_per_mm: of(self.cells_per_mm),
            odd: of(self.odd),
            area_tilt: of(self.area_tilt),
            pressure_centre_per_n: self.pressure_centre_per_n.map(of),
            spin_cross: of(self.spin_cross),
            slip_lead: self.slip_lead.map(of),
            gyration: of(self.gyration),
            band_normal: self.band_normal.map(of),
            band_friction: self.band_friction.map(of),
            pressure_exponent: of(self.pressure_exponent),
            pose_deg: self.pose_deg.map(of),
            springs: self.springs.map(|s| Spring {
                stiffness: of(s.stiffness),
                sharpness: of(s.sharpness),
                centre_mm: of(s.centre_mm),
                arm_mm: s.arm_mm.map(of),
            }),
            rows: self.rows.each_ref().map(Row::cast),
        }
    }
}

impl<const M: usize, const N: usize, T: Scalar> DataOf<M, N, T> {
    /// A model on these numbers as they are; see [`crate::build::ParamsOf::build_unchecked`].
    pub fn model_unchecked(&self) -> ModelOf<'_, M, N, T> {
        ModelOf { data: self, units: Units::fitted(), relaxation: None }
    }

    /// A model on these numbers, after [`DataOf::check`].
    pub fn model(&self) -> Result<ModelOf<'_, M, N, T>, Error> {
        self.check()?;
        Ok(self.model_unchecked())
    }
}
