//! Numbers of a `.msh` file, written as text or as bytes; errors name the place.

use std::path::Path;

use crate::Error;

/// How the numbers of a section are written.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Coding {
    /// Decimal, a record to a line.
    Text,
    /// Little-endian: `int` of 4 bytes, `size_t` and `double` of 8.
    Binary,
}

/// A place in the file.
pub(super) struct Cursor<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    place: usize,
    /// Section that is being read, with its `$`.
    pub section: String,
    section_start: usize,
    /// How the section's numbers are written.
    pub coding: Coding,
}

impl<'a> Cursor<'a> {
    pub fn new(path: &'a Path, bytes: &'a [u8]) -> Self {
        Self { path, bytes, place: 0, section: "file".into(), section_start: 0, coding: Coding::Text }
    }

    /// An error here: its line in a text, its byte behind the section's line in a binary section.
    pub fn fail(&self, value: impl Into<String>, problem: impl Into<String>) -> Error {
        let (end, field) = match self.coding {
            Coding::Text => (self.place, self.section.clone()),
            Coding::Binary => (self.section_start, format!("{} at byte {}", self.section, self.place)),
        };
        let breaks = self.bytes[..end.min(self.bytes.len())].iter().filter(|b| **b == b'\n').count();
        // A cursor behind a line break still reports the line before it.
        let after_break = end > 0 && self.bytes.get(end - 1) == Some(&b'\n');
        Error::Field {
            path: self.path.to_path_buf(),
            line: breaks + usize::from(!after_break),
            field,
            value: value.into(),
            problem: problem.into(),
        }
    }

    fn ends(&self) -> Error {
        self.fail("", "the file ends within the section")
    }

    /// The next line that is not blank, trimmed; None at the end of the file.
    pub fn line(&mut self) -> Option<String> {
        while self.place < self.bytes.len() {
            let rest = &self.bytes[self.place..];
            let length = rest.iter().position(|b| *b == b'\n').map_or(rest.len(), |n| n + 1);
            self.place += length;
            let line = String::from_utf8_lossy(&rest[..length]).trim().to_owned();
            if !line.is_empty() {
                return Some(line);
            }
        }
        None
    }

    /// [`Self::line`] within a section.
    ///
    /// # Errors
    /// The file ends.
    pub fn needed_line(&mut self) -> Result<String, Error> {
        self.line().ok_or_else(|| self.ends())
    }

    /// Begins a section whose name was just read.
    pub fn begin(&mut self, section: String, coding: Coding) {
        (self.section, self.section_start, self.coding) = (section, self.place, coding);
    }

    /// Reads the end of the section.
    ///
    /// # Errors
    /// Other text in its place.
    pub fn end(&mut self) -> Result<(), Error> {
        let expected = format!("$End{}", &self.section[1..]);
        match self.line() {
            Some(line) if line == expected => {
                self.coding = Coding::Text;
                Ok(())
            }
            Some(line) => {
                let shown: String = line.chars().take(40).collect();
                Err(self.fail(shown, format!("is in place of {expected}")))
            }
            None => Err(self.ends()),
        }
    }

    /// Skips the rest of the section.
    ///
    /// # Errors
    /// The file ends before.
    pub fn skip(&mut self) -> Result<(), Error> {
        let end = format!("$End{}", &self.section[1..]).into_bytes();
        let found = self.bytes[self.place..].windows(end.len()).position(|window| window == end);
        self.place += found.ok_or_else(|| self.ends())?;
        self.end()
    }

    /// Begins a record: in a text, the next line that is not blank.
    ///
    /// # Errors
    /// The file ends.
    pub fn record(&mut self) -> Result<(), Error> {
        if self.coding == Coding::Text {
            if self.place > 0 && self.bytes[self.place - 1] != b'\n' {
                let rest = &self.bytes[self.place..];
                self.place += rest.iter().position(|b| *b == b'\n').map_or(rest.len(), |n| n + 1);
            }
            let rest = &self.bytes[self.place..];
            self.place += rest.iter().position(|b| !b.is_ascii_whitespace()).ok_or_else(|| self.ends())?;
        }
        Ok(())
    }

    /// Refuses more numbers in the record than were read.
    ///
    /// # Errors
    /// There are more.
    pub fn record_is_whole(&self) -> Result<(), Error> {
        if self.coding == Coding::Binary {
            return Ok(());
        }
        let rest = self.bytes[self.place..].split(|b| *b == b'\n').next().unwrap_or_default();
        if rest.iter().all(u8::is_ascii_whitespace) {
            return Ok(());
        }
        Err(self.fail(String::from_utf8_lossy(rest).trim(), "is more than the line should hold"))
    }

    /// An `int`.
    ///
    /// # Errors
    /// It is missing or not a number.
    pub fn int(&mut self) -> Result<i64, Error> {
        match self.coding {
            Coding::Text => self.word(),
            Coding::Binary => Ok(i64::from(i32::from_le_bytes(self.take()?))),
        }
    }

    /// A `size_t`.
    ///
    /// # Errors
    /// It is missing or not a number.
    pub fn size(&mut self) -> Result<u64, Error> {
        match self.coding {
            Coding::Text => self.word(),
            Coding::Binary => Ok(u64::from_le_bytes(self.take()?)),
        }
    }

    /// A `double`.
    ///
    /// # Errors
    /// It is missing or not a number.
    pub fn double(&mut self) -> Result<f64, Error> {
        match self.coding {
            Coding::Text => self.word(),
            Coding::Binary => Ok(f64::from_le_bytes(self.take()?)),
        }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], Error> {
        let bytes = self.bytes.get(self.place..self.place + N).ok_or_else(|| self.ends())?;
        self.place += N;
        Ok(bytes.try_into().expect("N bytes"))
    }

    fn word<T: std::str::FromStr>(&mut self) -> Result<T, Error> {
        let rest = &self.bytes[self.place..];
        let start = rest.iter().position(|b| !matches!(b, b' ' | b'\t' | b'\r')).ok_or_else(|| self.ends())?;
        let length = rest[start..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - start);
        if length == 0 {
            return Err(self.fail("", "the line has too few numbers"));
        }
        let word = String::from_utf8_lossy(&rest[start..start + length]);
        self.place += start + length;
        word.parse().map_err(|_| self.fail(word.clone(), "is not such a number"))
    }
}
