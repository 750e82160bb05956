use fingerpad_offline::mesh::*;
use fingerpad_tests::peer_cases::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let mut case = Case::new(Box::leak(a[1].clone().into_boxed_str()), match a[2].as_str() { "coarse" => MeshPreset::Coarse, "fine" => MeshPreset::Fine, _ => MeshPreset::Default });
    if a[3] == "patch" { case.nail = Nail::FixedPatch; }
    case.d_factor = std::env::var("D").map_or(1.0, |d| d.parse().unwrap());
    let f = case.finger();
    let mut p = problem(&f, Law::Frictionless);
    if let Some(n) = a.get(4) { p.penalty.points_per_edge = n.parse().unwrap(); }
    let t = run(&p, &press_and_slide(&[0.75, 1.0, 1.25, 1.5], &[]));
    println!("{} points {}", case.line(&f), p.penalty.points_per_edge);
    for s in &t.snapshots[1..] { println!("{} {:.6}", s.response.depth_mm, s.response.normal_force_n); }
}
