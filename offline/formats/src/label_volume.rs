//! Voxels with labels, as a file stores them.

use std::collections::BTreeMap;

use nalgebra::Vector3;

/// A label per voxel on a grid at right angles.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelVolume {
    /// Voxels along axes i, j, k.
    pub size: [usize; 3],
    /// From a voxel's middle to the next along each axis, in the frame of the scanner, mm.
    pub steps_mm: [Vector3<f64>; 3],
    /// Labels, i fastest, then j, then k.
    pub labels: Vec<u16>,
}

impl LabelVolume {
    /// A volume whose axes are those of its frame.
    ///
    /// # Panics
    /// If there are not as many labels as voxels.
    pub fn new(size: [usize; 3], spacing_mm: [f64; 3], labels: Vec<u16>) -> Self {
        assert_eq!(labels.len(), size.iter().product::<usize>());
        Self { size, steps_mm: [0, 1, 2].map(|axis| Vector3::ith(axis, spacing_mm[axis])), labels }
    }

    /// Spacing of the voxels along i, j, k, mm.
    pub fn spacing_mm(&self) -> [f64; 3] {
        self.steps_mm.map(|s| s.norm())
    }

    /// Number of voxels of each label.
    pub fn counts(&self) -> BTreeMap<u16, usize> {
        let mut table = vec![0usize; usize::from(u16::MAX) + 1];
        self.labels.iter().for_each(|l| table[usize::from(*l)] += 1);
        (0..=u16::MAX).zip(table).filter(|(_, n)| *n > 0).collect()
    }
}
