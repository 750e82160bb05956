// Three plots: force against slide with its hysteresis, the limit surface with the load in it, forces over time.

import { byStick, colour, fixed, nice } from "./draw.js";

const MOST_POINTS = 2400;
const WINDOW_S = 10;
const TRACE_S = 0.02;

/** Axes of motion that have a loop of their own. */
const LOOPS = [
  { x: "slide x, mm", y: "friction along x, N", from: 1, dx: 0.02 },
  { x: "slide y, mm", y: "friction along y, N", from: 2, dx: 0.02 },
  { x: "twist, °", y: "moment, N mm", from: 3, dx: 0.15 },
];

/** Columns of the table that is saved, in the project's names. */
const COLUMNS = [
  ...["depth_mm", "slide_x_mm", "slide_y_mm", "spin_deg", "pitch_deg", "roll_deg"].map((name, i) => [name, (at) => at[i]]),
  ["normal_force_n", (_, r) => r.normal_n],
  ["friction_x_n", (_, r) => r.friction_x_n],
  ["friction_y_n", (_, r) => r.friction_y_n],
  ["spin_moment_n_mm", (_, r) => r.moment_n_mm],
  ["friction_limit_n", (_, r) => r.limit_n],
  ["slip_margin", (_, r) => r.margin],
  ["slip_margin_relaxed", (_, r) => r.margin_relaxed],
  ["stick_ratio", (_, r) => r.stick_ratio],
  ["status", (_, r) => r.status],
];

/** The last steps as the plots need them. */
export class Record {
  constructor() {
    this.clear();
  }

  clear() {
    this.loops = LOOPS.map(() => []);
    this.travel = [1e-9, 0, 0];
    this.trace = [];
    this.load = [];
    this.last = null;
  }

  /** Takes note of a step: place of the body, forces, time. */
  add(at, r, time) {
    const x = [at[1], at[2], at[3]];
    const y = [r.friction_x_n, r.friction_y_n, r.moment_n_mm];
    x.forEach((value, i) => {
      const moved = this.last ? Math.abs(value - this.last[i]) : 0;
      this.travel[i] = this.travel[i] * 0.9985 + moved * (i === 2 ? 0.1 : 1);
      const loop = this.loops[i];
      const before = loop.at(-1);
      if (!before || Math.abs(value - before[0]) > LOOPS[i].dx || Math.abs(y[i] - before[1]) > 0.01) {
        loop.push([value, y[i], r.regime ? r.stick_ratio : -1]);
        if (loop.length > MOST_POINTS) loop.splice(0, MOST_POINTS / 8);
      }
    });
    this.last = x;
    const before = this.trace.at(-1);
    if (!before || time - before.time >= TRACE_S) {
      this.trace.push({ time, normal: r.normal_n, friction: Math.hypot(r.friction_x_n, r.friction_y_n), limit: r.limit_n, stick: r.stick_ratio, row: COLUMNS.map(([, value]) => value(at, r)) });
      while (this.trace[0].time < time - WINDOW_S) this.trace.shift();
    }
  }

  /** The last seconds as a table, with the columns of a path and of a response. */
  csv() {
    const from = this.trace[0]?.time ?? 0;
    const rows = this.trace.map(({ time, row }) => [(time - from).toFixed(3), ...row.map((value) => Number(value.toPrecision(7)))].join(","));
    return `${["t_s", ...COLUMNS.map(([name]) => name)].join(",")}\n${rows.map((row) => `${row}\n`).join("")}`;
  }

  /** Largest force of the last seconds, N. */
  get most() {
    return Math.max(...this.trace.map((p) => Math.max(p.normal, p.friction)), 0);
  }

  /** The axis that has moved most of late. */
  get axis() {
    return this.travel.indexOf(Math.max(...this.travel));
  }
}

/** A frame with axes through zero: maps numbers to pixels. */
function frame(sheet, [x0, x1], [y0, y1], { left = 40, right = 12, top = 26, bottom = 26 } = {}) {
  const [w, h] = [sheet.w - left - right, sheet.h - top - bottom];
  return {
    x: (v) => left + ((v - x0) / (x1 - x0)) * w,
    y: (v) => top + h - ((v - y0) / (y1 - y0)) * h,
    box: [left, top, left + w, top + h],
  };
}

/** Lines at quarters, numbers at the ends and at zero. */
function ticks(sheet, f, wide, high) {
  const [l, t, r, b] = f.box;
  for (const share of [-1, -0.5, 0, 0.5, 1]) {
    const [x, y] = [f.x(share * wide), f.y(share * high)];
    const tone = share === 0 ? colour.faint : colour.line;
    sheet.polyline([[l, y], [r, y]], tone);
    sheet.polyline([[x, t], [x, b]], tone);
    if (share % 1 !== 0) continue;
    sheet.text(fixed(share * high, digits(high)), l - 7, y, { align: "right", base: "middle" });
    sheet.text(fixed(share * wide, digits(wide)), x, b + 16, { align: "center" });
  }
}

const digits = (most) => [0, 1, 2].find((n) => Math.abs(most * 10 ** n - Math.round(most * 10 ** n)) < 1e-6) ?? 3;

export class Loop {
  constructor(sheet) {
    this.sheet = sheet;
    this.span = [2, 0.2];
  }

  draw({ record, r, at }) {
    const axis = record.axis;
    const { x: xName, y: yName, from } = LOOPS[axis];
    const points = record.loops[axis];
    const limit = axis < 2 ? r.limit_n : 0;
    const wide = nice(Math.max(axis < 2 ? 2 : 10, ...points.map((p) => Math.abs(p[0]))));
    const high = nice(Math.max(axis < 2 ? 0.1 : 0.2, limit * 1.05, ...points.map((p) => Math.abs(p[1]))));
    const { sheet } = this;
    sheet.begin();
    const f = frame(sheet, [-wide, wide], [-high, high]);
    ticks(sheet, f, wide, high);
    if (limit > 0) {
      const y = f.y((axis ? r.friction_y_n : r.friction_x_n) < 0 ? -limit : limit);
      sheet.polyline([[f.box[0], y], [f.box[2], y]], colour.slip, 1.5, [5, 4]);
      // At the bottom the name of the axis stands on the right.
      const low = y > f.box[3] - 24;
      sheet.text("limit", low ? f.box[0] + 4 : f.box[2] - 4, y - 5, { align: low ? "left" : "right", fill: colour.warn });
    }
    this.trail(points, f);
    if (r.regime) sheet.dot(f.x(at[from]), f.y([r.friction_x_n, r.friction_y_n, r.moment_n_mm][axis]), 4.5, colour.ink, colour.card);
    sheet.text(yName, 8, 14, { size: 11.5 });
    sheet.text(xName, sheet.w - 12, sheet.h - 29, { align: "right" });
  }

  /** The way so far, older parts paler, coloured by what sticks. */
  trail(points, f) {
    const { ctx } = this.sheet;
    const toneOf = ([, , stick]) => (stick < 0 ? colour.line : byStick(stick));
    let i = 1;
    while (i < points.length) {
      const tone = toneOf(points[i]);
      const age = Math.floor((8 * i) / points.length);
      ctx.beginPath();
      ctx.moveTo(f.x(points[i - 1][0]), f.y(points[i - 1][1]));
      do {
        ctx.lineTo(f.x(points[i][0]), f.y(points[i][1]));
        i++;
      } while (i < points.length && toneOf(points[i]) === tone && Math.floor((8 * i) / points.length) === age);
      ctx.globalAlpha = 0.3 + (0.7 * (age + 1)) / 8;
      this.sheet.stroke(tone, 2);
    }
    ctx.globalAlpha = 1;
  }
}

/** Shares of their limits that friction and the moment about the normal use; the moment's with the sign of that about the pressure. */
export function shares(r) {
  if (!r.regime) return [0, 0];
  const friction = Math.min(Math.hypot(r.friction_x_n, r.friction_y_n) / Math.max(r.limit_n, 1e-9), 1);
  const used = 1 - r.margin;
  const about = r.moment_n_mm - r.pressure_x_mm * r.friction_y_n + r.pressure_y_mm * r.friction_x_n;
  return [friction, Math.sign(about) * Math.sqrt(Math.max(0, used * used - friction * friction))];
}

export class LimitSurface {
  constructor(sheet) {
    this.sheet = sheet;
    this.way = [];
  }

  draw({ r, record }) {
    const { sheet } = this;
    const ctx = sheet.begin();
    const [friction, moment] = shares(r);
    const ahead = record.axis === 1 ? r.friction_y_n : r.friction_x_n;
    const most = Math.max(r.limit_n, 1e-3);
    const here = [(ahead < 0 ? -1 : 1) * friction * most, 100 * moment];
    const wide = nice(Math.max(0.3, most * 1.02));
    const f = frame(sheet, [-wide, wide], [-108, 108]);
    ticks(sheet, f, wide, 100);
    if (!r.regime) {
      this.way = [];
      sheet.text("no contact, no limit", (f.box[0] + f.box[2]) / 2, f.y(0) - 10, { align: "center" });
    } else {
      sheet.trace(Array.from({ length: 121 }, (_, i) => [f.x(Math.cos((i * Math.PI) / 60) * most), f.y(100 * Math.sin((i * Math.PI) / 60))]));
      ctx.globalAlpha = 0.13;
      sheet.fill(colour.stick);
      ctx.globalAlpha = 1;
      sheet.stroke(colour.slip, 2.5);
      const [x, y] = [f.x(here[0]), f.y(here[1])];
      this.way.push(here);
      if (this.way.length > 90) this.way.shift();
      sheet.polyline(this.way.map(([a, b]) => [f.x(a), f.y(b)]), colour.faint, 2);
      sheet.arrow(f.x(0), f.y(0), x - f.x(0), y - f.y(0), colour.stick, 2.5);
      sheet.dot(x, y, 4.5, colour.ink, colour.card);
    }
    sheet.text("twist, % of its limit", 8, 14, { size: 11.5 });
    sheet.text("friction, N", sheet.w - 12, sheet.h - 29, { align: "right" });
  }
}

export class Trace {
  constructor(sheet) {
    this.sheet = sheet;
  }

  draw({ record, time }) {
    const { sheet } = this;
    const { trace } = record;
    sheet.begin();
    const high = nice(Math.max(0.2, ...trace.map((p) => Math.max(p.normal, p.limit))));
    const f = frame(sheet, [time - WINDOW_S, time], [0, high]);
    const [l, t, right, b] = f.box;
    for (const y of [0, high / 2, high]) {
      sheet.polyline([[l, f.y(y)], [right, f.y(y)]], y === 0 ? colour.faint : colour.line);
      if (y !== high / 2) sheet.text(fixed(y, digits(high)), l - 7, f.y(y), { align: "right", base: "middle" });
    }
    for (let s = 0; s <= WINDOW_S; s += 5) sheet.text(s === 0 ? "now" : `−${s} s`, f.x(time - s), b + 15, { align: s === 0 ? "right" : "center" });
    const rows = [["normal", colour.muted, 1.5, []], ["limit", colour.slip, 1.75, [5, 4]], ["friction", colour.stick, 2.25, []]];
    for (const [name, tone, width, dash] of rows) sheet.polyline(trace.map((p) => [f.x(p.time), f.y(p[name])]), tone, width, dash);
    sheet.text("N", 8, 14, { size: 11.5 });
    let x = l;
    for (const [words, tone] of [["normal force", colour.muted], ["limit", colour.warn], ["friction", colour.stick]]) {
      sheet.text(words, x, t - 12, { fill: tone, weight: 600 });
      x += sheet.ctx.measureText(words).width + 14;
    }
  }
}
