//! Every body against the definition of its surface.

use super::*;

fn bodies() -> Vec<RigidBody> {
    let waves = |x: f64, y: f64| 0.2 * (1.1 * x + 0.4).sin() * (0.8 * y).cos();
    let heights: Vec<f64> =
        (0..81).flat_map(|j| (0..81).map(move |i| waves(0.1 * f64::from(i) - 4.0, 0.1 * f64::from(j) - 4.0))).collect();
    vec![
        RigidBody::Plane,
        RigidBody::Sphere { radius_mm: 5.0 },
        RigidBody::Sphere { radius_mm: -40.0 },
        RigidBody::Cylinder { radius_mm: 10.0, axis_deg: 30.0 },
        RigidBody::Cylinder { radius_mm: -25.0, axis_deg: 90.0 },
        RigidBody::Edge { radius_mm: 0.5, axis_deg: -20.0, angle_deg: 90.0 },
        RigidBody::Groove { radius_mm: 2.0, axis_deg: 70.0, angle_deg: 120.0 },
        RigidBody::Heights(HeightField::new([81, 81], [0.1; 2], [-4.0; 2], heights).unwrap()),
    ]
}

/// Places within half a millimetre of the surface.
fn places(body: &RigidBody) -> Vec<Vector3<f64>> {
    let raw = (0..60).map(|k| {
        let k = f64::from(k);
        let even = |a: f64| (k * a + 0.3).sin();
        Vector3::new(2.0 * even(78.2), 2.0 * even(31.7), 0.1 * even(11.9))
    });
    raw.map(|p| Vector3::new(p.x, p.y, body.height_mm(p.x, p.y).unwrap() + p.z)).collect()
}

#[test]
fn the_closest_point_lies_on_the_surface_along_the_normal() {
    for body in bodies() {
        body.check().unwrap();
        for place in places(&body) {
            let spot = body.spot(&place);
            let on_surface = body.height_mm(spot.point.x, spot.point.y).unwrap();
            assert!((spot.point.z - on_surface).abs() < 1e-9, "{body:?}: {spot:?}");
            assert!((spot.at_gap(spot.gap_mm) - place).norm() < 1e-9, "{body:?}: {spot:?}");
            assert!((spot.normal.norm() - 1.0).abs() < 1e-12 && spot.normal.z > 0.0);
            assert_eq!(spot.gap_mm > 0.0, place.z > body.height_mm(place.x, place.y).unwrap(), "{body:?} {place}");
            // No other point of the surface nearby is nearer.
            for k in 0..16 {
                let (sin, cos) = (f64::from(k) * std::f64::consts::PI / 8.0).sin_cos();
                let (x, y) = (spot.point.x + 0.02 * cos, spot.point.y + 0.02 * sin);
                let other = Vector3::new(x, y, body.height_mm(x, y).unwrap());
                assert!((other - place).norm() >= spot.gap_mm.abs() - 1e-9, "{body:?}: {spot:?} {other}");
            }
        }
    }
}

#[test]
fn changes_of_gap_and_normal_match_their_derivatives() {
    const H: f64 = 1e-6;
    for body in bodies() {
        for place in places(&body) {
            let spot = body.spot(&place);
            let [s, t] = spot.tangents();
            assert!((s.cross(&t) - spot.normal).norm() < 1e-12);
            for k in 0..3 {
                let step = Vector3::ith(k, H);
                let (up, down) = (body.spot(&(place + step)), body.spot(&(place - step)));
                let slope = (up.gap_mm - down.gap_mm) / (2.0 * H);
                assert!((slope - spot.normal[k]).abs() < 1e-6, "{body:?}: {slope} {spot:?}");
                if up.bend.norm() > 0.0 && down.bend.norm() > 0.0 {
                    let turn = (up.normal - down.normal) / (2.0 * H);
                    assert!((turn - spot.bend.column(k)).norm() < 1e-4, "{body:?}, {k}: {turn} {}", spot.bend);
                }
            }
        }
    }
}

#[test]
fn bodies_that_cannot_be_are_refused() {
    for (body, named) in [
        (RigidBody::Sphere { radius_mm: 0.0 }, "radius_mm"),
        (RigidBody::Sphere { radius_mm: f64::NAN }, "radius_mm"),
        (RigidBody::Cylinder { radius_mm: 1.0, axis_deg: f64::INFINITY }, "axis_deg"),
        (RigidBody::Edge { radius_mm: -1.0, axis_deg: 0.0, angle_deg: 90.0 }, "radius_mm"),
        (RigidBody::Groove { radius_mm: 1.0, axis_deg: 0.0, angle_deg: 180.0 }, "angle_deg"),
    ] {
        let message = body.check().unwrap_err().to_string();
        assert!(message.contains(named), "{message}");
    }
}
