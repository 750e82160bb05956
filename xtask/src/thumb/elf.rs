//! Analysis of a firmware's ELF file: symbols, code sizes, worst-case stack.
//!
//! Main type: [`Elf`]. Decodes the Thumb encodings of calls and nothing else of the processor.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, bail};
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, SymbolKind};

/// A function by its address.
#[derive(Clone, Debug)]
struct Function {
    name: String,
    size: u64,
}

/// An ELF file, read.
pub struct Elf {
    names: Vec<String>,
    functions: BTreeMap<u64, Function>,
    /// Stack of a function's own frame, from the section `.stack_sizes`.
    frames: BTreeMap<u64, u64>,
    /// Bytes in sections that can be written to.
    writable: u64,
    /// Address and bytes of the sections with code.
    code: Vec<(u64, Vec<u8>)>,
}

impl Elf {
    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
        let file = object::File::parse(&*bytes)?;
        let mut names = Vec::new();
        let mut functions = BTreeMap::new();
        for symbol in file.symbols() {
            let name = format!("{:#}", rustc_demangle::demangle(symbol.name().unwrap_or_default()));
            if symbol.kind() == SymbolKind::Text && symbol.is_definition() && !name.starts_with('$') {
                functions.insert(symbol.address() & !1, Function { name: name.clone(), size: symbol.size() });
            }
            if symbol.is_definition() {
                names.push(name);
            }
        }
        let code = file
            .sections()
            .filter(|s| matches!(s.name(), Ok(".text" | ".vector_table")))
            .map(|s| Ok((s.address(), s.data()?.to_vec())))
            .collect::<Result<Vec<_>>>()?;
        let is_writable = |s: &object::Section<'_, '_>| match s.flags() {
            SectionFlags::Elf { sh_flags } => sh_flags & u64::from(object::elf::SHF_WRITE) != 0,
            _ => false,
        };
        let writable = file.sections().filter(is_writable).map(|s| s.size()).sum();
        let mut frames = BTreeMap::new();
        if let Some(section) = file.section_by_name(".stack_sizes") {
            let mut data = section.data()?;
            while let Some((address, rest)) = data.split_first_chunk::<4>() {
                let (size, used) = uleb128(rest)?;
                frames.insert(u64::from(u32::from_le_bytes(*address)) & !1, size);
                data = &rest[used..];
            }
        }
        Ok(Self { names, functions, frames, writable, code })
    }

    /// Symbols that `gate` picks.
    pub fn symbols(&self, gate: impl Fn(&str) -> bool) -> Vec<&str> {
        self.names.iter().map(String::as_str).filter(|n| gate(n)).collect()
    }

    /// Bytes in sections that can be written to.
    pub fn writable_bytes(&self) -> u64 {
        self.writable
    }

    /// Address of the function called `name`.
    pub fn function(&self, name: &str) -> Result<u64> {
        let found = self.functions.iter().find(|(_, f)| f.name == name);
        found.map(|(address, _)| *address).with_context(|| format!("no function {name}"))
    }

    /// Bytes of code and literals of the function at `address`.
    pub fn code_size(&self, address: u64) -> u64 {
        self.functions.get(&address).map_or(0, |f| f.size)
    }

    /// Deepest stack below a call of the function at `address`, bytes, and the way there.
    ///
    /// Follows direct calls. A function without a frame size (assembly of the compiler's library) counts 16 bytes.
    pub fn worst_stack(&self, address: u64) -> Result<(u64, Vec<String>)> {
        self.descend(address, &mut Vec::new())
    }

    fn descend(&self, address: u64, above: &mut Vec<u64>) -> Result<(u64, Vec<String>)> {
        let function = self.functions.get(&address).with_context(|| format!("no function at {address:x}"))?;
        if above.contains(&address) {
            bail!("{} calls itself", function.name);
        }
        above.push(address);
        let mut worst = (0, Vec::new());
        for callee in self.calls(address, function.size)? {
            let below = self.descend(callee, above)?;
            if below.0 > worst.0 {
                worst = below;
            }
        }
        above.pop();
        let mut way = vec![function.name.clone()];
        way.extend(worst.1);
        Ok((self.frames.get(&address).copied().unwrap_or(16) + worst.0, way))
    }

    /// Functions that the code at `address` calls or jumps to.
    fn calls(&self, address: u64, size: u64) -> Result<Vec<u64>> {
        let section = self.code.iter().find(|(start, data)| (*start..start + data.len() as u64).contains(&address));
        let (start, data) = section.context("a function outside the code")?;
        let from = (address - start) as usize;
        let code = &data[from..(from + size as usize).min(data.len())];
        let half = |i: usize| code.get(i..i + 2).map_or(0, |b| u16::from_le_bytes([b[0], b[1]]));
        let mut callees = Vec::new();
        let mut i = 0;
        while i + 2 <= code.len() {
            let first = half(i);
            let wide = matches!(first >> 11, 0b11101..=0b11111);
            let second = half(i + 2);
            // BL and B.W: 11110 S imm10, 1 L J1 1 J2 imm11
            if first >> 11 == 0b11110 && second & 0x9000 == 0x9000 {
                let s = u32::from(first >> 10 & 1);
                let (j1, j2) = (u32::from(second >> 13 & 1), u32::from(second >> 11 & 1));
                let (i1, i2) = (1 ^ j1 ^ s, 1 ^ j2 ^ s);
                let offset =
                    s << 24 | i1 << 23 | i2 << 22 | u32::from(first & 0x3ff) << 12 | u32::from(second & 0x7ff) << 1;
                let signed = i64::from((offset << 7) as i32 >> 7);
                let target = (address as i64 + i as i64 + 4 + signed) as u64;
                if target != address && self.functions.contains_key(&target) && !callees.contains(&target) {
                    callees.push(target);
                }
            }
            i += if wide { 4 } else { 2 };
        }
        Ok(callees)
    }
}

/// A number in LEB128 and its number of bytes.
fn uleb128(bytes: &[u8]) -> Result<(u64, usize)> {
    let mut value = 0;
    for (i, byte) in bytes.iter().enumerate().take(9) {
        value |= u64::from(byte & 0x7f) << (7 * i);
        if byte & 0x80 == 0 {
            return Ok((value, i + 1));
        }
    }
    bail!("a number without end in .stack_sizes")
}
