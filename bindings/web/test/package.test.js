// The npm package, packed and installed in a folder of its own: the bits of the core, its README, its types, and bad arguments.
// STORY is a folder with the requests of the bindings and the answers of the core (bindings/c/story).

import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { copyFileSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { verdict } from "../page/words.js";
import { PACKAGE, WEB } from "./folder.js";
import { nativeSteps, path } from "./native.js";

const STEPS = 3000;
const RESULT = 15;
const BODIES = [
  [{ kind: "plane" }, [30, 0]],
  [{ kind: "sphere", radius_mm: 20 }, [45, -10]],
  [{ kind: "cylinder", radius_mm: 10, axis_deg: 90 }, [30, 0]],
  [{ kind: "edge", radius_mm: 4, axis_deg: 30, angle_deg: 100 }, [25, 5]],
];
let folder, installed;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), "fingerpad-npm-"));
  const packed = JSON.parse(execFileSync("npm", ["pack", "--json", "--pack-destination", folder, PACKAGE], { encoding: "utf8" }))[0];
  writeFileSync(join(folder, "package.json"), '{"name": "user", "private": true, "type": "module"}');
  execFileSync("npm", ["install", "--offline", "--no-audit", "--no-fund", join(folder, packed.filename)], { cwd: folder });
  installed = join(folder, "node_modules/fingerpad");
});

after(() => rmSync(folder, { recursive: true, force: true }));

const load = () => import(pathToFileURL(join(installed, "index.js")));

test("steps have the bits of the core", async () => {
  const { Finger, REGIMES } = await load();
  const finger = await Finger.create();
  for (const [body, [pitch_deg, roll_deg]] of BODIES) {
    for (const disturbed of [false, true]) {
      const motions = path(STEPS, 11, disturbed);
      const { kind, radius_mm: radius = 0, axis_deg: axis = 0, angle_deg: angle = 90 } = body;
      const native = nativeSteps(motions, { kind, radius, axis, angle }, [pitch_deg, roll_deg]);
      const floats = new Float32Array(native.buffer);
      finger.lift({ body, pitch_deg, roll_deg });
      const seen = new Set();
      for (let i = 0; i < STEPS; i++) {
        const [depth_mm, slide_x_mm, slide_y_mm, spin_rad, dt_s, pitch, roll, hydration_au, temperature_c, speed_mm_s] = motions.subarray(10 * i, 10 * i + 10);
        const r = finger.step({ depth_mm, slide_x_mm, slide_y_mm, spin_rad, dt_s, pitch_deg: pitch, roll_deg: roll, hydration_au, temperature_c, speed_mm_s });
        const at = RESULT * i;
        const found = [r.normal_force_n, ...r.friction_n, r.stick_ratio, r.friction_limit_n, r.slip_margin, r.spin_moment_n_mm];
        assert.deepEqual(found, Array.from(floats.subarray(at, at + 7)), `${kind}, step ${i}`);
        assert.equal(r.slip_margin_relaxed, floats[at + 12]);
        assert.equal(r.regime, REGIMES[native[at + 13]]);
        assert.equal(r.status, native[at + 14]);
        seen.add(r.regime);
      }
      assert.ok(seen.size >= 3, `${kind}: ${[...seen]}`);
    }
  }
});

/** A shape of the story: its kind and five numbers. */
function shapeOf(kind, [a, b, c, edge_radius_mm, angle_deg], SHAPES) {
  const of = [{}, { radius_mm: a }, { semi_axes_mm: [a, b, c] }, { radius_mm: a, half_length_mm: b }, { radius_mm: a, half_length_mm: b }, { radius_mm: a, angle_deg }, { half_mm: [a, b, c], edge_radius_mm }];
  return { kind: SHAPES[kind], ...of[kind] };
}

test("contacts in frames have the bits of the core, on the requests of all bindings", async () => {
  const { FrameContact, REGIMES, SHAPES } = await load();
  const [requests, answers] = ["story.txt", "answers.txt"].map((name) => readFileSync(join(process.env.STORY, name), "utf8").trim().split("\n"));
  const bits = (words) => Uint32Array.from(words, (word) => parseInt(word, 16));
  const floats = (words) => [...new Float32Array(bits(words).buffer)];
  const faces = new Set();
  let [file, pad, contact, poses, touching] = [[], undefined, undefined, 0, 0];
  for (const [i, request] of requests.entries()) {
    const [name, ...words] = request.split(" ");
    const answer = answers[i].trim().split(" ");
    if (name === "pad-words") file.push(...bits(words));
    if (name === "pad-load") {
      pad = new Uint8Array(Uint32Array.from(file).buffer, 0, file[2]);
      [file, contact] = [[], undefined];
    }
    if (name === "shape") {
      const shape = shapeOf(parseInt(words[0], 16), floats(words.slice(1)), SHAPES);
      if (answer[0] !== "0") {
        assert.throws(() => contact.begin(shape), RangeError, request);
      } else if (contact) {
        contact.begin(shape);
      } else {
        contact = await FrameContact.create({ shape, pad });
      }
    }
    if (name === "pose") {
      const [x, y, z, w, a, b, c, dt_s] = floats(words);
      const r = contact.step({ position_mm: [x, y, z], quaternion_wxyz: [w, a, b, c], dt_s });
      const found = [...r.on_finger.force_n, ...r.on_finger.moment_n_mm, ...r.on_body.force_n, ...r.on_body.moment_n_mm, r.depth_mm, r.pitch_deg, r.roll_deg];
      found.push(r.normal_force_n, ...r.friction_n, r.stick_ratio, r.friction_limit_n, r.slip_margin, r.slip_margin_relaxed, r.spin_moment_n_mm, ...r.pressure_centre_mm, r.contact_area_mm2, r.band_normal_n, r.band_friction_n);
      const expected = floats([...answer.slice(0, 15), ...[0, 1, 2, 5, 6, 7, 8, 9, 12, 13, 14, 15, 16].map((k) => answer[16 + k])]);
      assert.deepEqual(found, expected, `request ${i}: ${request}`);
      assert.deepEqual([r.face, r.regime, r.status], [Number(answer[15]), REGIMES[answer[33]], parseInt(answer[34], 16)], `request ${i}: ${request}`);
      if (r.regime !== "no_contact") touching++;
      faces.add(r.face);
      poses++;
    }
  }
  assert.ok(poses > 1500 && touching > 700 && faces.size >= 3, `${poses} poses, ${touching} in contact, faces ${[...faces]}`);
});

test("tissue that relaxes: a hold whose force falls as its branches do, and the margin that is left", async () => {
  const { Finger } = await load();
  const finger = await Finger.create();
  const slow = finger.step({ depth_mm: 1 });
  finger.relax(true);
  const first = finger.step({ depth_mm: 1, dt_s: 1e-6 });
  let [r, time] = [first, 0];
  for (let k = 0; k < 800; k++) {
    const dt_s = 1e-4 * 1.015 ** k;
    time += dt_s;
    r = finger.step({ depth_mm: 1, dt_s });
    const over = 1 + Math.exp(-time / 0.004) + 0.6 * Math.exp(-time / 0.07) + 0.6 * Math.exp(-time / 1.4);
    assert.ok(Math.abs((3.2 * r.normal_force_n) / first.normal_force_n / over - 1) < 5e-3, `${time} s`);
  }
  assert.ok(first.slip_margin_relaxed < first.slip_margin - 1e-3 && Math.abs(r.slip_margin - r.slip_margin_relaxed) < 1e-5);
  for (const dt_s of [0, -1, NaN]) assert.ok(finger.step({ depth_mm: 1, dt_s }).status !== 0);
  finger.relax(false);
  assert.deepEqual(finger.step({ depth_mm: 1 }), slow);
});

test("without skin and speed the strength is that of the model file", async () => {
  const { Finger } = await load();
  const slid = async (extra) => {
    const finger = await Finger.create();
    for (let k = 1; k <= 100; k++) finger.step({ depth_mm: 0.015 * k });
    let r;
    for (let k = 0; k < 200; k++) r = finger.step({ depth_mm: 1.5, slide_x_mm: 0.05, ...extra });
    return r;
  };
  const [plain, fast, wet] = [await slid({}), await slid({ speed_mm_s: 0 }), await slid({ hydration_au: 60 })];
  assert.equal(plain.regime, "slip");
  assert.ok(Math.abs(plain.friction_n[0]) > 0.1 && plain.status === 0);
  assert.notEqual(fast.friction_n[0], plain.friction_n[0]);
  assert.ok(Math.abs(wet.friction_n[0]) > Math.abs(plain.friction_n[0]));
  const patches = await (async () => {
    const finger = await Finger.create();
    const r = finger.step({ depth_mm: 1.5 });
    return [r, finger.patches()];
  })();
  const area = patches[1].reduce((sum, patch) => sum + patch.contact_area_mm2, 0);
  assert.ok(Math.abs(area / patches[0].contact_area_mm2 - 1) < 0.05, `${area} ${patches[0].contact_area_mm2}`);
});

test("bad arguments are named with their value and range", async () => {
  const { Finger } = await load();
  const finger = await Finger.create();
  const refuses = (options, text) => assert.throws(() => finger.lift(options), (error) => error instanceof RangeError && error.message.includes(text));
  refuses({ body: { kind: "torus" } }, "torus");
  refuses({ body: { kind: "sphere", radius_mm: 0 } }, "body.radius_mm: 0 is not a number from 0.1");
  refuses({ body: { kind: "edge", radius_mm: 2, angle_deg: 180 } }, "body.angle_deg: 180");
  refuses({ pitch_deg: 85 }, "pitch_deg: 85");
  assert.throws(() => finger.step({}), /depth_mm must be given/);
  for (const nothing of [null, undefined, 3]) {
    assert.throws(() => finger.step(nothing), { name: "TypeError", message: `step: a motion is needed, an object, where ${nothing} is given` });
  }
  const { FrameContact } = await load();
  const contact = await FrameContact.create({ shape: { kind: "cuboid", half_mm: [15, 15, 15], edge_radius_mm: 2 } });
  for (const [shape, text] of [
    [{ kind: "torus" }, "shape.kind: torus is none of plane, sphere,"],
    [undefined, "shape.kind: undefined"],
    [{ kind: "sphere", radius_mm: 0 }, "shape.radius_mm: 0 is not a number from 0.1"],
    [{ kind: "cuboid", half_mm: [1, NaN, 1], edge_radius_mm: 1 }, "shape.half_mm: NaN is not a number from 0.1"],
    [{ kind: "cuboid", half_mm: 3, edge_radius_mm: 1 }, "shape.half_mm: 3 where 3 numbers are needed"],
    [{ kind: "edge", radius_mm: 3, angle_deg: 180 }, "shape.angle_deg: 180 is not a number from 1 to 179"],
  ]) assert.throws(() => contact.begin(shape), (error) => error.message.includes(text));
  const pose = { position_mm: [0, 0, -14], quaternion_wxyz: [1, 0, 0, 0] };
  assert.throws(() => contact.step(null), /step: a placement is needed, an object, where null is given/);
  assert.throws(() => contact.step({ ...pose, position_mm: [0, 0] }), /position_mm: 0,0 where 3 numbers are needed/);
  assert.throws(() => contact.step({ ...pose, strength_factor: "1" }), /strength_factor: 1 where 1 numbers are needed/);
  assert.ok(contact.step({ ...pose, quaternion_wxyz: [2, 0, 0, 0] }).status !== 0);
  const before = finger.step({ depth_mm: 1 });
  const bad = finger.step({ depth_mm: NaN });
  assert.ok(bad.status !== 0 && bad.normal_force_n === before.normal_force_n);
  await assert.rejects(Finger.create({ pad: readFileSync(join(installed, "index.js")) }), /not a model file/);
});

test("a program in TypeScript compiles, with and without the types of a browser", () => {
  copyFileSync(join(WEB, "test/types.ts"), join(folder, "types.ts"));
  const compiler = createRequire(import.meta.url).resolve("typescript/bin/tsc");
  const options = ["--noEmit", "--strict", "--target", "es2022", "--module", "nodenext"];
  for (const lib of ["es2022", "es2022,dom"]) {
    const { status, stdout } = spawnSync(process.execPath, [compiler, ...options, "--lib", lib, "types.ts"], { cwd: folder, encoding: "utf8" });
    assert.equal(status, 0, `--lib ${lib}:\n${stdout}`);
  }
});

test("the README's examples run", () => {
  const examples = [...readFileSync(join(installed, "README.md"), "utf8").matchAll(/```js\n([\s\S]*?)```/g)];
  const [slide, frames] = examples.map(([, example]) => {
    writeFileSync(join(folder, "example.js"), example);
    return execFileSync(process.execPath, ["example.js"], { cwd: folder, encoding: "utf8" }).trim().split("\n");
  });
  assert.equal(slide.length, 50);
  assert.match(slide.at(-1), /slip$/);
  // A block of 20 mm, pressed in by 1 mm.
  assert.match(frames.at(-1), /^face 3, 0\.29 N on the block/);
});

test("the names of numbers out of range are those of the core, in its order", () => {
  const core = readFileSync(join(WEB, "../../core/src/error.rs"), "utf8");
  const body = core.slice(core.indexOf("pub enum Field {"));
  const variants = [...body.slice(0, body.indexOf("\n}")).matchAll(/^ {4}(\w+),$/gm)].map(([, name]) => name);
  const names = readFileSync(join(WEB, "page/model.js"), "utf8").match(/const FIELDS = "([^"]+)"/)[1].split(" ");
  assert.ok(variants.length > 40);
  assert.deepEqual(names, variants);
});

test("the page says that all of a contact holds only where all of it does", () => {
  const plain = (stick_ratio) => verdict({ regime: 1, stick_ratio })[1];
  assert.match(plain(1), /^All of the contact/);
  assert.match(plain(0.999), /^Almost all of the contact/);
});
