// The finger from the side: the outline of the finger that the pad is of, pressed onto the body where it touches.

import { byStick, colour, fixed, nice } from "./draw.js";

// Section along the middle of shape E (data/geometry/e.toml), mm: x from the joint to the tip, z to the nail.
const SHAPE = { length: 25, cap: 12, thick: 7.5, power: 2.2, slope: 0.3, slopeFrom: 8, slopeOver: 4, skin: 0.6 };
const NAIL = [11, 23];
const BACK = -30;
/** Height over the contact in which the stretch of the skin falls to 37 %, mm. */
const FADE_MM = 5;

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

/** A place of the finger, tip down by the pitch. */
function turned([x, z], pitch) {
  const [c, s] = [Math.cos((pitch * Math.PI) / 180), Math.sin((pitch * Math.PI) / 180)];
  return [x * c + z * s, z * c - x * s];
}

/** The lowest place of the finger in a pitch: where a plane touches it first. */
const lowest = (pitch) => BOTTOM.reduce((a, b) => (turned(b, pitch)[1] < turned(a, pitch)[1] ? b : a));

/** Turns a place of the finger into the picture's frame: x from the point about which poses turn, z from first touch in the pitch. */
function turner(pitch, start) {
  const pivot = turned(lowest(start), pitch)[0];
  const low = turned(lowest(pitch), pitch)[1];
  return (p) => {
    const [x, z] = turned(p, pitch);
    return [x - pivot, z - low];
  };
}

/** How far the tip lies before the point about which poses turn, mm. */
export function tip(pitch, start) {
  const place = turner(pitch, start);
  return Math.max(...TOP.map((p) => place(p)[0]));
}

/** The pad's underside on a body of heights `h`: on it over the contact from `left` to `right`, which it leaves as a tangent. */
function pressed(bottom, depth, h, [left, right]) {
  const under = bottom.map(([x, z]) => [x, z - depth - h(x)]);
  if (!(right > left)) return bottom.map(([x, z]) => [x, z - depth]);
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
  return under.map(([x, g]) => {
    if (x > left && x < right && g < 1) return [x, h(x)];
    const [e, s] = x <= left ? [le, left - x] : [re, x - right];
    return [x, h(x) + Math.max(0, g - e.g * Math.exp(-s * e.decay))];
  });
}

/** Ends of the contact in the undeformed finger, and how far the patches have been pulled along from there, mm. */
function stretch(bottom, depth, h, patches) {
  const inside = bottom.filter(([x, z]) => z - depth < h(x)).map(([x]) => x);
  if (patches.length === 0 || inside.length < 2) return { ends: [0, 0], pull: 0 };
  const [l, r] = [Math.min(...patches.map((p) => p.x - p.radius)), Math.max(...patches.map((p) => p.x + p.radius))];
  const pull = (l + r - Math.min(...inside) - Math.max(...inside)) / 2;
  return { ends: [l - pull, r - pull], pull };
}

export class Side {
  constructor(sheet) {
    this.sheet = sheet;
  }

  /** Pixels per mm. */
  get scale() {
    return Math.min(this.sheet.w / 31, this.sheet.h / 21);
  }

  /** Where the point about which poses turn lies at first touch, px. */
  get origin() {
    return [this.sheet.w * 0.57, this.sheet.h - 5.8 * this.scale];
  }

  draw({ at, r, patches, body, start, record, height }) {
    const { sheet, scale: s } = this;
    sheet.begin();
    const [ox, oy] = this.origin;
    const [depth, , , , pitch] = at;
    const touch = r.regime > 0;
    const place = turner(pitch, start[0]);
    const [c, n] = [Math.cos(body[2]), Math.sin(body[2])];
    // Along the middle of the finger.
    const h = (x) => Math.max(height(c * (x - body[0]) - n * body[1], -n * (x - body[0]) - c * body[1]), -40);
    const bottom = BOTTOM.map(place);
    const middle = patches.filter((p) => Math.abs(p.y - r.pressure_y_mm) < 1.5 * p.radius);
    const { ends, pull } = stretch(bottom, depth, h, middle);
    const sheared = ([x, z], above) => [ox + (x + pull * Math.exp(-Math.max(above, 0) / FADE_MM)) * s, oy - z * s];
    const raised = (p) => {
      const [x, z] = place(p);
      return sheared([x, z - depth], z - depth);
    };
    this.body(ox, oy, s, body, h);
    if (touch) this.ghost(bottom, depth, h, ox, oy, s);
    // Deep, the end of the back reaches the body too.
    const back = TOP.map(place).map(([x, z]) => sheared([x, Math.max(z - depth, h(x))], z - depth));
    this.finger([...back, ...pressed(bottom, depth, h, ends).map(([x, z]) => sheared([x, z], z - h(x)))], raised, s);
    if (touch) {
      this.contact(middle, h, ox, oy, s);
      this.forces(r, record.most, h(r.pressure_x_mm), ox, oy, s);
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

  /** The body with a tick each millimetre along its surface, which move with it. */
  body(ox, oy, s, [slide], h) {
    const { sheet } = this;
    const top = [];
    for (let px = 0; px <= sheet.w + 3; px += 3) top.push([px, oy - h((px - ox) / s) * s]);
    sheet.trace([...top, [sheet.w + 3, sheet.h + 3], [0, sheet.h + 3]]);
    sheet.fill(colour.glass);
    sheet.polyline(top, colour.muted, 1.25);
    const first = Math.floor(-ox / s - slide) - 1;
    for (let n = first; ox + (n + slide) * s < sheet.w + s; n++) {
      const [x, y] = [ox + (n + slide) * s, oy - h(n + slide) * s];
      const long = n % 5 === 0;
      sheet.polyline([[x, y + 1], [x, y + (long ? 0.95 : 0.5) * s]], long ? colour.muted : colour.faint, 1);
    }
  }

  /** Where the underside would be without the body. */
  ghost(bottom, depth, h, ox, oy, s) {
    const points = bottom.filter(([x, z]) => z - depth < h(x)).map(([x, z]) => [ox + x * s, oy - (z - depth) * s]);
    this.sheet.polyline(points, colour.muted, 1, [2, 4]);
  }

  /** What sticks and what slips, along the contact's middle. */
  contact(patches, h, ox, oy, s) {
    this.sheet.ctx.lineCap = "butt";
    for (const p of [...patches].sort((a, b) => Math.abs(b.y) - Math.abs(a.y))) {
      const ends = [-1.15, 0, 1.15].map((k) => p.x + k * p.radius);
      this.sheet.polyline(ends.map((x) => [ox + x * s, oy - h(x) * s]), byStick(p.stick), 5);
    }
    this.sheet.ctx.lineCap = "round";
  }

  /** What the body does to the finger: normal force up, friction along. The largest force of the last seconds sets the scale. */
  forces(r, most, height, ox, oy, s) {
    const { sheet } = this;
    const [x, y] = [Math.min(Math.max(ox + r.pressure_x_mm * s, 70), sheet.w - 70), Math.max(oy - (height + 1.2) * s, 60)];
    const most_px = Math.min(0.25 * sheet.w, y - 26);
    const long = most_px / nice(Math.max(most, 0.3));
    const up = Math.min(r.normal_n * long, most_px);
    const tip = Math.min(Math.max(x + r.friction_x_n * long, 62), sheet.w - 62);
    sheet.arrow(x, y, 0, -up, colour.ink);
    sheet.arrow(x, y, tip - x, 0, colour.ink);
    sheet.dot(x, y, 3, colour.ink);
    const ink = { fill: colour.ink, weight: 600, size: 12.5 };
    sheet.text(`${fixed(r.normal_n, 2)} N`, x + 8, y - Math.max(up, 14) + 8, ink);
    const left = tip < x;
    if (Math.abs(tip - x) > 4) sheet.text(`${fixed(r.friction_x_n, 2)} N`, tip + (left ? -7 : 7), y + 1, { ...ink, align: left ? "right" : "left", base: "middle" });
  }

  depth(depth, ox, oy, s, touch) {
    const { sheet } = this;
    const [x, y] = [20, Math.min(oy + depth * s, sheet.h - 6)];
    if (touch) {
      sheet.polyline([[x, oy], [x, y]], colour.ink, 1.25);
      for (const end of [oy, y]) sheet.polyline([[x - 4, end], [x + 4, end]], colour.ink, 1.25);
    }
    sheet.text(touch ? `${fixed(depth, 2)} mm` : "in the air", touch ? x + 8 : x - 4, oy + 17, { fill: colour.ink, size: 12.5, weight: 600 });
  }
}
