/** Kinds of rigid bodies. */
export const BODIES: readonly ["plane", "sphere", "cylinder", "edge"];
/** Regimes of a contact. */
export const REGIMES: readonly ["no_contact", "stick", "partial_slip", "slip"];
/** Numbers of the laws of the skin in a model file. */
export const LAWS: { readonly moisture: number; readonly speed: number; readonly temperature: number };

export type Body =
  | { kind: "plane" }
  /** Radius of a sphere, mm. */
  | { kind: "sphere"; radius_mm: number }
  /** Radius of a cylinder, mm, and direction of its axis from x, degrees. */
  | { kind: "cylinder"; radius_mm: number; axis_deg?: number }
  /** Radius of the rounding, mm, direction of the edge from x and angle between the faces inside the body, degrees. */
  | { kind: "edge"; radius_mm: number; axis_deg?: number; angle_deg?: number };

/** One step: x along the finger from proximal to distal, z out of the body. */
export interface Motion {
  /** Depth at the end of the step, mm; 0 or less is in the air. */
  depth_mm: number;
  /** Slide of the body during the step, mm. */
  slide_x_mm?: number;
  slide_y_mm?: number;
  /** Turn of the body about its normal during the step, rad, counter-clockwise seen from the finger. */
  spin_rad?: number;
  /** Length of the step, s. */
  dt_s?: number;
  /** Pose at the end of the step, degrees; that of the step before unless given. */
  pitch_deg?: number;
  roll_deg?: number;
  /** Moisture (corneometer units) and temperature of the skin; 35 and 32, which leave the strength as it is, unless given. */
  hydration_au?: number;
  temperature_c?: number;
  /** Nominal speed of the slide, mm/s; 2, which leaves the strength as it is, unless given. 0: that of the step. */
  speed_mm_s?: number;
}

/** Forces of the body on the finger, N, and moments, N mm. */
export interface Response {
  normal_force_n: number;
  friction_n: [number, number];
  /** Largest friction in the direction of the present one. */
  friction_limit_n: number;
  /** 1 less the share of its limit that the load uses; 0 without contact. */
  slip_margin: number;
  /** Stuck area over contact area. */
  stick_ratio: number;
  spin_moment_n_mm: number;
  pressure_centre_mm: [number, number];
  contact_area_mm2: number;
  /** Half-widths of the 95 % bands. */
  band_normal_n: number;
  band_friction_n: number;
  regime: (typeof REGIMES)[number];
  /** Flags as in the C header; 0 without any. */
  status: number;
}

export interface Patch {
  place_mm: [number, number];
  pressure_mpa: number;
  traction_mpa: [number, number];
  stick_ratio: number;
  contact_area_mm2: number;
}

export class Finger {
  /** A finger without contact over a plane. `pad` is a model file of `fingerpad pad`, `wasm` the module; the defaults are those of the package. */
  static create(options?: { pad?: Uint8Array; wasm?: ArrayBuffer | ArrayBufferView }): Promise<Finger>;
  private constructor();
  /** Ranges of the fit of the pad. */
  get range(): Readonly<{ depth_max_mm: number; pitch_deg: [number, number]; roll_deg: [number, number]; neutral_pitch_deg: number }>;
  /** Ends the contact and places the finger over a body in a pose. Throws RangeError for a number out of range. */
  lift(options?: { body?: Body; pitch_deg?: number; roll_deg?: number }): void;
  /** Advances the contact by one step. */
  step(motion: Motion): Response;
  /** The patches of skin that touch after the last step. */
  patches(): Patch[];
}
