// A fingertip on a rigid body: friction, stick and slip at each step. One finger is one WebAssembly module with its own memory.

import { BODIES, LAWS, Model, MOTION } from "./model.js";

/** Regimes by their numbers in a response. */
export const REGIMES = ["no_contact", "stick", "partial_slip", "slip"];

/** Bytes of a file of the package, in a browser or in Node.js. */
async function bytesOf(name) {
  const url = new URL(name, import.meta.url);
  if (url.protocol !== "file:") {
    const answer = await fetch(url);
    if (!answer.ok) throw new Error(`${url}: ${answer.status} ${answer.statusText}`);
    return new Uint8Array(await answer.arrayBuffer());
  }
  const { readFile } = await import("node:fs/promises");
  return new Uint8Array(await readFile(url));
}

/** A number that an argument names, within its range. */
function within(name, value, low, high) {
  if (!(typeof value === "number" && value >= low && value <= high)) {
    throw new RangeError(`${name}: ${value} is not a number from ${low} to ${high}`);
  }
  return value;
}

export class Finger {
  #model;
  #body = { kind: "plane", radius: 0, axis: 0, angle: 0 };
  #pose = [0, 0];

  /** Starts a finger in the air over a plane in its neutral pose. */
  static async create({ pad, wasm } = {}) {
    const finger = new Finger();
    finger.#model = await Model.start(wasm ?? (await bytesOf("./fingerpad.wasm")));
    finger.#model.load(pad ?? (await bytesOf("./fingertip-pad.fpm")));
    finger.lift();
    return finger;
  }

  /** Largest depth, mm, and ranges of pitch and roll, degrees, for which the pad was fitted. */
  get range() {
    const { depthMax, pitchLow, pitchHigh, rollMax, pitch } = this.#model;
    return { depth_max_mm: depthMax, pitch_deg: [pitchLow, pitchHigh], roll_deg: [-rollMax, rollMax], neutral_pitch_deg: pitch };
  }

  /** Lifts the finger off, over a body in a pose. It forgets its contact. */
  lift({ body = { kind: "plane" }, pitch_deg = this.#model.pitch, roll_deg = 0 } = {}) {
    const { kind, radius_mm = 0, axis_deg = 0, angle_deg = 90 } = body;
    if (!BODIES.includes(kind)) throw new RangeError(`body.kind: ${kind} is none of ${BODIES.join(", ")}`);
    if (kind !== "plane") {
      within("body.radius_mm", radius_mm, 0.1, 1e6);
      within("body.axis_deg", axis_deg, -180, 180);
      within("body.angle_deg", angle_deg, 1, 179);
    }
    const { range } = this;
    within("pitch_deg", pitch_deg, ...range.pitch_deg);
    within("roll_deg", roll_deg, ...range.roll_deg);
    this.#body = { kind, radius: radius_mm, axis: axis_deg, angle: angle_deg };
    this.#pose = [pitch_deg, roll_deg];
    this.#model.touch(this.#body);
    this.#model.wasm.lift(pitch_deg, roll_deg);
  }

  /** Advances the contact by one step; a number that is not finite leaves its axis where it was and is flagged in `status`. */
  step({ depth_mm, slide_x_mm = 0, slide_y_mm = 0, spin_rad = 0, dt_s = 1e-3, pitch_deg = this.#pose[0], roll_deg = this.#pose[1], hydration_au = 35, temperature_c = 32, speed_mm_s = 2 }) {
    this.#pose = [pitch_deg, roll_deg];
    const motion = [depth_mm, slide_x_mm, slide_y_mm, spin_rad, dt_s, pitch_deg, roll_deg, hydration_au, temperature_c, speed_mm_s];
    if (motion.some((number) => typeof number !== "number")) throw new TypeError("step: every part of a motion is a number; depth_mm must be given");
    this.#model.motions.set(motion.slice(0, MOTION));
    this.#model.run(1);
    const r = this.#model.response(0);
    return {
      normal_force_n: r.normal_n,
      friction_n: [r.friction_x_n, r.friction_y_n],
      friction_limit_n: r.limit_n,
      slip_margin: r.margin,
      stick_ratio: r.stick_ratio,
      spin_moment_n_mm: r.moment_n_mm,
      pressure_centre_mm: [r.pressure_x_mm, r.pressure_y_mm],
      contact_area_mm2: r.area_mm2,
      band_normal_n: r.band_normal_n,
      band_friction_n: r.band_friction_n,
      regime: REGIMES[r.regime],
      status: r.status,
    };
  }

  /** The patches of skin that touch after the last step. */
  patches() {
    return this.#model.patches().map((p) => ({
      place_mm: [p.x, p.y],
      pressure_mpa: p.kpa / 1000,
      traction_mpa: [p.tx, p.ty],
      stick_ratio: p.stick,
      contact_area_mm2: Math.PI * p.radius ** 2,
    }));
  }
}

export { BODIES, LAWS };
