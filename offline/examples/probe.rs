use fingerpad_offline::{experiment::Config, mesh::MeshPreset, slide::*};
use std::ops::ControlFlow;
fn main() {
    let preset = std::env::args().nth(1).unwrap();
    let dir: f64 = std::env::args().nth(2).unwrap().parse().unwrap();
    let mut c = Config::default();
    c.mesh_preset = if preset == "coarse" { MeshPreset::Coarse } else { MeshPreset::Default };
    let (finger, _) = c.finger().unwrap();
    let (cx, cy) = (dir.to_radians().cos(), dir.to_radians().sin());
    let mut w = vec![];
    let mut t = 0.0;
    let mut add = |d: f64, s: f64| { w.push(Waypoint { t_s: t, normal: d, x: s*cx, y: s*cy }); t += 1.0; };
    add(0.0, 0.0); add(1.0, 0.0); add(1.0, 3.5);
    for s in [3.48, 3.4, 3.2, 3.0, 2.5, 2.0, 1.5] { add(1.0, s); }
    let path = Path { drives: [Drive::Displacement; 3], waypoints: w };
    let all: Vec<usize> = (0..path.waypoints.len()).collect();
    let tr = march(&c.problem(&finger), &path, &all, &mut |_| ControlFlow::Continue(())).unwrap();
    eprintln!("{:?}", tr.cost);
    let area: Vec<f64> = finger.mesh.pad_faces.iter().map(|f| { let p = f.map(|n| finger.mesh.nodes[n as usize]); 0.5*((p[2]-p[0]).cross(&(p[3]-p[1]))).norm() }).collect();
    let cen: Vec<_> = finger.mesh.pad_faces.iter().map(|f| { let p = f.map(|n| finger.mesh.nodes[n as usize]); (p[0]+p[1]+p[2]+p[3])*0.25 }).collect();
    for k in 1..tr.snapshots.len() {
        let (a, b) = (&tr.snapshots[k-1], &tr.snapshots[k]);
        let mut sum = [0.0; 8];
        for i in 0..area.len() {
            let (fa, fb) = (&a.faces[i], &b.faces[i]);
            if fb.contact_fraction <= 0.0 { continue; }
            let ar = area[i]*fb.contact_fraction;
            let slip = (fb.slip_mm[0]-fa.slip_mm[0])*cx + (fb.slip_mm[1]-fa.slip_mm[1])*cy;
            sum[0] += ar;
            sum[1] += ar*fb.stick_fraction;
            let sl = ar*(1.0-fb.stick_fraction);
            if slip > 0.0 { sum[2] += sl } else { sum[3] += sl }
            if fb.pressure_mpa < fa.pressure_mpa { sum[4] += sl } else { sum[5] += sl }
            sum[6] += sl*fb.pressure_mpa; sum[7] += ar*fb.pressure_mpa;
            if k == 4 || k == 6 { println!("  face {:6.2} {:6.2} p {:.5} dp {:+.5} q {:+.5} dslip {:+.5} stick {:.2} frac {:.2}", cen[i].x, cen[i].y, fb.pressure_mpa, fb.pressure_mpa-fa.pressure_mpa, fb.traction_mpa[0]*cx+fb.traction_mpa[1]*cy, slip, fb.stick_fraction, fb.contact_fraction); }
        }
        println!("s {:.2} stick {:.3} slipping: fwd {:.3} back {:.3} | p falling {:.3} rising {:.3} | load share of slipping {:.3}", b.response.slide_x_mm.hypot(b.response.slide_y_mm), sum[1]/sum[0], sum[2]/sum[0], sum[3]/sum[0], sum[4]/sum[0], sum[5]/sum[0], sum[6]/sum[7]);
    }
}
