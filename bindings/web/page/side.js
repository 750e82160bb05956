// The finger from the side: the outline of the finger that the default model was fitted to, pressed flat where it touches.

import { colour, fixed } from "./draw.js";

// Section along the middle of shape E (data/geometry/e.toml), mm: x from the joint to the tip, z to the nail.
const SHAPE = { length: 25, cap: 12, thick: 7.5, power: 2.2, slope: 0.3, slopeFrom: 8, slopeOver: 4, skin: 0.6 };
const NAIL = [11, 23];
const BACK = -30;

const lift = (x) => {
  const t = x - SHAPE.slopeFrom;
  return SHAPE.slope * (t < 0 ? 0 : t < SHAPE.slopeOver ? (t * t) / (2 * SHAPE.slopeOver) : t - SHAPE.slopeOver / 2);
};
const thick = (x) => {
  const t = Math.max(0, (x - SHAPE.length + SHAPE.cap) / SHAPE.cap);
  return SHAPE.thick * Math.max(0, 1 - t ** SHAPE.power) ** (1 / SHAPE.power);
};

// Closer where the end is round.
const ALONG = Array.from({ length: 91 }, (_, i) => BACK + (SHAPE.length - BACK) * Math.sin((Math.PI * i) / 180));
const TOP = ALONG.map((x) => [x, lift(x) + thick(x)]);
const BOTTOM = ALONG.map((x) => [x, lift(x) - thick(x)]).reverse();
// Corners within which the bones are rounded: the last one up to 6 mm before the tip, the joint, the one before.
const DISTAL = [[8.6, -0.6], [8.4, 2.4], [8.8, 5.6], [11, 5.3], [14, 3.9], [17.5, 4.6], [19.4, 4.2], [19.4, 1.6], [17, 1.2], [13.5, 1.5], [10.8, 0]].map(([x, z]) => [x, z + lift(x)]);
const MIDDLE = [[BACK, 4.2], [1, 4.3], [5, 5.6], [7.6, 4.6], [7.4, 2.3], [7.6, -0.2], [5, -1], [1, 0.6], [BACK, 0.6]];

/** Turns a place of the finger into the picture's frame: tip down by the pitch. */
function turner(pitch) {
  const [c, s] = [Math.cos((pitch * Math.PI) / 180), Math.sin((pitch * Math.PI) / 180)];
  const turn = ([x, z]) => [x * c + z * s, z * c - x * s];
  const low = BOTTOM.map(turn).reduce((a, b) => (b[1] < a[1] ? b : a));
  return (p) => {
    const [x, z] = turn(p);
    return [x - low[0], z - low[1]];
  };
}

/** Heights of the pad's underside pressed to a depth: 0 over the contact of half-length `a`, which it leaves as a tangent. */
function pressed(bottom, depth, a) {
  const under = bottom.map(([x, z]) => [x, z - depth]);
  const inside = under.filter(([, g]) => g < 0);
  if (inside.length < 2 || a <= 0) return { under, left: 0, right: 0 };
  const xs = inside.map(([x]) => x);
  const [l, r] = [Math.min(...xs), Math.max(...xs)];
  const share = Math.min(1, (2 * a) / (r - l));
  const [left, right] = [l * share, r * share];
  const gap = (x) => {
    const i = under.findIndex((p, k) => k > 0 && (p[0] - x) * (under[k - 1][0] - x) <= 0);
    if (i < 1) return 0;
    const [p, q] = [under[i - 1], under[i]];
    return p[1] + ((q[1] - p[1]) * (x - p[0])) / (q[0] - p[0] || 1);
  };
  const edge = (x, out) => {
    const g = Math.min(gap(x), -1e-3);
    return { g, decay: Math.max((gap(x + out * 0.2) - g) / 0.2 / -g, 0.02) };
  };
  const [le, re] = [edge(left, -1), edge(right, 1)];
  const shaped = under.map(([x, g]) => {
    if (x > left && x < right && g < 1) return [x, 0];
    const [e, s] = x <= left ? [le, left - x] : [re, x - right];
    return [x, Math.max(0, g - e.g * Math.exp(-s * e.decay))];
  });
  return { under: shaped, left, right };
}

export class Side {
  constructor(sheet) {
    this.sheet = sheet;
  }

  /** Pixels per mm. */
  get scale() {
    return Math.min(this.sheet.w / 31, this.sheet.h / 17.5);
  }

  draw({ at, r, a }) {
    const { sheet, scale: s } = this;
    const ctx = sheet.begin();
    const [ox, oy] = [sheet.w * 0.57, sheet.h - 2.6 * s];
    const [depth, slide, , , pitch] = at;
    const touch = r.regime > 0;
    const place = turner(pitch);
    const sheared = ([x, z]) => {
      const u = touch ? r.stretch_x_mm * Math.exp(-Math.max(z, 0) / 3.2) : 0;
      return [ox + (x + u) * s, oy - z * s];
    };
    const raised = (p) => {
      const [x, z] = place(p);
      return sheared([x, z - depth]);
    };
    const { under, left, right } = pressed(BOTTOM.map(place), depth, touch ? a : 0);
    this.plate(ox, oy, s, slide);
    if (touch) this.ghost(BOTTOM.map(place), depth, ox, oy, s);
    this.finger([...TOP.map(raised), ...under.map(sheared)], raised, s);
    if (touch) {
      this.contact(left, right, r, ox, oy, s);
      this.forces((left + right) / 2, r, ox, oy, s);
    }
    this.depth(depth, ox, oy, s, touch);
  }

  finger(outline, raised, s) {
    const { sheet } = this;
    const { ctx } = sheet;
    const closed = [...outline, outline[0]];
    sheet.trace(closed);
    sheet.fill(colour.flesh);
    ctx.save();
    ctx.clip();
    sheet.stroke(colour.skin, 2 * SHAPE.skin * s);
    ctx.restore();
    for (const part of [MIDDLE, DISTAL]) {
      this.rounded(part.map(raised));
      sheet.fill(colour.bone);
      sheet.stroke(colour.line);
    }
    sheet.polyline(closed, colour.muted, 1.25);
    const nail = TOP.filter(([x]) => x >= NAIL[0] && x <= NAIL[1] + 0.5).map(([x, z]) => raised([x, z + 0.12]));
    sheet.polyline(nail, colour.muted, 0.62 * s + 2);
    sheet.polyline(nail, colour.nail, 0.62 * s);
  }

  /** A closed figure within corners, which it touches halfway between. */
  rounded(corners) {
    const { ctx } = this.sheet;
    ctx.beginPath();
    corners.forEach(([x, y], i) => {
      const [nx, ny] = corners[(i + 1) % corners.length];
      const middle = [(x + nx) / 2, (y + ny) / 2];
      if (i) ctx.quadraticCurveTo(x, y, ...middle);
      else ctx.moveTo(...middle);
    });
    const [[x, y], [nx, ny]] = corners;
    ctx.quadraticCurveTo(x, y, (x + nx) / 2, (y + ny) / 2);
  }

  /** The plate with a tick each millimetre, which move with it. */
  plate(ox, oy, s, slide) {
    const { sheet } = this;
    const { ctx } = sheet;
    const high = 1.5 * s;
    ctx.fillStyle = colour.glass;
    ctx.fillRect(0, oy, sheet.w, high);
    sheet.polyline([[0, oy], [sheet.w, oy]], colour.muted, 1.25);
    const first = Math.floor((-ox / s - slide)) - 1;
    for (let n = first; ox + (n + slide) * s < sheet.w + s; n++) {
      const x = ox + (n + slide) * s;
      const long = n % 5 === 0;
      sheet.polyline([[x, oy + 1], [x, oy + (long ? 0.95 : 0.5) * s]], long ? colour.muted : colour.faint, 1);
    }
  }

  /** Where the underside would be without the plate. */
  ghost(bottom, depth, ox, oy, s) {
    const points = bottom.filter(([, z]) => z < depth).map(([x, z]) => [ox + x * s, oy - (z - depth) * s]);
    this.sheet.polyline(points, colour.muted, 1, [2, 4]);
  }

  /** What sticks and what slips, along the contact. */
  contact(left, right, r, ox, oy, s) {
    const [a, b] = [ox + (left + r.stretch_x_mm) * s, ox + (right + r.stretch_x_mm) * s];
    const [middle, core] = [(a + b) / 2, ((b - a) / 2) * Math.sqrt(r.stick_ratio)];
    this.sheet.ctx.lineCap = "butt";
    this.sheet.polyline([[a, oy], [b, oy]], colour.slip, 5);
    if (core > 0.5) this.sheet.polyline([[middle - core, oy], [middle + core, oy]], colour.stick, 5);
    this.sheet.ctx.lineCap = "round";
  }

  /** What the plate does to the finger: normal force up, friction along. */
  forces(middle, r, ox, oy, s) {
    const { sheet } = this;
    const [x, y] = [ox + (middle + r.stretch_x_mm) * s, oy - 1.2 * s];
    const [up, along] = [6 * s * r.normal_n, 11 * s * r.friction_x_n];
    sheet.arrow(x, y, 0, -up, colour.ink);
    sheet.arrow(x, y, along, 0, colour.ink);
    sheet.dot(x, y, 3, colour.ink);
    const ink = { fill: colour.ink, weight: 600, size: 12.5 };
    sheet.text(`${fixed(r.normal_n, 2)} N`, x + 8, y - Math.max(up, 14) + 8, ink);
    if (Math.abs(along) > 4) sheet.text(`${fixed(r.friction_x_n, 2)} N`, x + along + Math.sign(along) * 7, y + 1, { ...ink, align: along < 0 ? "right" : "left", base: "middle" });
  }

  depth(depth, ox, oy, s, touch) {
    const { sheet } = this;
    const [x, y] = [20, oy + depth * s];
    if (touch) {
      sheet.polyline([[x, oy], [x, y]], colour.ink, 1.25);
      for (const end of [oy, y]) sheet.polyline([[x - 4, end], [x + 4, end]], colour.ink, 1.25);
    }
    sheet.text(touch ? `${fixed(depth, 2)} mm` : "in the air", x - 4, oy - 9, { fill: colour.ink, size: 12.5, weight: 600 });
  }
}
