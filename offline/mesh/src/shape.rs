//! Parameters of the fingertip's shape, the contents of a geometry file.

use serde::{Deserialize, Serialize};

use super::MeshError;
use super::surface::Body;

/// How the nail is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Nail {
    /// A plate of tetrahedra tied to the skin; its outer face is `nail_fix`.
    #[default]
    Tets,
    /// No plate: the skin's nodes of the patch are `nail_fix` themselves.
    FixedPatch,
    /// Neither: a fingertip of a robot, held at its section and core.
    None,
}

/// Shape of the fingertip, in the finger's own frame: x from proximal (0) to distal (`length_mm`), y
/// lateral, z dorsal; the axis of the outer shaft is z = 0.
///
/// Outer surface: a shaft of constant section |y/a|^n + |z/b|^n = 1 and a cap of length Lt before it,
/// (|y/a|^n + |z/b|^n)^(m/n) + |x/Lt|^m = 1 (x from the cap's base); the bone is a body of the same
/// kind inside it. Then everything beyond `taper_start_mm` is sheared up, z += k r(x), so that the
/// flat of the pad faces an inclined plane.
///
/// Keys that a file leaves out have shape E's value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FingertipShape {
    /// a: half width of the outer section.
    pub half_width_mm: f64,
    /// b: half thickness of the outer section.
    pub half_thickness_mm: f64,
    /// L: length, cap included.
    pub length_mm: f64,
    /// Lt: length of the outer cap.
    pub cap_length_mm: f64,
    /// n: exponent of the outer section, >= 2.
    pub section_exponent: f64,
    /// m: exponent of the outer cap's profile, >= 2.
    pub profile_exponent: f64,
    /// k: slope of the shear.
    pub taper_slope: f64,
    /// Where the shear begins.
    pub taper_start_mm: f64,
    /// Length over which the slope grows from 0 to k.
    pub taper_blend_mm: f64,
    /// Thickness of the skin along the surface normal.
    pub skin_thickness_mm: f64,
    /// ab: half width of the bone's section.
    pub bone_half_width_mm: f64,
    /// bb: half thickness of the bone's section.
    pub bone_half_thickness_mm: f64,
    /// Ltb: length of the bone's cap.
    pub bone_cap_length_mm: f64,
    /// n_b: exponent of the bone's section, >= 2.
    pub bone_section_exponent: f64,
    /// m_b: exponent of the bone's profile, >= 2.
    pub bone_profile_exponent: f64,
    /// zb: dorsal offset of the bone's axis from the outer shaft's.
    pub bone_dorsal_offset_mm: f64,
    /// From the bone's tip to the outer tip, along x.
    pub bone_distal_clearance_mm: f64,
    /// x where the proximal bone ends and the joint gap begins.
    pub joint_start_mm: f64,
    /// x where the joint gap ends and the distal bone begins.
    pub joint_end_mm: f64,
    /// How the nail is made.
    pub nail: Nail,
    /// x of the nail's proximal edge.
    pub nail_start_mm: f64,
    /// x of the nail's distal edge.
    pub nail_end_mm: f64,
    /// Half the angle that the nail spans about the shaft's axis, measured from dorsal.
    pub nail_half_angle_deg: f64,
    /// Thickness of the nail plate.
    pub nail_thickness_mm: f64,
    /// Skin faces up to this height above the plane at first touch are contact candidates.
    pub pad_height_mm: f64,
    /// Angle between the finger's axis and the plane, tip down.
    pub inclination_deg: f64,
}

impl FingertipShape {
    /// The shape with all lengths times `size`.
    pub fn scaled(&self, size: f64) -> Self {
        let mut out = self.clone();
        let lengths = [
            &mut out.half_width_mm,
            &mut out.half_thickness_mm,
            &mut out.length_mm,
            &mut out.cap_length_mm,
            &mut out.taper_start_mm,
            &mut out.taper_blend_mm,
            &mut out.skin_thickness_mm,
            &mut out.bone_half_width_mm,
            &mut out.bone_half_thickness_mm,
            &mut out.bone_cap_length_mm,
            &mut out.bone_dorsal_offset_mm,
            &mut out.bone_distal_clearance_mm,
            &mut out.joint_start_mm,
            &mut out.joint_end_mm,
            &mut out.nail_start_mm,
            &mut out.nail_end_mm,
            &mut out.nail_thickness_mm,
            &mut out.pad_height_mm,
        ];
        lengths.into_iter().for_each(|length| *length *= size);
        out
    }
}

/// Shape E.
impl Default for FingertipShape {
    fn default() -> Self {
        Self {
            half_width_mm: 8.5,
            half_thickness_mm: 7.5,
            length_mm: 25.0,
            cap_length_mm: 12.0,
            section_exponent: 2.8,
            profile_exponent: 2.2,
            taper_slope: 0.3,
            taper_start_mm: 8.0,
            taper_blend_mm: 4.0,
            skin_thickness_mm: 0.6,
            bone_half_width_mm: 3.0,
            bone_half_thickness_mm: 1.8,
            bone_cap_length_mm: 7.0,
            bone_section_exponent: 2.2,
            bone_profile_exponent: 2.4,
            bone_dorsal_offset_mm: 3.2,
            bone_distal_clearance_mm: 6.0,
            joint_start_mm: 7.0,
            joint_end_mm: 9.0,
            nail: Nail::Tets,
            nail_start_mm: 11.0,
            nail_end_mm: 23.0,
            nail_half_angle_deg: 50.0,
            nail_thickness_mm: 0.5,
            pad_height_mm: 3.5,
            inclination_deg: 30.0,
        }
    }
}

/// What the name of a dome by its dimensions begins with.
const DOME: &str = "dome:";

/// The numbers behind `prefix` in the name of a shape by its dimensions, mm; None for another name.
///
/// * `names`: what each number is, the first `least` of them needed
pub(super) fn dimensions(
    name: &str,
    prefix: &str,
    names: &[&str],
    least: usize,
) -> Result<Option<Vec<f64>>, MeshError> {
    let Some(text) = name.strip_prefix(prefix) else { return Ok(None) };
    let refuse = |message: String| Err(MeshError::ShapeFile { name: name.into(), message });
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    if !(least..=names.len()).contains(&parts.len()) {
        return refuse(format!("{} numbers, but there must be {}", parts.len(), names.join(", ")));
    }
    let mut numbers = Vec::new();
    for (part, what) in parts.into_iter().zip(names) {
        match part.parse::<f64>() {
            Ok(number) if number > 0.0 && number.is_finite() => numbers.push(number),
            _ => return refuse(format!("{what} `{part}`: must be a positive number of mm")),
        }
    }
    Ok(Some(numbers))
}

impl FingertipShape {
    /// Names of the built-in shapes.
    pub const NAMES: [&str; 5] = ["a", "b", "d", "e", "base"];

    /// Whether a name states a shape, a built-in one or one by its dimensions, and no file.
    pub fn is_name(name: &str) -> bool {
        Self::NAMES.contains(&name) || name.starts_with(DOME)
    }

    /// One of the built-in shapes by name, or a dome by its dimensions, as `dome:12,7` or `dome:12,7,30`: radius, radius of the core, length.
    pub fn named(name: &str) -> Result<Self, MeshError> {
        if let Some(numbers) = dimensions(name, DOME, &["radius", "radius of the core", "length"], 2)? {
            let length_mm = numbers.get(2).copied().unwrap_or(2.0 * numbers[0]);
            return Self::dome(numbers[0], numbers[1], length_mm)
                .map_err(|error| MeshError::ShapeFile { name: name.into(), message: error.to_string() });
        }
        let text = match name {
            "a" => include_str!("../data/geometry/a.toml"),
            "b" => include_str!("../data/geometry/b.toml"),
            "d" => include_str!("../data/geometry/d.toml"),
            "e" => include_str!("../data/geometry/e.toml"),
            "base" => include_str!("../data/geometry/base.toml"),
            _ => {
                let names = Self::NAMES.join(", ");
                let message = format!(
                    "no such shape; there are {names}, and dome:RADIUS,CORE and flat:LENGTH,WIDTH,THICKNESS in mm"
                );
                return Err(MeshError::ShapeFile { name: name.into(), message });
            }
        };
        Self::from_toml(name, text)
    }

    /// A cylinder with a half-sphere at its end on a core of the same form, the fingertip of many robots; no nail.
    ///
    /// * `core_mm`: radius of the core; the soft layer is as thick as the difference
    ///
    /// # Errors
    /// [`MeshError::Shape`] with the number that is out of range.
    pub fn dome(radius_mm: f64, core_mm: f64, length_mm: f64) -> Result<Self, MeshError> {
        let layer_mm = radius_mm - core_mm;
        need(layer_mm > 0.02 * radius_mm, "core_mm", core_mm, || format!("must leave a layer under {radius_mm} mm"))?;
        need(length_mm >= 1.5 * radius_mm, "length_mm", length_mm, || {
            format!("must be at least {} mm", 1.5 * radius_mm)
        })?;
        let shape = Self {
            half_width_mm: radius_mm,
            half_thickness_mm: radius_mm,
            length_mm,
            cap_length_mm: radius_mm,
            section_exponent: 2.0,
            profile_exponent: 2.0,
            taper_slope: 0.0,
            taper_start_mm: radius_mm,
            taper_blend_mm: 0.5 * radius_mm,
            skin_thickness_mm: 0.15 * layer_mm,
            bone_half_width_mm: core_mm,
            bone_half_thickness_mm: core_mm,
            bone_cap_length_mm: core_mm,
            bone_section_exponent: 2.0,
            bone_profile_exponent: 2.0,
            bone_dorsal_offset_mm: 0.0,
            bone_distal_clearance_mm: layer_mm,
            joint_start_mm: 0.375 * radius_mm,
            joint_end_mm: 0.5 * radius_mm,
            nail: Nail::None,
            nail_start_mm: 0.5 * radius_mm,
            nail_end_mm: 0.75 * radius_mm,
            nail_half_angle_deg: 10.0,
            nail_thickness_mm: 0.5,
            pad_height_mm: layer_mm + 0.5,
            inclination_deg: 45.0,
        };
        shape.validate()?;
        Ok(shape)
    }

    /// Parses and checks the text of a geometry file; `name` is for the error message.
    pub fn from_toml(name: &str, text: &str) -> Result<Self, MeshError> {
        let shape: Self =
            toml::from_str(text).map_err(|e| MeshError::ShapeFile { name: name.into(), message: e.to_string() })?;
        shape.validate().map_err(|error| match error {
            MeshError::Shape { field, value, rule } => {
                let line = text.lines().position(|line| line.trim_start().starts_with(field));
                let place = line.map_or(String::new(), |line| format!("line {}: ", line + 1));
                MeshError::ShapeFile { name: name.into(), message: format!("{place}{field} = {value}: {rule}") }
            }
            other => other,
        })?;
        Ok(shape)
    }

    /// Volume of the analytic body inside the skin's outside, bones included and nail not, mm³.
    pub fn volume_mm3(&self) -> f64 {
        Body::outer(self).volume()
    }

    /// Refuses values from which no mesh can be made, naming the parameter.
    pub fn validate(&self) -> Result<(), MeshError> {
        let positive = [
            ("half_width_mm", self.half_width_mm),
            ("half_thickness_mm", self.half_thickness_mm),
            ("length_mm", self.length_mm),
            ("cap_length_mm", self.cap_length_mm),
            ("taper_blend_mm", self.taper_blend_mm),
            ("skin_thickness_mm", self.skin_thickness_mm),
            ("bone_half_width_mm", self.bone_half_width_mm),
            ("bone_half_thickness_mm", self.bone_half_thickness_mm),
            ("bone_cap_length_mm", self.bone_cap_length_mm),
            ("bone_distal_clearance_mm", self.bone_distal_clearance_mm),
            ("joint_start_mm", self.joint_start_mm),
            ("nail_start_mm", self.nail_start_mm),
            ("nail_thickness_mm", self.nail_thickness_mm),
            ("pad_height_mm", self.pad_height_mm),
        ];
        for (field, value) in positive {
            need(value > 0.0 && value.is_finite(), field, value, || "must be positive".into())?;
        }
        let exponents = [
            ("section_exponent", self.section_exponent),
            ("profile_exponent", self.profile_exponent),
            ("bone_section_exponent", self.bone_section_exponent),
            ("bone_profile_exponent", self.bone_profile_exponent),
        ];
        for (field, value) in exponents {
            need((2.0..=6.0).contains(&value), field, value, || "must be in 2..=6".into())?;
        }
        let (taper, start) = (self.taper_slope, self.taper_start_mm);
        need((0.0..=1.0).contains(&taper), "taper_slope", taper, || "must be in 0..=1".into())?;
        need((0.0..self.length_mm).contains(&start), "taper_start_mm", start, || "must be in 0..length_mm".into())?;
        let angle = self.inclination_deg;
        need((5.0..=85.0).contains(&angle), "inclination_deg", angle, || "must be in 5..=85".into())?;
        let angle = self.nail_half_angle_deg;
        need((5.0..=85.0).contains(&angle), "nail_half_angle_deg", angle, || "must be in 5..=85".into())?;
        self.validate_lengths()?;
        self.validate_bone()
    }

    /// The order of things along x.
    fn validate_lengths(&self) -> Result<(), MeshError> {
        let cap = self.cap_length_mm;
        need(cap < self.length_mm, "cap_length_mm", cap, || "must be less than length_mm".into())?;
        let bone_shaft = self.length_mm - self.bone_distal_clearance_mm - self.bone_cap_length_mm;
        let end = self.joint_end_mm;
        need(end > self.joint_start_mm, "joint_end_mm", end, || "must be beyond joint_start_mm".into())?;
        need(end <= bone_shaft && end < self.length_mm - cap, "joint_end_mm", end, || {
            format!(
                "must lie before the bone's cap (x = {bone_shaft} mm) and the outer one (x = {} mm)",
                self.length_mm - cap
            )
        })?;
        let end = self.nail_end_mm;
        need(end > self.nail_start_mm && end < self.length_mm, "nail_end_mm", end, || {
            "must lie between nail_start_mm and length_mm".into()
        })
    }

    /// Bone inside skin, skin inside tissue.
    fn validate_bone(&self) -> Result<(), MeshError> {
        let (skin, offset) = (self.skin_thickness_mm, self.bone_dorsal_offset_mm);
        let lateral = self.half_width_mm - self.bone_half_width_mm;
        let vertical = self.half_thickness_mm - self.bone_half_thickness_mm - offset.abs();
        let distal = self.bone_distal_clearance_mm;
        need(lateral > 0.0, "bone_half_width_mm", self.bone_half_width_mm, || "bone is outside the skin".into())?;
        need(offset.is_finite() && vertical > 0.0, "bone_dorsal_offset_mm", offset, || {
            "bone is outside the skin".into()
        })?;
        let tissue = lateral.min(vertical).min(distal);
        need(skin < tissue, "skin_thickness_mm", skin, || {
            format!("skin is thicker than the tissue over the bone ({tissue} mm)")
        })?;
        let inside = Body::bone(self).level_of_skin_inside(&Body::outer(self), skin);
        need(inside > 1.0, "bone_half_thickness_mm", self.bone_half_thickness_mm, || {
            "the bone's surface cuts through the skin's inner side (corner of the section or tip)".into()
        })
    }
}

/// `Err` unless `holds`; the condition is false for NaN.
fn need(holds: bool, field: &'static str, value: f64, rule: impl Fn() -> String) -> Result<(), MeshError> {
    if holds { Ok(()) } else { Err(MeshError::Shape { field, value, rule: rule() }) }
}

#[cfg(test)]
impl FingertipShape {
    /// A round bar that ends in half a sphere.
    pub(super) fn round(radius_mm: f64) -> Self {
        Self {
            half_width_mm: radius_mm,
            half_thickness_mm: radius_mm,
            cap_length_mm: radius_mm,
            section_exponent: 2.0,
            profile_exponent: 2.0,
            taper_slope: 0.0,
            ..Self::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Name of the refused field.
    fn refused(change: impl Fn(&mut FingertipShape)) -> &'static str {
        let mut shape = FingertipShape::default();
        change(&mut shape);
        match shape.validate() {
            Err(MeshError::Shape { field, .. }) => field,
            other => panic!("expected a refusal, got {other:?}"),
        }
    }

    #[test]
    fn shipped_shapes_are_valid_and_e_is_the_default() {
        for name in FingertipShape::NAMES {
            FingertipShape::named(name).unwrap();
        }
        assert_eq!(FingertipShape::named("e").unwrap(), FingertipShape::default());
        assert!(FingertipShape::named("z").unwrap_err().to_string().contains("a, b, d, e, base"));
    }

    #[test]
    fn round_trip_and_unknown_keys() {
        for nail in [Nail::FixedPatch, Nail::None] {
            let shape = FingertipShape { nail, ..FingertipShape::default() };
            let text = toml::to_string(&shape).unwrap();
            assert_eq!(FingertipShape::from_toml("x", &text).unwrap(), shape);
        }
        let message = FingertipShape::from_toml("x", "half_width = 3").unwrap_err().to_string();
        assert!(message.contains("line 1") && message.contains("half_width"), "{message}");
    }

    #[test]
    fn bad_values_are_refused_by_name() {
        assert_eq!(refused(|s| s.half_width_mm = -1.0), "half_width_mm");
        assert_eq!(refused(|s| s.cap_length_mm = f64::NAN), "cap_length_mm");
        assert_eq!(refused(|s| s.taper_slope = f64::NAN), "taper_slope");
        assert_eq!(refused(|s| s.section_exponent = 1.0), "section_exponent");
        assert_eq!(refused(|s| s.bone_half_width_mm = 9.0), "bone_half_width_mm");
        assert_eq!(refused(|s| s.bone_dorsal_offset_mm = f64::NAN), "bone_dorsal_offset_mm");
        assert_eq!(refused(|s| s.bone_dorsal_offset_mm = 6.0), "bone_dorsal_offset_mm");
        assert_eq!(refused(|s| s.skin_thickness_mm = 2.6), "skin_thickness_mm");
        assert_eq!(refused(|s| s.joint_end_mm = 12.5), "joint_end_mm");
        assert_eq!(refused(|s| s.nail_end_mm = 25.0), "nail_end_mm");
        let corner = |s: &mut FingertipShape| {
            s.section_exponent = 2.0;
            s.bone_section_exponent = 6.0;
            s.bone_half_width_mm = 6.0;
            s.bone_half_thickness_mm = 3.5;
        };
        assert_eq!(refused(corner), "bone_half_thickness_mm");
    }
}
