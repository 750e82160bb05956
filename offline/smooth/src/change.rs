//! What acts on the model at one sample.
//!
//! Main type: [`ModelChange`].

/// Contact area at which adhesion and drag are given, mm².
pub const REFERENCE_AREA_MM2: f64 = 63.5;

/// What effects, random effects and perturbations do to the model at one sample. `Default` changes nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelChange {
    /// Factor on the local shear strength tau_crit.
    pub strength: f64,
    /// Factor on the tissue's stiffness.
    pub stiffness: f64,
    /// Added to the depth, mm, where the depth is positive.
    pub depth_mm: f64,
    /// Added to the reading, N: normal, x, y.
    pub reading_n: [f64; 3],
    /// Share of the normal force that appears in x and y.
    pub cross: [f64; 2],
    /// Force along the motion at the reference area, N.
    pub drag_n: f64,
    /// Pull-off at the reference area, N: a line tension at the rim of the contact.
    pub adhesion_n: f64,
}

impl Default for ModelChange {
    fn default() -> Self {
        Self {
            strength: 1.0,
            stiffness: 1.0,
            depth_mm: 0.0,
            reading_n: [0.0; 3],
            cross: [0.0; 2],
            drag_n: 0.0,
            adhesion_n: 0.0,
        }
    }
}

impl ModelChange {
    /// Whether it adds to the readings beside the model.
    pub fn acts_on_readings(&self) -> bool {
        let forces = [self.cross[0], self.cross[1], self.drag_n, self.adhesion_n];
        self.reading_n.iter().chain(&forces).any(|f| *f != 0.0)
    }
}
