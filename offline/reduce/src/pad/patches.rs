//! Patches and bulk modes of a finger, from its compliance at small loads.

use fingerpad::pad::{FIRST_TOUCH_TERMS, MODES, Numbers, PACKED, first_touch_terms};
use fingerpad_fe::contact::Outline;
use fingerpad_fe::load_path::Finger;
use fingerpad_fe::solve::RestCompliance;
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, SMatrix, Vector3};

use super::{FittedNumbers, PadModel};
use crate::ReduceError;

/// One patch of skin.
struct Patch {
    middle: Vector3<f64>,
    area: f64,
    /// Second moment of its points about the middle, over its area, mm².
    spread: Matrix3<f64>,
    /// Inner normal of the skin.
    normal: Vector3<f64>,
    modes: SMatrix<f64, 3, MODES>,
    /// Part of its compliance that the modes do not represent, along the normal and across, mm/N.
    compliance: [f64; 2],
}

/// Poses in which a pad is used: pitch, and roll to either side, degrees.
const PITCH_RANGE_DEG: [f64; 2] = [10.0, 70.0];
const ROLL_MAX_DEG: f64 = 30.0;

/// Number of patches of a pad.
#[derive(Clone, Copy, Debug)]
pub struct PadSize {
    /// Wanted number of patches; the result may differ by a few. Patches on the middle plane count once, the others come in mirrored pairs.
    pub patches: usize,
}

/// Iterations of k-means.
const ROUNDS: usize = 60;
/// Poses, degrees from the neutral one, and depths, mm, of the loads from which the bulk modes follow.
const PITCHES_DEG: [f64; 7] = [-18.0, -10.0, 0.0, 10.0, 20.0, 30.0, 38.0];
const ROLLS_DEG: [f64; 5] = [-25.0, -12.0, 0.0, 12.0, 25.0];
const DEPTHS_MM: [f64; 4] = [0.3, 0.8, 1.6, 3.0];
/// Pitch of the shipped finger in its neutral pose, degrees.
const NEUTRAL_DEG: f64 = 30.0;

/// Loads from which the bulk modes follow: pitches from the neutral one, degrees, and depths, mm.
struct Poses {
    pitches_deg: [f64; 7],
    depths_mm: [f64; 4],
}

/// Angle from the neutral pose within which most contacts lie, degrees.
const USUAL_DEG: f64 = 18.0;
/// Weight of skin that no contact reaches, over that of skin that all contacts reach.
const LEAST_WEIGHT: f64 = 0.1;

/// Rotation of the body relative to a finger that is pitched and rolled by these angles from its neutral pose, rad.
pub(crate) fn tilt(pitch: f64, roll: f64) -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Vector3::x_axis(), -roll) * Rotation3::from_axis_angle(&Vector3::y_axis(), -pitch)
}

/// The pad of a finger, before the fit to nonlinear runs.
///
/// * `outline`: undeformed surface, from which depth is measured
/// * `length`: size of the tip over that of the shipped finger, see [`crate::Tip`]
/// * `depth_max_mm`: depth up to which the pad will be fitted
///
/// # Errors
/// [`ReduceError::Fit`] if the finger has no support, or if its surface has too few nodes for so many patches.
pub fn pad(
    finger: &Finger,
    outline: &Outline,
    size: PadSize,
    length: f64,
    depth_max_mm: f64,
) -> Result<PadModel, ReduceError> {
    let failed = |problem: String| ReduceError::Fit(problem);
    let compliance = RestCompliance::of(&finger.body).map_err(|e| failed(format!("compliance: {e}")))?;
    let nodes: Vec<Vector3<f64>> = compliance.nodes.iter().map(|&n| finger.mesh.nodes[n as usize]).collect();
    let (areas, normals) = around(finger, &compliance.nodes);
    // Leaves out nodes that are fixed or belong to no face.
    let moves = |k: usize| areas[k] > 0.0 && compliance.matrix[(3 * k + 2, 3 * k + 2)] > 0.0;
    let used: Vec<usize> = (0..nodes.len()).filter(|&k| moves(k)).collect();
    // The range of pitches is that of the shipped finger, whatever the neutral one.
    let shift_deg = NEUTRAL_DEG - finger.neutral_pitch_deg.round();
    let poses =
        Poses { pitches_deg: PITCHES_DEG.map(|pitch| pitch + shift_deg), depths_mm: DEPTHS_MM.map(|d| d * length) };
    let weights = weights(&nodes, &areas, outline, &poses);
    let patch_of = clusters(&used, &nodes, &weights, size.patches);
    let count = patch_of.iter().max().map_or(0, |m| m + 1);
    if used.len() < 2 * count {
        return Err(failed(format!("{} nodes of the pad for {count} patches", used.len())));
    }
    let mut patches = Vec::with_capacity(count);
    let mut means = DMatrix::zeros(3 * count, 3 * nodes.len());
    for patch in 0..count {
        let own: Vec<usize> = used.iter().zip(&patch_of).filter(|(_, p)| **p == patch).map(|(k, _)| *k).collect();
        let area: f64 = own.iter().map(|&k| areas[k]).sum();
        let middle = own.iter().map(|&k| nodes[k] * areas[k]).sum::<Vector3<f64>>() / area;
        let spread = own.iter().fold(Matrix3::zeros(), |sum, &k| {
            let arm = nodes[k] - middle;
            sum + arm * arm.transpose() * (areas[k] / area)
        });
        let normal = own.iter().map(|&k| normals[k] * areas[k]).sum::<Vector3<f64>>().normalize();
        for &k in &own {
            (0..3).for_each(|c| means[(3 * patch + c, 3 * k + c)] = areas[k] / area);
        }
        patches.push(Patch { middle, area, spread, normal, modes: SMatrix::zeros(), compliance: [0.0; 2] });
    }
    let contact = compliance.matrix.view((0, 0), (3 * nodes.len(), 3 * nodes.len()));
    let of_patches = &means * contact * means.transpose();
    let root = of_patches.clone().cholesky().ok_or_else(|| failed("compliance is not positive".into()))?.l();
    let loads = loads(&patches, &of_patches, outline, &poses);
    // The modes that contain most of the energy of these loads, each scaled by its stiffness.
    let energies = root.transpose() * loads;
    let svd = energies.svd(true, false);
    let directions = svd.u.ok_or_else(|| failed("no modes".into()))?;
    let modes = &root * directions.columns(0, MODES);
    let left = &of_patches - &modes * modes.transpose();
    for (k, patch) in patches.iter_mut().enumerate() {
        patch.modes = SMatrix::from_fn(|c, mode| modes[(3 * k + c, mode)]);
        let own: Matrix3<f64> = left.fixed_view::<3, 3>(3 * k, 3 * k).into_owned();
        let along = patch.normal.dot(&(own * patch.normal));
        patch.compliance = [along, 0.5 * (own.trace() - along)];
    }
    let whole: f64 = patches.iter().map(|p| p.area).sum();
    let middle = patches.iter().map(|p| p.middle * p.area).sum::<Vector3<f64>>() / whole;
    let rigid = rigid(&patches, &middle);
    let normals = patches.iter().map(|p| p.normal).collect();
    let numbers = Numbers {
        rigid: std::array::from_fn(|row| std::array::from_fn(|mode| rigid[(row, mode)])),
        squash: [0.0; PACKED],
        reach: 0.0,
        middle_mm: middle.into(),
        first_touch_mm: reach(outline, shift_deg),
        neutral_pitch_deg: finger.neutral_pitch_deg,
        pitch_range_deg: PITCH_RANGE_DEG,
        roll_max_deg: ROLL_MAX_DEG,
        depth_max_mm,
        band_normal: [[0.0; 3]; 2],
        band_friction: [[0.0; 3]; 2],
        band_body: [0.0; 2],
        band_deep: [0.0; 2],
        band_light_n: [[0.0; 2]; 2],
        law: FittedNumbers::default().law,
    };
    let patches = patches.into_iter().map(|p| {
        // The second moment of a patch of two nodes is singular.
        let root = (p.spread + Matrix3::identity() * 1e-6).cholesky().map_or(Matrix3::zeros(), |c| c.l());
        fingerpad::pad::Patch {
            middle_mm: p.middle.into(),
            area_mm2: p.area,
            spread_mm: [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)].map(|place| root[place]),
            modes: std::array::from_fn(|axis| std::array::from_fn(|mode| p.modes[(axis, mode)])),
            compliance_mm_per_n: p.compliance,
        }
    });
    let patches: Vec<fingerpad::pad::Patch<f64>> = patches.collect();
    let reach = patches.iter().map(fingerpad::pad::Patch::reach).fold(0.0, f64::max);
    Ok(PadModel { patches, numbers: Numbers { reach, ..numbers }, normals })
}

/// Translation and rotation that are closest to the motion of all patches in each mode, by least squares over the area.
fn rigid(patches: &[Patch], middle: &Vector3<f64>) -> SMatrix<f64, 6, MODES> {
    let (mut square, mut right) = (SMatrix::<f64, 6, 6>::zeros(), SMatrix::<f64, 6, MODES>::zeros());
    for patch in patches {
        let arm = patch.middle - middle;
        let mut motion = SMatrix::<f64, 3, 6>::zeros();
        motion.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
        motion.fixed_view_mut::<3, 3>(0, 3).copy_from(&-arm.cross_matrix());
        square += motion.transpose() * motion * patch.area;
        right += motion.transpose() * patch.modes * patch.area;
    }
    square.try_inverse().map_or(SMatrix::zeros(), |inverse| inverse * right)
}

/// Area around each node, mm², and its inner normal.
fn around(finger: &Finger, nodes: &[u32]) -> (Vec<f64>, Vec<Vector3<f64>>) {
    let mesh = &finger.mesh;
    let mut place = vec![usize::MAX; mesh.nodes.len()];
    nodes.iter().enumerate().for_each(|(k, &n)| place[n as usize] = k);
    let (mut areas, mut normals) = (vec![0.0; nodes.len()], vec![Vector3::zeros(); nodes.len()]);
    let quads = mesh.pad_faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d], [a, b, d], [b, c, d]]);
    let triangles = mesh.pad_triangles.iter().flat_map(|&t| [t, t]);
    for triangle in quads.chain(triangles) {
        let [a, b, c] = triangle.map(|n| mesh.nodes[n as usize]);
        // Each quadrilateral is divided into triangles along both diagonals.
        let outer = (b - a).cross(&(c - a)) * 0.25;
        for k in triangle.map(|n| place[n as usize]).into_iter().filter(|&k| k != usize::MAX) {
            areas[k] += outer.norm() / 3.0;
            normals[k] -= outer;
        }
    }
    let normals = normals.into_iter().map(|n| n.try_normalize(0.0).unwrap_or(Vector3::z())).collect();
    (areas, normals)
}

/// Weight of each node in the division into patches: its area times a factor that grows with the number of poses whose contact includes it,
/// so that patches are small there.
fn weights(nodes: &[Vector3<f64>], areas: &[f64], outline: &Outline, poses: &Poses) -> Vec<f64> {
    let mut touched = vec![0.0; nodes.len()];
    let mut whole = 0.0;
    for (pitch, roll) in poses.pitches_deg.into_iter().flat_map(|p| ROLLS_DEG.map(|r| (p, r))) {
        let normal = tilt(pitch.to_radians(), roll.to_radians()) * Vector3::z();
        let height = first_touch(outline, &normal);
        let often = (-(pitch / USUAL_DEG).powi(2) - (roll / USUAL_DEG).powi(2)).exp();
        for depth in poses.depths_mm {
            whole += often;
            for (touched, node) in touched.iter_mut().zip(nodes) {
                if height + depth > normal.dot(node) {
                    *touched += often;
                }
            }
        }
    }
    touched.iter().zip(areas).map(|(touched, area)| area * (LEAST_WEIGHT + touched / whole)).collect()
}

/// Index of the patch of each used node: k-means over one half, mirrored. Patches at the middle plane are joined with their mirror image.
fn clusters(used: &[usize], nodes: &[Vector3<f64>], weights: &[f64], wanted: usize) -> Vec<usize> {
    let half: Vec<usize> = used.iter().copied().filter(|&k| nodes[k].y > -1e-9).collect();
    // A patch with nodes in the middle plane is its own mirror image.
    let central = |middles: &[Vector3<f64>]| {
        let mut central = vec![false; middles.len()];
        half.iter().filter(|&&k| nodes[k].y < 1e-9).for_each(|&k| central[nearest(&nodes[k], middles)] = true);
        central
    };
    let mut best: Option<(usize, Vec<Vector3<f64>>, Vec<bool>)> = None;
    for count in 2..=wanted {
        let middles = k_means(&half, nodes, weights, count);
        let central = central(&middles);
        let whole = central.iter().map(|central| if *central { 1 } else { 2 }).sum::<usize>();
        let off = whole.abs_diff(wanted);
        if best.as_ref().is_none_or(|(least, ..)| off < *least) {
            best = Some((off, middles, central));
        }
    }
    let (middles, central) = best.map(|(_, middles, central)| (middles, central)).unwrap_or_default();
    // Mirror images of patches away from the middle plane come after all others.
    let mut mirrored = vec![usize::MAX; middles.len()];
    let mut next = middles.len();
    for (mirrored, central) in mirrored.iter_mut().zip(central) {
        if !central {
            *mirrored = next;
            next += 1;
        }
    }
    let patch = |&k: &usize| {
        let folded = Vector3::new(nodes[k].x, nodes[k].y.abs(), nodes[k].z);
        let own = nearest(&folded, &middles);
        if nodes[k].y < -1e-9 && mirrored[own] != usize::MAX { mirrored[own] } else { own }
    };
    let found: Vec<usize> = used.iter().map(patch).collect();
    // Where centres lie at equal distances from a node, one of them may have none.
    let mut numbers: Vec<usize> = found.clone();
    numbers.sort_unstable();
    numbers.dedup();
    found.into_iter().filter_map(|own| numbers.binary_search(&own).ok()).collect()
}

fn nearest(point: &Vector3<f64>, middles: &[Vector3<f64>]) -> usize {
    let distance = |k: &usize| (middles[*k] - point).norm_squared();
    (0..middles.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
}

/// Centres of `count` clusters, started from points that are far from each other.
fn k_means(points: &[usize], nodes: &[Vector3<f64>], weights: &[f64], count: usize) -> Vec<Vector3<f64>> {
    let mut middles = vec![nodes[points[0]]];
    while middles.len() < count {
        let far = |k: &usize| {
            middles.iter().map(|m| (m - nodes[*k]).norm_squared()).fold(f64::INFINITY, f64::min) * weights[*k]
        };
        let next = points.iter().max_by(|a, b| far(a).total_cmp(&far(b))).expect("there are points");
        middles.push(nodes[*next]);
    }
    for _ in 0..ROUNDS {
        let mut sums = vec![(Vector3::zeros(), 0.0); count];
        for &k in points {
            let sum = &mut sums[nearest(&nodes[k], &middles)];
            sum.0 += nodes[k] * weights[k];
            sum.1 += weights[k];
        }
        for (middle, (sum, area)) in middles.iter_mut().zip(sums) {
            if area > 0.0 {
                *middle = sum / area;
            }
        }
    }
    middles
}

/// Loads of contacts in many poses, N, one per column, each of unit energy: the pressure of a press, and its friction along x, along y and
/// under a spin.
fn loads(patches: &[Patch], compliance: &DMatrix<f64>, outline: &Outline, poses: &Poses) -> DMatrix<f64> {
    let mut columns: Vec<DVector<f64>> = Vec::new();
    for pitch in poses.pitches_deg {
        for roll in ROLLS_DEG {
            let tilt = tilt(pitch.to_radians(), roll.to_radians());
            let normal = tilt * Vector3::z();
            for depth in poses.depths_mm {
                let height = first_touch(outline, &normal) + depth;
                let pressure = press(patches, compliance, &normal, height);
                if pressure.iter().sum::<f64>() <= 0.0 {
                    continue;
                }
                let [x, y] = [tilt * Vector3::x(), tilt * Vector3::y()];
                let whole: f64 = pressure.iter().sum();
                let centre = patches.iter().zip(&pressure).map(|(p, f)| p.middle * *f).sum::<Vector3<f64>>() / whole;
                let load = |of: &dyn Fn(&Patch) -> Vector3<f64>, power: f64| {
                    let mut load = DVector::zeros(3 * patches.len());
                    for (k, (patch, f)) in patches.iter().zip(&pressure).enumerate() {
                        load.fixed_rows_mut::<3>(3 * k).copy_from(&(of(patch) * f.powf(power)));
                    }
                    load
                };
                columns.push(load(&|_| normal, 1.0));
                columns.push(load(&|_| x, 0.5));
                columns.push(load(&|_| y, 0.5));
                columns.push(load(&|p| normal.cross(&(p.middle - centre)), 0.5));
            }
        }
    }
    let scaled = columns.into_iter().filter_map(|load| {
        let energy = load.dot(&(compliance * &load));
        // A single patch has no moment about its own middle.
        (energy > 1e-12).then(|| load / energy.sqrt())
    });
    DMatrix::from_columns(&scaled.collect::<Vec<_>>())
}

/// Forces of a frictionless press on patches that touch at their middles, N, by Gauss-Seidel iterations.
fn press(patches: &[Patch], compliance: &DMatrix<f64>, normal: &Vector3<f64>, height: f64) -> Vec<f64> {
    let count = patches.len();
    let along = DMatrix::from_fn(count, count, |a, b| {
        let block: Matrix3<f64> = compliance.fixed_view::<3, 3>(3 * a, 3 * b).into_owned();
        normal.dot(&(block * normal))
    });
    let mut force = vec![0.0; count];
    for _ in 0..200 {
        for a in 0..count {
            let overlap = height - normal.dot(&patches[a].middle);
            let others: f64 = (0..count).map(|b| along[(a, b)] * force[b]).sum::<f64>() - along[(a, a)] * force[a];
            force[a] = ((overlap - others) / along[(a, a)]).max(0.0);
        }
    }
    force
}

/// Height of the plane at first touch, along its normal, mm.
fn first_touch(outline: &Outline, normal: &Vector3<f64>) -> f64 {
    outline.lowest(normal).map_or(0.0, |lowest| lowest.dot(normal))
}

/// The height of first touch over the poses, by least squares.
fn reach(outline: &Outline, shift_deg: f64) -> [f64; FIRST_TOUCH_TERMS] {
    let mut rows = Vec::new();
    let mut heights = Vec::new();
    for pitch in (-20..=40).step_by(2) {
        for roll in (-30..=30).step_by(3) {
            let normal = tilt((f64::from(pitch) + shift_deg).to_radians(), f64::from(roll).to_radians()) * Vector3::z();
            rows.push(first_touch_terms(normal.x, normal.y));
            heights.push(first_touch(outline, &normal));
        }
    }
    let matrix = DMatrix::from_fn(rows.len(), FIRST_TOUCH_TERMS, |row, k| rows[row][k]);
    let solution = matrix.svd(true, true).solve(&DVector::from_vec(heights), 1e-12).expect("both factors are there");
    std::array::from_fn(|k| solution[k])
}
