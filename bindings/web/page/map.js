// The contact patch from below, through the plate: area, place and stuck share are the model's, the outline is a drawing.

import { colour, fixed } from "./draw.js";

/** Exponent of the outline |x/a|^n + |y/b|^n = 1 and its area over a b; length over width, as in the finite elements at 1 mm. */
const POWER = 2.6;
const FULL = 3.4066;
const ASPECT = 1.28;
const RIDGE_MM = 0.62;

/** Half-length of a patch of an area, mm. */
export function halfLength(area) {
  return Math.sqrt((area * ASPECT) / FULL);
}

const ROUND = Array.from({ length: 72 }, (_, i) => {
  const t = (i / 72) * 2 * Math.PI;
  const [c, s] = [Math.cos(t), Math.sin(t)];
  return [Math.sign(c) * Math.abs(c) ** (2 / POWER), Math.sign(s) * Math.abs(s) ** (2 / POWER)];
});

export class Patch {
  constructor(sheet) {
    this.sheet = sheet;
  }

  get scale() {
    return Math.min(this.sheet.w / 25, this.sheet.h / 21);
  }

  get middle() {
    return [this.sheet.w * 0.5, this.sheet.h * 0.49];
  }

  /** Radius of the ring by which the plate is turned, px. */
  get ring() {
    return 8.9 * this.scale;
  }

  /** Where the ring's knob is, px. */
  knob(spin) {
    const t = ((spin - 50) * Math.PI) / 180;
    return [this.middle[0] + this.ring * Math.cos(t), this.middle[1] + this.ring * Math.sin(t)];
  }

  draw({ at, r, a, touch, focus }) {
    const { sheet, scale: s } = this;
    const ctx = sheet.begin();
    const [mx, my] = this.middle;
    const [, x, y, spin] = at;
    this.grid(x, y, (spin * Math.PI) / 180);
    ctx.save();
    ctx.translate(mx, my);
    ctx.scale(s, s);
    this.finger(at[5]);
    if (touch) this.touching(r, a, at[5]);
    ctx.restore();
    if (touch) {
      const [px, py] = [mx + (r.pressure_x_mm - 0.6) * s, my + r.pressure_y_mm * s];
      const reach = (3.6 * s) / Math.max(r.limit_n, 1e-6);
      sheet.arrow(px, py, r.friction_x_n * reach, r.friction_y_n * reach, "#fff", 5);
      sheet.arrow(px, py, r.friction_x_n * reach, r.friction_y_n * reach, "#111", 2.2);
      sheet.dot(px, py, 3, "#111", "#fff");
    }
    this.turning(spin, focus);
    sheet.polyline([[14, sheet.h - 14], [14 + 5 * s, sheet.h - 14]], colour.ink, 1.5);
    sheet.text("5 mm", 14 + 5 * s + 8, sheet.h - 10, { fill: colour.ink });
  }

  /** The plate's own marks, which slide and turn with it. */
  grid(x, y, spin) {
    const { sheet, scale: s } = this;
    const [mx, my] = this.middle;
    const [c, n] = [Math.cos(spin), Math.sin(spin)];
    const back = ([px, py]) => [c * (px - x) + n * (py - y), c * (py - y) - n * (px - x)];
    const { ctx } = sheet;
    ctx.beginPath();
    const [bx, by] = back([0, 0]).map((v) => 2 * Math.round(v / 2));
    for (let i = -10; i <= 10; i++) {
      for (let j = -10; j <= 10; j++) {
        const [gx, gy] = [bx + 2 * i, by + 2 * j];
        const [px, py] = [mx + (x + c * gx - n * gy) * s, my + (y + n * gx + c * gy) * s];
        if (px < -4 || py < -4 || px > sheet.w + 4 || py > sheet.h + 4) continue;
        ctx.rect(px - 1.2, py - 1.2, 2.4, 2.4);
      }
    }
    sheet.fill(colour.faint);
  }

  /** Silhouette of the finger behind the plate. */
  finger(roll) {
    const { ctx } = this.sheet;
    ctx.beginPath();
    ctx.moveTo(-40, -8.5);
    ctx.lineTo(-4, -8.5);
    ctx.bezierCurveTo(5, -8.4, 9.4, -6, 9.4, 0.05 * roll);
    ctx.bezierCurveTo(9.4, 6, 5, 8.4, -4, 8.5);
    ctx.lineTo(-40, 8.5);
    ctx.closePath();
    ctx.globalAlpha = 0.62;
    this.sheet.fill(colour.flesh);
    ctx.globalAlpha = 1;
    this.sheet.stroke(colour.line, 1.2 / this.scale);
  }

  outline(x, y, a, b) {
    this.sheet.trace(ROUND.map(([u, v]) => [x + a * u, y + b * v]));
    this.sheet.ctx.closePath();
  }

  /** The patch: slips where it is amber, sticks where it is blue, with the ridges of the skin that friction carries along. */
  touching(r, a, roll) {
    const { sheet } = this;
    const { ctx } = sheet;
    const b = a / ASPECT;
    const [x, y] = [r.pressure_x_mm - 0.6, r.pressure_y_mm];
    ctx.save();
    this.outline(x, y, a, b);
    sheet.fill(colour.slip);
    ctx.clip();
    const core = Math.sqrt(r.stick_ratio);
    if (core > 0.02) {
      this.outline(x, y, a * core, b * core);
      sheet.fill(colour.stick);
    }
    this.ridges(r.stretch_x_mm, r.stretch_y_mm - 0.03 * roll);
    ctx.restore();
    this.outline(x, y, a, b);
    sheet.stroke(colour.ink, 1.1 / this.scale);
  }

  /** A fingerprint's loops. */
  ridges(dx, dy) {
    const { ctx } = this.sheet;
    for (let k = 1; k < 24; k++) {
      const q = k * RIDGE_MM;
      ctx.beginPath();
      ctx.moveTo(-12 + dx, 1.02 * q + 1.2 + dy);
      ctx.bezierCurveTo(-4 + dx, 1.0 * q + 0.9 + dy, -1 + 0.75 * q + dx, 0.95 * q + 0.4 + dy, 0.8 + 0.78 * q + dx, 0.2 + dy);
      ctx.bezierCurveTo(0.9 + 0.7 * q + dx, -0.95 * q + dy, -3 + dx, -0.92 * q - 0.2 + dy, -12 + dx, -0.75 * q - 0.1 + dy);
      this.sheet.stroke("#fff5", 0.24);
    }
  }

  /** The ring that turns the plate. */
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
