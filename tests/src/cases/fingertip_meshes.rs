//! Every named shape at every preset that tests can afford is a mesh that can be computed with.

use crate::verify;
use fingerpad_fe::mesh::{FingertipShape, MeshPreset, check, fingertip, quality};

pub fn named_shapes_pass_the_check() {
    for name in ["a", "b", "d", "e", "base"] {
        let shape = FingertipShape::named(name).unwrap();
        for (preset, label) in
            [(MeshPreset::Coarse, "coarse"), (MeshPreset::Medium, "medium"), (MeshPreset::Default, "default")]
        {
            let mesh = fingertip(&shape, &preset.divisions()).unwrap().mesh;
            check(&mesh).unwrap_or_else(|e| panic!("shape {name} {label}: {e}"));
            let report = quality(&mesh);
            let case = format!("mesh shape {name} {label} ({} nodes)", report.nodes);
            verify(&case, "1 - least scaled Jacobian of hexes", 1.0 - report.worst_hex_scaled_jacobian, 0.85);
            verify(&case, "1 - least scaled Jacobian of tets", 1.0 - report.worst_tet_scaled_jacobian, 0.95);
        }
    }
}
