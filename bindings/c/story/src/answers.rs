//! What the core answers to a story.

use bytemuck::Pod;
use fingerpad::effects::Effects;
use fingerpad::events::{Queue, Watch};
use fingerpad::frames::{FrameContact, RoundBed, Shape};
use fingerpad::host::{ModelFile, PadModelFile};
use fingerpad::{
    Contact, Drive, Driven, Error, File, ForceResponse, ForceState, Gradient, Memory, Model, Motion, Normal,
    Relaxation, RelaxingState, Response, SPRINGS, SpinState, State, StateOf, Surroundings, Tangential, Tuning,
};

use crate::pad::{TellsPad, pose, range, shape_of, teller};
use crate::requests::{Request, words};

/// Code of a value out of range, as in `fingerpad.h`.
pub const RANGE: u32 = 8;

/// The core with everything that a story changes.
pub struct Teller<'a> {
    files: &'a [ModelFile; 2],
    file: File<'a>,
    model: Model<'a>,
    plain: State,
    spin: SpinState,
    force_state: ForceState,
    contact: Contact<SPRINGS>,
    around: Surroundings,
    watch: Watch,
    /// The first model with tissue that relaxes.
    soft: Model<'a>,
    soft_plain: RelaxingState<1>,
    soft_spin: RelaxingState<2>,
    framed: (FrameContact<SpinState>, FrameContact<RelaxingState<2>>),
    pads: &'a [PadModelFile],
    pad: Box<dyn TellsPad + 'a>,
}

impl<'a> Teller<'a> {
    pub fn new(files: &'a [ModelFile; 2], pads: &'a [PadModelFile]) -> Self {
        let file = files[0].file();
        Self {
            files,
            file,
            model: file.model,
            plain: State::default(),
            spin: SpinState::default(),
            force_state: ForceState::default(),
            contact: Contact::default(),
            around: Surroundings::default(),
            watch: Watch::new(0),
            soft: soft(files),
            soft_plain: RelaxingState::relaxing(),
            soft_spin: RelaxingState::relaxing(),
            framed: framed(&file.model, &soft(files), Shape::plane()).expect("a bed touches planes"),
            pads,
            pad: teller(&pads[0]),
        }
    }

    /// The answer to one request, as a line.
    pub fn answer(&mut self, request: &Request) -> String {
        match *request {
            Request::Model(k) => {
                let (files, pads) = (self.files, self.pads);
                let file = files[k].file();
                *self = Self { file, watch: Watch::new(k as u8), around: reference(&file), ..Self::new(files, pads) };
                self.tune(Tuning::default())
            }
            Request::Tune([size, stiffness, lambda]) => self.tune(Tuning { size, stiffness, lambda }),
            Request::Factor(factor) => self.factor(factor),
            Request::Around(
                [hydration_au, temperature_c, finger_width_mm, series_s, dwell, occlusion, speed, own @ ..],
            ) => {
                let given = |x: f32| (!x.is_nan()).then_some(x);
                let [dwell_s, occlusion_s, speed_mm_s] = [dwell, occlusion, speed].map(given);
                self.around = Surroundings {
                    hydration_au,
                    temperature_c,
                    finger_width_mm,
                    series_s,
                    dwell_s,
                    occlusion_s,
                    speed_mm_s,
                    own,
                };
                "0".to_owned()
            }
            Request::Step([depth_mm, x, y, spin_increment_rad, dt_s]) => {
                self.step(Motion { depth_mm, slide_increment_mm: [x, y], spin_increment_rad, dt_s })
            }
            Request::Driven { by_normal_force, by_friction, numbers } => {
                self.driven(drive(by_normal_force, by_friction, numbers))
            }
            Request::Gradient(direction) => {
                let (plain, spin) = (&self.plain, &self.spin);
                let (soft_plain, soft_spin) = (&self.soft_plain, &self.soft_spin);
                let all = [
                    self.model.gradient(plain, direction),
                    self.model.gradient(spin, direction),
                    self.soft.gradient(soft_plain, direction),
                    self.soft.gradient(soft_spin, direction),
                ];
                all.iter().map(derivatives).collect()
            }
            Request::Grip([x, y, margin, factor]) => {
                let grip = self.model.least_grip([x, y], margin, factor);
                format!("{} {:x}", words(&[grip.depth_mm, grip.normal_force_n]), grip.status.0)
            }
            Request::BedShape { kind, numbers } => {
                let begun = shape_of(kind, numbers).and_then(|shape| framed(&self.model, &self.soft, shape));
                range(begun.map(|begun| self.framed = begun).is_some())
            }
            Request::BedPose(numbers) => {
                let (prompt, soft) = &mut self.framed;
                pose(prompt, &RoundBed::new(self.model), numbers) + &pose(soft, &RoundBed::new(self.soft), numbers)
            }
            Request::Save => self.save(),
            Request::PadWords { .. } => "0".to_owned(),
            Request::PadLoad(k) => {
                self.pad = teller(&self.pads[k]);
                self.pad.patch_count().to_string()
            }
            Request::Pad(tuning) => self.pad.tune(tuning),
            Request::Body { kind, numbers } => self.pad.begin(kind, numbers),
            Request::PadFactor(factor) => self.pad.factor(factor),
            Request::PadStep(numbers) => self.pad.step(numbers),
            Request::Patches => self.pad.patches(),
            Request::Shape { kind, numbers } => self.pad.shape(kind, numbers),
            Request::Pose(numbers) => self.pad.pose(numbers),
            Request::PadSave => self.pad.save(),
        }
    }

    fn tune(&mut self, tuning: Tuning) -> String {
        match self.file.model.tuned(tuning) {
            Ok(tuned) => {
                self.model = tuned;
                self.soft = soft(self.files).tuned(tuning).expect("the same factors");
                "0".to_owned()
            }
            Err(Error::Range { .. }) => RANGE.to_string(),
            Err(other) => other.to_string(),
        }
    }

    fn factor(&mut self, factor: f32) -> String {
        if !(0.1..=5.0).contains(&factor) {
            return RANGE.to_string();
        }
        self.plain.set_strength_factor(factor);
        self.spin.set_strength_factor(factor);
        self.soft_plain.set_strength_factor(factor);
        self.soft_spin.set_strength_factor(factor);
        self.force_state.set_strength_factor(factor);
        self.contact.state.set_strength_factor(factor);
        "0".to_owned()
    }

    fn step(&mut self, motion: Motion) -> String {
        let effects = Effects::of_file(&self.file).expect("the story's files have known effects");
        let (plain, spin, contact) = (&mut self.plain, &mut self.spin, &mut self.contact);
        let [one, two, three] = [
            self.model.step(plain, motion),
            self.model.step(spin, motion),
            effects.step(&self.model, contact, self.around, motion),
        ];
        let mut queue: Queue<4> = Queue::new();
        let (mut producer, mut consumer) = queue.split();
        self.watch.look(&one, &mut producer);
        let events: String = std::iter::from_fn(|| consumer.dequeue())
            .map(|event| format!(" @{} {} {}", event.tick, event.finger, event.change as u8))
            .collect();
        let reading =
            words(&effects.reading(&three)) + &words(&effects.reading_under(&three, &self.contact, &self.around));
        let alone = forces_alone(&self.model.step_forces(&mut self.force_state, motion));
        let soft = [self.soft.step(&mut self.soft_plain, motion), self.soft.step(&mut self.soft_spin, motion)];
        let soft: String = soft.iter().map(forces).collect();
        format!("{}{}{}{alone}{soft}{reading}{events}", forces(&one), forces(&two), forces(&three))
    }

    fn driven(&mut self, drive: Drive) -> String {
        let (plain, spin) = (&mut self.plain, &mut self.spin);
        let all = [
            self.model.step_driven(plain, drive),
            self.model.step_driven(spin, drive),
            self.soft.step_driven(&mut self.soft_plain, drive),
            self.soft.step_driven(&mut self.soft_spin, drive),
        ];
        all.iter().map(|Driven { response, motion }| forces(response) + &moved(motion)).collect()
    }

    fn save(&mut self) -> String {
        let model = self.file.model.data().checksum();
        let mut says = String::new();
        saved(model, &mut self.plain, &mut says);
        saved(model, &mut self.spin, &mut says);
        saved(self.soft.checksum(), &mut self.soft_plain, &mut says);
        saved(self.soft.checksum(), &mut self.soft_spin, &mut says);
        says
    }
}

/// The reference state of a model: columns of the user's own as they were in the calibration.
pub fn reference(file: &File<'_>) -> Surroundings {
    let mut out = Surroundings::default();
    out.own.iter_mut().zip(file.columns).for_each(|(to, column)| *to = column.reference);
    out
}

/// Contacts of two beds in frames, if they can touch such a shape.
fn framed(
    model: &Model<'_>,
    soft: &Model<'_>,
    shape: Shape,
) -> Option<(FrameContact<SpinState>, FrameContact<RelaxingState<2>>)> {
    let [model, soft] = [model, soft].map(|model| RoundBed::new(*model));
    Some((FrameContact::new(&model, shape).ok()?, FrameContact::new(&soft, shape).ok()?))
}

fn soft<'a>(files: &'a [ModelFile; 2]) -> Model<'a> {
    files[0].file().model.with_relaxation(&Relaxation::HUMAN_ASSUMED).expect("the bed that ships may relax")
}

fn saved<const P: usize, R: Memory<SPRINGS, P, f32> + Pod>(
    model: u32,
    state: &mut StateOf<SPRINGS, P, f32, R>,
    says: &mut String,
) {
    let mut bytes = vec![0; StateOf::<SPRINGS, P, f32, R>::SAVED_BYTES];
    state.write_bytes(model, &mut bytes).expect("the buffer has that length");
    *state = StateOf::read_bytes(model, &bytes).expect("what was written can be read");
    says.push(' ');
    says.extend(bytes.iter().map(|byte| format!("{byte:02x}")));
}

fn drive(by_normal_force: bool, by_friction: bool, numbers: [f32; 8]) -> Drive {
    let [depth_mm, normal_n, x_mm, y_mm, x_n, y_n, spin_increment_rad, dt_s] = numbers;
    Drive {
        normal: if by_normal_force { Normal::ForceN(normal_n) } else { Normal::DepthMm(depth_mm) },
        tangential: if by_friction {
            Tangential::FrictionN([x_n, y_n])
        } else {
            Tangential::SlideIncrementMm([x_mm, y_mm])
        },
        spin_increment_rad,
        dt_s,
    }
}

/// All numbers of a response.
pub fn forces(r: &Response) -> String {
    let numbers = [
        r.normal_force_n,
        r.friction_n[0],
        r.friction_n[1],
        r.tangential_friction_n[0],
        r.tangential_friction_n[1],
        r.stick_ratio,
        r.friction_limit_n,
        r.slip_margin,
        r.slip_margin_relaxed,
        r.spin_moment_n_mm,
        r.tilt_moment_n_mm[0],
        r.tilt_moment_n_mm[1],
        r.pressure_centre_mm[0],
        r.pressure_centre_mm[1],
        r.contact_area_mm2,
        r.band_normal_n,
        r.band_friction_n,
    ];
    format!("{} {} {:x}", words(&numbers), r.regime as u8, r.status.0)
}

fn forces_alone(r: &ForceResponse) -> String {
    let ([x, y], [centre_x, centre_y]) = (r.friction_n, r.pressure_centre_mm);
    let (limit, margin, moment) = (r.friction_limit_n, r.slip_margin, r.spin_moment_n_mm);
    let numbers = [r.normal_force_n, x, y, limit, margin, moment, centre_x, centre_y, r.contact_area_mm2];
    format!("{} {:x}", words(&numbers), r.status.0)
}

fn moved(motion: &Motion) -> String {
    let [x, y] = motion.slide_increment_mm;
    words(&[motion.depth_mm, x, y, motion.spin_increment_rad, motion.dt_s])
}

fn derivatives(gradient: &Gradient) -> String {
    let [x, y] = &gradient.friction_n_mm;
    words(&gradient.normal_n_mm) + &words(x) + &words(y)
}
