//! The numbers of a model as a step reads them.
//!
//! Main types: [`DataOf`] (in flash), [`Element`], [`ModelOf`] (ready to step). Uses table and rescaling.

use bytemuck::{AnyBitPattern, Pod, Zeroable};

use crate::rescaling::{Fitted, Scaled, Scaling};
use crate::table::Row;
use crate::{Motion, Response, StateOf, step};

/// Elements of the default model.
pub const ELEMENTS: usize = 2;
/// Depths at which the tables of the default model are given.
pub const NODES: usize = 37;

/// The default model; see [`ModelOf`].
pub type Model<'a> = ModelOf<'a, ELEMENTS, NODES>;
/// The default model retuned to another finger; see [`ModelOf::tuned`].
pub type Tuned<'a> = ModelOf<'a, ELEMENTS, NODES, Scaled>;
/// The numbers of the default model; see [`DataOf`].
pub type Data = DataOf<ELEMENTS, NODES>;

/// One elasto-slip element as the step reads it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Element {
    /// 1 over the relative slide at which it yields.
    pub inverse_yield: f32,
    /// Its share of the strength.
    pub strength: f32,
    /// Its share of the elastic energy: strength times yield position.
    pub energy: f32,
}

/// The numbers of a model as they lie in flash, made by [`crate::ParamsOf::try_build`] or read from a file.
///
/// Plain 32-bit floats throughout, so that a file can be used where it lies.
#[derive(Clone, Copy, Debug, PartialEq, AnyBitPattern)]
#[repr(C)]
pub struct DataOf<const M: usize, const N: usize> {
    /// Largest depth of the tables, mm.
    pub depth_max: f32,
    /// Cells of the tables per mm.
    pub cells_per_mm: f32,
    /// Half of a cell, mm.
    pub half_cell: f32,
    /// Half of [`crate::ParamsOf::turn_slip`].
    pub half_turn_slip: f32,
    /// 1 over [`crate::ParamsOf::full_slip`].
    pub slip_rate: f32,
    /// Twice [`crate::ParamsOf::odd_compliance_mm_n2`].
    pub twice_odd: f32,
    /// Growth of the area at full shear along +x, share; the same is lost along −x.
    pub area_tilt: f32,
    /// Half-width of the normal force's band over that of the table, a parabola in the stick ratio: in full slip,
    /// and the factors of the ratio and of its square.
    pub band_normal: [f32; 3],
    /// Half-width of friction's band over the strength, likewise.
    pub band_friction: [f32; 3],
    /// Exponent of the local friction law, for retuning.
    pub pressure_exponent: f32,
    /// The elements.
    pub elements: [Element; M],
    /// The tables.
    pub rows: [Row; N],
}

/// A model ready to step: the numbers in flash and, once [`ModelOf::tuned`], the factors for another finger.
#[derive(Clone, Copy, Debug)]
pub struct ModelOf<'a, const M: usize, const N: usize, S = Fitted> {
    pub(crate) data: &'a DataOf<M, N>,
    pub(crate) scale: S,
}

impl<'a, const M: usize, const N: usize, S: Scaling> ModelOf<'a, M, N, S> {
    /// The numbers the model reads.
    pub fn data(&self) -> &'a DataOf<M, N> {
        self.data
    }

    /// Largest depth for which the model was fitted, mm.
    pub fn depth_max_mm(&self) -> f32 {
        self.scale.length(self.data.depth_max)
    }

    /// [`step()`] as a method.
    #[inline]
    pub fn step(&self, state: &mut StateOf<M>, motion: Motion) -> Response {
        step(self, state, motion)
    }
}

impl<const M: usize, const N: usize> DataOf<M, N> {
    /// Strength over contact area at the largest depth, MPa.
    pub(crate) fn deepest_shear_mpa(&self) -> f32 {
        self.rows.last().map_or(1.0, |row| row.limit.value / row.area.value)
    }

    /// A model on these numbers, after [`DataOf::check`].
    pub fn model(&self) -> Result<ModelOf<'_, M, N>, crate::Error> {
        self.check()?;
        Ok(ModelOf::from_checked(self))
    }
}
