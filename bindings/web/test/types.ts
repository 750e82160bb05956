// A user's program in TypeScript, only compiled: it uses all types of the npm package. An unused `@ts-expect-error` is an error.

import { BODIES, Finger, FrameContact, LAWS, REGIMES, SHAPES, type Body, type FrameResponse, type Motion, type Patch, type Placement, type Response, type Shape, type Wrench } from "fingerpad";

const bodies: Body[] = [
  { kind: "plane" },
  { kind: "sphere", radius_mm: 20 },
  { kind: "cylinder", radius_mm: 10, axis_deg: 90 },
  { kind: "edge", radius_mm: 4, axis_deg: 30, angle_deg: 100 },
];
const kinds: readonly Body["kind"][] = BODIES;
const regimes: readonly Response["regime"][] = REGIMES;
const laws: number[] = [LAWS.moisture, LAWS.speed, LAWS.temperature];

const files = { pad: new Uint8Array(8), wasm: new Uint8Array(8) };
const finger: Finger = await Finger.create(files);
await Finger.create({ wasm: new ArrayBuffer(8) });
const { depth_max_mm, pitch_deg: [lowest], roll_deg: [, highest], neutral_pitch_deg } = finger.range;
finger.lift();
for (const body of bodies) finger.lift({ body, pitch_deg: lowest, roll_deg: highest });
finger.lift({ pitch_deg: neutral_pitch_deg });

const skin = { hydration_au: 60, temperature_c: 30, speed_mm_s: 0 };
const motion: Motion = { depth_mm: 0.5 * depth_max_mm, slide_x_mm: 0.05, slide_y_mm: 0, spin_rad: 0, dt_s: 1e-3, pitch_deg: 30, roll_deg: 0, ...skin };
const response: Response = finger.step(motion);
const [x, y] = response.friction_n;
const [cx, cy] = response.pressure_centre_mm;
const numbers: number[] = [
  response.normal_force_n, x, y, response.friction_limit_n, response.slip_margin, response.stick_ratio, response.spin_moment_n_mm, cx, cy,
  response.contact_area_mm2, response.band_normal_n, response.band_friction_n, response.status,
];
const patches: Patch[] = finger.patches();
for (const { place_mm, traction_mpa, pressure_mpa, stick_ratio, contact_area_mm2 } of patches) {
  numbers.push(...place_mm, ...traction_mpa, pressure_mpa, stick_ratio, contact_area_mm2);
}

const shapes: Shape[] = [
  { kind: "plane" },
  { kind: "sphere", radius_mm: 20 },
  { kind: "ellipsoid", semi_axes_mm: [20, 15, 10] },
  { kind: "capsule", radius_mm: 10, half_length_mm: 20 },
  { kind: "cylinder", radius_mm: 10, half_length_mm: 20 },
  { kind: "edge", radius_mm: 3, angle_deg: 90 },
  { kind: "cuboid", half_mm: [15, 15, 15], edge_radius_mm: 2 },
];
const shapeKinds: readonly Shape["kind"][] = SHAPES;
const framed: FrameContact = await FrameContact.create({ shape: shapes[0]!, ...files });
for (const shape of shapes) framed.begin(shape);
const placement: Placement = { position_mm: [0, 0, -1], quaternion_wxyz: [1, 0, 0, 0], dt_s: 1e-3, strength_factor: 1 };
const felt: FrameResponse = framed.step(placement);
const wrenches: Wrench[] = [felt.on_finger, felt.on_body];
for (const { force_n, moment_n_mm } of wrenches) numbers.push(...force_n, ...moment_n_mm);
numbers.push(felt.depth_mm, felt.pitch_deg, felt.roll_deg, felt.face, felt.normal_force_n);
export { kinds, laws, numbers, regimes, shapeKinds };

// @ts-expect-error: the depth is missing
finger.step({ slide_x_mm: 0.1 });
// @ts-expect-error: a body of another kind
finger.lift({ body: { kind: "torus" } });
// @ts-expect-error: a sphere without its radius
finger.lift({ body: { kind: "sphere" } });
// @ts-expect-error: `create` starts a finger, not `new`
new Finger();
// @ts-expect-error: the lists are constant
BODIES.push("plane");
// @ts-expect-error: the numbers of the laws are constant
LAWS.speed = 1;
// @ts-expect-error: the range is that of the model file
finger.range.depth_max_mm = 5;
// @ts-expect-error: a contact in frames needs a shape
await FrameContact.create({});
// @ts-expect-error: a cuboid without the radius of its edges
framed.begin({ kind: "cuboid", half_mm: [1, 1, 1] });
// @ts-expect-error: a pose has an orientation
framed.step({ position_mm: [0, 0, 0] });
