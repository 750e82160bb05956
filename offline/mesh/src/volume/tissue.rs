//! The volume turned to the finger's axes, cut near the fingertip, cleaned, and separated into its pieces.

use nalgebra::{Rotation3, Vector3};

use super::error::VolumeError;
use super::{LabelVolume, VolumeGeometry};

/// Kind of a voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Kind {
    Outside,
    Soft,
    DistalBone,
    ProximalBone,
    Nail,
}

impl Kind {
    pub(super) fn is_bone(self) -> bool {
        matches!(self, Self::DistalBone | Self::ProximalBone)
    }

    /// Inside the skin's outer surface.
    pub(super) fn is_inside(self) -> bool {
        self == Self::Soft || self.is_bone()
    }
}

/// Where the frame of the finger lies among the voxels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    /// Turn from the finger's axes to the turned volume's.
    pub(super) rotation: Rotation3<f64>,
    /// The finger's origin in the turned volume, mm.
    pub(super) origin_mm: Vector3<f64>,
}

impl Pose {
    /// From the finger's frame to the turned volume's, mm.
    pub(super) fn to_volume(self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point + self.origin_mm
    }

    /// From the turned volume's frame to the finger's, mm.
    pub(super) fn to_finger(self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation.inverse() * (point - self.origin_mm)
    }
}

/// Voxels in the order distal (fastest), lateral, dorsal; only those near the fingertip.
pub(super) struct Tissue {
    pub(super) size: [usize; 3],
    pub(super) spacing_mm: [f64; 3],
    pub(super) kinds: Vec<Kind>,
    /// Voxels of air enclosed by tissue, taken as soft tissue, and of specks apart from the finger, dropped.
    pub(super) filled: usize,
    pub(super) dropped: usize,
    /// File axis of each axis, its sign, and the first voxel that was kept.
    axes: [(usize, f64); 3],
    file_size: [usize; 3],
    first: usize,
}

/// Room kept beyond the cut, mm.
const MARGIN_MM: f64 = 3.0;
/// Specks of bone below this volume are soft tissue, mm³.
const SPECK_MM3: f64 = 2.0;

impl Tissue {
    pub(super) fn new(volume: &LabelVolume, settings: &VolumeGeometry) -> Result<Self, VolumeError> {
        let kind_of = kinds_of_labels(volume, settings)?;
        let axes = finger_axes(volume, settings)?;
        let spacing = volume.spacing_mm();
        let (size, spacing_mm) = (axes.map(|(a, _)| volume.size[a]), axes.map(|(a, _)| spacing[a]));
        let mut tissue =
            Self { size, spacing_mm, kinds: vec![], filled: 0, dropped: 0, axes, file_size: volume.size, first: 0 };
        let at = |i: usize, j: usize, k: usize| {
            let mut index = [0; 3];
            for (n, (axis, sign)) in [i, j, k].into_iter().zip(axes) {
                index[axis] = if sign > 0.0 { n } else { volume.size[axis] - 1 - n };
            }
            let [a, b, c] = index;
            kind_of[usize::from(volume.labels[(c * volume.size[1] + b) * volume.size[0] + a])]
        };
        let filled = |i: usize| (0..size[2]).any(|k| (0..size[1]).any(|j| at(i, j, k).is_inside()));
        let tip = (0..size[0]).rev().find(|&i| filled(i)).expect("there is soft tissue");
        let wanted = ((settings.length_mm + MARGIN_MM) / spacing_mm[0]).ceil() as usize;
        tissue.first = (tip + 1).saturating_sub(wanted);
        tissue.size[0] = (tip + 3).min(size[0]) - tissue.first;
        for k in 0..size[2] {
            for j in 0..size[1] {
                tissue.kinds.extend((0..tissue.size[0]).map(|i| at(i + tissue.first, j, k)));
            }
        }
        tissue.clean();
        let proximal = (0..tissue.size[0]).find(|&i| tissue.filled(i)).unwrap_or(0);
        let reach = (tip + 1 - tissue.first - proximal) as f64 * spacing_mm[0];
        if !(reach > settings.length_mm + spacing_mm[0]) {
            return Err(VolumeError::TooShort { what: "the finger", reach_mm: reach, length_mm: settings.length_mm });
        }
        Ok(tissue)
    }

    pub(super) fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.size[1] + j) * self.size[0] + i
    }

    pub(super) fn place(&self, index: usize) -> [usize; 3] {
        let [ni, nj, _] = self.size;
        [index % ni, index / ni % nj, index / ni / nj]
    }

    /// Middle of a voxel in the turned volume, mm.
    pub(super) fn middle(&self, [i, j, k]: [usize; 3]) -> Vector3<f64> {
        Vector3::new(i as f64 + 0.5, j as f64 + 0.5, k as f64 + 0.5).component_mul(&Vector3::from(self.spacing_mm))
    }

    fn filled(&self, i: usize) -> bool {
        (0..self.size[2]).any(|k| (0..self.size[1]).any(|j| self.kinds[self.index([i, j, k])].is_inside()))
    }

    /// Indices in the file, of a point of the turned volume.
    pub(super) fn voxel_in_file(&self, point: &Vector3<f64>) -> [i64; 3] {
        let mut voxel = Vector3::zeros();
        for (n, (axis, sign)) in self.axes.into_iter().enumerate() {
            let shift = if n == 0 { self.first as f64 } else { 0.0 };
            let index = point[n] / self.spacing_mm[n] - 0.5 + shift;
            voxel[axis] = if sign > 0.0 { index } else { self.file_size[axis] as f64 - 1.0 - index };
        }
        super::error::voxel(voxel)
    }

    /// Neighbours across faces, with the axis and its direction.
    pub(super) fn neighbours(&self, index: usize) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        let place = self.place(index);
        (0..3).flat_map(move |axis| {
            let mut lower = place;
            let mut upper = place;
            upper[axis] += 1;
            let down = (place[axis] > 0).then(|| {
                lower[axis] -= 1;
                (self.index(lower), axis, -1.0)
            });
            let up = (upper[axis] < self.size[axis]).then(|| (self.index(upper), axis, 1.0));
            down.into_iter().chain(up)
        })
    }

    /// Pieces of the voxels for which `of` holds, largest first; connected across faces.
    pub(super) fn pieces(&self, of: impl Fn(Kind) -> bool) -> Vec<Vec<usize>> {
        let mut seen: Vec<bool> = self.kinds.iter().map(|k| !of(*k)).collect();
        let mut pieces = Vec::new();
        for start in 0..seen.len() {
            if seen[start] {
                continue;
            }
            seen[start] = true;
            let mut piece = vec![start];
            let mut next = 0;
            while next < piece.len() {
                for (neighbour, _, _) in self.neighbours(piece[next]) {
                    if !std::mem::replace(&mut seen[neighbour], true) {
                        piece.push(neighbour);
                    }
                }
                next += 1;
            }
            pieces.push(piece);
        }
        pieces.sort_by_key(|piece| std::cmp::Reverse(piece.len()));
        pieces
    }

    /// Keeps the largest piece that is not air, fills air inside it, and soft tissue inside bone.
    fn clean(&mut self) {
        for speck in self.pieces(|k| k != Kind::Outside).into_iter().skip(1) {
            self.dropped += speck.len();
            speck.into_iter().for_each(|v| self.kinds[v] = Kind::Outside);
        }
        let last = self.size.map(|n| n - 1);
        let open = |place: [usize; 3]| (0..3).any(|axis| place[axis] == 0 || place[axis] == last[axis]);
        for piece in self.pieces(|k| k == Kind::Outside) {
            if !piece.iter().any(|v| open(self.place(*v))) {
                self.filled += piece.len();
                piece.into_iter().for_each(|v| self.kinds[v] = Kind::Soft);
            }
        }
        // Marrow that was labelled as tissue, enclosed by bone.
        for piece in self.pieces(|k| !k.is_bone()).into_iter().skip(1) {
            if !piece.iter().any(|v| open(self.place(*v))) {
                piece.into_iter().for_each(|v| self.kinds[v] = Kind::DistalBone);
            }
        }
        let voxel_mm3: f64 = self.spacing_mm.iter().product();
        for piece in self.pieces(Kind::is_bone) {
            if (piece.len() as f64) * voxel_mm3 < SPECK_MM3 {
                piece.into_iter().for_each(|v| self.kinds[v] = Kind::Soft);
            }
        }
    }
}

/// Kind of each label.
fn kinds_of_labels(volume: &LabelVolume, settings: &VolumeGeometry) -> Result<Vec<Kind>, VolumeError> {
    let counts = volume.counts();
    let found: Vec<String> = counts.iter().map(|(label, n)| format!("{label} ({n} voxels)")).collect();
    let found = format!("labels {}", found.join(", "));
    let named = &settings.labels;
    let groups = [
        (&named.outside, Kind::Outside),
        (&named.soft, Kind::Soft),
        (&named.bone, Kind::DistalBone),
        (&named.nail, Kind::Nail),
    ];
    let mut kinds: Vec<Option<Kind>> = vec![None; usize::from(u16::MAX) + 1];
    for (labels, kind) in groups {
        for &label in labels {
            if kinds[usize::from(label)].replace(kind).is_some() {
                return Err(VolumeError::Setting {
                    field: "labels",
                    value: label.to_string(),
                    rule: "a label can be one thing only".into(),
                });
            }
        }
    }
    if let Some((&label, &voxels)) = counts.iter().find(|(label, _)| kinds[usize::from(**label)].is_none()) {
        return Err(VolumeError::UnknownLabel { label, voxels, found });
    }
    for (what, labels) in [("soft tissue", &named.soft), ("bone", &named.bone)] {
        if !labels.iter().any(|l| counts.contains_key(l)) {
            return Err(VolumeError::MissingLabel { what, expected: labels.clone(), found });
        }
    }
    Ok(kinds.into_iter().map(|k| k.unwrap_or(Kind::Outside)).collect())
}

/// Axes of the file that point distally, laterally (left) and dorsally, with their signs.
fn finger_axes(volume: &LabelVolume, settings: &VolumeGeometry) -> Result<[(usize, f64); 3], VolumeError> {
    let (distal, dorsal) = (settings.distal_axis.axis_and_sign(), settings.dorsal_axis.axis_and_sign());
    if distal.0 == dorsal.0 {
        return Err(VolumeError::Setting {
            field: "dorsal_axis",
            value: format!("{:?}", settings.dorsal_axis),
            rule: "must be another axis than distal_axis".into(),
        });
    }
    let lateral = 3 - distal.0 - dorsal.0;
    let toward = |(axis, sign): (usize, f64)| volume.steps_mm[axis] * sign;
    let left = toward(dorsal).cross(&toward(distal));
    Ok([distal, (lateral, left.dot(&volume.steps_mm[lateral]).signum()), dorsal])
}
