use fingerpad_tests::hidden::{sets::{Hide, case}};
fn main(){
 let c = case(3, Hide::Nothing, 0.1, 0, 60, true);
 println!("{:?}\n{:?}", c.finger, c.noise);
 for r in c.calibration.runs.iter().take(2) { for (i,row) in r.rows.iter().enumerate() { println!("{:.2} d {:.3} s {:.3} {:.3} N {:.4} {:.4} {:.4}", row.t_s, row.depth_mm, r.slide_mm[i][0], r.slide_mm[i][1], r.force_n[i][0], r.force_n[i][1], r.force_n[i][2]); } }
}
