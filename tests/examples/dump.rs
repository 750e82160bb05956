use fingerpad_offline::{mesh::*, peer::*};
use fingerpad_tests::peer_cases::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let mut case = Case::new(Box::leak(a[1].clone().into_boxed_str()), if a[2] == "coarse" { MeshPreset::Coarse } else { MeshPreset::Default });
    if a[3] == "patch" { case.nail = Nail::FixedPatch; }
    let inc: f64 = a[4].parse().unwrap();
    case.d_factor = std::env::var("D").map_or(1.0, |d| d.parse().unwrap());
    let f = case.finger();
    let fr = a.get(5).map(|s| Friction { mu: MU, stick_slope_mpa_mm: s.parse().unwrap() });
    let mut steps = vec![Step { first_increment_mm: inc, max_increment_mm: inc, ..Step::press(&[0.75, 1.0, 1.25, 1.5]) }];
    if fr.is_some() { steps = vec![Step { first_increment_mm: inc, max_increment_mm: inc, ..Step::press(&[0.75]) }, Step::slide_x(0.75, &SLIDES_MM)]; }
    print!("{}", case.deck(&f, fr, steps).to_text().unwrap());
}
