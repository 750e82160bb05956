//! A model as source text: a Rust constant, a C array of the file's bytes, or JSON.
//!
//! Main type: [`Format`]. Uses file.

use std::fmt::Write as _;

use fingerpad::SPRINGS;
use fingerpad::build::{Data, Line, Parabola, Row, Spring};
use fingerpad::host::ModelFile;

/// Format of a model's source text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `pub static MODEL: fingerpad::build::Data`, numbers that read back as the same bits.
    Rust,
    /// The file's bytes as an array for `fingerpad_model_load`.
    C,
    /// All numbers with their names, provenance and effects.
    Json,
}

/// The text of a model file in that format.
pub fn export(file: &ModelFile, format: Format) -> String {
    match format {
        Format::Rust => rust(file),
        Format::C => c(file),
        Format::Json => json(file),
    }
}

/// A literal that reads back as the same 32 bits; all numbers of a checked model are finite.
fn literal(value: f32) -> String {
    format!("{value:?}")
}

fn rust(file: &ModelFile) -> String {
    let model = file.file();
    let data: &Data = model.model.data();
    let mut out = String::new();
    let _ = writeln!(out, "// A fingerpad model; made by `fingerpad export`.");
    for line in wrapped(model.meta) {
        let _ = writeln!(out, "// {line}");
    }
    let (m, n) = (data.springs.len(), data.rows.len());
    let _ = writeln!(out, "\nuse fingerpad::build::{{DataOf, Line, Parabola, Row, Spring}};\n");
    let _ = writeln!(out, "/// Turn it into a model with `MODEL.model()`, which checks it.");
    let _ = writeln!(out, "pub static MODEL: DataOf<{m}, {n}> = DataOf {{");
    for (name, values) in head(data) {
        let text = values.iter().map(|v| literal(*v)).collect::<Vec<_>>().join(", ");
        let _ = match values.len() {
            1 => writeln!(out, "    {name}: {text},"),
            _ => writeln!(out, "    {name}: [{text}],"),
        };
    }
    let _ = writeln!(out, "    springs: [");
    for spring in &data.springs {
        let [stiffness, sharpness, centre, x, y] = numbers_of(spring).map(literal);
        let _ = writeln!(
            out,
            "        Spring {{ stiffness: {stiffness}, sharpness: {sharpness}, centre_mm: {centre}, arm_mm: [{x}, {y}] }},"
        );
    }
    let _ = writeln!(out, "    ],\n    rows: [");
    for row in &data.rows {
        let _ = writeln!(out, "        Row {{");
        for (name, line) in lines(row) {
            let _ = writeln!(out, "            {name}: {},", line_text(&line));
        }
        for (name, parabola) in parabolas(row) {
            let [value, slope, bend] = [parabola.value, parabola.slope, parabola.bend].map(literal);
            let _ = writeln!(out, "            {name}: Parabola {{ value: {value}, slope: {slope}, bend: {bend} }},");
        }
        for (name, lines) in of_springs(row) {
            let text: Vec<String> = lines.iter().map(line_text).collect();
            let _ = writeln!(out, "            {name}: [{}],", text.join(", "));
        }
        let _ = writeln!(out, "        }},");
    }
    let _ = writeln!(out, "    ],\n}};");
    out
}

fn line_text(line: &Line) -> String {
    let [value, change] = [line.value, line.change].map(literal);
    format!("Line {{ value: {value}, change: {change} }}")
}

fn head(data: &Data) -> [(&'static str, &[f32]); 11] {
    let one = std::slice::from_ref;
    [
        ("depth_max", one(&data.depth_max)),
        ("cells_per_mm", one(&data.cells_per_mm)),
        ("odd", one(&data.odd)),
        ("area_tilt", one(&data.area_tilt)),
        ("pressure_centre_per_n", &data.pressure_centre_per_n),
        ("spin_cross", one(&data.spin_cross)),
        ("slip_lead", &data.slip_lead),
        ("gyration", one(&data.gyration)),
        ("band_normal", &data.band_normal),
        ("band_friction", &data.band_friction),
        ("pressure_exponent", one(&data.pressure_exponent)),
    ]
}

fn numbers_of(spring: &Spring) -> [f32; 5] {
    [spring.stiffness, spring.sharpness, spring.centre_mm, spring.arm_mm[0], spring.arm_mm[1]]
}

fn lines(row: &Row<SPRINGS>) -> [(&'static str, Line); 11] {
    [
        ("normal", row.normal),
        ("area", row.area),
        ("anisotropy", row.anisotropy),
        ("yield_shift", row.yield_shift),
        ("limit", row.limit),
        ("limit_ratio", row.limit_ratio),
        ("limit_shift", row.limit_shift),
        ("spin_limit", row.spin_limit),
        ("friction_centre", row.friction_centre),
        ("pressure_centre", row.pressure_centre),
        ("band_normal", row.band_normal),
    ]
}

fn parabolas(row: &Row<SPRINGS>) -> [(&'static str, Parabola); 3] {
    [("stiffness_x", row.stiffness_x), ("stiffness_y", row.stiffness_y), ("press_slide", row.press_slide)]
}

/// Tables of which each spring has one.
fn of_springs(row: &Row<SPRINGS>) -> [(&'static str, &[Line]); 2] {
    [("radius", &row.radius), ("area_share", &row.area_share)]
}

/// `text` in lines of at most 110 bytes, cut after a comma.
fn wrapped(text: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for piece in text.split_inclusive(',') {
        let last = lines.len() - 1;
        if !lines[last].is_empty() && lines[last].len() + piece.len() > 110 {
            lines.push(piece.replace(['\n', '\r'], " "));
        } else {
            lines[last].push_str(&piece.replace(['\n', '\r'], " "));
        }
    }
    lines
}

fn c(file: &ModelFile) -> String {
    let bytes = file.bytes();
    let mut out = String::from("/* A fingerpad model; made by `fingerpad export`.\n");
    for line in wrapped(file.file().meta) {
        let _ = writeln!(out, " * {}", line.replace("*/", "* /"));
    }
    let _ = write!(
        out,
        " */\n#ifndef FINGERPAD_MODEL_FILE_H\n#define FINGERPAD_MODEL_FILE_H\n\n#include <stddef.h>\n#include <stdint.h>\n\n\
         #define FINGERPAD_MODEL_FILE_LENGTH {0}u\n\n\
         /* For fingerpad_model_load(&model, fingerpad_model_file, FINGERPAD_MODEL_FILE_LENGTH). */\n\
         static const _Alignas(8) uint8_t fingerpad_model_file[{0}] = {{\n",
        bytes.len()
    );
    for chunk in bytes.chunks(16) {
        let row: Vec<String> = chunk.iter().map(|b| format!("0x{b:02x}")).collect();
        let _ = writeln!(out, "    {},", row.join(", "));
    }
    out.push_str("};\n\n#endif\n");
    out
}

fn json(file: &ModelFile) -> String {
    let model = file.file();
    let data = model.model.data();
    let meta = serde_json::from_str::<serde_json::Value>(model.meta)
        .unwrap_or_else(|_| serde_json::Value::String(model.meta.to_owned()));
    let springs: Vec<_> = data
        .springs
        .iter()
        .map(|s| {
            let [stiffness, sharpness, centre, x, y] = numbers_of(s);
            serde_json::json!({
                "stiffness": stiffness, "sharpness": sharpness, "centre_mm": centre, "arm_mm": [x, y],
            })
        })
        .collect();
    let mut tables = serde_json::Map::new();
    for (k, (name, _)) in lines(&data.rows[0]).iter().enumerate() {
        let values: Vec<f32> = data.rows.iter().map(|row| lines(row)[k].1.value).collect();
        tables.insert((*name).to_owned(), values.into());
    }
    for (k, (name, _)) in parabolas(&data.rows[0]).iter().enumerate() {
        let values: Vec<f32> = data.rows.iter().map(|row| parabolas(row)[k].1.value).collect();
        tables.insert((*name).to_owned(), values.into());
    }
    for (k, (name, _)) in of_springs(&data.rows[0]).iter().enumerate() {
        let at = |row: &Row<SPRINGS>| of_springs(row)[k].1.iter().map(|line| line.value).collect::<Vec<f32>>();
        tables.insert((*name).to_owned(), data.rows.iter().map(at).collect::<Vec<_>>().into());
    }
    let effects: Vec<_> =
        model.effects.iter().map(|e| serde_json::json!({"kind": e.kind, "values": e.values})).collect();
    let number = |v: &[f32]| if let [one] = v { (*one).into() } else { v.into() };
    let numbers: serde_json::Map<_, _> = head(data).iter().map(|(name, v)| ((*name).to_owned(), number(v))).collect();
    let cell = data.depth_max / (data.rows.len() - 1) as f32;
    let depth_mm: Vec<f32> = (0..data.rows.len()).map(|i| cell * i as f32).collect();
    let whole = serde_json::json!({
        "format": "fpm", "version": fingerpad::build::VERSION, "meta": meta, "numbers": numbers, "springs": springs,
        "depth_mm": depth_mm, "tables": tables, "effects": effects,
    });
    serde_json::to_string_pretty(&whole).expect("plain numbers and text") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use fingerpad::build::Params;

    const META: &str = r#"{"name":"a, long, enough, text"}"#;

    fn example() -> ModelFile {
        let data = Params::example().try_build().unwrap();
        let mut bytes = vec![0; Data::file_length(&[], META)];
        data.write_file(&[], META, &mut bytes).unwrap();
        ModelFile::new(&bytes).unwrap()
    }

    #[test]
    fn c_is_the_file_byte_for_byte() {
        let file = example();
        let text = export(&file, Format::C);
        let body = &text[text.find("= {").unwrap()..];
        let bytes: Vec<u8> = body.split("0x").skip(1).map(|t| u8::from_str_radix(&t[..2], 16).unwrap()).collect();
        assert_eq!(bytes, file.bytes());
    }

    #[test]
    fn rust_literals_are_the_numbers_bit_for_bit() {
        let file = example();
        let text = export(&file, Format::Rust);
        let numbers: Vec<f32> = text
            .lines()
            .skip_while(|l| !l.starts_with("pub static"))
            .skip(1)
            .flat_map(|l| l.split([' ', ',', '{', '}', '[', ']', ':']))
            .filter_map(|word| word.parse().ok())
            .collect();
        let model = file.file();
        let data = model.model.data();
        let mut expected: Vec<f32> = head(data).iter().flat_map(|(_, v)| v.iter().copied()).collect();
        for spring in &data.springs {
            expected.extend(numbers_of(spring));
        }
        for row in &data.rows {
            expected.extend(lines(row).iter().flat_map(|(_, l)| [l.value, l.change]));
            expected.extend(parabolas(row).iter().flat_map(|(_, p)| [p.value, p.slope, p.bend]));
            expected.extend(of_springs(row).iter().flat_map(|(_, l)| l.iter()).flat_map(|l| [l.value, l.change]));
        }
        let bits = |v: &[f32]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&numbers), bits(&expected));
    }

    #[test]
    fn json_holds_meta_and_tables() {
        let value: serde_json::Value = serde_json::from_str(&export(&example(), Format::Json)).unwrap();
        assert_eq!(value["meta"]["name"], "a, long, enough, text");
        assert_eq!(value["tables"]["normal"].as_array().unwrap().len(), fingerpad::NODES);
        assert_eq!(value["tables"]["radius"][20].as_array().unwrap().len(), fingerpad::SPRINGS);
        assert_eq!(value["springs"].as_array().unwrap().len(), fingerpad::SPRINGS);
    }
}
