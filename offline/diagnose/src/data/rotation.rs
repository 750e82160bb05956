//! Forces that were logged in the frame of a sensor, turned into the frame of the contact.
//!
//! Main type: [`Rotation`].

use fingerpad_formats::significant;
use nalgebra::{Matrix3, Rotation3, Vector3};

use crate::data::outliers::{at_rail, rails};
use crate::data::runs::RunSet;
use crate::error::DiagnoseError;
use crate::schema::Caution;

/// Largest difference between the matrix of a user times its transpose and the unit matrix: matrices are printed with few digits.
const ORTHOGONAL: f64 = 2e-3;

/// A rotation from the frame of a sensor to that of the contact, whose axes are x, y and the direction of the normal force.
#[derive(Clone, Debug, PartialEq)]
pub struct Rotation {
    /// Force in the contact frame = matrix · force in the frame of the sensor.
    matrix: Matrix3<f64>,
    /// The option with its value, for messages.
    source: String,
}

/// The numbers of an option, separated by commas.
fn numbers<const N: usize>(flag: &str, text: &str, names: &str) -> Result<[f64; N], String> {
    let cells: Vec<&str> = text.split(',').map(str::trim).collect();
    if cells.len() != N {
        return Err(format!("{flag} {text}: {} numbers where {N} are needed ({names})", cells.len()));
    }
    let mut out = [0.0; N];
    for (to, cell) in out.iter_mut().zip(&cells) {
        *to = cell.parse::<f64>().map_err(|_| format!("{flag} {text}: `{cell}` is not a number"))?;
        if !to.is_finite() {
            return Err(format!("{flag} {text}: `{cell}` is not finite"));
        }
    }
    Ok(out)
}

impl Rotation {
    /// From roll, pitch and yaw of the sensor in the contact frame, degrees: about the fixed axes x, y, z, one after the other, as ROS
    /// and URDF have it. The matrix is Rz(yaw) Ry(pitch) Rx(roll).
    ///
    /// # Errors
    /// A sentence with the option and its value.
    pub fn from_rpy_deg(text: &str) -> Result<Self, String> {
        const FLAG: &str = "--sensor-rpy-deg";
        let angles_deg: [f64; 3] = numbers(FLAG, text, "roll, pitch and yaw")?;
        if let Some(angle_deg) = angles_deg.iter().find(|a| a.abs() > 360.0) {
            return Err(format!("{FLAG} {text}: {angle_deg} is not between -360 and 360 degrees"));
        }
        let [roll, pitch, yaw] = angles_deg.map(f64::to_radians);
        let matrix = Rotation3::from_euler_angles(roll, pitch, yaw).into_inner();
        Ok(Self { matrix, source: format!("{FLAG} {text}") })
    }

    /// From the nine numbers of the matrix, row by row. Digits that printing cut off are restored.
    ///
    /// # Errors
    /// A sentence with the option and its value, for matrices that are no rotation.
    pub fn from_matrix(text: &str) -> Result<Self, String> {
        const FLAG: &str = "--sensor-matrix";
        let m: [f64; 9] = numbers(FLAG, text, "the rows of the matrix, one after the other")?;
        let matrix = Matrix3::from_row_slice(&m);
        let gram = matrix * matrix.transpose();
        for i in 0..3 {
            for j in 0..3 {
                let value = gram[(i, j)];
                let wanted = f64::from(u8::from(i == j));
                if !((value - wanted).abs() <= ORTHOGONAL) {
                    return Err(format!(
                        "{FLAG} {text}: the matrix is not orthogonal: rows {} and {} have the product {}, where a rotation has {wanted} \
                         (within {ORTHOGONAL})",
                        i + 1,
                        j + 1,
                        significant(value, 4)
                    ));
                }
            }
        }
        if matrix.determinant() < 0.0 {
            return Err(format!(
                "{FLAG} {text}: the matrix is left-handed (determinant {}, where a rotation has 1); where the sensor reports the \
                 opposite force, give the columns a minus sign in --map",
                significant(matrix.determinant(), 4)
            ));
        }
        // The nearest rotation: that of the singular value decomposition.
        let svd = matrix.svd(true, true);
        let nearest = svd.u.zip(svd.v_t).map_or(matrix, |(u, v_t)| u * v_t);
        Ok(Self { matrix: nearest, source: format!("{FLAG} {text}") })
    }

    /// A force in the contact frame.
    ///
    /// * `force_n`: normal, x, y in the frame of the sensor, N
    pub fn apply(&self, force_n: [f64; 3]) -> [f64; 3] {
        let [normal, x, y] = force_n;
        let turned = self.matrix * Vector3::new(x, y, normal);
        [turned.z, turned.x, turned.y]
    }

    /// How the forces were read, one line.
    pub fn note(&self) -> String {
        let row = |i: usize| [0, 1, 2].map(|j| significant(self.matrix[(i, j)], 6)).join(" ");
        let rows = [0, 1, 2].map(row);
        format!("forces are turned from the sensor's frame by {}: matrix [{}]", self.source, rows.join("; "))
    }

    /// Turns the forces of a set. A row with a reading at the sensor's rail loses all three readings, because the rotation would spread
    /// the wrong one over them.
    ///
    /// * `names`: names of the columns of normal force, x and y
    ///
    /// # Errors
    /// [`DiagnoseError`] where the sensor is at its rail in half of the rows in contact.
    pub fn turn(&self, set: &mut RunSet, names: [&str; 3]) -> Result<(), DiagnoseError> {
        let rails = rails(set);
        let railed = at_rail(set, &rails);
        let (mut lost, mut in_contact) = (0, 0);
        for (run, flags) in set.runs.iter_mut().zip(&railed) {
            for ((row, force_n), flag) in run.rows.iter().zip(&mut run.force_n).zip(flags) {
                let is_lost = flag.contains(&true);
                *force_n = if is_lost { [f64::NAN; 3] } else { self.apply(*force_n) };
                in_contact += usize::from(row.depth_mm > 0.0);
                lost += usize::from(is_lost && row.depth_mm > 0.0);
            }
        }
        let of = |channel: usize, force_n: f64| format!("`{}` ends at {} N", names[channel], significant(force_n, 4));
        let ends: Vec<String> = rails.iter().map(|rail| of(rail.channel, rail.force_n)).collect();
        if 2 * lost > in_contact {
            return Err(DiagnoseError::Unusable {
                path: set.path.clone(),
                problem: format!(
                    "line {}: {}, the sensor's rail, in {lost} of {in_contact} rows in contact: the other rows carry no diagnosis",
                    set.runs[0].line,
                    ends.join(", ")
                ),
            });
        }
        if !ends.is_empty() {
            set.cautions.push(Caution {
                kind: "sensor_rail".into(),
                role: String::new(),
                column: String::new(),
                text: format!(
                    "The sensor, not the finger: {} in {}, the sensor's rail. The forces of the {lost} rows in contact with these readings \
                     are left out; a sensor with a larger range is needed there.",
                    ends.join(", "),
                    set.path.display()
                ),
            });
        }
        set.notes.push(self.note());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::runs::{Labels, RawRow};

    #[test]
    fn the_angles_turn_about_the_fixed_axes_one_after_the_other() {
        // Roll 90: the sensor's z points against y of the contact. Yaw 90 then turns that to +x.
        let turned = |text: &str| Rotation::from_rpy_deg(text).unwrap().apply([2.0, 0.0, 0.0]);
        for (text, wanted) in [
            ("90,0,0", [0.0, 0.0, -2.0]),
            ("90,0,90", [0.0, 2.0, 0.0]),
            ("0,90,0", [0.0, 2.0, 0.0]),
            ("180,0,45", [-2.0, 0.0, 0.0]),
        ] {
            turned(text).iter().zip(wanted).for_each(|(a, b)| assert!((a - b).abs() < 1e-12, "{text}"));
        }
        let (s, c) = 30f64.to_radians().sin_cos();
        let matrix = format!("{c:.4},{:.4},0,{s:.4},{c:.4},0,0,0,1", -s);
        let [a, b] = [Rotation::from_matrix(&matrix), Rotation::from_rpy_deg("0,0,30")].map(Result::unwrap);
        let [a, b] = [a, b].map(|r| r.apply([0.5, 1.0, -2.0]));
        a.iter().zip(b).for_each(|(a, b)| assert!((a - b).abs() < 2e-4));
        // The digits that were cut off cost no length.
        assert!((a.iter().map(|f| f * f).sum::<f64>() - 5.25).abs() < 1e-9);
    }

    #[test]
    fn matrices_that_are_no_rotation_and_wrong_numbers_are_refused() {
        for (text, word) in [
            ("1,0,0,0,1,0,0,0,-1", "left-handed"),
            ("1,0,0,0,1,0,0,0.1,1", "not orthogonal"),
            ("2,0,0,0,2,0,0,0,2", "not orthogonal"),
            ("1,0,0,0,1,0,0,0", "8 numbers where 9"),
            ("1,0,0,0,1,0,0,0,nan", "not finite"),
        ] {
            let message = Rotation::from_matrix(text).unwrap_err();
            assert!(message.contains(word) && message.contains(text), "{message}");
        }
        for (text, word) in [("0,90", "2 numbers where 3"), ("0,x,0", "`x`"), ("0,0,4000", "360")] {
            let message = Rotation::from_rpy_deg(text).unwrap_err();
            assert!(message.contains(word), "{message}");
        }
    }

    #[test]
    fn rows_at_a_rail_lose_all_readings() {
        let row = |i: usize| RawRow::bare(2 + i, i as f64, 1.0, [i as f64, 0.0], [(0.1 * i as f64).min(2.0), 0.3, 0.0]);
        let rows = vec![(Labels::default(), (0..31).map(row).collect())];
        let mut set = RunSet::from_rows("m.csv".into(), rows).unwrap();
        Rotation::from_rpy_deg("0,45,0").unwrap().turn(&mut set, ["Fz", "Fx", "Fy"]).unwrap();
        let force_n = &set.runs[0].force_n;
        assert!(
            force_n[20..].iter().flatten().all(|f| f.is_nan()) && force_n[..20].iter().flatten().all(|f| f.is_finite())
        );
        assert!(set.cautions[0].text.contains("`Fz` ends at 2 N"), "{}", set.cautions[0].text);
    }
}
