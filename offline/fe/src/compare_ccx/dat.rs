//! Reader of CalculiX's output: totals and node values of the `.dat` file, iterations of the `.sta` file.

use nalgebra::Vector3;

use super::Error;

/// One table of a `.dat` file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Block {
    /// The words before `for set`, such as `total force (fx,fy,fz)`.
    pub quantity: String,
    /// Set name, upper case as CalculiX prints it.
    pub set: String,
    /// Total time since the first step began (here: travel, mm), printed with seven digits.
    pub time: f64,
    /// Node number (0 in a total) and value.
    pub rows: Vec<(u32, Vector3<f64>)>,
}

/// Reads the tables; a last line cut off by a killed run is dropped with its table.
pub(super) fn parse(file: &str, text: &str) -> Result<Vec<Block>, Error> {
    let mut blocks: Vec<Block> = Vec::new();
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    for (i, line) in whole.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let wrong = |problem: &str| Error::Output {
            file: file.to_owned(),
            line: i + 1,
            problem: format!("{problem}: `{}`", line.trim()),
        };
        if let Some((quantity, rest)) = line.split_once(" for set ") {
            let (set, time) = rest.split_once(" and time ").ok_or_else(|| wrong("a heading without a time"))?;
            let time = fortran(time.trim()).ok_or_else(|| wrong("not a time"))?;
            let (quantity, set) = (quantity.trim().to_owned(), set.trim().to_owned());
            blocks.push(Block { quantity, set, time, rows: Vec::new() });
            continue;
        }
        let block = blocks.last_mut().ok_or_else(|| wrong("values before a heading"))?;
        let words: Vec<&str> = line.split_whitespace().collect();
        let (node, values) = match words.len() {
            3 => (0, &words[..]),
            4 => (words[0].parse().map_err(|_| wrong("not a node number"))?, &words[1..]),
            _ => return Err(wrong("neither a total nor the value of a node")),
        };
        let values: Vec<f64> =
            values.iter().map(|word| fortran(word)).collect::<Option<_>>().ok_or_else(|| wrong("not numbers"))?;
        block.rows.push((node, Vector3::from_column_slice(&values)));
    }
    Ok(blocks)
}

/// A number of a Fortran `E13.6` field, in which `1.0-100` means 1e-100.
fn fortran(word: &str) -> Option<f64> {
    if let Ok(value) = word.parse::<f64>() {
        return value.is_finite().then_some(value);
    }
    let sign = word.rfind(['-', '+']).filter(|at| *at > 0)?;
    format!("{}e{}", &word[..sign], &word[sign..]).parse().ok()
}

/// Increments, attempts that failed, iterations of both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Iterations {
    pub increments: u32,
    pub failed: u32,
    pub iterations: u32,
}

/// Sums up a `.sta` file, which has a line per attempt: step, increment, attempt (with `U` if it failed), iterations.
pub(super) fn parse_sta(text: &str) -> Iterations {
    let mut sum = Iterations::default();
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [step, _, attempt, iterations, ..] = words[..] else {
            continue;
        };
        let (Ok(_), Ok(iterations)) = (step.parse::<u32>(), iterations.parse::<u32>()) else {
            continue;
        };
        sum.iterations += iterations;
        if attempt.ends_with('U') { sum.failed += 1 } else { sum.increments += 1 }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    const DAT: &str = "
 total force (fx,fy,fz) for set PLANE_NODES and time  0.7500000E+00

       -9.744419E-14  1.000000-104  1.468777E-01

 displacements (vx,vy,vz) for set PEER_PAD and time  0.7500000E+00

         1 -7.341736E-02 -7.377094E-02 -2.737516E-03
        10 -7.940122E-02 -7.657769E-02 -1.629528E-02
";

    #[test]
    fn tables_of_a_run() {
        let blocks = parse("j.dat", DAT).unwrap();
        assert_eq!(blocks.len(), 2);
        assert_eq!(blocks[0].set, "PLANE_NODES");
        assert_eq!(blocks[0].rows, [(0, Vector3::new(-9.744419e-14, 1e-104, 0.1468777))]);
        assert_eq!(blocks[1].rows[1], (10, Vector3::new(-7.940122e-2, -7.657769e-2, -1.629528e-2)));
        assert_eq!(blocks[1].time, 0.75);
    }

    #[test]
    fn a_line_cut_off_is_dropped_and_nonsense_is_named() {
        assert_eq!(parse("j.dat", &DAT[..DAT.len() - 30]).unwrap()[1].rows.len(), 1);
        let error = parse("j.dat", &DAT.replace("-1.629528E-02", "**********")).unwrap_err().to_string();
        assert!(error.starts_with("j.dat:9: not numbers: `10 "), "{error}");
    }

    #[test]
    fn attempts_of_a_run() {
        let sta = "SUMMARY OF JOB INFORMATION
  STEP      INC     ATT  ITRS     TOT TIME     STEP TIME      INC TIME
     1          1     1     9  0.333333E+00  0.333333E+00  0.333333E+00
     2          1    1U    60  0.100000E+01  0.000000E+00  0.100000E+01
     2          1     2     4  0.125000E+01  0.250000E+00  0.250000E+00
";
        assert_eq!(parse_sta(sta), Iterations { increments: 2, failed: 1, iterations: 73 });
    }
}
