//! Stability of a law in Drucker's sense.

use wide::f64x8;

use super::Hyperelastic;

/// Principal stretches between which a law must be stable.
pub const STABLE_STRETCHES: [f64; 2] = [0.5, 2.0];

/// Steps of the logarithmic stretch from 1 to the bound.
const STEPS: i32 = 40;

/// The mildest isochoric deformation, as principal stretches in falling order, at which the law loses Drucker's
/// stability (Drucker 1959); None if it is stable wherever all stretches lie within [`STABLE_STRETCHES`].
///
/// A law is stable if its stress does positive work on every further isochoric strain, `d tau : d eps > 0`, with
/// Kirchhoff stress and logarithmic strain: d tau_A/d eps_B = c_AABB + 2 tau_A (A = B) is positive definite on strains
/// without trace. Examined on a grid of `ln l_1`, `ln l_2` in steps of 1/40 of the bound.
pub fn first_instability(law: &impl Hyperelastic) -> Option<[f64; 3]> {
    let mut states = isochoric_states();
    states.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    states.chunks(8).find_map(|states| {
        let lane = |k: usize| states[k.min(states.len() - 1)];
        let squares = [0, 1, 2].map(|a| f64x8::new(std::array::from_fn(|k| lane(k)[a].powi(2))));
        let [x, y, z] = squares;
        let moduli = law.moduli(&[x, y, z, f64x8::ZERO, f64x8::ZERO, f64x8::ZERO], f64x8::ONE);
        let tau = moduli.tau.map(f64x8::to_array);
        let c = moduli.c.map(|row| row.map(f64x8::to_array));
        let stable = |k: usize| {
            let slope = |a: usize, b: usize| c[a][b][k] + if a == b { 2.0 * tau[a][k] } else { 0.0 };
            // Along the traceless strains (1, −1, 0) and (1, 1, −2), not normalised.
            let quadratic = |p: [f64; 3], q: [f64; 3]| -> f64 {
                (0..3).map(|a| (0..3).map(|b| p[a] * slope(a, b) * q[b]).sum::<f64>()).sum()
            };
            let (p, q) = ([1.0, -1.0, 0.0], [1.0, 1.0, -2.0]);
            let (pp, qq, pq) = (quadratic(p, p), quadratic(q, q), quadratic(p, q));
            pp > 0.0 && qq > 0.0 && pp * qq > pq * pq
        };
        (0..states.len()).find(|&k| !stable(k)).map(|k| states[k])
    })
}

/// Isochoric stretches in falling order on a logarithmic grid within the bounds.
fn isochoric_states() -> Vec<[f64; 3]> {
    let step = STABLE_STRETCHES[1].ln() / f64::from(STEPS);
    let mut states = Vec::new();
    for first in 0..=STEPS {
        for second in -STEPS..=first {
            let third = -first - second;
            if third <= second && third >= -STEPS {
                states.push([first, second, third].map(|n| (step * f64::from(n)).exp()));
            }
        }
    }
    states
}

/// Length of the logarithmic strain.
fn distance(stretches: &[f64; 3]) -> f64 {
    stretches.iter().map(|l| l.ln().powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::{MooneyRivlin, NeoHooke, Ogden, OgdenSeries, OgdenTerm, Yeoh};
    use super::*;

    #[test]
    fn laws_that_stiffen_are_stable() {
        let d_per_mpa = 1.0;
        assert_eq!(first_instability(&NeoHooke { mu_mpa: 0.3, d_per_mpa }), None);
        assert_eq!(first_instability(&MooneyRivlin { c10_mpa: 0.2, c01_mpa: 0.05, d_per_mpa }), None);
        assert_eq!(first_instability(&Yeoh { c10_mpa: 0.2, c20_mpa: -0.002, c30_mpa: 1e-4, d_per_mpa }), None);
        for alpha in [-9.0, -1.0, 0.1, 1.4, 25.0] {
            assert_eq!(first_instability(&Ogden { mu_mpa: 0.03, alpha, d_per_mpa }), None);
        }
        // Ogden 1972 for Treloar's rubber: m = 0.63, 0.0012, −0.01 MPa, mu = m alpha/2.
        let terms =
            [(0.63, 1.3), (0.0012, 5.0), (-0.01, -2.0)].map(|(m, alpha)| OgdenTerm { mu_mpa: m * alpha / 2.0, alpha });
        assert_eq!(first_instability(&OgdenSeries::new(&terms, d_per_mpa).unwrap()), None);
    }

    #[test]
    fn a_yeoh_law_that_softens_loses_stability_where_its_stress_in_pure_shear_falls() {
        let law = Yeoh { c10_mpa: 0.2, c20_mpa: -0.04, c30_mpa: 0.0, d_per_mpa: 1.0 };
        let found = first_instability(&law).unwrap();
        // Along pure shear l, 1, 1/l the stress tau_1 − tau_3 = 2 W' (l² − 1/l²), W' = C10 + 2 C20 (l² + 1/l² − 2), turns
        // at some l; no state milder is unstable.
        let difference = |e: f64| {
            let (l, s) = ((2.0 * e).exp(), (-2.0 * e).exp());
            2.0 * (0.2 - 0.08 * (l + s - 2.0)) * (l - s)
        };
        let turn = (1..1000).map(|n| 1e-3 * f64::from(n)).find(|e| difference(e + 1e-3) < difference(*e)).unwrap();
        let length = 2f64.sqrt() * turn;
        let step = 2f64.ln() / 40.0;
        assert!((distance(&found) - length).abs() < 2.0 * step, "{found:?} {} {length}", distance(&found));
    }

    #[test]
    fn a_negative_second_invariant_is_unstable_across_a_pulled_bar() {
        let law = MooneyRivlin { c10_mpa: 0.2, c01_mpa: -0.1, d_per_mpa: 1.0 };
        // d tau : d eps = 4 sum_A (C10 l_A² + C01/l_A²) d eps_A²: across a bar pulled to l, where l_A² = 1/l, it falls
        // to nothing at l² = −C10/C01 = 2.
        let [first, second, third] = first_instability(&law).unwrap();
        let close = |l: f64, exact: f64| (l / exact).ln().abs() < 2f64.ln() / 39.0;
        assert!(close(first, 2f64.sqrt()), "{first}");
        assert!(close(second, 0.5f64.powf(0.25)) && close(third, 0.5f64.powf(0.25)), "{second} {third}");
        assert!(first_instability(&NeoHooke { mu_mpa: -0.1, d_per_mpa: 1.0 }) == Some([1.0; 3]));
    }
}
