//! A model as source text: a Rust constant, a C array of the file's bytes, or JSON.
//!
//! Main type: [`Format`]. Uses file.

use std::fmt::Write as _;

use fingerpad::{Data, Line};

use fingerpad::ModelFile;

/// Format of a model's source text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `pub static MODEL: fingerpad::Data`, numbers that read back as the same bits.
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
    let (m, n) = (data.elements.len(), data.rows.len());
    let _ = writeln!(out, "\nuse fingerpad::{{DataOf, Element, Line, Row}};\n");
    let _ = writeln!(out, "/// Turn it into a model with `MODEL.model()`, which checks it.");
    let _ = writeln!(out, "pub static MODEL: DataOf<{m}, {n}> = DataOf {{");
    for (name, values) in head(data) {
        let text = values.iter().map(|v| literal(*v)).collect::<Vec<_>>().join(", ");
        let _ = match values.len() {
            1 => writeln!(out, "    {name}: {text},"),
            _ => writeln!(out, "    {name}: [{text}],"),
        };
    }
    let _ = writeln!(out, "    elements: [");
    for e in &data.elements {
        let [y, w, e] = [e.inverse_yield, e.strength, e.energy].map(literal);
        let _ = writeln!(out, "        Element {{ inverse_yield: {y}, strength: {w}, energy: {e} }},");
    }
    let _ = writeln!(out, "    ],\n    rows: [");
    for row in &data.rows {
        let _ = writeln!(out, "        Row {{");
        for (name, line) in lines(row) {
            let [value, change] = [line.value, line.change].map(literal);
            let _ = writeln!(out, "            {name}: Line {{ value: {value}, change: {change} }},");
        }
        let _ = writeln!(out, "            press_slide: {},\n        }},", literal(row.press_slide));
    }
    let _ = writeln!(out, "    ],\n}};");
    out
}

fn head(data: &Data) -> [(&'static str, &[f32]); 10] {
    let one = std::slice::from_ref;
    [
        ("depth_max", one(&data.depth_max)),
        ("cells_per_mm", one(&data.cells_per_mm)),
        ("half_cell", one(&data.half_cell)),
        ("half_turn_slip", one(&data.half_turn_slip)),
        ("slip_rate", one(&data.slip_rate)),
        ("twice_odd", one(&data.twice_odd)),
        ("area_tilt", one(&data.area_tilt)),
        ("band_normal", &data.band_normal),
        ("band_friction", &data.band_friction),
        ("pressure_exponent", one(&data.pressure_exponent)),
    ]
}

fn lines(row: &fingerpad::Row) -> [(&'static str, Line); 11] {
    [
        ("normal", row.normal),
        ("area", row.area),
        ("limit", row.limit),
        ("stiffness", row.stiffness),
        ("stiffness_anisotropy", row.stiffness_anisotropy),
        ("strength_anisotropy", row.strength_anisotropy),
        ("normal_shear_x", row.normal_shear_x),
        ("normal_shear_y", row.normal_shear_y),
        ("yield_shift", row.yield_shift),
        ("band_normal", row.band_normal),
        ("press_coupling", row.press_coupling),
    ]
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
    let elements: Vec<_> = data
        .elements
        .iter()
        .map(|e| serde_json::json!({"inverse_yield": e.inverse_yield, "strength": e.strength, "energy": e.energy}))
        .collect();
    let tables: serde_json::Map<_, _> = lines(&data.rows[0])
        .iter()
        .enumerate()
        .map(|(k, (name, _))| {
            let values: Vec<f32> = data.rows.iter().map(|row| lines(row)[k].1.value).collect();
            ((*name).to_owned(), values.into())
        })
        .collect();
    let effects: Vec<_> =
        model.effects.iter().map(|e| serde_json::json!({"kind": e.kind, "values": e.values})).collect();
    let number = |v: &[f32]| if let [one] = v { (*one).into() } else { v.into() };
    let numbers: serde_json::Map<_, _> = head(data).iter().map(|(name, v)| ((*name).to_owned(), number(v))).collect();
    let cell = data.depth_max / (data.rows.len() - 1) as f32;
    let depth_mm: Vec<f32> = (0..data.rows.len()).map(|i| cell * i as f32).collect();
    let whole = serde_json::json!({
        "format": "fpm", "version": fingerpad::VERSION, "meta": meta, "numbers": numbers, "elements": elements,
        "depth_mm": depth_mm, "tables": tables, "effects": effects,
    });
    serde_json::to_string_pretty(&whole).expect("plain numbers and text") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use fingerpad::Params;

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
        for e in &data.elements {
            expected.extend([e.inverse_yield, e.strength, e.energy]);
        }
        for row in &data.rows {
            expected.extend(lines(row).iter().flat_map(|(_, l)| [l.value, l.change]));
            expected.push(row.press_slide);
        }
        let bits = |v: &[f32]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&numbers), bits(&expected));
    }

    #[test]
    fn json_holds_meta_and_tables() {
        let value: serde_json::Value = serde_json::from_str(&export(&example(), Format::Json)).unwrap();
        assert_eq!(value["meta"]["name"], "a, long, enough, text");
        assert_eq!(value["tables"]["normal"].as_array().unwrap().len(), fingerpad::NODES);
        assert_eq!(value["elements"].as_array().unwrap().len(), fingerpad::ELEMENTS);
    }
}
