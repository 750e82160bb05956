// The contact from below, through the body: each patch of skin where it is, coloured by its pressure or by how much of it sticks.

import { byPressure, byStick, colour, fixed, nice } from "./draw.js";

/** Corners of the circle in which a patch is drawn, and how far it goes beyond the patch's area in contact. */
const CORNERS = Array.from({ length: 20 }, (_, i) => [Math.cos((i * Math.PI) / 10), Math.sin((i * Math.PI) / 10)]);
const BEYOND = 1.2;
/** Share of a step by which the scale of the pressure follows it down. */
const FADE = 0.01;

/** Cells of patches: each a circle, cut halfway to every other one. */
export function cells(patches) {
  return patches.map((p) => {
    let cell = CORNERS.map(([c, s]) => [p.x + c * p.radius * BEYOND, p.y + s * p.radius * BEYOND]);
    for (const q of patches) {
      const [dx, dy] = [q.x - p.x, q.y - p.y];
      const far = Math.hypot(dx, dy);
      if (q === p || far > BEYOND * (p.radius + q.radius) || far < 1e-6) continue;
      // The border lies nearer to the smaller one.
      const half = 0.5 * (far * far + p.radius * p.radius - q.radius * q.radius);
      const side = ([x, y]) => (x - p.x) * dx + (y - p.y) * dy - half;
      cell = cell.flatMap((a, i) => {
        const b = cell[(i + 1) % cell.length];
        const [u, v] = [side(a), side(b)];
        const cut = u < 0 !== v < 0 ? [[a[0] + ((b[0] - a[0]) * u) / (u - v), a[1] + ((b[1] - a[1]) * u) / (u - v)]] : [];
        return u < 0 ? [a, ...cut] : cut;
      });
    }
    return cell;
  });
}

/** A coordinate within a picture's margin, px. */
const inside = (at, size) => Math.min(Math.max(at, 8), size - 8);

export class ContactMap {
  constructor(sheet) {
    this.sheet = sheet;
    this.shows = "pressure";
    this.most = 10;
  }

  get scale() {
    return Math.min(this.sheet.w / 32, this.sheet.h / 27.4);
  }

  get middle() {
    return [this.sheet.w * 0.5, this.sheet.h * 0.48];
  }

  /** Radius of the ring by which the body is turned, px. */
  get ring() {
    return 12.4 * this.scale;
  }

  /** Where the ring's knob is, px. */
  knob(spin) {
    const t = ((spin - 50) * Math.PI) / 180;
    return [this.middle[0] + this.ring * Math.cos(t), this.middle[1] + this.ring * Math.sin(t)];
  }

  draw({ at, r, patches, touch, focus, body, shape, start, tip }) {
    const { sheet, scale: s } = this;
    const ctx = sheet.begin();
    const [mx, my] = this.middle;
    this.marks(body, shape);
    ctx.save();
    ctx.translate(mx, my);
    ctx.scale(s, s);
    this.finger(tip, at[5], start[1]);
    ctx.restore();
    if (touch) {
      this.patches(patches);
      const [px, py] = [inside(mx + r.pressure_x_mm * s, sheet.w), inside(my + r.pressure_y_mm * s, sheet.h)];
      const reach = (4.5 * s) / Math.max(r.limit_n, 1e-6);
      const [tx, ty] = [inside(px + r.friction_x_n * reach, sheet.w), inside(py + r.friction_y_n * reach, sheet.h)];
      sheet.arrow(px, py, tx - px, ty - py, "#fff", 5);
      sheet.arrow(px, py, tx - px, ty - py, "#111", 2.2);
      sheet.dot(px, py, 3, "#111", "#fff");
    }
    this.turning(at[3], focus);
    this.legend();
  }

  /** The body's own marks, which move and turn with it, and its outline. */
  marks([x, y, angle], shape) {
    const { sheet, scale: s } = this;
    const [mx, my] = this.middle;
    const [c, n] = [Math.cos(angle), Math.sin(angle)];
    const { ctx } = sheet;
    const to = ([gx, gy]) => [mx + (x + c * gx - n * gy) * s, my + (y + n * gx + c * gy) * s];
    const [bx, by] = [-c * x - n * y, n * x - c * y].map((v) => 2 * Math.round(v / 2));
    const [axis, round] = [(shape.axis * Math.PI) / 180, shape.radius];
    const across = ([gx, gy]) => (shape.kind === "sphere" ? Math.hypot(gx, gy) : Math.cos(axis) * gy - Math.sin(axis) * gx);
    const bounded = shape.kind === "sphere" || shape.kind === "cylinder";
    ctx.beginPath();
    for (let i = -12; i <= 12; i++) {
      for (let j = -12; j <= 12; j++) {
        const mark = [bx + 2 * i, by + 2 * j];
        const [px, py] = to(mark);
        if (px < -4 || py < -4 || px > sheet.w + 4 || py > sheet.h + 4 || (bounded && Math.abs(across(mark)) > round)) continue;
        ctx.rect(px - 1.2, py - 1.2, 2.4, 2.4);
      }
    }
    sheet.fill(colour.faint);
    const along = (offset) => [-60, 60].map((t) => to([t * Math.cos(axis) - offset * Math.sin(axis), t * Math.sin(axis) + offset * Math.cos(axis)]));
    if (shape.kind === "sphere") {
      ctx.beginPath();
      ctx.arc(...to([0, 0]), round * s, 0, 7);
      sheet.stroke(colour.muted, 1.25);
    }
    if (shape.kind === "cylinder") for (const side of [-round, round]) sheet.polyline(along(side), colour.muted, 1.25);
    if (shape.kind === "edge") sheet.polyline(along(0), colour.muted, 1.25);
  }

  /** Silhouette of the finger behind the body, its tip at `tip` mm. */
  finger(tip, roll, start) {
    const { ctx } = this.sheet;
    const sine = (deg) => Math.sin((deg * Math.PI) / 180);
    ctx.translate(tip - 9.4, 7.5 * (sine(start) - sine(roll)));
    ctx.beginPath();
    ctx.moveTo(-40, -8.5);
    ctx.lineTo(-4, -8.5);
    ctx.bezierCurveTo(5, -8.4, 9.4, -6, 9.4, 0);
    ctx.bezierCurveTo(9.4, 6, 5, 8.4, -4, 8.5);
    ctx.lineTo(-40, 8.5);
    ctx.closePath();
    ctx.globalAlpha = 0.62;
    this.sheet.fill(colour.flesh);
    ctx.globalAlpha = 1;
    this.sheet.stroke(colour.line, 1.2 / this.scale);
  }

  /** Every patch in contact, with a line that reaches its rim where friction uses all of its strength. */
  patches(patches) {
    const { sheet, scale: s } = this;
    const [mx, my] = this.middle;
    const most = Math.max(1, ...patches.map((p) => p.kpa));
    this.most = Math.max(most, this.most * (1 - FADE));
    const [full, isPressure] = [nice(this.most), this.shows === "pressure"];
    cells(patches).forEach((cell, i) => {
      const p = patches[i];
      sheet.trace(cell.map(([x, y]) => [mx + x * s, my + y * s]));
      sheet.ctx.closePath();
      sheet.fill(isPressure ? byPressure(p.kpa / full) : byStick(p.stick));
      sheet.stroke(colour.card, 1);
    });
    for (const p of patches) {
      const pull = Math.hypot(p.tx, p.ty);
      if (pull < 1e-9) continue;
      const reach = (0.9 * p.radius * p.used * s) / pull;
      const [x, y] = [mx + p.x * s, my + p.y * s];
      sheet.polyline([[x, y], [x + p.tx * reach, y + p.ty * reach]], isPressure ? colour.slip : colour.card, 1.75);
    }
  }

  /** What the colours say, and the scale. */
  legend() {
    const { sheet, scale: s } = this;
    sheet.ctx.globalAlpha = 0.8;
    sheet.ctx.fillStyle = colour.card;
    sheet.ctx.fillRect(0, sheet.h - 27, sheet.w, 27);
    sheet.ctx.globalAlpha = 1;
    sheet.polyline([[14, sheet.h - 14], [14 + 5 * s, sheet.h - 14]], colour.ink, 1.5);
    sheet.text("5 mm", 14 + 5 * s + 8, sheet.h - 10, { fill: colour.ink });
    const isPressure = this.shows === "pressure";
    const [wide, y] = [84, sheet.h - 19];
    const words = isPressure ? ["0", `${fixed(nice(this.most), 0)} kPa`] : ["slips", "sticks"];
    const x = sheet.w - wide - (isPressure ? 62 : 58);
    const tone = isPressure ? byPressure : byStick;
    for (let i = 0; i < 12; i++) {
      sheet.ctx.fillStyle = tone(i / 11);
      sheet.ctx.fillRect(x + (i * wide) / 12, y, wide / 12 + 0.5, 9);
    }
    sheet.text(words[0], x - 6, y + 9, { align: "right", fill: colour.ink });
    sheet.text(words[1], x + wide + 6, y + 9, { fill: colour.ink });
  }

  /** The ring that turns the body. */
  turning(spin, focus) {
    const { sheet } = this;
    const { ctx } = sheet;
    const [mx, my] = this.middle;
    const zero = (-50 * Math.PI) / 180;
    const arc = (from, to, tone) => {
      ctx.beginPath();
      ctx.arc(mx, my, this.ring, Math.min(from, to), Math.max(from, to));
      sheet.stroke(tone, 2);
    };
    arc(zero - Math.PI / 3, zero + Math.PI / 3, colour.line);
    arc(zero, zero + (spin * Math.PI) / 180, colour.ink);
    const [kx, ky] = this.knob(spin);
    sheet.dot(kx, ky, 8, colour.card, focus ? colour.stick : colour.ink);
    sheet.dot(kx, ky, 2.5, colour.ink);
    sheet.text(Math.abs(spin) < 0.5 ? "twist" : `twist ${fixed(spin, 0)}°`, sheet.w - 12, 20, { align: "right", fill: colour.ink });
  }
}
