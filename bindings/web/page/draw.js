// A canvas that is sharp at every size, and the page's colours.

const NAMES = ["ink", "muted", "faint", "line", "card", "stick", "between", "slip", "flesh", "skin", "bone", "nail", "glass", "warn", "low", "high"];
export const colour = {};

/** Reads the colours of the present scheme. */
export function readColours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of NAMES) colour[name] = style.getPropertyValue(`--${name}`).trim();
  for (let i = 0; i <= 16; i++) load[i] = mix(colour.low, colour.high, i / 16);
  for (let i = 0; i <= 8; i++) blend[i] = i < 4 ? mix(colour.slip, colour.between, i / 4) : mix(colour.between, colour.stick, i / 4 - 1);
}

const blend = [];
/** From slip (0) to stick (1). */
export function byStick(ratio) {
  return blend[Math.round(8 * Math.min(Math.max(ratio, 0), 1))];
}

const load = [];
/** From no pressure (0) to the largest (1). */
export function byPressure(share) {
  return load[Math.round(16 * Math.min(Math.max(share, 0), 1))];
}

function mix(a, b, t) {
  const part = (hex, i) => parseInt(hex.slice(1 + 2 * i, 3 + 2 * i), 16);
  return `rgb(${[0, 1, 2].map((i) => Math.round(part(a, i) * (1 - t) + part(b, i) * t)).join(" ")})`;
}

export class Sheet {
  constructor(canvas) {
    this.canvas = canvas;
    this.ctx = canvas.getContext("2d");
    this.fit();
    new ResizeObserver(() => this.fit()).observe(canvas);
  }

  fit() {
    const { width, height } = this.canvas.getBoundingClientRect();
    const dots = Math.min(devicePixelRatio || 1, 2.5);
    this.w = width;
    this.h = height;
    this.dots = dots;
    this.canvas.width = Math.max(1, Math.round(width * dots));
    this.canvas.height = Math.max(1, Math.round(height * dots));
  }

  /** An empty sheet in CSS pixels. */
  begin() {
    const { ctx } = this;
    ctx.setTransform(this.dots, 0, 0, this.dots, 0, 0);
    ctx.clearRect(0, 0, this.w, this.h);
    ctx.lineJoin = ctx.lineCap = "round";
    ctx.setLineDash([]);
    return ctx;
  }

  text(words, x, y, { align = "left", fill = colour.muted, size = 11.5, weight = 400, base = "alphabetic" } = {}) {
    const { ctx } = this;
    ctx.font = `${weight} ${size}px system-ui, sans-serif`;
    ctx.textAlign = align;
    ctx.textBaseline = base;
    ctx.fillStyle = fill;
    ctx.fillText(words, x, y);
  }

  /** Begins a figure through places. */
  trace(points) {
    this.ctx.beginPath();
    for (const [x, y] of points) this.ctx.lineTo(x, y);
  }

  fill(tone) {
    this.ctx.fillStyle = tone;
    this.ctx.fill();
  }

  stroke(tone, width = 1) {
    this.ctx.strokeStyle = tone;
    this.ctx.lineWidth = width;
    this.ctx.stroke();
  }

  polyline(points, tone, width, dash = []) {
    this.trace(points);
    this.ctx.setLineDash(dash);
    this.stroke(tone, width);
    this.ctx.setLineDash([]);
  }

  dot(x, y, radius, fill, ring) {
    const { ctx } = this;
    ctx.beginPath();
    ctx.arc(x, y, radius, 0, 7);
    this.fill(fill);
    if (ring) this.stroke(ring, 2);
  }

  arrow(x, y, dx, dy, stroke, width = 2.5) {
    const length = Math.hypot(dx, dy);
    if (length < 5) return;
    const [ux, uy] = [dx / length, dy / length];
    const head = Math.min(9, length * 0.6);
    const [tx, ty] = [x + dx, y + dy];
    this.polyline([[x, y], [tx - ux * head * 0.7, ty - uy * head * 0.7]], stroke, width);
    const side = [-0.48, 0.48].map((k) => [tx - head * (ux - k * uy), ty - head * (uy + k * ux)]);
    this.trace([[tx, ty], ...side]);
    this.fill(stroke);
  }
}

/** A minus sign that is as wide as a plus. */
export function fixed(x, digits) {
  const text = Math.abs(x).toFixed(digits);
  return x < 0 && Number(text) !== 0 ? `−${text}` : text;
}

/** The next of 1, 2, 5 times a power of ten. */
export function nice(x) {
  const power = 10 ** Math.floor(Math.log10(Math.max(x, 1e-9)));
  return [1, 1.5, 2, 3, 4, 5, 6, 8, 10].find((n) => n * power >= x * 0.999) * power;
}
