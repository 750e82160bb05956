//! A haptic renderer at 1 kHz: a hand feels the fingertip through a device that reads 1 um and answers one step late.
//! `cargo run --release -p fingerpad --example haptic`
//!
//! The model itself yields no work. A force that is held over a step and comes one step late does: a little at each press. The
//! renderer books what it gives (the passivity observer of Hannaford and Ryu 2002, IEEE Trans. Robot. Autom. 18:1), and where the
//! books fall below a reserve it brakes by as much. The books are those of the device, with its noise; the example keeps true ones beside.

use fingerpad::frames::RoundBed;
use fingerpad::haptics::{least_damping_n_s_per_m, press_stiffness_n_per_mm};
use fingerpad::{Model, Motion, State, include_fpm, step};

const DT_S: f32 = 1e-3;
/// Most that the brake may do, N s/mm.
const BRAKE_MAX: f32 = 0.01;
/// Energy that the renderer keeps in hand, mJ: what the delay may give away before the brake answers.
const RESERVE_MJ: f32 = 0.15;
/// Half-width of the encoder's noise, mm.
const ENCODER_MM: f32 = 1e-3;
/// What the hand has, t, N/mm and N s/mm.
const MASS_T: f32 = 100e-6;
const MUSCLE_N_MM: f32 = 1.0;
const MUSCLE_N_S_MM: f32 = 1e-3;

/// Depth and slide along x.
type Pair = [f32; 2];

/// The renderer: the position of the hand in, the force on the hand out.
struct Renderer<'a> {
    model: Model<'a>,
    finger: State,
    last_mm: Pair,
    /// The last two forces: the device has just acted with the first of them.
    forces_n: [Pair; 2],
    /// Energy that the hand has given, less what it was given back, mJ.
    books_mj: f32,
    brakes: bool,
}

impl Renderer<'_> {
    fn update(&mut self, at_mm: Pair) -> Pair {
        let way = [at_mm[0] - self.last_mm[0], at_mm[1] - self.last_mm[1]];
        let [acted, coming] = self.forces_n;
        self.books_mj -= acted[0] * way[0] + acted[1] * way[1];
        self.last_mm = at_mm;
        let motion =
            Motion { depth_mm: at_mm[0], slide_increment_mm: [way[1], 0.0], spin_increment_rad: 0.0, dt_s: DT_S };
        let r = step(&self.model, &mut self.finger, motion);
        let mut force = [-r.normal_force_n, -r.friction_n[0]];
        let square = way[0] * way[0] + way[1] * way[1];
        if self.brakes && self.books_mj < RESERVE_MJ && square > 0.0 {
            let brake = ((RESERVE_MJ - self.books_mj) / square).min(BRAKE_MAX / DT_S);
            force = [force[0] - brake * way[0], force[1] - brake * way[1]];
        }
        self.forces_n = [coming, force];
        force
    }
}

/// What a session came to.
#[derive(Debug)]
struct Session {
    /// Least of the true books at any time, mJ: below 0 the hand was given energy from nothing.
    least_mj: f64,
    /// Energy exchanged in both directions, mJ.
    turnover_mj: f64,
    largest_n: f32,
}

/// Ten seconds of quick presses with small slides.
fn session(model: &Model<'_>, brakes: bool) -> Session {
    let mut renderer = Renderer {
        model: *model,
        finger: State::default(),
        last_mm: [-0.5, 0.0],
        forces_n: [[0.0; 2]; 2],
        books_mj: 0.0,
        brakes,
    };
    let (mut place, mut speed, mut late) = ([-0.5f32, 0.0], [0.0f32; 2], [0.0f32; 2]);
    let mut seed = 9u32;
    let mut noise = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / (1 << 23) as f32 - 1.0
    };
    let mut s = Session { least_mj: 0.0, turnover_mj: 0.0, largest_n: 0.0 };
    let mut books = 0.0;
    for i in 0..10_000 {
        let time = i as f32 * DT_S;
        let wanted = [0.4 + 0.9 * (25.0 * time).sin(), 0.02 * (11.0 * time).sin()];
        let force = renderer.update(place.map(|x| x + ENCODER_MM * noise()));
        // One step late, then held for a step.
        let felt = core::mem::replace(&mut late, force);
        let before = place;
        for k in 0..2 {
            let muscle = MUSCLE_N_MM * (wanted[k] - place[k]) - MUSCLE_N_S_MM * speed[k];
            speed[k] += (muscle + felt[k]) / MASS_T * DT_S;
            place[k] += speed[k] * DT_S;
            let given = f64::from(felt[k]) * f64::from(place[k] - before[k]);
            books -= given;
            s.turnover_mj += given.abs();
            s.largest_n = s.largest_n.max(felt[k].abs());
        }
        s.least_mj = s.least_mj.min(books);
    }
    s
}

/// The shipped model of an index finger.
fn shipped() -> Result<Model<'static>, fingerpad::Error> {
    Model::from_bytes(include_fpm!("../tests/data/fingertip.fpm"))
}

fn both() -> Result<[Session; 2], fingerpad::Error> {
    let model = shipped()?;
    Ok([false, true].map(|brakes| session(&model, brakes)))
}

fn main() -> Result<(), fingerpad::Error> {
    let bed = RoundBed::new(shipped()?);
    for depth_mm in [1.0, 2.0] {
        let stiffness = press_stiffness_n_per_mm::<State, _>(&bed, depth_mm)?;
        let least = [0, 1].map(|late| least_damping_n_s_per_m(stiffness, DT_S, late));
        println!(
            "at {depth_mm} mm: {stiffness:.2} N/mm; a hand held directly on it needs {:.2} N s/m, {:.2} N s/m where the force comes a sample late",
            least[0], least[1]
        );
    }
    let [plain, braked] = both()?;
    println!("model alone: {plain:?}");
    println!("with the brake: {braked:?}");
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_hand_is_given_no_energy() {
        let [plain, braked] = super::both().unwrap();
        // What the brake cannot see: the noise of the encoder and the step by which it is late.
        assert!(braked.least_mj > -2e-3, "{braked:?}");
        assert!(plain.least_mj < 10.0 * braked.least_mj.min(-1e-3), "{plain:?} {braked:?}");
        assert!(braked.turnover_mj > 1.0 && braked.largest_n < 5.0, "{braked:?}");
    }
}
