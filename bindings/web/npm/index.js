// A fingertip on a rigid body: friction, stick and slip at each step. One finger is one WebAssembly module with its own memory.

import { BODIES, LAWS, Model, MOTION, WORDS, responseAt } from "./model.js";

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

/** An object that has to be given. */
function given(name, value) {
  if (typeof value !== "object" || value === null) throw new TypeError(`${name} is needed, an object, where ${value} is given`);
  return value;
}

/** A number that an argument names, within its range. */
function within(name, value, low, high) {
  if (!(typeof value === "number" && value >= low && value <= high)) {
    throw new RangeError(`${name}: ${value} is not a number from ${low} to ${high}`);
  }
  return value;
}

/** A module with a pad. */
async function started({ pad, wasm } = {}) {
  const model = await Model.start(wasm ?? (await bytesOf("./fingerpad.wasm")));
  model.load(pad ?? (await bytesOf("./fingertip-pad.fpm")));
  return model;
}

/** A response under its public names. */
function named(r) {
  return {
    normal_force_n: r.normal_n,
    friction_n: [r.friction_x_n, r.friction_y_n],
    friction_limit_n: r.limit_n,
    slip_margin: r.margin,
    slip_margin_relaxed: r.margin_relaxed,
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

export class Finger {
  #model;
  #body = { kind: "plane", radius: 0, axis: 0, angle: 0 };
  #pose = [0, 0];

  /** Starts a finger in the air over a plane in its neutral pose. */
  static async create(files) {
    const finger = new Finger();
    finger.#model = await started(files);
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

  /** Lifts the finger off and gives it tissue that relaxes, or that of the file again. The shares of its branches are assumed. */
  relax(isAssumed) {
    this.#model.relax(isAssumed);
    this.#model.wasm.lift(...this.#pose);
  }

  /** Advances the contact by one step; a number that is not finite leaves its axis where it was and is flagged in `status`. */
  step(motion) {
    const { depth_mm, slide_x_mm = 0, slide_y_mm = 0, spin_rad = 0, dt_s = 1e-3, pitch_deg = this.#pose[0], roll_deg = this.#pose[1], hydration_au = 35, temperature_c = 32, speed_mm_s = 2 } = given("step: a motion", motion);
    this.#pose = [pitch_deg, roll_deg];
    const numbers = [depth_mm, slide_x_mm, slide_y_mm, spin_rad, dt_s, pitch_deg, roll_deg, hydration_au, temperature_c, speed_mm_s];
    if (numbers.some((number) => typeof number !== "number")) throw new TypeError("step: every part of a motion is a number; depth_mm must be given");
    this.#model.motions.set(numbers.slice(0, MOTION));
    this.#model.run(1);
    return named(this.#model.response(0));
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

const ROUND = [["radius_mm", 0, 1], ["half_length_mm", 1, 1]];
/** Shapes in the order of their numbers in the module; of each size its name, its place there and how many numbers it has. */
const SIZES = {
  plane: [],
  sphere: [["radius_mm", 0, 1]],
  ellipsoid: [["semi_axes_mm", 0, 3]],
  capsule: ROUND,
  cylinder: ROUND,
  edge: [["radius_mm", 0, 1], ["angle_deg", 4, 1]],
  cuboid: [["half_mm", 0, 3], ["edge_radius_mm", 3, 1]],
};
/** Kinds of shapes. */
export const SHAPES = Object.keys(SIZES);
/** Words of a response in frames before those of the model. */
const FRAME = 16;

/** The given count of numbers that an argument names. */
function numbersOf(name, values, count) {
  if (!Array.isArray(values) || values.length !== count || values.some((value) => typeof value !== "number")) {
    throw new TypeError(`${name}: ${values} where ${count} numbers are needed`);
  }
  return values;
}

/** The numbers of a shape as the module takes them. */
function sizesOf(shape) {
  if (!SHAPES.includes(shape?.kind)) throw new RangeError(`shape.kind: ${shape?.kind} is none of ${SHAPES.join(", ")}`);
  const sizes = [0, 0, 0, 0, 0];
  for (const [name, place, count] of SIZES[shape.kind]) {
    const [low, high] = name === "angle_deg" ? [1, 179] : [0.1, 1e6];
    const given = count === 1 ? [shape[name]] : numbersOf(`shape.${name}`, shape[name], count);
    given.forEach((size, i) => { sizes[place + i] = within(`shape.${name}`, size, low, high); });
  }
  return sizes;
}

export class FrameContact {
  #model;
  #pose;
  #floats;
  #words;

  /** Starts a finger in the air that is to touch a body of a shape. */
  static async create({ shape, ...files }) {
    const contact = new FrameContact();
    const model = await started(files);
    contact.#model = model;
    const { memory, pose, frame_result } = model.wasm;
    contact.#pose = new Float64Array(memory.buffer, pose(), 7);
    contact.#floats = new Float32Array(memory.buffer, frame_result(), FRAME + WORDS);
    contact.#words = new Uint32Array(memory.buffer, frame_result(), FRAME + WORDS);
    contact.begin(shape);
    return contact;
  }

  /** Ends the contact; the finger is then to touch a body of another shape. */
  begin(shape) {
    this.#pose.set(sizesOf(shape));
    if (this.#model.wasm.set_shape(SHAPES.indexOf(shape.kind)) !== 0) throw new Error(`no ${shape.kind} of these numbers`);
  }

  /** Advances the contact to a pose of the body; one that is not finite or not of unit length is not taken and flagged in `status`. */
  step(placement) {
    const { position_mm, quaternion_wxyz, dt_s = 1e-3, strength_factor = NaN } = given("step: a placement", placement);
    this.#pose.set([...numbersOf("position_mm", position_mm, 3), ...numbersOf("quaternion_wxyz", quaternion_wxyz, 4)]);
    const [dt, strength] = [...numbersOf("dt_s", [dt_s], 1), ...numbersOf("strength_factor", [strength_factor], 1)];
    this.#model.wasm.step_frame(dt, strength);
    const [floats, words] = [this.#floats, this.#words];
    const wrench = (at) => ({ force_n: [...floats.subarray(at, at + 3)], moment_n_mm: [...floats.subarray(at + 3, at + 6)] });
    return {
      on_finger: wrench(0),
      on_body: wrench(6),
      depth_mm: floats[12],
      pitch_deg: floats[13],
      roll_deg: floats[14],
      face: words[15],
      ...named(responseAt(floats, words, FRAME)),
    };
  }
}

export { BODIES, LAWS };
