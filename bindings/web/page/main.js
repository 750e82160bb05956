// Joins the model, the hand that moves the body, and the views.

import { colour, fixed, readColours, Sheet } from "./draw.js";
import { Hand, STEP_S } from "./hand.js";
import { hashOf, restore } from "./link.js";
import { ContactMap } from "./map.js";
import { LAWS, Model } from "./model.js";
import { EXAMPLE, parsePath, Walk } from "./path.js";
import { LimitSurface, Loop, Record, Trace } from "./plots.js";
import { Side, tip } from "./side.js";
import { formulas, held, numbers, remarks, verdict } from "./words.js";

/** Longest time that one frame makes up for, s: a page that was hidden does not run after it. */
const MOST_S = 0.1;
/** Time for which a regime must last before it is announced, s. */
const ANNOUNCED_S = 0.12;
/** Time between two looks whether the address still fits, ms. */
const LINK_MS = 500;
const AXES = ["depth", "x", "y", "spin", "pitch", "roll"];
/** Words, range, step and unit of every slider. */
const SLIDERS = {
  depth: ["Depth", -0.3, 5, 0.01, " mm"],
  x: ["Slide along", -6, 6, 0.02, " mm"],
  y: ["Slide across", -6, 6, 0.02, " mm"],
  spin: ["Twist", -60, 60, 0.5, "°"],
  pitch: ["Pitch", 10, 70, 0.5, "°"],
  roll: ["Roll", -30, 30, 0.5, "°"],
  radius: ["Radius", 5, 60, 0.5, " mm"],
  axis: ["Direction", -90, 90, 5, "°"],
  angle: ["Angle of the edge", 30, 150, 5, "°"],
  moisture: ["Moisture", 5, 100, 1, " a.u."],
  temperature: ["Temperature", 20, 42, 0.5, " °C"],
  speed: ["Speed of sliding", -1, 2, 0.02, " mm/s"],
  noise: ["Size", 1, 10, 1, " µm"],
};
/** Numbers that bodies have: least, largest and usual radius (mm), usual axis and angle (degrees). */
const SHAPES = {
  plane: {},
  sphere: { radius: [8, 60, 20] },
  cylinder: { radius: [5, 60, 10], axis: 90 },
  edge: { radius: [2, 10, 4], axis: 90, angle: 90 },
};
const NUMBERS = { normal: "Normal force", friction: "Friction", limit: "Friction limit", band: "95 % band", moment: "Moment", area: "Contact area" };
const SKIN = { moisture: "hydration_au", temperature: "temperature_c", speed: "speed_mm_s" };
const REST = { hydration_au: 35, temperature_c: 32, speed_mm_s: 2 };

const el = (id) => document.getElementById(id);
const on = (node, type, act) => node.addEventListener(type, act);
const calm = matchMedia("(prefers-reduced-motion: reduce)");

class Page {
  constructor(model) {
    this.model = model;
    this.hand = new Hand(model.pitch);
    this.shape = { kind: "plane", radius: 20, axis: 90, angle: 90 };
    /** Pitch and roll in which the point about which poses turn is the one of first touch. */
    this.start_deg = [model.pitch, 0];
    this.record = new Record();
    this.r = model.response(0);
    this.work = [];
    this.left = 0;
    this.announced = { regime: -1, since: 0 };
    this.average = 0;
    this.loops = false;
    /** Values of the controls at rest, and the address that was written last. */
    this.rest = {};
    this.hash = null;
    this.views = {
      side: new Side(new Sheet(el("side"))),
      patch: new ContactMap(new Sheet(el("patch"))),
      loop: new Loop(new Sheet(el("loop"))),
      limit: new LimitSurface(new Sheet(el("limit"))),
      trace: new Trace(new Sheet(el("trace"))),
    };
  }

  // Time

  start() {
    let last = performance.now();
    const frame = (now) => {
      const from = performance.now();
      this.left += Math.min(Math.max(now - last, 0) / 1000, MOST_S);
      last = now;
      const steps = Math.floor(this.left / STEP_S);
      this.left -= steps * STEP_S;
      this.advance(steps);
      this.show();
      this.work.push([now, performance.now() - from]);
      if (this.work.length > 600) this.work.shift();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  /** Makes steps of the fixed length and takes note of each. */
  advance(steps) {
    const { model, hand, record } = this;
    for (let done = 0; done < steps; ) {
      const count = Math.min(steps - done, model.most);
      const places = [];
      for (let i = 0; i < count; i++) {
        hand.write(model.motions, i);
        places.push([...hand.at, hand.time]);
      }
      model.run(count);
      places.forEach((place, i) => {
        this.r = model.response(i);
        record.add(place, this.r, place[6]);
        this.average += 0.01 * (Math.hypot(this.r.friction_x_n, this.r.friction_y_n) - this.average);
      });
      done += count;
    }
    if (hand.walk?.done) this.ended();
  }

  ended() {
    if (this.loops) {
      this.play(this.path, true);
    } else {
      this.hand.take();
      this.walked("The path is at its end.");
    }
  }

  /** Lifts the finger off; the contact with the body starts again. */
  lift() {
    const { model, hand } = this;
    model.wasm.lift(hand.at[4], hand.at[5]);
    hand.body = [0, 0, 0];
    this.start_deg = this.shape.kind === "plane" ? [model.pitch, 0] : hand.at.slice(4);
    this.r = { ...this.r, regime: 0, area_mm2: 0 };
  }

  /** Puts another body under the finger, which then presses it as deep as before. */
  touch(change) {
    this.take();
    const { hand, model } = this;
    const { radius, axis, angle } = SHAPES[change.kind ?? this.shape.kind];
    if (change.kind) change = { radius: radius?.[2] ?? 20, axis: axis ?? 90, angle: angle ?? 90, ...change };
    Object.assign(this.shape, change);
    model.touch(this.shape);
    const [depth, , , , pitch, roll] = hand.target;
    hand.at = [-0.3, 0, 0, 0, pitch, roll];
    hand.target = [depth, 0, 0, 0, pitch, roll];
    this.lift();
    this.record.clear();
    this.shaped();
  }

  /** Shows the numbers that the body has. */
  shaped() {
    const { shape } = this;
    const has = SHAPES[shape.kind];
    el("kind").value = shape.kind;
    if (has.radius) [el("radius").min, el("radius").max] = has.radius;
    for (const id of ["radius", "axis", "angle"]) {
      document.querySelector(`[for=${id}]`).hidden = !(id in has);
      el(id).value = shape[id];
      output(el(id), fixed(shape[id], id === "radius" ? 1 : 0));
    }
  }

  // Views

  show() {
    const { model, hand, record, r } = this;
    const scene = {
      at: hand.at,
      r,
      patches: r.regime > 0 ? model.patches() : [],
      touch: r.regime > 0,
      focus: document.activeElement === el("patch"),
      record,
      time: hand.time,
      body: hand.body,
      shape: this.shape,
      start: this.start_deg,
      tip: tip(hand.at[4], this.start_deg[0]),
      height: model.wasm.height,
    };
    for (const view of Object.values(this.views)) view.draw(scene);
    this.announce();
    this.follow();
  }

  announce() {
    const { r, hand } = this;
    if (r.regime !== this.announced.seen) Object.assign(this.announced, { seen: r.regime, since: hand.time });
    if (r.regime !== this.announced.regime && hand.time - this.announced.since >= ANNOUNCED_S) {
      this.announced.regime = r.regime;
      [el("regime").textContent, el("plain").textContent] = verdict(r);
    }
    say("remark", remarks(r));
    for (const [name, words] of Object.entries(numbers(r))) say(`n-${name}`, words);
    gauge("stick", r.stick_ratio);
    gauge("margin", r.margin);
    this.tellHeld();
  }

  /** Shows the effect of a disturbance on a static load. */
  tellHeld() {
    const { hand } = this;
    const shaken = hand.disturbance.noise_um > 0 || hand.disturbance.vibrates;
    const still = !hand.walk && hand.at.every((x, i) => Math.abs(x - hand.target[i]) < 1e-3);
    if (!shaken || !still || !this.r.regime) {
      this.held = null;
      return;
    }
    this.held ??= { friction: this.average, time: hand.time };
    say("held", held(this.held.friction, this.average, hand.time - this.held.time));
  }

  /** Sliders show where the body is. */
  follow() {
    const { hand } = this;
    AXES.forEach((name, i) => {
      const input = el(name);
      const value = hand.walk ? hand.at[i] : hand.target[i];
      if (document.activeElement !== input || hand.walk) input.value = value;
      output(input, fixed(value, i < 3 ? 2 : 0));
    });
    if (hand.walk) gauge("progress", hand.walk.share);
  }

  // The address

  /** Writes the state into the address; a path that plays leaves it as it is. */
  link() {
    if (this.hand.walk) return;
    const hash = hashOf(this);
    el("link").href = hash || "#";
    if (hash === this.hash) return;
    this.hash = hash;
    history.replaceState(null, "", hash || location.pathname + location.search);
  }

  /** Restores the state of an address. */
  goTo(hash) {
    const refused = restore(this, hash);
    this.hash = hash;
    notice(refused.length ? `The link was restored but for: ${refused.join("; ")}.` : "");
  }

  /** Saves the last ten seconds as a file. */
  save() {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([this.record.csv()], { type: "text/csv" }));
    link.download = "fingerpad-trace.csv";
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  // Hands

  /** The visitor takes over. */
  take() {
    if (!this.hand.walk) return;
    this.hand.take();
    this.walked("Stopped: the body is yours.");
  }

  /** Requests a position, within the limits of the sliders. */
  ask(axis, value) {
    const input = el(AXES[axis]);
    this.hand.target[axis] = Math.min(Math.max(value, Number(input.min)), Number(input.max));
  }

  play(path, loops, words) {
    this.path = path;
    this.loops = loops;
    if (!loops || this.record.trace.length === 0) this.record.clear();
    this.hand.follow(new Walk(path, STEP_S, this.model.pitch));
    this.lift();
    el("play").textContent = "Stop";
    if (words) say("walk", words);
  }

  walked(words) {
    this.loops = false;
    this.hand.walk = null;
    el("play").textContent = "Play the example";
    say("walk", words);
  }

  reset() {
    this.walked("");
    this.hand.at = [-0.3, 0, 0, 0, this.model.pitch, 0];
    this.hand.target = [...this.hand.at];
    this.lift();
    this.record.clear();
    gauge("progress", 0);
  }

  /** Tissue that relaxes: its force falls while the finger holds. The finger touches anew. */
  relax(isAssumed) {
    this.model.relax(isAssumed);
    this.lift();
    this.record.clear();
  }

  skinChanged() {
    const { hydration_au, temperature_c, speed_mm_s } = this.hand.skin;
    const factor = this.model.wasm.strength(hydration_au, temperature_c, speed_mm_s);
    el("factor").textContent = Math.abs(factor - 1) < 5e-4 ? "" : `strength × ${fixed(factor, 2)}`;
  }

  /** Opens a model file or a path; what is in use stays if it is neither. */
  async open(file) {
    try {
      const bytes = new Uint8Array(await file.arrayBuffer());
      if (/\.csv$/i.test(file.name)) {
        const path = parsePath(new TextDecoder().decode(bytes));
        const over = path.passedOver.length ? ` Columns passed over: ${path.passedOver.join(", ")}.` : "";
        this.play(path, false, `${file.name}: ${path.rows.length} rows.${over}`);
        notice("");
      } else {
        this.model.load(bytes);
        this.model.relax(el("relaxes").checked);
        this.lift();
        this.record.clear();
        this.named(file.name);
        el("finger").value = file.name;
        notice(`${file.name} is in use now.`, true);
      }
    } catch (error) {
      notice(`${file.name} was not opened: ${error.message}. Nothing has changed.`);
    }
  }

  /** Shows which model is in use. */
  named(name) {
    const { model } = this;
    el("model").textContent = `${name}, ${model.areas.length} patches, fitted to ${fixed(model.depthMax, 1)} mm`;
    const ranges = { depth: [-0.3, Math.floor(100 * model.depthMax) / 100], pitch: [model.pitchLow, model.pitchHigh], roll: [-model.rollMax, model.rollMax] };
    for (const [id, [low, high]] of Object.entries(ranges)) [el(id).min, el(id).max] = [low, high];
    el("formulas").textContent = formulas(model, LAWS).join("\n");
    this.skinChanged();
  }
}

function say(id, words) {
  const node = el(id);
  if (node.textContent !== words) node.textContent = words;
}

/** Fills in what comes from tables. */
function furnish() {
  for (const [id, [words, min, max, step]] of Object.entries(SLIDERS)) {
    document.querySelector(`[for=${id}]`).innerHTML = `${words} <output></output><input id="${id}" type="range" min="${min}" max="${max}" step="${step}">`;
  }
  el("numbers").innerHTML = Object.entries(NUMBERS).map(([id, words]) => `<dt>${words}<dd id="n-${id}">`).join("");
}

function gauge(id, share) {
  el(id).style.width = `${100 * share}%`;
}

function output(input, words) {
  const node = input.parentElement.querySelector("output");
  const text = words + SLIDERS[input.id][4];
  if (node.textContent !== text) node.textContent = text;
}

function notice(words, good = false) {
  const node = el("alert");
  node.hidden = words === "";
  node.classList.toggle("good", good);
  node.textContent = words;
}

/** Sliders, switches and buttons. */
function controls(page) {
  const { hand } = page;
  AXES.forEach((name, i) => on(el(name), "input", (event) => {
    page.take();
    page.ask(i, Number(event.target.value));
  }));
  const skin = (id, value) => {
    hand.skin[SKIN[id]] = id === "speed" ? 10 ** value : value;
    output(el(id), fixed(hand.skin[SKIN[id]], id === "speed" ? 1 : 0));
  };
  for (const id of Object.keys(SKIN)) {
    const rest = REST[SKIN[id]];
    el(id).value = id === "speed" ? Math.log10(rest) : rest;
    output(el(id), fixed(rest, id === "speed" ? 1 : 0));
    on(el(id), "input", (event) => {
      skin(id, Number(event.target.value));
      page.skinChanged();
    });
  }
  const disturb = () => {
    const size = Number(el("noise").value);
    hand.disturbance = { noise_um: el("noisy").checked ? size : 0, vibrates: el("vibrates").checked };
    page.held = null;
    output(el("noise"), String(size));
  };
  el("noise").value = 5;
  for (const id of ["noisy", "noise", "vibrates"]) on(el(id), "input", disturb);
  disturb();
  on(el("relaxes"), "input", (event) => page.relax(event.target.checked));
  on(el("kind"), "change", (event) => page.touch({ kind: event.target.value }));
  for (const id of ["radius", "axis", "angle"]) on(el(id), "input", (event) => page.touch({ [id]: Number(event.target.value) }));
  page.shaped();
  for (const shows of ["pressure", "stick"]) on(el(`by-${shows}`), "change", () => { page.views.patch.shows = shows; });
  on(el("play"), "click", () => (hand.walk ? page.take() : page.play(parsePath(EXAMPLE), false, "The example path.")));
  on(el("reset"), "click", () => page.reset());
  on(el("save"), "click", () => page.save());
  on(el("finger"), "change", async ({ target: { value: name } }) => {
    const response = await fetch(name);
    page.open({ name, arrayBuffer: () => response.arrayBuffer() });
  });
  on(el("open"), "change", (event) => {
    if (event.target.files[0]) page.open(event.target.files[0]);
    event.target.value = "";
  });
}

/** Dragging in a view: the body, from the side also the finger, which it pitches. */
function pointers(page) {
  const { hand } = page;
  for (const name of ["side", "patch"]) {
    const canvas = el(name);
    const view = page.views[name];
    let drag = null;
    on(canvas, "pointerdown", (event) => {
      page.take();
      canvas.setPointerCapture(event.pointerId);
      const [x, y] = [event.offsetX, event.offsetY];
      const twists = name === "patch" && Math.hypot(x - view.knob(hand.at[3])[0], y - view.knob(hand.at[3])[1]) < 26;
      const pitches = name === "side" && y < view.origin[1] - 4 * view.scale;
      drag = { x, y, from: [...hand.target], twists, pitches, angle: angle(view, x, y) };
    });
    on(canvas, "pointermove", (event) => {
      if (!drag) return;
      const [dx, dy] = [(event.offsetX - drag.x) / view.scale, (event.offsetY - drag.y) / view.scale];
      if (drag.twists || drag.pitches) {
        const turned = ((angle(view, event.offsetX, event.offsetY) - drag.angle + 540) % 360) - 180;
        page.ask(drag.twists ? 3 : 4, drag.from[drag.twists ? 3 : 4] + turned);
      } else {
        page.ask(1, drag.from[1] + dx);
        page.ask(name === "side" ? 0 : 2, name === "side" ? drag.from[0] - dy : drag.from[2] + dy);
      }
    });
    for (const end of ["pointerup", "pointercancel"]) on(canvas, end, () => { drag = null; });
  }
}

/** Angle of a place about the contact in a view, clockwise in the picture, degrees. */
function angle(view, x, y) {
  const [mx, my] = view.middle ?? view.origin;
  return (Math.atan2(y - my, x - mx) * 180) / Math.PI;
}

/** Keys in the two views: axis and step. */
const KEYS = {
  side: { ArrowLeft: [1, -0.1], ArrowRight: [1, 0.1], ArrowUp: [0, 0.05], ArrowDown: [0, -0.05], w: [4, 1], s: [4, -1] },
  patch: { ArrowLeft: [1, -0.1], ArrowRight: [1, 0.1], ArrowUp: [2, -0.1], ArrowDown: [2, 0.1], q: [3, -2], e: [3, 2], a: [5, -1], d: [5, 1] },
};

function keys(page) {
  for (const [name, map] of Object.entries(KEYS)) {
    on(el(name), "keydown", (event) => {
      const move = map[event.key] ?? map[event.key.toLowerCase()];
      if (!move || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      page.take();
      page.ask(move[0], page.hand.target[move[0]] + move[1] * (event.shiftKey ? 5 : 1));
    });
  }
}

function drops(page) {
  const over = (on) => (event) => {
    event.preventDefault();
    document.body.classList.toggle("drop", on);
  };
  on(window, "dragover", over(true));
  on(window, "dragleave", over(false));
  on(window, "drop", (event) => {
    over(false)(event);
    if (event.dataTransfer?.files[0]) page.open(event.dataTransfer.files[0]);
  });
}

async function begin() {
  furnish();
  readColours();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", readColours);
  // A browser may remember another choice from the visit before.
  el("finger").selectedIndex = 0;
  const shipped = el("finger").value;
  const bytes = async (stream) => new Uint8Array(await new Response(stream).arrayBuffer());
  const { body } = await fetch("fingerpad.wasm.deflate");
  const model = await Model.start(await bytes(body.pipeThrough(new DecompressionStream("deflate-raw"))));
  model.load(await bytes((await fetch(shipped)).body));
  const page = new Page(model);
  controls(page);
  pointers(page);
  keys(page);
  drops(page);
  page.named(shipped);
  for (const input of document.querySelectorAll("input[type=range]")) page.rest[input.id] = input.value;
  AXES.forEach((id, i) => { page.rest[id] = page.hand.at[i]; });
  on(window, "hashchange", () => { if (location.hash !== page.hash) page.goTo(location.hash); });
  setInterval(() => page.link(), LINK_MS);
  if (location.hash.length > 1) {
    page.goTo(location.hash);
  } else if (calm.matches) {
    page.hand.target = [1.1, 1.6, 0, 0, model.pitch, 0];
    page.hand.at[0] = 1.1;
  } else {
    page.play(parsePath(EXAMPLE), true, "The example plays until you touch something.");
  }
  page.start();
  // For the console and the tests.
  globalThis.fingerpad = Object.assign(page, { Walk, parsePath, colour });
}

begin().catch((error) => notice(`The page could not start: ${error.message}. It needs a web server`));
