//! Errors of a file.

use std::path::PathBuf;

use crate::dialect::{self, Decimals};

/// A file that could not be read, understood or written.
///
/// Lines count from 1, the header included.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused (missing file, no permission, disk full).
    #[error("{}: {source}", path.display())]
    File {
        /// The file as it was named.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// Blank lines only.
    #[error("{}: the file is empty; its first line must name the columns: {expected}", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// The columns understood.
        expected: String,
    },
    /// A byte sequence that is not UTF-8.
    #[error("{}:{line}: not a text file in UTF-8", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// Line.
        line: usize,
    },
    /// A column that this format does not have.
    #[error("{}:{line}: unknown column `{column}`; {hint}", path.display())]
    UnknownColumn {
        /// The file.
        path: PathBuf,
        /// Line.
        line: usize,
        /// The column as spelled in the file.
        column: String,
        /// The probable intention, or the existing names.
        hint: String,
    },
    /// A column that is needed and not there.
    #[error("{}:{line}: no column {column}", path.display())]
    MissingColumn {
        /// The file.
        path: PathBuf,
        /// Line.
        line: usize,
        /// The missing column, in quotes; alternatives joined by `or`.
        column: String,
    },
    /// Two columns with the same meaning, or with contradicting ones.
    #[error("{}:{line}: column `{column}` cannot be used together with `{other}`", path.display())]
    Conflict {
        /// The file.
        path: PathBuf,
        /// Line.
        line: usize,
        /// The later column.
        column: String,
        /// The earlier one.
        other: String,
    },
    /// A column that the header has twice.
    #[error(
        "{}:{line}: column `{column}` occurs twice in the header, as cells {} and {}: remove or rename one of them",
        path.display(), places[0], places[1]
    )]
    Duplicate {
        /// The file.
        path: PathBuf,
        /// Line.
        line: usize,
        /// The column as spelled in the file.
        column: String,
        /// Its cells, counted from 1.
        places: [usize; 2],
    },
    /// A row with more or fewer cells than the header.
    #[error(
        "{}:{line}: {found} cells, but the header has {expected} (separated by {}s{})",
        path.display(), dialect::name(*separator), Decimals::cell_count_hint(*separator, *found, *expected)
    )]
    CellCount {
        /// The file.
        path: PathBuf,
        /// Line.
        line: usize,
        /// Cells in this row.
        found: usize,
        /// Columns of the header.
        expected: usize,
        /// Character that separates the cells.
        separator: char,
    },
    /// A cell with a value that cannot be.
    #[error("{}:{line}: column `{column}`: `{value}` {problem}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Line.
        line: usize,
        /// Column.
        column: String,
        /// The cell of the file, or the value that was to be written.
        value: String,
        /// The defect, as the end of the sentence.
        problem: String,
    },
    /// Not enough rows.
    #[error("{}:{line}: the file ends after {found} row(s) of values; at least {needed} needed", path.display())]
    TooFewRows {
        /// The file.
        path: PathBuf,
        /// Last line that holds something.
        line: usize,
        /// Rows found.
        found: usize,
        /// Rows needed.
        needed: usize,
    },
    /// A header's field, a keyword's parameter or a section that is not understood.
    #[error("{}:{line}: {field}: `{value}` {problem}", path.display())]
    Field {
        /// The file.
        path: PathBuf,
        /// Line.
        line: usize,
        /// The field, keyword or section.
        field: String,
        /// The text of the file.
        value: String,
        /// The defect, as the end of the sentence.
        problem: String,
    },
    /// A defect of a line as a whole, or of the file from there on.
    #[error("{}:{line}: {problem}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Line.
        line: usize,
        /// The defect.
        problem: String,
    },
    /// A mesh or field that this format cannot hold, or data that do not fit their header.
    #[error("{}: {problem}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// The defect.
        problem: String,
    },
}
