//! dev
use fingerpad_offline::diagnose::{dev, Verdict};
use fingerpad_tests::hidden::{effects::LIBRARY, sets::{Hide, case}};
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let kind = args[1].as_str();
    let size: f64 = args[2].parse().unwrap();
    let level: usize = args[3].parse().unwrap();
    let reps: u64 = args[4].parse().unwrap();
    let verbose = args.len() > 5;
    let mut list: Vec<(u64, Hide)> = vec![];
    for rep in 0..reps {
        match kind {
            "one" => { let l: usize = args[5].parse().unwrap(); list.push((1000*rep + l as u64 + 17, Hide::Law(l))) },
            "law" => for law in 0..17 { list.push((1000*rep + law as u64 + 17, Hide::Law(law))) },
            "none" => list.push((5000+rep, Hide::Nothing)),
            "out" => for i in 0..6 { list.push((7000+10*rep+i as u64, Hide::Outside(i))) },
            "drop" => for i in [0,6,8,14,16] { list.push((9000+20*rep+i as u64, Hide::Unrecorded(i))) },
            "pair" => { for (k,(i,j)) in [(0,10),(1,11),(4,13),(5,8),(7,12),(3,14),(16,9),(15,4),(2,6),(0,5),(8,13),(1,7)].into_iter().enumerate() { list.push((11000+20*rep+k as u64, Hide::Pair(i,j))) } },
            _ => panic!(),
        }
    }
    let mut counts = std::collections::BTreeMap::<&str, usize>::new();
    let mut time = 0.0;
    for (seed, hide) in &list {
        let c = case(*seed, *hide, size, level, 60, true);
        let t = std::time::Instant::now();
        let (v, fams, values, s) = dev(&c.calibration, &c.measured);
        time += t.elapsed().as_secs_f64();
        let truth: Vec<&str> = c.truth.iter().map(|e| LIBRARY.iter().find(|l| l.0 == e.name).map_or("-", |l| l.1)).collect();
        let mut names: Vec<&str> = fams.iter().map(|f| f[0]).collect();
        names.sort(); let mut want = truth.clone(); want.sort();
        let class = match v {
            Verdict::None => "none",
            Verdict::UnexplainedStructure => "unexplained",
            Verdict::Named => if names == want { "exact" } else if names.iter().all(|n| want.contains(n)) { "part" } else if want.iter().all(|n| names.contains(n)) { "extra" } else { "WRONG" },
            Verdict::Ambiguous => if want.iter().all(|w| fams.iter().any(|f| f.contains(w))) { "ambig_in" } else { "ambig_out" },
        };
        *counts.entry(class).or_default() += 1;
        let amp = c.truth.first().map(|e| e.amplitude).unwrap_or(0.0);
        if verbose || class != "exact" { println!("{class:11} {seed} {:?} a {amp:.4} {:?} {s}", c.truth.iter().map(|e| e.name).collect::<Vec<_>>(), values.first().map(|v| v[0])); }
    }
    println!("{kind} {size} {level}: {counts:?} of {} ; {:.2} s each", list.len(), time / list.len() as f64);
}
