// The pad: a WebAssembly module that holds the file, the body, the contact and its own memory.

/** Numbers of a motion: depth, slide x, y in mm, spin in rad, dt in s, pitch, roll in degrees, moisture, temperature, speed. */
export const MOTION = 10;
/** Numbers of a response in the order in which the module writes them; the last two are whole. */
const RESPONSE = [
  "normal_n",
  "friction_x_n",
  "friction_y_n",
  "stick_ratio",
  "limit_n",
  "margin",
  "moment_n_mm",
  "pressure_x_mm",
  "pressure_y_mm",
  "area_mm2",
  "band_normal_n",
  "band_friction_n",
  "margin_relaxed",
  "regime",
  "status",
];
export const WORDS = RESPONSE.length;
/** Numbers of a patch: place x, y, z, pressure, traction x, y, area in contact, stick ratio, used share of the strength. */
const PATCH = 9;
export const LAWS = { moisture: 1, speed: 2, temperature: 17 };
/** Bodies by their numbers in the module. */
export const BODIES = ["plane", "sphere", "cylinder", "edge"];

const FIELDS = "DepthMax NormalForce ContactArea FrictionLimit TangentialStiffness StiffnessSlope StiffnessShare StiffnessRatio StrengthRatio YieldSlide AreaShare Sharpness SpringArm SpinLimit SpinCross SlipLead PressureCentre Radius Axis FaceAngle PressCoupling TiltX OddStiffness AreaTilt BandNormal BandFriction BandSlip PressureExponent Pose Size Stiffness Lambda EffectValue State PatchArea PatchPlace PatchCompliance BulkMode BulkStiffness BulkStiffening Flattening FirstTouch Lift TableValue Observer RelaxationShare RelaxationTime Orthotropy".split(" ");

export class Model {
  /** Starts the module from its bytes. */
  static async start(bytes) {
    const { instance } = await WebAssembly.instantiate(bytes, {});
    return new Model(instance.exports);
  }

  constructor(wasm) {
    this.wasm = wasm;
    this.most = wasm.most_steps();
    const memory = wasm.memory.buffer;
    this.motions = new Float32Array(memory, wasm.motions(), MOTION * this.most);
    this.floats = new Float32Array(memory, wasm.results(), WORDS * this.most);
    this.words = new Uint32Array(memory, wasm.results(), WORDS * this.most);
    this.patchStates = new Float32Array(memory, wasm.patch_states(), PATCH * 64);
  }

  /** Uses a pad's model file from now on. Throws in plain words if it is none; the one in use then stays. */
  load(bytes) {
    const { wasm } = this;
    if (bytes.length > wasm.incoming_bytes()) {
      throw new Error(`${bytes.length} bytes; model files have at most ${wasm.incoming_bytes()}`);
    }
    new Uint8Array(wasm.memory.buffer, wasm.incoming(), bytes.length).set(bytes);
    if (wasm.load(bytes.length) !== 0) throw new Error(this.refusal());
    [this.depthMax, this.pitchLow, this.pitchHigh, this.rollMax, this.pitch] = [0, 1, 2, 3, 4].map((i) => wasm.fitted(i));
    this.areas = Array.from({ length: wasm.patches() }, (_, i) => wasm.patch_area_mm2(i));
  }

  /** The reason for which the last file was refused, as the core puts it. */
  refusal() {
    const words = new Uint32Array(this.wasm.memory.buffer, this.wasm.refusal(), 5);
    const floats = new Float32Array(words.buffer, words.byteOffset, 5);
    const [reason, a, b] = words;
    switch (reason) {
      case 1: return "not a model file (it does not start with FPM1)";
      case 2: return `format version ${a}; this library reads version ${b}`;
      case 3: return `${b} bytes where ${a} are expected`;
      case 4: return "checksum wrong: the file is damaged";
      case 6: return b === 0 ? `a pad of ${a} modes, which is not what is used here` : `${a} patches; at most ${b} are used here`;
      case 7: return section(a);
      case 8: return `${FIELDS[a]}[${b}] = ${number(floats[3])} is out of range`;
      default: return `refused for reason ${reason}`;
    }
  }

  /** Puts a body under the finger, which must be lifted then. */
  touch({ kind, radius, axis, angle }) {
    if (this.wasm.set_body(BODIES.indexOf(kind), radius, axis, angle) !== 0) throw new Error(`no ${kind} of these numbers`);
  }

  /** Gives the finger tissue that relaxes, with assumed shares; or that of the file. It must be lifted then. */
  relax(isAssumed) {
    this.wasm.relax(isAssumed ? 1 : 0);
  }

  /** Advances the finger by the motions that were written; at most `most` at once. */
  run(count) {
    return this.wasm.run(count);
  }

  /** One response as an object. */
  response(index) {
    return responseAt(this.floats, this.words, index * WORDS);
  }

  /** The patches that touch after the last step: place, radius of their own area and of the area in contact in mm, pressure in kPa. */
  patches() {
    const count = this.wasm.look();
    const found = [];
    for (let i = 0; i < count; i++) {
      const [x, y, , mpa, tx, ty, area, stick, used] = this.patchStates.subarray(PATCH * i, PATCH * (i + 1));
      if (area > 0) found.push({ x, y, kpa: 1000 * mpa, tx, ty, stick, used, radius: Math.sqrt(area / Math.PI), own: Math.sqrt(this.areas[i] / Math.PI) });
    }
    return found;
  }

  value(kind, index) {
    return this.wasm.law_value(kind, index);
  }
}

/** The response that begins at a word. */
export function responseAt(floats, words, at) {
  return Object.fromEntries(RESPONSE.map((name, i) => [name, (i < WORDS - 2 ? floats : words)[at + i]]));
}

/** What is said of a file without a section. */
function section(word) {
  const name = String.fromCharCode(word & 255, (word >> 8) & 255, (word >> 16) & 255, word >>> 24);
  return name === "PADN" ? "a bed of springs; this page takes pads" : `section ${name} is missing or not understood`;
}

/** The shortest decimal number with these 32 bits. */
function number(x) {
  for (let digits = 1; digits < 9; digits++) {
    const text = x.toPrecision(digits);
    if (Math.fround(text) === x) return String(Number(text));
  }
  return Number.isFinite(x) ? String(x) : Number.isNaN(x) ? "NaN" : x > 0 ? "inf" : "-inf";
}
