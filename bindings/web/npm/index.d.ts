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

/** Kinds of shapes. */
export const SHAPES: readonly ["plane", "sphere", "ellipsoid", "capsule", "cylinder", "edge", "cuboid"];

/** The shape of a rigid body in its own frame: the origin in the middle, the axis of a cylinder and a capsule along z. Sizes are 0.1 to 1e6 mm. */
export type Shape =
  /** z = 0, the body below it. */
  | { kind: "plane" }
  | { kind: "sphere"; radius_mm: number }
  /** Semi-axes along x, y and z. */
  | { kind: "ellipsoid"; semi_axes_mm: [number, number, number] }
  /** Half the length is that from the origin to an end of the cylinder, or to the centre of a round end. */
  | { kind: "capsule" | "cylinder"; radius_mm: number; half_length_mm: number }
  /** Two faces that meet in a rounded edge along x, on which the origin lies, z out between them; the angle is inside the body. */
  | { kind: "edge"; radius_mm: number; angle_deg: number }
  /** Half the extents along x, y and z, and the radius of the edges. */
  | { kind: "cuboid"; half_mm: [number, number, number]; edge_radius_mm: number };

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
  /** The slip margin that is left when the tissue has relaxed at the present depth; else the slip margin. */
  slip_margin_relaxed: number;
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

/** Force, N, and moment about the origin of a frame, N mm, along its axes. */
export interface Wrench {
  force_n: [number, number, number];
  moment_n_mm: [number, number, number];
}

/** Pose of the body in the finger's frame at the end of a step. */
export interface Placement {
  position_mm: [number, number, number];
  /** Of unit length: rotates vectors of the body's frame into the finger's. */
  quaternion_wxyz: [number, number, number, number];
  /** Length of the step, s; 1e-3 unless given. */
  dt_s?: number;
  /** Factor on the friction, 0.1 to 5 (held there), kept until another is given. */
  strength_factor?: number;
}

/** The response of the model, along the axes of the face's plane, and what follows from it in both frames. */
export interface FrameResponse extends Response {
  /** What the body exerts on the finger, in the finger's frame. */
  on_finger: Wrench;
  /** What the finger exerts on the body, in the body's frame. */
  on_body: Wrench;
  /** Depth of the body in the finger; 0 where the finger stands over no face. */
  depth_mm: number;
  /** The finger against the face. */
  pitch_deg: number;
  roll_deg: number;
  /** 0 for none; 1 for a plane, a sphere, an ellipsoid and an edge; of a cuboid 1 to 6 for +x, +y, +z, -x, -y, -z and 7 to 18 for its edges;
   * of a capsule and a cylinder 1 for the side, 2 and 3 for the ends at +z and -z. */
  face: number;
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
  /** Lifts the finger off and gives it tissue that relaxes (true), or that of the file again. The shares of its branches are assumed. */
  relax(isAssumed: boolean): void;
  /** Advances the contact by one step. */
  step(motion: Motion): Response;
  /** The patches of skin that touch after the last step. */
  patches(): Patch[];
}

/** A finger against one rigid body. The finger's frame is fixed to the bone: x from proximal to distal, z out of the pad's surface into the
 * finger; the origin is where a plane first touches in the neutral pose. */
export class FrameContact {
  /** A finger without contact that is to touch a body of a shape; `pad` and `wasm` as of `Finger`. */
  static create(options: { shape: Shape; pad?: Uint8Array; wasm?: ArrayBuffer | ArrayBufferView }): Promise<FrameContact>;
  private constructor();
  /** Ends the contact and takes another body, with a strength factor of 1. Throws RangeError for a size out of range. */
  begin(shape: Shape): void;
  /** Advances the contact to a pose; one that is not finite or not of unit length is not taken, and flagged. */
  step(placement: Placement): FrameResponse;
}
