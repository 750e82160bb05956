// The motion of the body: the position that a hand requests, or a recorded path, with disturbances added.

import { MOTION } from "./model.js";

/** The fixed inner step, s. */
export const STEP_S = 0.001;
/** Time in which the body comes within 37 % of where it is asked to be, s. */
const FOLLOW_S = 0.06;
/** Distances below this are none, mm or degrees. */
const NEAR = 1e-6;
const VIBRATION = { mm: 0.05, hz: 30 };
const AXES = 6;

/** A number of the standard normal distribution (Box and Muller 1958). */
function normal() {
  return Math.sqrt(-2 * Math.log(1 - Math.random())) * Math.cos(2 * Math.PI * Math.random());
}

export class Hand {
  constructor(pitch) {
    /** Depth, slide x, slide y in mm; spin, pitch, roll in degrees. */
    this.at = [-0.3, 0, 0, 0, pitch, 0];
    this.target = [...this.at];
    /** Where the body is since the finger was lifted: its apex along x and y, mm, and its angle, rad. Turns are about the finger. */
    this.body = [0, 0, 0];
    this.skin = { hydration_au: 35, temperature_c: 32, speed_mm_s: 2 };
    this.disturbance = { noise_um: 0, vibrates: false };
    this.walk = null;
    this.time = 0;
  }

  /** Leaves a path and takes over from where the body is. */
  take() {
    this.walk = null;
    this.target = [...this.at];
  }

  /** Goes along a path from its first row, which is no slide. */
  follow(walk) {
    this.walk = walk;
    this.at = walk.next();
    walk.i = 0;
    this.target = [...this.at];
  }

  /** Writes the motion of one step; increments are differences in 64 bits. */
  write(motions, index) {
    const { at, skin, walk } = this;
    let to;
    if (walk && !walk.done) {
      to = walk.next();
    } else {
      const share = 1 - Math.exp(-STEP_S / FOLLOW_S);
      to = at.map((x, i) => (Math.abs(this.target[i] - x) < NEAR ? this.target[i] : x + (this.target[i] - x) * share));
    }
    this.time += STEP_S;
    const speed = walk && !walk.done ? 0 : skin.speed_mm_s;
    const turn = (to[3] - at[3]) * (Math.PI / 180);
    this.carry(to[1] - at[1], to[2] - at[2], turn);
    motions.set([to[0] + this.shake(to[0]), to[1] - at[1], to[2] - at[2], turn, STEP_S, to[4], to[5], skin.hydration_au, skin.temperature_c, speed], index * MOTION);
    for (let i = 0; i < AXES; i++) at[i] = to[i];
    if (walk) this.target = [...at];
  }

  /** Follows the body through a step. */
  carry(dx, dy, turn) {
    const [x, y, angle] = this.body;
    const [c, s, hc, hs] = [Math.cos(turn), Math.sin(turn), Math.cos(turn / 2), Math.sin(turn / 2)];
    this.body = [c * x - s * y + hc * dx - hs * dy, s * x + c * y + hs * dx + hc * dy, angle + turn];
  }

  /** What the disturbances add to a depth, mm; nothing in the air. */
  shake(depth) {
    if (depth <= 0) return 0;
    const { noise_um, vibrates } = this.disturbance;
    const noise = noise_um > 0 ? 0.001 * noise_um * normal() : 0;
    return noise + (vibrates ? VIBRATION.mm * Math.sin(2 * Math.PI * VIBRATION.hz * this.time) : 0);
  }
}
