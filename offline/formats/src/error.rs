//! What can be wrong with a file.

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
        /// What the system said.
        source: std::io::Error,
    },
    /// Nothing but blank lines.
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
        /// What was probably meant, or what there is.
        hint: String,
    },
    /// A column that is needed and not there.
    #[error("{}:{line}: no column {column}", path.display())]
    MissingColumn {
        /// The file.
        path: PathBuf,
        /// Line.
        line: usize,
        /// What is missing, in quotes; alternatives joined by `or`.
        column: String,
    },
    /// Two columns that say the same or contradict each other.
    #[error("{}:{line}: column `{column}` cannot stand beside `{other}`", path.display())]
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
        "{}:{line}: column `{column}` stands twice in the header, as cells {} and {}: remove or rename one of them",
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
        "{}:{line}: {found} cells where the header has {expected} (separated by {}s{})",
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
        /// The cell as it stands in the file, or the value that was to be written.
        value: String,
        /// What is wrong with it, as the end of the sentence.
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
        /// What stands there.
        value: String,
        /// What is wrong with it, as the end of the sentence.
        problem: String,
    },
    /// Something that is wrong with a line as a whole, or with the file from there on.
    #[error("{}:{line}: {problem}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Line.
        line: usize,
        /// What is wrong.
        problem: String,
    },
    /// A mesh or field that this format cannot hold, or data that do not fit their header.
    #[error("{}: {problem}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
}
