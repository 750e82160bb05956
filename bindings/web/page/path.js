// A recorded path of the body: the project's CSV, checked, and read at any time.

const NEEDED = ["t_s", "depth_mm", "slide_x_mm", "slide_y_mm"];
const TURNS = ["spin_deg", "pitch_deg", "roll_deg"];
const FORCES = ["normal_force_n", "friction_x_n", "friction_y_n", "spin_moment_n_mm", "moment_y_n_mm", "moment_x_n_mm"];

export const EXAMPLE = `t_s,depth_mm,slide_x_mm,slide_y_mm,spin_deg,pitch_deg,roll_deg
0,-0.2,0,0,0,30,0
1,1.2,0,0,0,30,0
3,1.2,4,0,0,30,0
6,1.2,-3,0,0,30,0
8,1.2,1,0,0,30,0
9,1.2,1,0,24,30,0
10,1.2,1,0,-10,30,0
11.5,1.6,1,0,-10,48,0
13,1.6,1,0,-10,30,16
14.5,2.6,2.5,2.6,-10,22,-8
16,1.4,1,-0.5,0,30,0
17,-0.2,0,0,0,30,0
17.5,-0.2,0,0,0,30,0
`;

/** Cells of a line; quotes may stand around one. */
function cells(line) {
  return line.split(",").map((cell) => cell.trim().replace(/^"(.*)"$/, "$1").trim());
}

/** Reads a path; throws with line, column and value. Columns that a motion does not need are passed over. */
export function parsePath(text) {
  const lines = text.replace(/^\ufeff/, "").split(/\r\n|\n|\r/).map((line, i) => [i + 1, line]).filter(([, line]) => line.trim() !== "");
  if (lines.length === 0) throw new Error("the file is empty");
  const [[headLine, headText], ...body] = lines;
  const head = cells(headText);
  const at = Object.fromEntries(head.map((name, i) => [name, i]));
  for (const name of NEEDED) {
    if (name in at) continue;
    const forces = FORCES.filter((force) => force in at);
    const hint = forces.length > 0 ? `; the page replays motions, \`fingerpad eval\` also forces (${forces.join(", ")})` : `; columns are ${[...NEEDED, ...TURNS].join(", ")}`;
    throw new Error(`line ${headLine}: no column \`${name}\`${hint}`);
  }
  if (new Set(head).size < head.length) throw new Error(`line ${headLine}: a column stands twice`);
  const used = [...NEEDED, ...TURNS.filter((name) => name in at)];
  const rows = [];
  for (const [line, row] of body) {
    const values = cells(row);
    if (values.length !== head.length) throw new Error(`line ${line}: ${values.length} cells where the header has ${head.length}`);
    const numbers = used.map((name) => {
      const cell = values[at[name]];
      const value = cell === "" ? NaN : Number(cell);
      if (!Number.isFinite(value)) throw new Error(`line ${line}: column \`${name}\`: \`${cell}\` is ${cell === "" ? "missing" : "not a finite number"}`);
      return value;
    });
    const before = rows.at(-1);
    if (before && numbers[0] <= before[0]) throw new Error(`line ${line}: column \`t_s\`: \`${values[at[NEEDED[0]]]}\` is not after ${before[0]} of the row before; time must increase`);
    rows.push(numbers);
  }
  if (rows.length < 2) throw new Error(`the file ends after ${rows.length} row(s) of values; at least 2 needed`);
  return { rows, used, passedOver: head.filter((name) => !used.includes(name)) };
}

/** A path that is walked along in steps of `dt` seconds from its start: place i belongs to time i dt. */
export class Walk {
  constructor(path, dt, pitch) {
    this.rows = path.rows;
    this.columns = ["depth_mm", "slide_x_mm", "slide_y_mm", ...TURNS].map((name) => path.used.indexOf(name));
    this.rest = [0, 0, 0, 0, pitch, 0];
    this.dt = dt;
    this.from = this.rows[0][0];
    this.duration = this.rows.at(-1)[0] - this.from;
    this.steps = Math.ceil(this.duration / dt);
    this.i = 0;
    this.k = 0;
  }

  /** The next place, straight between rows: depth, slides in mm, spin, pitch and roll in degrees. */
  next() {
    const { rows } = this;
    const time = Math.min(this.from + this.i * this.dt, rows.at(-1)[0]);
    while (this.k + 2 < rows.length && rows[this.k + 1][0] < time) this.k++;
    const [a, b] = [rows[this.k], rows[this.k + 1]];
    const share = Math.min(Math.max((time - a[0]) / (b[0] - a[0]), 0), 1);
    this.i++;
    return this.columns.map((c, n) => (c < 0 ? this.rest[n] : a[c] + (b[c] - a[c]) * share));
  }

  get done() {
    return this.i > this.steps;
  }

  get share() {
    return Math.min(this.i / Math.max(this.steps, 1), 1);
  }
}
