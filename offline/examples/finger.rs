use fingerpad_offline::{contact::*, mesh::*, slide::*, solve::Settings};
use std::ops::ControlFlow;
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let preset = match args[1].as_str() {
        "coarse" => MeshPreset::Coarse,
        "fine" => MeshPreset::Fine,
        _ => MeshPreset::Default,
    };
    let tip = fingertip(&FingertipShape::named(&args[0]).unwrap(), &preset.divisions()).unwrap();
    let mut tissue = Tissue::default();
    tissue.bone.kind = match args[2].as_str() {
        "fixed" => BoneKind::Fixed,
        "deformable" => BoneKind::Deformable,
        _ => BoneKind::Floating,
    };
    let (depth, slide): (f64, f64) = (args[3].parse().unwrap(), args[4].parse().unwrap());
    let t0 = std::time::Instant::now();
    let f = Finger::new(tip, &tissue).unwrap();
    println!(
        "nodes {} hexes {} dofs {} contact {} setup {:?}",
        f.mesh.nodes.len(),
        f.mesh.hexes.len(),
        f.body.dofs.count,
        f.body.dofs.count - f.body.dofs.first_contact_dof,
        t0.elapsed()
    );
    let mut march_settings = MarchSettings::default();
    let mut friction = Some(RubberFriction::default());
    let mut penalty = PenaltySettings::default();
    let mut settings = Settings::default();
    for a in &args[5..] {
        let (k, v) = a.split_once('=').unwrap();
        let v: f64 = v.parse().unwrap();
        match k {
            "slide" => march_settings.max_slide_step_mm = v,
            "depth" => march_settings.max_depth_step_mm = v,
            "nofric" => friction = None,
            "press" => march_settings.friction_while_pressing = v > 0.0,
            "pen" => penalty.penalty_mpa_per_mm = v,
            "aug" => penalty.augment = v > 0.0,
            "tol" => settings.tolerance = v,
            "pts" => penalty.points_per_edge = v as usize,
            "refresh" => settings.refresh_cost_iterations = v,
            "lambda" => friction.as_mut().unwrap().lambda = v,
            "beta" => friction.as_mut().unwrap().beta = v,
            "preg" => friction.as_mut().unwrap().regular_pressure_mpa = v,
            _ => panic!(),
        }
    }
    let problem =
        Problem { body: &f.body, pad_faces: &f.mesh.pad_faces, friction, penalty, settings, march: march_settings };
    let wp = |t, d, x, y| Waypoint { t_s: t, normal: d, x, y };
    let mut waypoints = vec![wp(0.0, 0.0, 0.0, 0.0), wp(1.0, depth, 0.0, 0.0)];
    if slide != 0.0 {
        waypoints.push(wp(2.0, depth, slide, 0.0));
    }
    let D = Drive::Displacement;
    let Fo = Drive::Force;
    let mut drives = [D; 3];
    if let Ok(kind) = std::env::var("PATHKIND") {
        waypoints = match kind.as_str() {
            "square" => vec![
                wp(0., 0., 0., 0.),
                wp(1., 1., 0., 0.),
                wp(2., 1., 2., 0.),
                wp(3., 1., 2., 2.),
                wp(4., 1., 0., 2.),
                wp(5., 1., 0., 0.),
            ],
            "minusx" => vec![wp(0., 0., 0., 0.), wp(1., 1., 0., 0.), wp(2., 1., -4., 0.)],
            "plusy" => vec![wp(0., 0., 0., 0.), wp(1., 1., 0., 0.), wp(2., 1., 0., 4.)],
            "lift" => vec![
                wp(0., 0., 0., 0.),
                wp(1., 1., 0., 0.),
                wp(2., 1., 1.5, 0.),
                wp(3., -0.2, 1.5, 0.),
                wp(4., 1.0, 1.5, 0.),
            ],
            "reverse" => vec![wp(0., 0., 0., 0.), wp(1., 1., 0., 0.), wp(2., 1., 3., 0.), wp(3., 1., -3., 0.)],
            "both" => vec![
                wp(0., 0., 0., 0.),
                wp(1., 0.75, 0., 0.),
                wp(2., 1.25, 2., 0.),
                wp(3., 0.5, 3., 1.),
                wp(4., 1.0, 2.0, 0.),
            ],
            "down" => vec![wp(0., 0., 0., 0.), wp(1., 1.5, 0., 0.), wp(2., 0.3, 0., 0.), wp(3., 0.3, 1., 0.)],
            "forcez" => {
                drives = [Fo, D, D];
                vec![wp(0., 0., 0., 0.), wp(1., 0.3, 0., 0.), wp(2., 0.3, 4., 0.)]
            }
            "forcex" => {
                drives = [D, Fo, D];
                vec![wp(0., 0., 0., 0.), wp(1., 1.0, 0., 0.), wp(2., 1.0, 0.3, 0.), wp(3., 1.0, 0.3, 0.)]
            }
            "forcexz" => {
                drives = [Fo, Fo, Fo];
                vec![wp(0., 0., 0., 0.), wp(1., 0.3, 0., 0.), wp(2., 0.3, 0.3, 0.1)]
            }
            _ => panic!(),
        }
    }
    let path = Path { drives, waypoints };
    let r = march(&problem, &path, &[], &mut |p| {
        println!(
            "{:.3} d {:.3} N {:.5} F {:.5} F/N {:.4} A {:.2} stick {:.3} slide {:.3} inc {} cut {} it {} fac {} cpu {:.2}",
            p.share,
            p.response.depth_mm,
            p.response.normal_force_n,
            p.response.friction_x_n,
            p.response.friction_x_n / p.response.normal_force_n,
            p.response.contact_area_mm2,
            p.response.stick_ratio,
            p.response.slide_x_mm,
            p.cost.increments,
            p.cost.cutbacks,
            p.cost.iterations,
            p.cost.factorisations,
            p.cost.cpu_s
        );
        ControlFlow::Continue(())
    });
    match r {
        Ok(t) => println!("{:?} {:?}", t.cost, t.work),
        Err(e) => println!("{e}"),
    }
}
