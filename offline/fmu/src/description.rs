//! What an importing tool reads: `modelDescription.xml` and `sources/buildDescription.xml`.
//!
//! Value references are those of `bindings/fmu/fingerpad_fmu.c`.

use std::fmt::Write as _;

use fingerpad::build::TableColumn;
use fingerpad::{File, Surroundings};

/// Version of the unit's variables and saved states, as in the unit.
const VERSION: u32 = 2;

/// A number of the unit: value reference, name, unit (empty for none), start value, what it is.
type Variable = (u32, &'static str, &'static str, f64, &'static str);

const MOTION: [Variable; 5] = [
    (1, "depth_mm", "mm", 0.0, "Depth of the plane in the finger; 0 or less is no contact"),
    (2, "slide_x_mm", "mm", 0.0, "Place of the plane along x, the finger's axis from proximal to distal"),
    (3, "slide_y_mm", "mm", 0.0, "Place of the plane along y"),
    (4, "spin_rad", "rad", 0.0, "Angle of the plane about its normal, counter-clockwise seen from the finger"),
    (5, "strength_factor", "", 1.0, "Factor on all strengths, 0.1 to 5: moisture, speed, dwell from outside"),
];

const PARAMETERS: [Variable; 3] = [
    (21, "size", "", 1.0, "Factor on all lengths of the finger, 0.5 to 2"),
    (22, "stiffness", "", 1.0, "Factor on the tissue's stiffness, 0.2 to 5"),
    (23, "lambda", "", 1.0, "Factor on lambda of the friction law, 0.1 to 10"),
];

const OUTPUTS: [Variable; 12] = [
    (41, "normal_force_n", "N", 0.0, "Normal force of the plane on the finger"),
    (42, "friction_x_n", "N", 0.0, "Friction along x of the plane on the finger"),
    (43, "friction_y_n", "N", 0.0, "Friction along y of the plane on the finger"),
    (44, "spin_moment_n_mm", "N.mm", 0.0, "Moment about the normal through the point under first touch"),
    (45, "stick_ratio", "", 0.0, "Stuck area over contact area"),
    (46, "friction_limit_n", "N", 0.0, "Largest friction in the direction of the present one"),
    (47, "slip_margin", "", 0.0, "1 less the share of its limit that the load uses; 0 without contact"),
    (48, "pressure_centre_x_mm", "mm", 0.0, "Centre of pressure along x from the point under first touch"),
    (49, "pressure_centre_y_mm", "mm", 0.0, "Centre of pressure along y from the point under first touch"),
    (50, "contact_area_mm2", "mm2", 0.0, "Contact area"),
    (51, "band_normal_n", "N", 0.0, "Half-width of the 95 % band of the normal force"),
    (52, "band_friction_n", "N", 0.0, "Half-width of the 95 % band of each friction component"),
];

const INTEGERS: [(u32, &str, &str); 3] = [
    (61, "regime", "0 no contact, 1 stick, 2 partial slip, 3 slip"),
    (
        62,
        "status",
        "Flags: 2 bad input, 8 depth above range, 16 large increment, 64 spin ignored, 128 memory lost, 256 effect held",
    ),
    (
        63,
        "substeps",
        "Number of equal parts into which the last step was divided, so that each moves by at most 0.005 mm",
    ),
];

/// Units with their factor to the base units and the exponents of kg, m, s.
const UNITS: [(&str, f64, [i32; 3]); 5] = [
    ("mm", 1e-3, [0, 1, 0]),
    ("mm2", 1e-6, [0, 2, 0]),
    ("N", 1.0, [1, 1, -2]),
    ("N.mm", 1e-3, [1, 2, -2]),
    ("MPa", 1e6, [1, -1, -2]),
];

/// How a tool that compiles the unit itself goes about it.
pub const BUILD_DESCRIPTION: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiBuildDescription fmiVersion="3.0">
  <BuildConfiguration modelIdentifier="fingerpad" description="CMakeLists.txt beside this file also compiles the library">
    <SourceFileSet language="C99">
      <SourceFile name="fingerpad_fmu.c"/>
      <SourceFile name="unused.c"/>
      <IncludeDirectory name="."/>
      <IncludeDirectory name="fmi"/>
    </SourceFileSet>
    <Library name="fingerpad" external="true" description="The C library: cargo compiles it from rust/bindings/c"/>
  </BuildConfiguration>
</fmiBuildDescription>
"#;

/// The inputs of a model: the motion, and what its effects read.
fn inputs(file: &File<'_>) -> Vec<Variable> {
    let mut all = MOTION.to_vec();
    if !file.effects.is_empty() {
        let Surroundings { hydration_au, temperature_c, finger_width_mm, .. } = Surroundings::default();
        all.push((8, "hydration_au", "", f64::from(hydration_au), "Moisture of the skin, corneometer units"));
        all.push((9, "temperature_c", "degC", f64::from(temperature_c), "Temperature of the skin"));
        all.push((10, "finger_width_mm", "mm", f64::from(finger_width_mm), "Width of the finger"));
        all.push((11, "series_s", "s", 0.0, "Clock of the series in which the tissue drifts"));
    }
    all
}

/// Value reference of the first column of the user's own.
const FIRST_OWN: u32 = 12;

/// Name of a column of the user's own among the unit's variables: its own one, or `own_` before it where that is taken.
fn own_name(name: &str) -> String {
    let numbers = MOTION.iter().chain(&PARAMETERS).chain(&OUTPUTS).map(|v| v.1);
    let mut taken = numbers.chain(INTEGERS.iter().map(|v| v.1)).chain(["time"]);
    if taken.any(|known| known == name) { format!("own_{name}") } else { name.to_owned() }
}

/// The inputs that a law of the user's own reads, with the ranges in which it holds.
fn own_inputs(xml: &mut String, columns: &[TableColumn]) {
    for (column, reference) in columns.iter().zip(FIRST_OWN..) {
        let unit =
            if column.unit().is_empty() { String::new() } else { format!(" unit=\"{}\"", escaped(column.unit())) };
        let _ = writeln!(
            xml,
            "    <Float64 name=\"{}\" valueReference=\"{reference}\" causality=\"input\" variability=\"continuous\" \
             start=\"{}\"{unit} description=\"Read by a law of the user's own, which holds from {} to {}; beyond it is held\"/>",
            escaped(&own_name(column.name())),
            column.reference,
            column.low,
            column.high
        );
    }
}

/// `modelDescription.xml` of a model's unit.
pub fn model_description(file: &File<'_>, name: &str) -> String {
    let mut xml = head(file, name);
    units(&mut xml, file.columns);
    xml.push_str("  <DefaultExperiment startTime=\"0\" stopTime=\"1\" stepSize=\"0.001\"/>\n  <ModelVariables>\n");
    let time = "name=\"time\" valueReference=\"0\" causality=\"independent\" variability=\"continuous\"";
    let _ = writeln!(xml, "    <Float64 {time} unit=\"s\" description=\"Time\"/>");
    for variable in inputs(file) {
        number(&mut xml, variable, "causality=\"input\" variability=\"continuous\"");
    }
    own_inputs(&mut xml, file.columns);
    for variable in PARAMETERS {
        number(&mut xml, variable, "causality=\"parameter\" variability=\"fixed\" initial=\"exact\"");
    }
    for variable in OUTPUTS {
        number(&mut xml, variable, "causality=\"output\" variability=\"continuous\" initial=\"exact\"");
    }
    for (reference, name, says) in INTEGERS {
        let kind = "causality=\"output\" variability=\"discrete\" initial=\"exact\" start=\"0\"";
        let _ =
            writeln!(xml, "    <Int32 name=\"{name}\" valueReference=\"{reference}\" {kind} description=\"{says}\"/>");
    }
    xml.push_str("  </ModelVariables>\n  <ModelStructure>\n");
    let outputs = OUTPUTS.iter().map(|variable| variable.0).chain(INTEGERS.iter().map(|variable| variable.0));
    for reference in outputs {
        let _ = writeln!(xml, "    <Output valueReference=\"{reference}\"/>");
    }
    xml.push_str("  </ModelStructure>\n</fmiModelDescription>\n");
    xml
}

fn head(file: &File<'_>, name: &str) -> String {
    let token = format!("{{fingerpad-{VERSION}-{:08x}}}", file.model.data().checksum());
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="fingertip" instantiationToken="{token}"
    description="The friction of a fingertip, reduced model {}" generationTool="fingerpad {}"
    license="MIT OR Apache-2.0" variableNamingConvention="flat">
  <CoSimulation modelIdentifier="fingerpad" canGetAndSetFMUState="true" canSerializeFMUState="true"
      canHandleVariableCommunicationStepSize="true"/>
"#,
        escaped(name),
        env!("CARGO_PKG_VERSION")
    )
}

/// Units of the variables; those of the user's own that are none of ours stand without base units, so that nothing is
/// converted.
fn units(xml: &mut String, columns: &[TableColumn]) {
    xml.push_str("  <UnitDefinitions>\n");
    for (name, factor, [kg, m, s]) in UNITS {
        let _ = writeln!(
            xml,
            "    <Unit name=\"{name}\"><BaseUnit kg=\"{kg}\" m=\"{m}\" s=\"{s}\" factor=\"{factor}\"/></Unit>"
        );
    }
    let degree = std::f64::consts::PI / 180.0;
    let _ = writeln!(xml, "    <Unit name=\"s\"><BaseUnit s=\"1\"/></Unit>");
    let _ = writeln!(xml, "    <Unit name=\"rad\"><BaseUnit rad=\"1\"/></Unit>");
    let _ = writeln!(xml, "    <Unit name=\"deg\"><BaseUnit rad=\"1\" factor=\"{degree}\"/></Unit>");
    let _ = writeln!(xml, "    <Unit name=\"degC\"><BaseUnit K=\"1\" offset=\"273.15\"/></Unit>");
    let mut known: Vec<&str> = UNITS.iter().map(|unit| unit.0).chain(["", "s", "rad", "deg", "degC"]).collect();
    for unit in columns.iter().map(TableColumn::unit) {
        if !known.contains(&unit) {
            known.push(unit);
            let _ = writeln!(xml, "    <Unit name=\"{}\"/>", escaped(unit));
        }
    }
    xml.push_str("  </UnitDefinitions>\n");
}

fn number(xml: &mut String, (reference, name, unit, start, says): Variable, kind: &str) {
    let unit = if unit.is_empty() { String::new() } else { format!(" unit=\"{unit}\"") };
    let _ = writeln!(
        xml,
        "    <Float64 name=\"{name}\" valueReference=\"{reference}\" {kind} start=\"{start}\"{unit} description=\"{says}\"/>"
    );
}

/// A file's name as text of an attribute.
fn escaped(text: &str) -> String {
    text.chars()
        .map(|c| match c {
            '&' => "&amp;".to_owned(),
            '<' => "&lt;".to_owned(),
            '"' => "&quot;".to_owned(),
            c if c.is_control() => " ".to_owned(),
            c => c.to_string(),
        })
        .collect()
}
