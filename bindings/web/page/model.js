// The model: a WebAssembly module that holds the file, the contact and its own memory.

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
  "centre_x_mm",
  "centre_y_mm",
  "stretch_x_mm",
  "stretch_y_mm",
  "regime",
  "status",
];
const WORDS = RESPONSE.length;
export const LAWS = { moisture: 1, speed: 2, temperature: 17 };

const FIELDS = "DepthMax NormalForce ContactArea FrictionLimit TangentialStiffness StiffnessSlope StiffnessShare StiffnessRatio StrengthRatio YieldSlide AreaShare Sharpness SpringArm SpinLimit SpinCross PressureCentre PressCoupling TiltX OddStiffness AreaTilt BandNormal BandFriction BandSlip PressureExponent Pose Size Stiffness Lambda Tau0 EffectValue State TableValue".split(" ");

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
  }

  /** Uses a model file from now on. Throws in plain words if it is none; the one in use then stays. */
  load(bytes) {
    const { wasm } = this;
    if (bytes.length > wasm.incoming_bytes()) {
      throw new Error(`${bytes.length} bytes; model files have at most ${wasm.incoming_bytes()}`);
    }
    new Uint8Array(wasm.memory.buffer, wasm.incoming(), bytes.length).set(bytes);
    if (wasm.load(bytes.length) !== 0) throw new Error(this.refusal());
    this.depthMax = wasm.depth_max_mm();
    this.pitch = wasm.fitted_pitch_deg();
    this.cross = wasm.spin_cross();
    this.poses = wasm.knows_poses() === 1;
  }

  /** The reason for which the last file was refused, as the core puts it. */
  refusal() {
    const words = new Uint32Array(this.wasm.memory.buffer, this.wasm.refusal(), 5);
    const floats = new Float32Array(words.buffer, words.byteOffset, 5);
    const [reason, a, b] = words;
    const field = FIELDS[a];
    switch (reason) {
      case 1: return "not a model file (it does not start with FPM1)";
      case 2: return `format version ${a}; this library reads version ${b}`;
      case 3: return `${b} bytes where ${a} are expected`;
      case 4: return "checksum wrong: the file is damaged";
      case 6: return `made for ${a} springs and ${b} table nodes, which is not what is used here`;
      case 7: return `section ${String.fromCharCode(a & 255, (a >> 8) & 255, (a >> 16) & 255, a >>> 24)} is missing or not understood`;
      case 8: return `${field}[${b}] = ${number(floats[3])} is out of range`;
      case 9: return `${field} falls at [${b}]`;
      case 10: return `${field} in cell ${b} could create energy: ${number(floats[3])} where ${number(floats[4])} is allowed`;
      default: return `refused for reason ${reason}`;
    }
  }

  /** Advances a contact by the motions that were written; at most `most` at once. */
  run(contact, count) {
    return this.wasm.run(contact, count);
  }

  /** One response as an object. */
  response(index) {
    const at = index * WORDS;
    const r = {};
    RESPONSE.forEach((name, i) => { r[name] = i < WORDS - 2 ? this.floats[at + i] : this.words[at + i]; });
    return r;
  }

  /** Where a law's size comes from: 2 the file, 1 typical, 0 not there. */
  origin(kind) {
    return this.wasm.law_origin(kind);
  }

  value(kind, index) {
    return this.wasm.law_value(kind, index);
  }
}

/** The shortest decimal number with these 32 bits. */
function number(x) {
  for (let digits = 1; digits < 9; digits++) {
    const text = x.toPrecision(digits);
    if (Math.fround(text) === x) return String(Number(text));
  }
  return Number.isFinite(x) ? String(x) : Number.isNaN(x) ? "NaN" : x > 0 ? "inf" : "-inf";
}
