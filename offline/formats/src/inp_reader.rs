//! Reads the mesh of an Abaqus or CalculiX `.inp` file.
//!
//! Understood: `*NODE`, `*ELEMENT` (C3D8, C3D4 and C3D10 of any suffix; faces, which carry sets), `*NSET` and `*ELSET` with `GENERATE`
//! and names of other sets, `*SURFACE` of elements, `*EQUATION` that ties a node to others, `*INCLUDE`; comments `**`,
//! keyword and data lines that go on after a comma, any case, Fortran's `D` exponents. Keywords that would make or move
//! mesh (`*NGEN`, `*SYSTEM`, an `*INSTANCE` with a place, ...) are refused, all others skipped with their data.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::Vector3;

use super::Error;
use crate::raw_mesh::{RawElement, RawKind, RawMesh, RawTie};

/// Faces of a C3D8, S1 to S6, as corners of the element.
const HEX_FACES: [[usize; 4]; 6] = [[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]];
/// Faces of a C3D10, S1 to S4, as its corners.
const TET_FACES: [[usize; 3]; 4] = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];
/// Keywords whose neglect would change the mesh.
const REFUSED: [&str; 9] = ["NGEN", "NFILL", "NCOPY", "ELGEN", "ELCOPY", "SYSTEM", "TRANSFORM", "NMAP", "SUBMODEL"];
/// Files that include each other deeper than this include themselves.
const MOST_INCLUDES: usize = 8;

/// Reads a mesh.
///
/// # Errors
/// [`Error::Field`] with file, line, keyword and value; [`Error::File`] for a file that cannot be opened.
pub fn read(path: &Path) -> Result<RawMesh, Error> {
    let mut reader = Reader::default();
    reader.file(path, 0)?;
    reader.finish()
}

/// Position in the file.
#[derive(Clone, Debug, Default)]
struct Place {
    path: PathBuf,
    line: usize,
}

impl Place {
    fn fail(&self, field: &str, value: impl Into<String>, problem: impl Into<String>) -> Error {
        Error::Field {
            path: self.path.clone(),
            line: self.line,
            field: field.into(),
            value: value.into(),
            problem: problem.into(),
        }
    }
}

/// Members of a set: numbers, and other sets named before or after.
#[derive(Default)]
struct Members {
    numbers: Vec<u64>,
    names: Vec<(String, Place)>,
}

#[derive(Default)]
struct Reader {
    mesh: RawMesh,
    node_sets: BTreeMap<String, Members>,
    element_sets: BTreeMap<String, Members>,
    /// Surfaces: element or set, face number.
    surfaces: BTreeMap<String, Vec<(String, usize, Place)>>,
    equations: Vec<(Vec<(u64, usize, f64)>, Place)>,
}

/// A keyword with its parameters, and its data lines joined.
struct Card {
    keyword: String,
    parameters: BTreeMap<String, String>,
    place: Place,
}

impl Card {
    fn parse(text: &str, place: Place) -> Self {
        let mut parts = text.trim_start_matches('*').split(',').map(str::trim);
        let keyword = parts.next().unwrap_or("").to_uppercase();
        let pair = |part: &str| {
            let (key, value) = part.split_once('=').unwrap_or((part, ""));
            (key.trim().to_uppercase(), value.trim().trim_matches('"').to_owned())
        };
        Self { keyword, parameters: parts.filter(|p| !p.is_empty()).map(pair).collect(), place }
    }

    fn get(&self, key: &str) -> Option<&str> {
        self.parameters.get(key).map(String::as_str)
    }

    fn need(&self, key: &str) -> Result<&str, Error> {
        let found = self.get(key).filter(|v| !v.is_empty());
        found.ok_or_else(|| self.place.fail(&format!("*{}", self.keyword), key, "is missing"))
    }
}

impl Reader {
    fn file(&mut self, path: &Path, depth: usize) -> Result<(), Error> {
        let bytes = std::fs::read(path).map_err(|source| Error::File { path: path.to_path_buf(), source })?;
        let text = String::from_utf8_lossy(&bytes);
        let mut lines = text.lines().enumerate().peekable();
        let mut card: Option<Card> = None;
        let mut data: Vec<(String, Place)> = Vec::new();
        while let Some((index, line)) = lines.next() {
            let place = Place { path: path.to_path_buf(), line: index + 1 };
            let line = line.trim();
            if line.is_empty() || line.starts_with("**") {
                continue;
            }
            if !line.starts_with('*') {
                data.push((line.to_owned(), place));
                continue;
            }
            if let Some(card) = card.take() {
                self.card(&card, &data, depth)?;
            }
            data.clear();
            let mut whole = line.to_owned();
            while whole.ends_with(',') {
                let Some((_, next)) = lines.next_if(|(_, next)| !next.trim().starts_with('*')) else { break };
                whole.push_str(next.trim());
            }
            card = Some(Card::parse(&whole, place));
        }
        match card {
            Some(card) => self.card(&card, &data, depth),
            None => Err(Place { path: path.to_path_buf(), line: 1 }.fail("file", "", "has no keyword (*NODE, ...)")),
        }
    }

    fn card(&mut self, card: &Card, data: &[(String, Place)], depth: usize) -> Result<(), Error> {
        let keyword = card.keyword.as_str();
        match keyword {
            "NODE" if card.get("SYSTEM").is_some_and(|s| !s.eq_ignore_ascii_case("R")) => {
                Err(card.place.fail("*NODE", "SYSTEM", "is not supported; only Cartesian coordinates are"))
            }
            "NODE" => self.nodes(card, data),
            "ELEMENT" => self.elements(card, data),
            "NSET" => members(self.node_sets.entry(card.need("NSET")?.into()).or_default(), card, data),
            "ELSET" => members(self.element_sets.entry(card.need("ELSET")?.into()).or_default(), card, data),
            "SURFACE" => self.surface(card, data),
            "EQUATION" => self.equation(data),
            "INCLUDE" => {
                let name = card.need("INPUT")?;
                if depth == MOST_INCLUDES {
                    return Err(card.place.fail("*INCLUDE", name, "includes itself, it seems"));
                }
                let folder = card.place.path.parent().unwrap_or(Path::new(""));
                self.file(&folder.join(name), depth + 1)
            }
            "INSTANCE" if !data.is_empty() => {
                Err(card.place.fail("*INSTANCE", &data[0].0, "moves a part: write the file flattened, with one mesh"))
            }
            _ if REFUSED.contains(&keyword) => {
                let problem = "makes or moves nodes or elements and is not read: write the mesh out in full";
                Err(card.place.fail("keyword", format!("*{keyword}"), problem))
            }
            _ => {
                if !self.mesh.ignored.iter().any(|k| k[1..] == *keyword) {
                    self.mesh.ignored.push(format!("*{keyword}"));
                }
                Ok(())
            }
        }
    }

    fn nodes(&mut self, card: &Card, data: &[(String, Place)]) -> Result<(), Error> {
        for (line, place) in data {
            let cells = cells(line);
            let number = whole(&cells, 0, "*NODE", place)?;
            let mut position = Vector3::zeros();
            for axis in 0..3 {
                // Trailing coordinates that are left out are 0.
                if cells.get(axis + 1).is_some_and(|c| !c.is_empty()) {
                    position[axis] = real(&cells, axis + 1, "*NODE", place)?;
                }
            }
            if cells.len() < 2 {
                return Err(place.fail("*NODE", line, "has no coordinates"));
            }
            self.mesh.nodes.push((number, position));
            if let Some(set) = card.get("NSET") {
                self.node_sets.entry(set.into()).or_default().numbers.push(number);
            }
        }
        Ok(())
    }

    fn elements(&mut self, card: &Card, data: &[(String, Place)]) -> Result<(), Error> {
        let name = card.need("TYPE")?.to_uppercase();
        let suffix = |prefix: &str| {
            let rest = name.strip_prefix(prefix)?;
            rest.chars().all(|c| c.is_ascii_alphabetic()).then_some(())
        };
        let faces = ["S4", "CPS4", "CPE4", "M3D4", "SFM3D4", "R3D4"];
        let triangles = ["S3", "CPS3", "CPE3", "M3D3", "SFM3D3", "R3D3"];
        let lines = ["T3D2", "T2D2", "B31", "B21"];
        let (kind, count) = match () {
            () if suffix("C3D8").is_some() => (RawKind::Hex, 8),
            () if suffix("C3D4").is_some() => (RawKind::Tet, 4),
            () if suffix("C3D10").is_some() => (RawKind::Tet10, 10),
            () if faces.iter().any(|f| suffix(f).is_some()) => (RawKind::Quad, 4),
            () if triangles.iter().any(|f| suffix(f).is_some()) => (RawKind::Tri, 3),
            () if lines.iter().any(|f| suffix(f).is_some()) => {
                self.mesh.ignored.push(format!("elements of type {name}"));
                return Ok(());
            }
            () => {
                let problem = "is not read; C3D8, C3D4 and C3D10 (with any suffix) are";
                return Err(card.place.fail("*ELEMENT TYPE", name, problem));
            }
        };
        let mut cells: Vec<String> = Vec::new();
        let mut start = card.place.clone();
        for (line, place) in data {
            if cells.is_empty() {
                start = place.clone();
            }
            let more = self::cells(line);
            let open = more.last().is_some_and(|c| c.is_empty());
            cells.extend(more.into_iter().filter(|c| !c.is_empty()));
            if cells.len() < count + 1 {
                if open {
                    continue;
                }
                return Err(start.fail("*ELEMENT", line, format!("has {} of {count} nodes", cells.len().max(1) - 1)));
            }
            if cells.len() > count + 1 {
                return Err(start.fail("*ELEMENT", line, format!("has more than the {count} nodes of a {name}")));
            }
            let label = whole(&cells, 0, "*ELEMENT", &start)?;
            let nodes = (1..=count).map(|c| whole(&cells, c, "*ELEMENT", &start)).collect::<Result<_, _>>()?;
            self.mesh.elements.push(RawElement { label, kind, nodes });
            if let Some(set) = card.get("ELSET") {
                self.element_sets.entry(set.into()).or_default().numbers.push(label);
            }
            cells.clear();
        }
        if cells.is_empty() { Ok(()) } else { Err(start.fail("*ELEMENT", cells.join(","), "is cut off")) }
    }

    fn surface(&mut self, card: &Card, data: &[(String, Place)]) -> Result<(), Error> {
        let name = card.need("NAME")?;
        if card.get("TYPE").is_some_and(|t| t.eq_ignore_ascii_case("NODE")) {
            return members(self.node_sets.entry(name.into()).or_default(), card, data);
        }
        for (line, place) in data {
            let cells = cells(line);
            let face = cells.get(1).and_then(|c| c.to_uppercase().strip_prefix('S')?.parse::<usize>().ok());
            let Some(face) = face.filter(|f| (1..=6).contains(f)) else {
                return Err(place.fail("*SURFACE", line, "is not `element or set, S1 to S6`"));
            };
            self.surfaces.entry(name.into()).or_default().push((cells[0].clone(), face, place.clone()));
        }
        Ok(())
    }

    fn equation(&mut self, data: &[(String, Place)]) -> Result<(), Error> {
        let mut lines = data.iter();
        while let Some((line, place)) = lines.next() {
            let count = whole(&cells(line), 0, "*EQUATION", place)? as usize;
            let mut terms: Vec<String> = Vec::new();
            while terms.len() < 3 * count {
                let Some((line, _)) = lines.next() else {
                    return Err(place.fail("*EQUATION", line, "ends before all its terms"));
                };
                terms.extend(cells(line).into_iter().filter(|c| !c.is_empty()));
            }
            let term = |n: usize| {
                Ok((
                    whole(&terms, 3 * n, "*EQUATION", place)?,
                    whole(&terms, 3 * n + 1, "*EQUATION", place)? as usize,
                    real(&terms, 3 * n + 2, "*EQUATION", place)?,
                ))
            };
            let terms = (0..count).map(term).collect::<Result<_, Error>>()?;
            self.equations.push((terms, place.clone()));
        }
        Ok(())
    }

    /// Sets of sets, surfaces and equations once everything is known.
    fn finish(mut self) -> Result<RawMesh, Error> {
        self.mesh.element_sets = resolve(&self.element_sets)?;
        self.mesh.node_sets = resolve(&self.node_sets)?;
        let elements: BTreeMap<u64, &RawElement> = self.mesh.elements.iter().map(|e| (e.label, e)).collect();
        for (name, entries) in &self.surfaces {
            let mut faces = Vec::new();
            for (what, face, place) in entries {
                let labels = match what.parse::<u64>() {
                    Ok(label) => vec![label],
                    Err(_) => find(&self.mesh.element_sets, what)
                        .ok_or_else(|| place.fail("*SURFACE", what, "is neither an element nor an element set"))?
                        .clone(),
                };
                for label in labels {
                    let element = elements.get(&label);
                    let Some(element) = element else {
                        return Err(place.fail("*SURFACE", label.to_string(), "is no element of the file"));
                    };
                    let corners = match element.kind {
                        RawKind::Hex => HEX_FACES.get(face - 1).map(|f| f.as_slice()),
                        RawKind::Tet10 => TET_FACES.get(face - 1).map(|f| f.as_slice()),
                        _ => None,
                    };
                    let Some(corners) = corners else {
                        let problem = format!("is no hexahedron or 10-node tetrahedron with a face S{face}");
                        return Err(place.fail("*SURFACE", label.to_string(), problem));
                    };
                    faces.push(corners.iter().map(|c| element.nodes[*c]).collect());
                }
            }
            self.mesh.surfaces.insert(name.clone(), faces);
        }
        self.mesh.ties = ties(&self.equations)?;
        Ok(self.mesh)
    }
}

/// Ties out of equations -u_slave + sum of w u_master = 0, one for each of the three directions.
fn ties(equations: &[(Vec<(u64, usize, f64)>, Place)]) -> Result<Vec<RawTie>, Error> {
    let mut found: BTreeMap<u64, [Option<Vec<(u64, f64)>>; 3]> = BTreeMap::new();
    for (terms, place) in equations {
        let Some(&(slave, dof, first)) = terms.first() else { continue };
        let fail = |problem: &str| place.fail("*EQUATION", format!("node {slave}, direction {dof}"), problem);
        if !(1..=3).contains(&dof) || terms.iter().any(|t| t.1 != dof) || first == 0.0 {
            return Err(fail("is not a tie: all terms must act in the same of directions 1 to 3"));
        }
        let masters = terms[1..].iter().map(|(n, _, w)| (*n, -w / first)).collect();
        if found.entry(slave).or_default()[dof - 1].replace(masters).is_some() {
            return Err(fail("is given twice"));
        }
    }
    let same = |a: &[(u64, f64)], b: &[(u64, f64)]| {
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.0 == b.0 && (a.1 - b.1).abs() < 1e-9)
    };
    let tie = |(slave, directions): (u64, [Option<Vec<(u64, f64)>>; 3])| match directions {
        [Some(x), Some(y), Some(z)] if same(&x, &y) && same(&x, &z) => Ok(RawTie { slave, masters: x }),
        _ => {
            let place = &equations[0].1;
            let problem = "is not tied alike in directions 1, 2 and 3";
            Err(place.fail("*EQUATION", format!("node {slave}"), problem))
        }
    };
    found.into_iter().map(tie).collect()
}

fn members(set: &mut Members, card: &Card, data: &[(String, Place)]) -> Result<(), Error> {
    let keyword = format!("*{}", card.keyword);
    let generate = card.parameters.contains_key("GENERATE");
    for (line, place) in data {
        let cells = cells(line);
        if generate {
            let [from, to] = [whole(&cells, 0, &keyword, place)?, whole(&cells, 1, &keyword, place)?];
            let step = if cells.get(2).is_some_and(|c| !c.is_empty()) { whole(&cells, 2, &keyword, place)? } else { 1 };
            if step == 0 || from > to || (to - from) / step > 100_000_000 {
                return Err(place.fail(&keyword, line, "is not `from, to, step` with from <= to and step > 0"));
            }
            set.numbers.extend((from..=to).step_by(step as usize));
            continue;
        }
        for cell in cells.into_iter().filter(|c| !c.is_empty()) {
            match cell.parse::<u64>() {
                Ok(number) => set.numbers.push(number),
                Err(_) if cell.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') => {
                    set.names.push((cell, place.clone()));
                }
                Err(_) => return Err(place.fail(&keyword, cell, "is neither a number nor a set's name")),
            }
        }
    }
    Ok(())
}

fn find<'a, T>(map: &'a BTreeMap<String, T>, name: &str) -> Option<&'a T> {
    map.iter().find(|(key, _)| key.eq_ignore_ascii_case(name)).map(|(_, value)| value)
}

/// Numbers of each set, those of the sets that it names included.
fn resolve(sets: &BTreeMap<String, Members>) -> Result<BTreeMap<String, Vec<u64>>, Error> {
    fn collect(
        sets: &BTreeMap<String, Members>,
        name: &str,
        place: &Place,
        depth: usize,
        into: &mut Vec<u64>,
    ) -> Result<(), Error> {
        let members = find(sets, name).ok_or_else(|| place.fail("set", name, "is used here but never defined"))?;
        if depth > 16 {
            return Err(place.fail("set", name, "contains itself"));
        }
        into.extend(&members.numbers);
        members.names.iter().try_for_each(|(name, place)| collect(sets, name, place, depth + 1, into))
    }
    let mut all = BTreeMap::new();
    for name in sets.keys() {
        let mut numbers = Vec::new();
        collect(sets, name, &Place::default(), 0, &mut numbers)?;
        numbers.sort_unstable();
        numbers.dedup();
        all.insert(name.clone(), numbers);
    }
    Ok(all)
}

fn cells(line: &str) -> Vec<String> {
    line.split(',').map(|c| c.trim().to_owned()).collect()
}

fn whole(cells: &[String], at: usize, keyword: &str, place: &Place) -> Result<u64, Error> {
    let cell = cells.get(at).map_or("", String::as_str);
    let number = cell.parse::<u64>().ok().filter(|n| *n > 0);
    number.ok_or_else(|| place.fail(keyword, cell, format!("is not a number from 1 (column {})", at + 1)))
}

fn real(cells: &[String], at: usize, keyword: &str, place: &Place) -> Result<f64, Error> {
    let cell = cells.get(at).map_or("", String::as_str);
    let number = cell.replace(['d', 'D'], "e").parse::<f64>().ok().filter(|v| v.is_finite());
    number.ok_or_else(|| place.fail(keyword, cell, format!("is not a finite number (column {})", at + 1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<RawMesh, String> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("m.inp");
        std::fs::write(&path, text).unwrap();
        std::fs::write(dir.path().join("more.inc"), "*Nset, nset=Top\n 5, 6,\n 7, 8\n").unwrap();
        read(&path).map_err(|e| e.to_string())
    }

    const NODES: &str = "*Heading\n a cube, made by hand\n** comment\n*Node, nset=ALL\n1, 0, 0, 0\n2, 1., 0, 0\n\
        3, 1, 1.0D0, 0\n4, 0, 1\n5, 0, 0, 1\n6, 1, 0, 1\n7, 1, 1, 1\n8, 0, 1, 1\n";

    #[test]
    fn sets_lines_that_go_on_includes_and_cases() {
        let text = format!(
            "{NODES}*ELEMENT, type=c3d8rh,\n ELSET=Skin\n10, 1, 2, 3, 4,\n 5, 6, 7, 8\n*NSET, NSET=even, generate\n2, 8, 2\n\
             *INCLUDE, INPUT=more.inc\n*NSET, nset=both\nTOP, even\n*Surface, name=Pad, type=element\nSKIN, s1\n\
             *Material, name=x\n*Elastic\n1, 0.3\n"
        );
        let mesh = parse(&text).unwrap();
        assert_eq!(mesh.nodes.len(), 8);
        assert_eq!(mesh.nodes[2].1, Vector3::new(1.0, 1.0, 0.0));
        assert_eq!(mesh.elements[0].nodes, [1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(mesh.element_sets["Skin"], [10]);
        assert_eq!(mesh.node_sets["both"], [2, 4, 5, 6, 7, 8]);
        assert_eq!(mesh.surfaces["Pad"], [[1, 2, 3, 4]]);
        assert_eq!(mesh.ignored, ["*HEADING", "*MATERIAL", "*ELASTIC"]);
    }

    #[test]
    fn equations_are_ties() {
        let equation = |dof| format!("3\n9, {dof}, -2., 1, {dof}, 1.5,\n2, {dof}, 0.5\n");
        let mesh = parse(&format!("{NODES}*EQUATION\n{}{}{}", equation(1), equation(2), equation(3))).unwrap();
        assert_eq!(mesh.ties, [RawTie { slave: 9, masters: vec![(1, 0.75), (2, 0.25)] }]);
        let error = parse(&format!("{NODES}*EQUATION\n{}{}", equation(1), equation(2))).unwrap_err();
        assert!(error.contains("node 9"), "{error}");
    }

    #[test]
    fn errors_name_line_and_value() {
        for (more, expected) in [
            ("*NODE\n9, 1, x, 0\n", ":14: *NODE: `x` is not a finite number (column 3)"),
            ("*ELEMENT, TYPE=C3D8\n1, 1, 2, 3, 4, 5, 6, 7\n", ":14: *ELEMENT: `1, 1, 2, 3, 4, 5, 6, 7` has 7 of 8"),
            ("*ELEMENT, TYPE=C3D8\n1, 1, 2, 3, 4,\n", ":14: *ELEMENT: `1,1,2,3,4` is cut off"),
            ("*ELEMENT, TYPE=C3D20R\n", ":13: *ELEMENT TYPE: `C3D20R` is not read"),
            ("*ELEMENT\n", ":13: *ELEMENT: `TYPE` is missing"),
            ("*NSET, NSET=a, GENERATE\n5, 1\n", ":14: *NSET: `5, 1` is not `from, to, step`"),
            ("*NSET, NSET=a\nb\n", ":14: set: `b` is used here but never defined"),
            ("*NSET, NSET=a\n1.5\n", ":14: *NSET: `1.5` is neither"),
            ("*NGEN\n1, 3\n", ":13: keyword: `*NGEN` makes or moves"),
            ("*SURFACE, NAME=p\n1, S7\n", ":14: *SURFACE: `1, S7` is not"),
            ("*INCLUDE, INPUT=nowhere\n", "nowhere"),
            ("*INCLUDE, INPUT=m.inp\n", "includes itself"),
        ] {
            let error = parse(&format!("{NODES}{more}")).unwrap_err();
            assert!(error.contains(expected), "{error}\nshould contain: {expected}");
        }
        assert!(parse("1, 2\n").unwrap_err().contains("no keyword"));
    }
}
