//! How a CSV file separates cells and writes decimals: comma, semicolon or tab; point or comma.
//!
//! Main function: [`separator`]; main type: [`Decimals`].

use std::borrow::Cow;

/// Characters that separate cells, with their names.
pub const SEPARATORS: [(char, &str); 3] = [(',', "comma"), (';', "semicolon"), ('\t', "tab")];

/// Rows by which a separator is found.
const ROWS: usize = 20;

/// The character that separates the cells of a file.
///
/// * `head`: the file's first lines
///
/// A header with one of comma, semicolon and tab decides; with several of them, the one that separates the first rows
/// into as many cells as the header.
///
/// # Errors
/// The ambiguity, as a sentence.
pub fn separator(head: &str) -> Result<char, String> {
    let mut lines = head.strip_prefix('\u{feff}').unwrap_or(head).lines().filter(|line| !line.trim().is_empty());
    let header = lines.next().unwrap_or("");
    let rows: Vec<&str> = lines.take(ROWS).collect();
    let count = |line: &str, c: char| split(line, c).len();
    let there: Vec<(char, &str)> = SEPARATORS.into_iter().filter(|(c, _)| count(header, *c) > 1).collect();
    if let [(only, _)] = there[..] {
        return Ok(only);
    }
    let fits = |c: char| rows.iter().all(|row| count(row, c) == count(header, c));
    match there.iter().filter(|(c, _)| fits(*c)).collect::<Vec<_>>()[..] {
        _ if there.is_empty() => Ok(','),
        [(only, _)] => Ok(*only),
        _ => {
            let names: Vec<String> = there.iter().map(|(_, name)| format!("{name}s")).collect();
            Err(format!(
                "the header contains {}, and which of them separates the cells is unclear: use one separator in the whole file",
                names.join(" and ")
            ))
        }
    }
}

/// Cells of a line: separators outside quotes separate.
pub fn split(line: &str, separator: char) -> Vec<&str> {
    let (mut cells, mut start, mut quoted) = (Vec::new(), 0, false);
    for (i, c) in line.char_indices() {
        match c {
            '"' => quoted = !quoted,
            c if c == separator && !quoted => {
                cells.push(&line[start..i]);
                start = i + c.len_utf8();
            }
            _ => {}
        }
    }
    cells.push(&line[start..]);
    cells
}

/// The decimals of a file, from the numbers that were read of it.
#[derive(Clone, Debug)]
pub struct Decimals {
    separator: char,
    /// Line and text of the first number with a decimal comma, and with a decimal point.
    comma: Option<(usize, String)>,
    point: Option<(usize, String)>,
    /// The first number whose comma may separate thousands.
    unclear: Option<(usize, String)>,
}

impl Decimals {
    /// Before any number of a file is read.
    pub fn new(separator: char) -> Self {
        Self { separator, comma: None, point: None, unclear: None }
    }

    /// The file's separator.
    pub fn separator(&self) -> char {
        self.separator
    }

    /// A cell with a decimal point; other text is returned unchanged.
    ///
    /// # Errors
    /// The defect of the number's decimals, as the end of a sentence.
    pub fn plain<'a>(&mut self, line: usize, cell: &'a str) -> Result<Cow<'a, str>, String> {
        let mixed = |is: &str, other: &str, (line, text): &(usize, String)| {
            format!("has a decimal {is}, and line {line} has a decimal {other} (`{text}`)")
        };
        let Some((whole, fraction)) = cell.split_once(',') else {
            if cell.contains('.') && self.point.is_none() && cell.parse::<f64>().is_ok() {
                if let Some(comma) = self.comma.as_ref().or(self.unclear.as_ref()) {
                    return Err(mixed("point", "comma", comma));
                }
                self.point = Some((line, cell.to_owned()));
            }
            return Ok(Cow::Borrowed(cell));
        };
        let pointed = format!("{whole}.{fraction}");
        if self.separator == ',' || pointed.parse::<f64>().is_err() {
            return Ok(Cow::Borrowed(cell));
        }
        if let Some(point) = &self.point {
            return Err(mixed("comma", "point", point));
        }
        let digits = whole.trim_start_matches(['-', '+']);
        let may_be_thousands = fraction.len() == 3 && (1..=3).contains(&digits.len()) && !digits.starts_with('0');
        let first = if may_be_thousands { &mut self.unclear } else { &mut self.comma };
        if first.is_none() {
            *first = Some((line, cell.to_owned()));
        }
        Ok(Cow::Owned(pointed))
    }

    /// An ambiguity at the end of a file: line and sentence.
    ///
    /// # Errors
    /// If every decimal comma of the file may separate thousands.
    pub fn finish(&self) -> Result<(), (usize, String)> {
        match (&self.unclear, &self.comma) {
            (Some((line, text)), None) => Err((
                *line,
                format!(
                    "`{text}` may be {} or {}: no other number of the file shows whether its comma is a decimal comma",
                    text.replace(',', "."),
                    text.replace(',', "")
                ),
            )),
            _ => Ok(()),
        }
    }

    /// Format of the file, if it has other separators than commas or other decimals than points.
    pub fn note(&self) -> Option<String> {
        let (_, name) = SEPARATORS.iter().find(|(c, _)| *c == self.separator).filter(|(c, _)| *c != ',')?;
        let commas = if self.comma.is_some() { " with decimal commas" } else { "" };
        Some(format!("read as {name}-separated{commas}"))
    }

    /// Why a cell is not a number, as the end of a sentence.
    pub fn not_a_number(&self, text: &str) -> String {
        let finite = |text: &str| text.parse::<f64>().is_ok_and(f64::is_finite);
        let whole = text.split('.').next().unwrap_or(text);
        let pointed = text.replacen(',', ".", 1);
        if text.contains(',') && !whole.split(',').skip(1).all(|group| group.len() == 3) && finite(&pointed) {
            return format!(
                "has a decimal comma, while commas separate the cells of this file: write {pointed}, or separate the cells \
                 by semicolons"
            );
        }
        let joined = text.replace([',', ' ', '\'', '_', '\u{a0}', '\u{202f}', '\u{2009}'], "");
        if joined.len() < text.len() && finite(&joined) {
            return format!("has a thousands separator: write {joined}");
        }
        "is not a number".into()
    }

    /// A hint for a row whose cells are more than those of the header.
    pub(crate) fn cell_count_hint(separator: char, found: usize, expected: usize) -> &'static str {
        match separator {
            ',' if found > expected => {
                "; a decimal comma is a separator here: write decimal points, or separate the cells by semicolons"
            }
            _ => "",
        }
    }
}

/// A separator in words.
pub(crate) fn name(separator: char) -> &'static str {
    SEPARATORS.iter().find(|(c, _)| *c == separator).map_or("character", |(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_separator_is_found_and_an_unclear_one_refused() {
        for (head, wanted) in [
            ("a,b\n1,2\n", ','),
            ("a;b\n0,5;2\n", ';'),
            ("\u{feff}a\tb\n0,5\t2\n", '\t'),
            ("run;depth (mm, from touch);n\nr1;0,5;0,5\n", ';'),
            ("\"a;b\",c\n1,2\n", ','),
            ("", ','),
        ] {
            assert_eq!(separator(head), Ok(wanted), "{head}");
        }
        let problem = separator("a,b;c\n1,2;3\n").unwrap_err();
        assert!(problem.contains("commas and semicolons"), "{problem}");
    }

    #[test]
    fn decimal_commas_are_read_and_contradictions_refused() {
        let mut decimals = Decimals::new(';');
        assert_eq!(decimals.plain(2, "1,234").unwrap(), "1.234");
        assert!(decimals.finish().unwrap_err().1.contains("1.234 or 1234"));
        assert_eq!(decimals.plain(3, "-0,25").unwrap(), "-0.25");
        assert_eq!(decimals.plain(3, "7").unwrap(), "7");
        assert!(decimals.finish().is_ok());
        assert_eq!(decimals.note().unwrap(), "read as semicolon-separated with decimal commas");
        let problem = decimals.plain(4, "0.5").unwrap_err();
        assert!(problem.contains("line 3") && problem.contains("-0,25"), "{problem}");
        let mut points = Decimals::new('\t');
        points.plain(2, "0.5").unwrap();
        assert!(points.plain(3, "0,5").unwrap_err().contains("line 2"));
        let commas = Decimals::new(',');
        assert_eq!(commas.note(), None);
        assert!(commas.not_a_number("-0,2").contains("write -0.2"));
        assert!(commas.not_a_number("1,000.5").contains("write 1000.5"));
        assert_eq!(commas.not_a_number("x"), "is not a number");
    }
}
