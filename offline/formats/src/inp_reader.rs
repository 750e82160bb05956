//! Reads the mesh of an Abaqus or CalculiX `.inp` file.
//!
//! Understood: `*NODE`, `*ELEMENT` (C3D8, C3D4 and C3D10 of any suffix, C3D20 and C3D27 by their corners; faces, which carry sets),
//! `*NSET` and `*ELSET` with `GENERATE` and names of other sets, `*SURFACE` of elements, `*EQUATION` that ties a node to
//! others, `*PART` and `*INSTANCE` with its place, `*INCLUDE` and data lines in another file (`INPUT=`); comments `**`,
//! keyword and data lines that go on after a comma, any case, Fortran's `D` exponents. Keywords that would make or move
//! mesh (`*NGEN`, `*SYSTEM`, ...) are refused, all others skipped with their data.
//!
//! Sets of an instance have two names: `instance.set`, and `set` alone for those of all instances unless the assembly has
//! a set of that name. All elements of an instance are a set named as it, and those of a part one named as that.

mod card;
mod element_type;
mod scope;

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::Vector3;

use super::Error;
use crate::raw_mesh::{RawElement, RawKind, RawMesh, RawTie};
use card::{Card, Place, cells, real, whole};
use element_type::{ElementType, element_type};
use scope::{Faces, Members, Placement, Scope, Terms};

/// Faces of a C3D8, S1 to S6, as corners of the element.
const HEX_FACES: [[usize; 4]; 6] = [[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]];
/// Faces of a C3D10, S1 to S4, as its corners.
const TET_FACES: [[usize; 3]; 4] = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];
/// Keywords whose neglect would change the mesh.
const REFUSED: [&str; 9] = ["NGEN", "NFILL", "NCOPY", "ELGEN", "ELCOPY", "SYSTEM", "TRANSFORM", "NMAP", "SUBMODEL"];
/// Keywords whose data lines may stand in another file.
const WITH_INPUT: [&str; 6] = ["NODE", "ELEMENT", "NSET", "ELSET", "SURFACE", "EQUATION"];
/// Keywords that only open or close a block.
const BRACKETS: [&str; 2] = ["ASSEMBLY", "END ASSEMBLY"];
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

/// The block that is being read, beside the model itself.
#[derive(Default)]
enum Block {
    #[default]
    Model,
    Part(String),
    /// An instance: its name, its part's, its place, and where it begins.
    Instance(String, String, Placement, Place),
}

#[derive(Default)]
struct Reader {
    ignored: Vec<String>,
    renumbered: Vec<String>,
    /// What is being read: the part or instance, or the model.
    here: Scope,
    block: Block,
    /// The model, while a part or an instance is read.
    model: Scope,
    parts: Vec<(String, Scope)>,
    /// Instances, and what was added to their numbers.
    instances: Vec<(String, u64)>,
    /// Parts that have an instance.
    placed: Vec<String>,
    /// Added to the numbers of nodes and elements of the assembly itself.
    assembly_offset: u64,
    /// Sets that are called by the bare names of instances' sets: node sets, element sets, surfaces.
    bare: [BTreeMap<String, Vec<String>>; 3],
    /// Elements of whole instances and of all instances of a part.
    wholes: BTreeMap<String, Vec<u64>>,
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
                self.card(&card, &mut data, depth)?;
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
            Some(card) => self.card(&card, &mut data, depth),
            None => Err(Place { path: path.to_path_buf(), line: 1 }.fail("file", "", "has no keyword (*NODE, ...)")),
        }
    }

    fn card(&mut self, card: &Card, data: &mut Vec<(String, Place)>, depth: usize) -> Result<(), Error> {
        let keyword = card.keyword.as_str();
        if WITH_INPUT.contains(&keyword) && card.get("INPUT").is_some() {
            data.extend(card.data_of_input()?);
        }
        match keyword {
            "NODE" if card.get("SYSTEM").is_some_and(|s| !s.eq_ignore_ascii_case("R")) => {
                Err(card.place.fail("*NODE", "SYSTEM", "is not supported; only Cartesian coordinates are"))
            }
            "NODE" => self.nodes(card, data),
            "ELEMENT" => self.elements(card, data),
            "NSET" => self.set(card, data, |scope| &mut scope.node_sets, card.need("NSET")?),
            "ELSET" => self.set(card, data, |scope| &mut scope.element_sets, card.need("ELSET")?),
            "SURFACE" => self.surface(card, data),
            "EQUATION" => self.equation(data),
            "INCLUDE" => {
                let name = card.need("INPUT")?;
                if depth == MOST_INCLUDES {
                    return Err(card.place.fail("*INCLUDE", name, "includes itself, it seems"));
                }
                self.file(&card.beside(name), depth + 1)
            }
            "PART" => self.begin(card, Block::Part(card.need("NAME")?.into()), Scope::default()),
            "END PART" => self.end_part(card),
            "INSTANCE" => self.begin_instance(card, data),
            "END INSTANCE" => self.end_instance(card),
            _ if REFUSED.contains(&keyword) => {
                let problem = "makes or moves nodes or elements and is not read: write the mesh out in full";
                Err(card.place.fail("keyword", format!("*{keyword}"), problem))
            }
            _ => {
                if !BRACKETS.contains(&keyword) && !self.ignored.iter().any(|k| k[1..] == *keyword) {
                    self.ignored.push(format!("*{keyword}"));
                }
                Ok(())
            }
        }
    }

    /// Begins a part or an instance.
    fn begin(&mut self, card: &Card, block: Block, content: Scope) -> Result<(), Error> {
        if !matches!(self.block, Block::Model) {
            return Err(card.place.fail(
                "keyword",
                format!("*{}", card.keyword),
                "stands inside of a part or an instance",
            ));
        }
        self.block = block;
        self.model = std::mem::replace(&mut self.here, content);
        Ok(())
    }

    fn end_part(&mut self, card: &Card) -> Result<(), Error> {
        let Block::Part(name) = std::mem::take(&mut self.block) else {
            return Err(card.place.fail("keyword", "*END PART", "ends no part"));
        };
        let part = std::mem::replace(&mut self.here, std::mem::take(&mut self.model));
        self.parts.push((name, part));
        Ok(())
    }

    fn begin_instance(&mut self, card: &Card, data: &[(String, Place)]) -> Result<(), Error> {
        if card.get("LIBRARY").is_some() || card.get("INSTANCE").is_some() {
            return Err(card.place.fail(
                "*INSTANCE",
                "LIBRARY",
                "is the result of another analysis, which is not read",
            ));
        }
        let (name, part) = (card.need("NAME")?, card.need("PART")?);
        if self.instances.iter().any(|(other, _)| other.eq_ignore_ascii_case(name)) {
            return Err(card.place.fail("*INSTANCE", name, "is a second instance of this name"));
        }
        let Some((part, content)) = self.parts.iter().find(|(other, _)| other.eq_ignore_ascii_case(part)) else {
            return Err(card.place.fail("*INSTANCE", part, "is no part of the file (*PART)"));
        };
        let placement = Placement::read(card, data)?;
        let block = Block::Instance(name.into(), part.clone(), placement, card.place.clone());
        let content = content.clone();
        self.begin(card, block, content)
    }

    fn end_instance(&mut self, card: &Card) -> Result<(), Error> {
        let Block::Instance(name, part, placement, _) = std::mem::take(&mut self.block) else {
            return Err(card.place.fail("keyword", "*END INSTANCE", "ends no instance"));
        };
        let content = std::mem::replace(&mut self.here, std::mem::take(&mut self.model));
        self.place_instance(&name, &part, content, &placement);
        Ok(())
    }

    /// Puts an instance into the model; numbers that the model has already are increased.
    fn place_instance(&mut self, name: &str, part: &str, content: Scope, placement: &Placement) {
        let offset = if content.collides_with(&self.here) { self.free_offset(content.highest()) } else { 0 };
        if offset > 0 {
            self.renumbered.push(format!("{offset} was added to the numbers of instance {name}"));
        }
        let labels: Vec<u64> = content.elements.iter().map(|e| e.label + offset).collect();
        let names = self.here.take(content, name, offset, placement);
        for (bare, names) in self.bare.iter_mut().zip(names) {
            for set in names {
                let qualified = format!("{name}.{set}");
                bare.entry(set).or_default().push(qualified);
            }
        }
        for whole in [name, part] {
            self.wholes.entry(whole.into()).or_default().extend(&labels);
        }
        self.instances.push((name.into(), offset));
        self.placed.push(part.into());
    }

    /// A round number above all numbers of the model, with room below the next one for the numbers of any part.
    fn free_offset(&self, highest: u64) -> u64 {
        let highest = self.parts.iter().map(|(_, part)| part.highest()).fold(highest.max(1), u64::max);
        let unit = 10u64.saturating_pow(highest.ilog10() + 1);
        (self.here.highest() / unit + 1).saturating_mul(unit)
    }

    /// What is added to the numbers of the block that is being read, or of the instance of that name.
    fn offset(&self, card: Option<&Card>) -> Result<(u64, Option<String>), Error> {
        match card.and_then(|card| Some((card, card.get("INSTANCE")?))) {
            Some((card, name)) => {
                let found = self.instances.iter().find(|(other, _)| other.eq_ignore_ascii_case(name));
                let found =
                    found.ok_or_else(|| card.place.fail(&format!("*{}", card.keyword), name, "is no instance"))?;
                Ok((found.1, Some(found.0.clone())))
            }
            None if matches!(self.block, Block::Model) => Ok((self.assembly_offset, None)),
            None => Ok((0, None)),
        }
    }

    /// The number that `instance.number` has.
    fn of_instance(&self, cell: &str) -> Option<u64> {
        let (instance, number) = cell.rsplit_once('.')?;
        let (_, offset) = self.instances.iter().find(|(name, _)| name.eq_ignore_ascii_case(instance))?;
        Some(number.parse::<u64>().ok()? + offset)
    }

    /// A node or an element that a line refers to.
    fn reference(&self, cells: &[String], at: usize, keyword: &str, place: &Place) -> Result<u64, Error> {
        match cells.get(at).and_then(|cell| self.of_instance(cell)) {
            Some(number) => Ok(number),
            None => Ok(whole(cells, at, keyword, place)? + self.offset(None)?.0),
        }
    }

    /// Numbers of the assembly's own nodes and elements must not be those of its instances.
    fn make_room(&mut self) {
        if matches!(self.block, Block::Model) && !self.instances.is_empty() && self.assembly_offset == 0 {
            self.assembly_offset = self.free_offset(1);
        }
    }

    fn nodes(&mut self, card: &Card, data: &[(String, Place)]) -> Result<(), Error> {
        self.make_room();
        let (offset, _) = self.offset(None)?;
        for (line, place) in data {
            let cells = cells(line);
            let number = whole(&cells, 0, "*NODE", place)? + offset;
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
            self.here.nodes.push((number, position));
            if let Some(set) = card.get("NSET") {
                self.here.node_sets.entry(set.into()).or_default().numbers.push(number);
            }
        }
        Ok(())
    }

    fn elements(&mut self, card: &Card, data: &[(String, Place)]) -> Result<(), Error> {
        let name = card.need("TYPE")?.to_uppercase();
        self.make_room();
        let (offset, _) = self.offset(None)?;
        let (kind, count, kept) = match element_type(&name) {
            Some(ElementType::Read { kind, nodes, kept }) => (kind, nodes, kept),
            Some(ElementType::Line) => {
                self.ignore(format!("elements of type {name}"));
                return Ok(());
            }
            None => {
                let problem = "is not read; hexahedra (C3D8, C3D20, C3D27), tetrahedra (C3D4, C3D10), faces and lines of either \
                    order are, with any suffix: mesh the part with those";
                return Err(card.place.fail("*ELEMENT TYPE", name, problem));
            }
        };
        if kept < count {
            self.ignore(format!("nodes of {name} but for its corners"));
        }
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
            let label = whole(&cells, 0, "*ELEMENT", &start)? + offset;
            let nodes = (1..=kept).map(|c| self.reference(&cells, c, "*ELEMENT", &start)).collect::<Result<_, _>>()?;
            self.here.elements.push(RawElement { label, kind, nodes });
            if let Some(set) = card.get("ELSET") {
                self.here.element_sets.entry(set.into()).or_default().numbers.push(label);
            }
            cells.clear();
        }
        if cells.is_empty() { Ok(()) } else { Err(start.fail("*ELEMENT", cells.join(","), "is cut off")) }
    }

    fn ignore(&mut self, what: String) {
        if !self.ignored.contains(&what) {
            self.ignored.push(what);
        }
    }

    /// Adds a card's members to a set.
    fn set(
        &mut self,
        card: &Card,
        data: &[(String, Place)],
        sets: fn(&mut Scope) -> &mut BTreeMap<String, Members>,
        name: &str,
    ) -> Result<(), Error> {
        let found = self.members(card, data)?;
        let set = sets(&mut self.here).entry(name.into()).or_default();
        set.numbers.extend(found.numbers);
        set.names.extend(found.names);
        Ok(())
    }

    fn surface(&mut self, card: &Card, data: &[(String, Place)]) -> Result<(), Error> {
        let name = card.need("NAME")?;
        if card.get("TYPE").is_some_and(|t| t.eq_ignore_ascii_case("NODE")) {
            return self.set(card, data, |scope| &mut scope.node_sets, name);
        }
        let mut faces = Faces::new();
        for (line, place) in data {
            let cells = cells(line);
            let face = match cells.get(1).map(|c| c.to_uppercase()).as_deref() {
                // The two sides of elements that are faces themselves.
                Some("SPOS" | "SNEG") => Some(0),
                Some(text) => {
                    text.strip_prefix('S').and_then(|n| n.parse::<usize>().ok()).filter(|f| (1..=6).contains(f))
                }
                None => None,
            };
            let Some(face) = face else {
                return Err(place.fail("*SURFACE", line, "is not `element or set, S1 to S6` (of shells SPOS or SNEG)"));
            };
            let is_label = cells[0].parse::<u64>().is_ok() || self.of_instance(&cells[0]).is_some();
            let what =
                if is_label { self.reference(&cells, 0, "*SURFACE", place)?.to_string() } else { cells[0].clone() };
            faces.push((what, face, place.clone()));
        }
        self.here.surfaces.entry(name.into()).or_default().extend(faces);
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
                    self.reference(&terms, 3 * n, "*EQUATION", place)?,
                    whole(&terms, 3 * n + 1, "*EQUATION", place)? as usize,
                    real(&terms, 3 * n + 2, "*EQUATION", place)?,
                ))
            };
            let terms = (0..count).map(term).collect::<Result<_, Error>>()?;
            self.here.equations.push((terms, place.clone()));
        }
        Ok(())
    }

    /// Members of a set, of the instance that the card names.
    fn members(&self, card: &Card, data: &[(String, Place)]) -> Result<Members, Error> {
        let keyword = format!("*{}", card.keyword);
        let generate = card.parameters.contains_key("GENERATE");
        let (offset, instance) = self.offset(Some(card))?;
        let mut set = Members::default();
        for (line, place) in data {
            let cells = cells(line);
            if generate {
                let [from, to] = [whole(&cells, 0, &keyword, place)?, whole(&cells, 1, &keyword, place)?];
                let step =
                    if cells.get(2).is_some_and(|c| !c.is_empty()) { whole(&cells, 2, &keyword, place)? } else { 1 };
                if step == 0 || from > to || (to - from) / step > 100_000_000 {
                    return Err(place.fail(&keyword, line, "is not `from, to, step` with from <= to and step > 0"));
                }
                set.numbers.extend((from..=to).step_by(step as usize).map(|n| n + offset));
                continue;
            }
            for cell in cells.into_iter().filter(|c| !c.is_empty()) {
                match cell
                    .parse::<u64>()
                    .ok()
                    .map(|number| number.saturating_add(offset))
                    .or_else(|| self.of_instance(&cell))
                {
                    Some(number) => set.numbers.push(number),
                    None if cell.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') => {
                        let name = instance.as_ref().map_or(cell.clone(), |instance| format!("{instance}.{cell}"));
                        set.names.push((name, place.clone()));
                    }
                    None => return Err(place.fail(&keyword, cell, "is neither a number nor a set's name")),
                }
            }
        }
        Ok(set)
    }

    /// Sets of sets, surfaces and equations once everything is known.
    fn finish(mut self) -> Result<RawMesh, Error> {
        match &self.block {
            Block::Model => {}
            Block::Part(name) => return Err(Place::default().fail("*PART", name, "has no *END PART")),
            Block::Instance(name, .., place) => return Err(place.fail("*INSTANCE", name, "has no *END INSTANCE")),
        }
        self.place_parts();
        let [node_names, element_names, surface_names] = std::mem::take(&mut self.bare);
        let mut surfaces = std::mem::take(&mut self.here.surfaces);
        for (name, qualified) in
            surface_names.into_iter().filter(|(name, _)| find(&surfaces, name).is_none()).collect::<Vec<_>>()
        {
            let faces = qualified.iter().flat_map(|set| surfaces[set].clone()).collect();
            surfaces.insert(name, faces);
        }
        for (sets, names) in [(&mut self.here.node_sets, node_names), (&mut self.here.element_sets, element_names)] {
            let new = names.into_iter().filter(|(name, _)| find(sets, name).is_none()).collect::<Vec<_>>();
            sets.extend(new.into_iter().map(|(name, qualified)| {
                let names = qualified.into_iter().map(|set| (set, Place::default())).collect();
                (name, Members { numbers: Vec::new(), names })
            }));
        }
        for (name, numbers) in self.wholes {
            if find(&self.here.element_sets, &name).is_none() {
                self.here.element_sets.insert(name, Members { numbers, names: Vec::new() });
            }
        }
        let mut mesh = RawMesh {
            element_sets: resolve(&self.here.element_sets)?,
            node_sets: resolve(&self.here.node_sets)?,
            ties: ties(&self.here.equations)?,
            nodes: self.here.nodes,
            elements: self.here.elements,
            ignored: self.ignored,
            renumbered: self.renumbered,
            ..RawMesh::new()
        };
        mesh.surfaces = faces_of_surfaces(&surfaces, &mesh)?;
        Ok(mesh)
    }

    /// Parts of a file without instances are the model; else those without an instance are no part of it.
    fn place_parts(&mut self) {
        let none = self.instances.is_empty();
        for (name, part) in std::mem::take(&mut self.parts) {
            if none {
                self.place_instance(&name, &name, part, &Placement::default());
            } else if !self.placed.iter().any(|placed| placed.eq_ignore_ascii_case(&name)) && !part.elements.is_empty()
            {
                self.ignored.push(format!("part {name}, of which there is no instance"));
            }
        }
    }
}

/// Faces of every surface by their corners.
fn faces_of_surfaces(
    surfaces: &BTreeMap<String, Faces>,
    mesh: &RawMesh,
) -> Result<BTreeMap<String, Vec<Vec<u64>>>, Error> {
    let elements: BTreeMap<u64, &RawElement> = mesh.elements.iter().map(|e| (e.label, e)).collect();
    let mut found = BTreeMap::new();
    for (name, entries) in surfaces {
        let mut faces: Vec<Vec<u64>> = Vec::new();
        for (what, face, place) in entries {
            let labels = match what.parse::<u64>() {
                Ok(label) => vec![label],
                Err(_) => find(&mesh.element_sets, what)
                    .ok_or_else(|| place.fail("*SURFACE", what, "is neither an element nor an element set"))?
                    .clone(),
            };
            for label in labels {
                let Some(element) = elements.get(&label) else {
                    return Err(place.fail("*SURFACE", label.to_string(), "is no element of the file"));
                };
                let corners: Option<&[usize]> = match (element.kind, face) {
                    (RawKind::Hex, 1..) => HEX_FACES.get(face - 1).map(|f| f.as_slice()),
                    (RawKind::Tet10, 1..) => TET_FACES.get(face - 1).map(|f| f.as_slice()),
                    (RawKind::Quad, 0) => Some(&[0, 1, 2, 3]),
                    (RawKind::Tri, 0) => Some(&[0, 1, 2]),
                    _ => None,
                };
                let Some(corners) = corners else {
                    let problem = format!("is no hexahedron or 10-node tetrahedron with a face S{face}");
                    return Err(place.fail("*SURFACE", label.to_string(), problem));
                };
                faces.push(corners.iter().map(|c| element.nodes[*c]).collect());
            }
        }
        found.insert(name.clone(), faces);
    }
    Ok(found)
}

/// Ties out of equations -u_slave + sum of w u_master = 0, one for each of the three directions.
fn ties(equations: &[(Terms, Place)]) -> Result<Vec<RawTie>, Error> {
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

#[cfg(test)]
mod tests;
