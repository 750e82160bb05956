//! dev
use fingerpad_offline::diagnose::dev;
use fingerpad_tests::hidden::{effects::LIBRARY, sets::{Hide, case}};
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let size: f64 = args[1].parse().unwrap();
    let level: usize = args[2].parse().unwrap();
    let reps: u64 = args[3].parse().unwrap();
    for law in 0..17 { for rep in 0..reps {
        let t = std::time::Instant::now();
        let c = case(1000*rep + law as u64 + 17, Hide::Law(law), size, level, 60, true);
        let made = t.elapsed().as_secs_f64();
        let t = std::time::Instant::now();
        let s = dev(&c.calibration, &c.measured);
        println!("{:18} a {:8.4} [{:.2} s] {s} ({:.2} s)", LIBRARY[law].0, c.truth[0].amplitude, made, t.elapsed().as_secs_f64());
    }}
}
