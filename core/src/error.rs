//! Errors before a step: files and parameters that are refused.

use crate::sections::RELAXATION;

/// Why a model file, a set of parameters, an effect slot or a saved state was refused.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Error {
    /// The bytes do not start with the mark of a model file.
    Magic,
    /// The file's format version is not the one this library reads.
    Version {
        /// Version in the file.
        found: u32,
    },
    /// The length of the file differs from that in its header, or a section reaches beyond its end.
    Length {
        /// Length in bytes that was expected.
        expected: u32,
        /// Length in bytes that was there.
        found: u32,
    },
    /// The checksum does not agree: the file is damaged.
    Checksum,
    /// The bytes do not start at an address divisible by 4; see [`crate::include_fpm`].
    Alignment,
    /// The file was made for another number of springs or table nodes, or of modes of a pad; or a pad has more patches than a state.
    Shape {
        /// Springs in the file.
        elements: u32,
        /// Table nodes in the file.
        nodes: u32,
    },
    /// A section that must be there is missing, or an effect's kind is unknown.
    Section {
        /// The section's four letters.
        id: [u8; 4],
    },
    /// A value is not finite or outside its range.
    Range {
        /// Name of the parameter.
        what: Field,
        /// Table node, spring or value of the effect slots, counted from 0.
        index: u16,
        /// The value.
        value: f32,
    },
    /// A table decreases where it must not.
    NotMonotone {
        /// Name of the table.
        what: Field,
        /// The node at which it is lower than before.
        index: u16,
    },
    /// The parameters would let a closed path create energy.
    NotPassive {
        /// The parameter that is too large or too steep.
        what: Field,
        /// The cell of the table, counted from 0.
        index: u16,
        /// Its value.
        value: f32,
        /// Its largest allowed value.
        limit: f32,
    },
    /// A saved state belongs to another model file.
    OtherModel {
        /// Checksum of the numbers of the model that the state was saved with.
        found: u32,
        /// Checksum of the present model.
        expected: u32,
    },
    /// The tissue would relax twice: by its branches (section `RELX`) and by the effect `normal_relaxation`.
    RelaxesTwice,
    /// A bed of springs touches flat faces alone, and the shape has a curved one; a pad touches it.
    Curved,
    /// A buffer is too small.
    Buffer {
        /// Bytes that are needed.
        needed: u32,
    },
}

/// The parameter that an [`Error`] is about.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs)]
pub enum Field {
    DepthMax,
    NormalForce,
    ContactArea,
    FrictionLimit,
    TangentialStiffness,
    /// Change of the tangential stiffness with depth.
    StiffnessSlope,
    StiffnessShare,
    StiffnessRatio,
    StrengthRatio,
    /// Slide at which a spring begins to slip, mm.
    YieldSlide,
    AreaShare,
    Sharpness,
    /// Place of a spring, mm.
    SpringArm,
    SpinLimit,
    SpinCross,
    /// Lead of slip along x.
    SlipLead,
    PressureCentre,
    /// Radius of a rigid body, mm.
    Radius,
    /// Direction of the axis of a rigid body, degrees.
    Axis,
    /// Angle between the faces of an edge, degrees.
    FaceAngle,
    PressCoupling,
    TiltX,
    OddStiffness,
    AreaTilt,
    BandNormal,
    BandFriction,
    BandSlip,
    PressureExponent,
    /// Pitch (0) or roll (1), degrees.
    Pose,
    Size,
    Stiffness,
    Lambda,
    /// The values of the effect slots, six a slot, counted through the file.
    EffectValue,
    State,
    PatchArea,
    /// Middle and spread of a patch.
    PatchPlace,
    PatchCompliance,
    /// Modes of a patch; after the last patch, rigid motion of the bulk.
    BulkMode,
    BulkStiffness,
    BulkStiffening,
    /// Pressure at which a patch touches as a whole.
    Flattening,
    FirstTouch,
    /// Second order of the bulk's rigid motion.
    Lift,
    /// A value of a table of effects, by its number among the table's nodes.
    TableValue,
    /// A value of [`crate::margin::Settings`], by its place there.
    Observer,
    /// Share of a branch of the tissue, by its number.
    RelaxationShare,
    /// Time of a branch, s.
    RelaxationTime,
    /// Ratio (0) and axis (1, degrees) of orthotropic friction.
    Orthotropy,
}

impl core::fmt::Display for Error {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            Self::Magic => f.write_str("not a model file (it does not start with FPM1)"),
            Self::Version { found } => {
                write!(f, "format version {found}; this library reads version {}", crate::build::VERSION)
            }
            Self::Length { expected, found } => write!(f, "{found} bytes where {expected} are expected"),
            Self::Checksum => f.write_str("checksum wrong: the file is damaged"),
            Self::Alignment => f.write_str("the bytes do not start at an address divisible by 4"),
            Self::Shape { elements, nodes } => {
                write!(f, "made for {elements} springs and {nodes} table nodes, which is not what is used here")
            }
            Self::Section { id: RELAXATION } => {
                f.write_str("section RELX: tissue that relaxes is not followed here, or the section is damaged")
            }
            Self::Section { id } => write!(
                f,
                "section {}{}{}{} is missing or not understood",
                id[0].escape_ascii(),
                id[1].escape_ascii(),
                id[2].escape_ascii(),
                id[3].escape_ascii()
            ),
            Self::Range { what, index, value } => write!(f, "{what:?}[{index}] = {value} is out of range"),
            Self::NotMonotone { what, index } => write!(f, "{what:?} falls at [{index}]"),
            Self::NotPassive { what, index, value, limit } => {
                write!(f, "{what:?} in cell {index} could create energy: {value} where {limit} is allowed")
            }
            Self::OtherModel { found, expected } => {
                write!(f, "the state was saved with another model (numbers {found:08x}, here {expected:08x})")
            }
            Self::RelaxesTwice => {
                f.write_str("section RELX beside the effect normal_relaxation: the tissue would relax twice")
            }
            Self::Curved => f.write_str("a bed of springs touches planes and boxes alone; use a pad for this shape"),
            Self::Buffer { needed } => write!(f, "the buffer is too small: {needed} bytes are needed"),
        }
    }
}

impl core::error::Error for Error {}
