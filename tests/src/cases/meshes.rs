//! Influence of mesh, bones and nail on the result: convergence, growth of cost, variants side by side.

use fingerpad_fe::assembly::Joint;
use fingerpad_fe::load_path::{Bone, BoneKind, Finger, Problem, Tissue, Trajectory};
use fingerpad_fe::mesh::{Divisions, FingertipShape, MeshPreset, Nail, fingertip};

use super::{Effort, Failure};
use crate::{
    Check,
    calculix::{Case, Element},
    memory::peak_gib,
    problems::fingers::{at_corner, finger, follow, placed, problem},
};

/// Meshes refined evenly.
const PRESETS: [MeshPreset; 3] = [MeshPreset::Coarse, MeshPreset::Medium, MeshPreset::Fine];

/// Normal force (N), contact area (mm²) and F/N in full slip at 1 mm.
fn kinetic(finger: &Finger) -> Result<[f64; 3], Failure> {
    let problem = problem(&finger.body, &finger.mesh.pad_faces);
    let end = *follow(&problem, &placed(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 4.0, 0.0]]))?
        .responses
        .last()
        .ok_or("no response")?;
    Ok([end.normal_force_n, end.contact_area_mm2, end.friction_x_n / end.normal_force_n])
}

/// Order and limit of three values on meshes of size `h`, coarse to fine; the order is kept between 1 and 2.
fn extrapolated(h: [f64; 3], f: [f64; 3]) -> (f64, f64) {
    let ratio = (f[0] - f[1]) / (f[1] - f[2]);
    let of_order = |p: f64| (h[0].powf(p) - h[1].powf(p)) / (h[1].powf(p) - h[2].powf(p));
    let (mut low, mut high) = (1.0, 2.0);
    if !(ratio > of_order(low)) {
        // Not yet in the asymptotic range: the cautious end.
        high = low;
    } else if ratio > of_order(high) {
        low = high;
    }
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if of_order(middle) < ratio { low = middle } else { high = middle }
    }
    let p = 0.5 * (low + high);
    (p, f[2] + (f[2] - f[1]) / ((h[1] / h[2]).powf(p) - 1.0))
}

/// Three meshes of A (bone fixed) and E (floating) at 1 mm.
pub fn convergence(effort: Effort) -> Result<Vec<Check>, Failure> {
    let mut checks = Vec::new();
    for (shape, bone) in [("a", BoneKind::Fixed), ("e", BoneKind::Floating)] {
        let mut values = Vec::new();
        let presets = if effort == Effort::Quick { &PRESETS[..1] } else { &PRESETS[..] };
        for &preset in presets {
            let finger = finger(shape, preset, bone, 1.0)?;
            values.push(kinetic(&finger)?);
            let nodes = finger.mesh.nodes.len();
            for (what, value) in ["N (N)", "area (mm²)", "F/N"].iter().zip(values[values.len() - 1]) {
                checks.push(Check::reported(format!("{shape} {bone:?}, {nodes} nodes: {what}"), value));
            }
        }
        if let [coarse, medium, fine] = values[..] {
            let h = PRESETS.map(|preset| 1.0 / preset.divisions().distal_rings as f64);
            for (k, what) in ["N", "area", "F/N"].iter().enumerate() {
                let (order, limit) = extrapolated(h, [coarse[k], medium[k], fine[k]]);
                checks.push(Check::reported(format!("{shape} {bone:?}: order of {what} (kept in 1..2)"), order));
                let name = format!("{shape} {bone:?}: {what}, medium mesh against the extrapolated");
                checks.push(Check::relative(name, medium[k], limit, 0.03));
            }
        }
    }
    Ok(checks)
}

/// Depths of [`finer`], mm, each slid at by 3 mm more.
const DEPTHS_MM: [f64; 4] = [0.75, 1.0, 1.25, 1.5];

/// F/N and contact area (mm²) in full slip at the depths of [`DEPTHS_MM`].
fn in_full_slip(shape: &str, bone: BoneKind, divisions: &Divisions) -> Result<Vec<[f64; 2]>, Failure> {
    let tip = fingertip(&FingertipShape::named(shape)?, divisions)?;
    let bone = Bone { kind: bone, ..Default::default() };
    let finger = Finger::new(tip, &Tissue { bone, ..Default::default() })?;
    let mut corners = vec![[0.0; 3]];
    for (k, depth_mm) in DEPTHS_MM.into_iter().enumerate() {
        corners.extend([[depth_mm, 3.0 * k as f64, 0.0], [depth_mm, 3.0 * (k + 1) as f64, 0.0]]);
    }
    let problem = Problem { half: finger.half.as_ref(), ..problem(&finger.body, &finger.mesh.pad_faces) };
    let run = follow(&problem, &placed(&corners))?;
    let at = |k: usize| at_corner(&run, 2 * k + 2);
    Ok((0..DEPTHS_MM.len()).map(|k| [at(k).friction_x_n / at(k).normal_force_n, at(k).contact_area_mm2]).collect())
}

/// The shipped mesh against the mean of evenly finer ones, whose areas scatter by where their nodes lie at the rim.
pub fn finer(effort: Effort) -> Result<Vec<Check>, Failure> {
    let (preset, factors): (_, &[f64]) =
        if effort == Effort::Quick { (MeshPreset::Coarse, &[1.5]) } else { (MeshPreset::Default, &[1.6, 1.8, 2.0]) };
    let even = if effort == Effort::Quick { preset } else { MeshPreset::Medium };
    let mut checks = Vec::new();
    for (shape, bone) in [("e", BoneKind::Floating), ("a", BoneKind::Fixed)] {
        let ours = in_full_slip(shape, bone, &preset.divisions())?;
        let mut references = Vec::new();
        for &factor in factors {
            references.push(in_full_slip(shape, bone, &even.divisions().scaled(factor))?);
        }
        for (k, depth_mm) in DEPTHS_MM.into_iter().enumerate() {
            for (i, (what, bound)) in [("F/N", 0.02), ("area (mm²)", 0.015)].into_iter().enumerate() {
                let all = references.iter().map(|reference| reference[k][i]);
                let mean = all.clone().sum::<f64>() / references.len() as f64;
                let (least, most) = all.fold((f64::INFINITY, 0.0f64), |(a, b), x| (a.min(x), b.max(x)));
                let name = |what: &str| format!("{shape} {bone:?}, {preset:?}, {depth_mm} mm: {what}");
                if effort == Effort::Quick {
                    checks.push(Check::reported(name(what), ours[k][i] / mean));
                } else {
                    checks.push(Check::relative(name(what), ours[k][i], mean, bound));
                    checks.push(Check::reported(
                        name(&format!("{what}: scatter of the finer meshes")),
                        (most - least) / mean,
                    ));
                }
            }
        }
    }
    Ok(checks)
}

/// Rows at even steps of a slide of 3 mm at 1 mm of depth and of the slide back to 1.5 mm: friction (N) and stick
/// ratio.
fn there_and_back(finger: &Finger) -> Result<Vec<[f64; 2]>, Failure> {
    let slides: Vec<f64> = (1..=30).chain((15..30).rev()).map(|k| 0.1 * f64::from(k)).collect();
    let mut corners = vec![[0.0; 3], [1.0, 0.0, 0.0]];
    corners.extend(slides.iter().map(|&s| [1.0, s, 0.0]));
    let problem = Problem { half: finger.half.as_ref(), ..problem(&finger.body, &finger.mesh.pad_faces) };
    let run = follow(&problem, &placed(&corners))?;
    let row = |k: usize| {
        let r = at_corner(&run, k);
        [r.friction_x_n, r.stick_ratio]
    };
    Ok((2..corners.len()).map(row).collect())
}

/// Friction and stick ratio over a slide and a reversal on the shipped meshes against those with the pad's faces halved.
pub fn slides(effort: Effort) -> Result<Vec<Check>, Failure> {
    let preset = if effort == Effort::Quick { MeshPreset::Coarse } else { MeshPreset::Default };
    let mut checks = Vec::new();
    for (shape, bone) in [("e", BoneKind::Floating), ("a", BoneKind::Fixed)] {
        let whole = preset.divisions();
        let halved = Divisions { pad_refinement: whole.pad_refinement + 1, ..whole };
        let rows = [whole, halved].map(|divisions| -> Result<Vec<[f64; 2]>, Failure> {
            let tip = fingertip(&FingertipShape::named(shape)?, &divisions)?;
            let bone = Bone { kind: bone, ..Default::default() };
            there_and_back(&Finger::new(tip, &Tissue { bone, ..Default::default() })?)
        });
        let [ours, finer] = rows;
        let (ours, finer) = (ours?, finer?);
        let largest_force = finer.iter().map(|row| row[0].abs()).fold(0.0, f64::max);
        let errors = |k: usize| ours.iter().zip(&finer).map(move |(a, b)| (a[k] - b[k]).abs());
        let rms = |k: usize| (errors(k).map(|e| e * e).sum::<f64>() / ours.len() as f64).sqrt();
        let largest = |k: usize| errors(k).fold(0.0, f64::max);
        let name = |what: &str| format!("{shape} {bone:?}, {preset:?} against faces halved: {what}");
        checks.extend([
            Check::at_most(name("stick ratio, RMS"), rms(1), 0.02),
            Check::at_most(name("stick ratio, largest difference"), largest(1), 0.05),
            Check::at_most(name("F(s) over the largest, RMS"), rms(0) / largest_force, 0.01),
            Check::at_most(name("F(s) over the largest, largest difference"), largest(0) / largest_force, 0.02),
        ]);
    }
    Ok(checks)
}

/// Frictionless press of A (bone fixed) to 1 mm on three meshes with mean dilatation and with CalculiX's C3D8R.
///
/// Both elements model the same body: their difference on one mesh is an error of the mesh and has to vanish.
pub fn elements(effort: Effort) -> Result<Vec<Check>, Failure> {
    let presets = if effort == Effort::Quick { &PRESETS[..2] } else { &PRESETS[..] };
    let normal = |element: Element, preset: MeshPreset| -> Result<f64, Failure> {
        let finger = Case::new("a", preset).with(element).finger();
        let problem = Problem { friction: None, ..problem(&finger.body, &finger.mesh.pad_faces) };
        let run = follow(&problem, &placed(&[[0.0; 3], [1.0, 0.0, 0.0]]))?;
        Ok(run.responses.last().ok_or("no response")?.normal_force_n)
    };
    let mut checks = Vec::new();
    let (mut shipped, mut reduced, mut last) = (Vec::new(), Vec::new(), f64::INFINITY);
    for &preset in presets {
        shipped.push(normal(Element::MeanDilatation, preset)?);
        reduced.push(normal(Element::C3d8r, preset)?);
        let (ours, theirs) = (shipped[shipped.len() - 1], reduced[reduced.len() - 1]);
        let name = |what: &str| format!("a Fixed, {preset:?}, frictionless 1 mm: {what}");
        checks.push(Check::reported(name("N, mean dilatation (N)"), ours));
        checks.push(Check::reported(name("N, C3D8R (N)"), theirs));
        let apart = (ours / theirs - 1.0).abs();
        checks.push(Check::at_most(name("relative difference, below the coarser mesh's"), apart, last));
        last = apart;
    }
    if let ([a, b, c], [d, e, f]) = (&shipped[..], &reduced[..]) {
        let h = PRESETS.map(|preset| 1.0 / preset.divisions().distal_rings as f64);
        let limits = [extrapolated(h, [*a, *b, *c]), extrapolated(h, [*d, *e, *f])];
        checks.push(Check::reported("order, mean dilatation (kept in 1..2)", limits[0].0));
        checks.push(Check::reported("order, C3D8R (kept in 1..2)", limits[1].0));
        checks.push(Check::relative("N extrapolated, mean dilatation against C3D8R", limits[0].1, limits[1].1, 0.01));
    }
    Ok(checks)
}

/// Press of 1.5 mm and 6 mm of slide on three meshes of E: time and memory.
pub fn growth(effort: Effort) -> Result<Vec<Check>, Failure> {
    let presets = if effort == Effort::Quick { &PRESETS[..1] } else { &PRESETS[..] };
    let mut checks = Vec::new();
    for &preset in presets {
        let finger = finger("e", preset, BoneKind::Floating, 1.0)?;
        let problem = problem(&finger.body, &finger.mesh.pad_faces);
        let Trajectory { cost, .. } = follow(&problem, &placed(&[[0.0; 3], [1.5, 0.0, 0.0], [1.5, 6.0, 0.0]]))?;
        let name = |what: &str| format!("e Floating, {} nodes: {what}", finger.mesh.nodes.len());
        checks.push(Check::reported(name("CPU (s)"), cost.cpu_s));
        checks.push(Check::reported(name("peak memory of the process so far (GiB)"), peak_gib()));
        checks.push(Check::reported(name("increments"), cost.increments.into()));
        checks.push(Check::reported(name("factorisations"), cost.factorisations.into()));
    }
    Ok(checks)
}

/// Rigid against deformable bone, the joint of the floating one, the supports of the nail: E at 1 mm.
pub fn variants(effort: Effort) -> Result<Vec<Check>, Failure> {
    let preset = if effort == Effort::Quick { MeshPreset::Coarse } else { MeshPreset::Default };
    let with = |bone: Bone, nail: Nail| -> Result<[f64; 3], Failure> {
        let shape = FingertipShape { nail, ..FingertipShape::named("e")? };
        let tip = fingertip(&shape, &preset.divisions())?;
        kinetic(&Finger::new(tip, &Tissue { bone, ..Default::default() })?)
    };
    let joint = |factor: f64| {
        let joint = Joint::default();
        Joint {
            translation_n_per_mm: joint.translation_n_per_mm * factor,
            rotation_nmm_per_rad: joint.rotation_nmm_per_rad * factor,
        }
    };
    let floating = |factor: f64| Bone { joint: joint(factor), ..Default::default() };
    let kind = |kind: BoneKind| Bone { kind, ..Default::default() };
    let variants = [
        ("floating (default)", floating(1.0), Nail::Tets),
        ("floating, joint x0.1", floating(0.1), Nail::Tets),
        ("floating, joint x10", floating(10.0), Nail::Tets),
        ("fixed", kind(BoneKind::Fixed), Nail::Tets),
        ("floating, nail as a fixed patch", floating(1.0), Nail::FixedPatch),
        ("floating, no joint", floating(0.0), Nail::Tets),
        ("deformable, 10 GPa", kind(BoneKind::Deformable), Nail::Tets),
    ];
    let mut checks = Vec::new();
    let mut free = [f64::NAN; 3];
    for (name, bone, nail) in variants {
        let values = with(bone, nail)?;
        for (what, value) in ["N (N)", "area (mm²)", "F/N"].iter().zip(values) {
            checks.push(Check::reported(format!("{name}: {what}"), value));
        }
        if bone.kind == BoneKind::Deformable {
            // The elastic phalanx hangs in the tissue alone, as the rigid one without its joint, and is 300 000 times
            // as stiff as the tissue.
            for (what, (value, free)) in ["N", "area", "F/N"].iter().zip(values.iter().zip(free)) {
                checks.push(Check::relative(format!("{name}, against rigid, no joint: {what}"), *value, free, 0.01));
            }
        }
        free = values;
    }
    Ok(checks)
}

#[cfg(test)]
mod tests {
    use super::extrapolated;

    #[test]
    fn order_and_limit_of_a_power_law_come_back() {
        let h = [0.1, 0.05, 1.0 / 36.0];
        let (order, limit) = extrapolated(h, h.map(|h| 3.0 + 2.0 * f64::powf(h, 1.5)));
        assert!((order - 1.5).abs() < 1e-9 && (limit - 3.0).abs() < 1e-9, "{order} {limit}");
    }
}
