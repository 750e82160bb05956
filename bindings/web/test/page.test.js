// The page in headless Chromium: bits against the host, frames, hands, keys, files, a phone's width.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { crc32 } from "node:zlib";
import { MODEL, SITE, WEB } from "./folder.js";
import { bodyWords, nativeSteps, path, reference, withFile, words } from "./native.js";
import { PATH } from "./paths.js";
import { browser, open, serve } from "./serve.js";

const STEPS = 6000;
/** Words of a response and of a patch. */
const [RESULT, PATCH] = [15, 9];
/** Bodies and the poses over their apex. */
const BODIES = [
  [{ kind: "plane", radius: 20, axis: 0, angle: 90 }, [30, 0]],
  [{ kind: "sphere", radius: 20, axis: 0, angle: 90 }, [45, -10]],
  [{ kind: "cylinder", radius: 10, axis: 90, angle: 90 }, [30, 0]],
  [{ kind: "edge", radius: 4, axis: 30, angle: 100 }, [25, 5]],
];
const ROOT = join(WEB, "../..");
let server, running, shared;
const opened = [];

async function start(options = {}) {
  const one = await open(running, server.address, { viewport: { width: 1200, height: 850 }, ...options });
  opened.push(one.seen);
  return one.page;
}

before(async () => {
  server = await serve(SITE);
  running = await browser();
  shared = await start();
});

after(async () => {
  await running.close();
  server.close();
});

/** Steps in the page's module, in batches: the words of all responses, then of the patches after the last one. */
function steps(page, motions, body, pose) {
  return page.evaluate(([numbers, body, pose, result]) => {
    const { model } = globalThis.fingerpad;
    const [motions, words] = [Float32Array.from(numbers, (x) => x ?? NaN), []];
    model.touch(body);
    model.wasm.lift(...pose);
    for (let from = 0; from < motions.length / 10; from += model.most) {
      const batch = motions.subarray(10 * from, 10 * (from + model.most));
      model.motions.set(batch);
      model.run(batch.length / 10);
      words.push(...model.words.subarray(0, (result * batch.length) / 10));
    }
    const count = model.wasm.look();
    return [...words, ...new Uint32Array(model.patchStates.buffer, model.patchStates.byteOffset, 9 * count)];
  }, [Array.from(motions, (x) => (Number.isNaN(x) ? null : x)), body, pose, RESULT]);
}

function same(page, native, what) {
  assert.equal(page.length, native.length, what);
  for (let i = 0; i < native.length; i++) {
    if (page[i] !== native[i]) assert.fail(`${what}: step ${Math.floor(i / RESULT)}, output ${i % RESULT}: ${page[i].toString(16)} in the page, ${native[i].toString(16)} on the host`);
  }
}

const text = (page, id) => page.locator(`#${id}`).textContent();
const friction = async (page) => parseFloat(await text(page, "n-friction"));

for (const [body, pose] of BODIES) {
  for (const disturbed of [false, true]) {
    test(`the page has the host's bits on a ${disturbed ? "disturbed" : "clean"} path, steps and patches: ${body.kind}`, async () => {
      const seed = (Date.now() % 1e9) + Number(disturbed);
      console.log(`seed ${seed}`);
      const page = await start({ reducedMotion: "reduce" });
      const motions = path(STEPS, seed, disturbed);
      const native = nativeSteps(motions, body, pose);
      const responses = native.subarray(0, RESULT * STEPS);
      const regimes = new Set(responses.filter((_, i) => i % RESULT === RESULT - 2));
      assert.deepEqual([...regimes].sort(), [0, 1, 2, 3], "the path must see air, stick, partial slip and slip");
      assert.equal(native.length, RESULT * STEPS + 37 * PATCH);
      same(await steps(page, motions, body, pose), native, `seed ${seed}`);
      await page.close();
    });
  }
}

test("a recorded path is replayed with the host's bits", async () => {
  const file = join(ROOT, "data/examples/path.csv");
  const turned = "t_s,depth_mm,slide_x_mm,slide_y_mm,spin_deg,pitch_deg,roll_deg\n0,0.3,0,0,0,30,0\n0.5,1.3,0.2,0,0,30,0\n1.1,1.3,2.5,-1,20,35,5\n1.7,0.9,-1,0.5,-15,25,-5\n2,-0.1,0,0,0,30,0\n";
  const [body, pose] = [{ kind: "sphere", radius: 15, axis: 0, angle: 90 }, [30, 0]];
  const page = await start({ reducedMotion: "reduce" });
  for (const csv of [readFileSync(file, "utf8"), turned]) {
    const bits = await page.evaluate(([csv, body, result]) => {
      const page = globalThis.fingerpad;
      const { model, hand, parsePath, Walk } = page;
      Object.assign(page.shape, body);
      model.touch(body);
      const walk = new Walk(parsePath(csv), 0.001, model.pitch);
      hand.follow(walk);
      page.lift();
      const words = [];
      while (!walk.done) {
        hand.write(model.motions, 0);
        model.run(1);
        words.push(...model.words.subarray(0, result));
      }
      hand.take();
      const count = model.wasm.look();
      return [...words, ...new Uint32Array(model.patchStates.buffer, model.patchStates.byteOffset, 9 * count)];
    }, [csv, body, RESULT]);
    const out = withFile("path.csv", csv, (name) => reference("path", MODEL, bodyWords(body, pose), name, "0.001"));
    same(bits, words(out), "path");
  }
  await page.close();
});

test("a load that is held at the end of a path stays", async () => {
  const page = await start({ reducedMotion: "reduce" });
  const [stopped, held] = await page.evaluate((csv) => {
    const page = globalThis.fingerpad;
    page.play(page.parsePath(csv), false, "");
    page.advance(8205);
    const stopped = page.r.friction_x_n;
    page.advance(700);
    return [stopped, page.r.friction_x_n];
  }, PATH);
  assert.ok(stopped > 0.2 && Math.abs(held / stopped - 1) < 0.01, `${stopped} ${held} N`);
  await page.close();
});

test("the work of a frame leaves room for 60 a second", async () => {
  const page = await start();
  const chromium = await page.context().newCDPSession(page);
  // Time that the page's thread had a processor, so that other work on the machine does not count.
  await chromium.send("Performance.enable", { timeDomain: "threadTicks" });
  const tasks = async () => {
    const { metrics } = await chromium.send("Performance.getMetrics");
    return 1000 * metrics.find(({ name }) => name === "TaskDuration").value;
  };
  const frames = () => page.evaluate(() => globalThis.fingerpad.work.length);
  const [ms0, frames0] = [await tasks(), await frames()];
  await page.waitForTimeout(4000);
  const [ms1, frames1] = [await tasks(), await frames()];
  const work = await page.evaluate(() => globalThis.fingerpad.work);
  const middle = (xs) => [...xs].sort((a, b) => a - b)[Math.floor(xs.length / 2)];
  const fps = (1000 * (work.length - 1)) / (work.at(-1)[0] - work[0][0]);
  const own = (ms1 - ms0) / (frames1 - frames0);
  console.log(`${fps.toFixed(1)} frames a second on this machine now; ${own.toFixed(2)} ms of the thread's CPU a frame (${frames1 - frames0} frames), scripts ${middle(work.map(([, ms]) => ms)).toFixed(2)} ms of clock (median)`);
  assert.ok(frames1 - frames0 > 20, `${frames1 - frames0} frames`);
  assert.ok(own > 0 && own < 1000 / 60, `${own} ms of CPU a frame`);
  await page.close();
});

test("time is the clock's: steps of 1 ms, as many as have passed", async () => {
  const [steps, clock] = await shared.evaluate(async () => {
    const { hand } = globalThis.fingerpad;
    const frame = () => new Promise(requestAnimationFrame);
    const t0 = await frame();
    const s0 = hand.time;
    let t1 = t0;
    while (t1 - t0 < 1500) t1 = await frame();
    return [hand.time - s0, (t1 - t0) / 1000];
  });
  assert.ok(steps <= clock + 0.06 && steps > 0.5 * clock, `${steps} s of steps in ${clock} s`);
});

test("keys move body and finger, and the words follow", async () => {
  const page = await start({ reducedMotion: "reduce" });
  assert.equal(await page.evaluate(() => globalThis.fingerpad.hand.walk), null, "nothing moves by itself");
  await page.click("#reset");
  await page.waitForFunction(() => document.getElementById("regime").textContent === "In the air");
  assert.equal(await page.locator("#n-margin").textContent(), "no contact");
  await page.focus("#side");
  for (let i = 0; i < 5; i++) await page.keyboard.press("Shift+ArrowUp");
  await page.waitForFunction(() => document.getElementById("regime").textContent === "It sticks");
  assert.equal(await page.locator("[role=status] strong").textContent(), "It sticks");
  await page.focus("#x");
  for (let i = 0; i < 12; i++) await page.keyboard.press("PageUp");
  await page.waitForFunction(() => document.getElementById("regime").textContent === "It slips");
  assert.ok((await friction(page)) > 0.1);
  await page.focus("#patch");
  await page.keyboard.press("Shift+E");
  await page.keyboard.press("Shift+D");
  await page.focus("#side");
  await page.keyboard.press("Shift+W");
  assert.deepEqual(await page.evaluate(() => globalThis.fingerpad.hand.target.slice(3)), [10, 35, 5]);
  await page.focus("#patch");
  const ring = await page.evaluate(() => getComputedStyle(document.getElementById("patch")).outlineStyle);
  assert.equal(ring, "solid", "the focus is seen");
  const labels = await page.evaluate(() => [...document.querySelectorAll("input[type=range]")].map((input) => input.labels[0].firstChild.textContent.trim()));
  for (const label of ["Depth", "Slide along", "Slide across", "Twist", "Pitch", "Roll", "Radius", "Direction", "Angle of the edge", "Moisture", "Temperature", "Speed of sliding"]) {
    assert.ok(labels.includes(label), `${label}: ${labels}`);
  }
  await page.close();
});

test("a hand drags and twists the body and pitches the finger", async () => {
  const page = await start({ reducedMotion: "reduce" });
  const target = () => page.evaluate(() => globalThis.fingerpad.hand.target);
  const from = await target();
  const box = await page.locator("#side").boundingBox();
  await page.mouse.move(box.x + 200, box.y + 300);
  await page.mouse.down();
  await page.mouse.move(box.x + 240, box.y + 290, { steps: 4 });
  await page.mouse.up();
  const scale = await page.evaluate(() => globalThis.fingerpad.views.side.scale);
  const to = await target();
  assert.ok(Math.abs(to[1] - from[1] - 40 / scale) < 1e-6 && Math.abs(to[0] - from[0] - 10 / scale) < 1e-6, `${from} ${to}`);
  const knob = await page.evaluate(() => globalThis.fingerpad.views.patch.knob(globalThis.fingerpad.hand.at[3]));
  const patch = await page.locator("#patch").boundingBox();
  await page.mouse.move(patch.x + knob[0], patch.y + knob[1]);
  await page.mouse.down();
  await page.mouse.move(patch.x + knob[0] + 30, patch.y + knob[1] + 40, { steps: 4 });
  await page.mouse.up();
  assert.ok((await target())[3] > 5, "twisted");
  const pitch = (await target())[4];
  await page.mouse.move(box.x + 100, box.y + 120);
  await page.mouse.down();
  await page.mouse.move(box.x + 140, box.y + 80, { steps: 4 });
  await page.mouse.up();
  const after = await target();
  assert.ok(after[4] > pitch + 5 && after[4] <= 70, `pitched to ${after[4]}`);
  await page.close();
});

test("the finger touches what is chosen, up to the pad's largest depth, and the map shows its patches", async () => {
  const page = await start({ reducedMotion: "reduce" });
  const pressed = {};
  for (const kind of ["plane", "sphere", "cylinder", "edge"]) {
    await page.selectOption("#kind", kind);
    assert.equal(await page.isVisible("#radius"), kind !== "plane", kind);
    assert.equal(await page.isVisible("#angle"), kind === "edge", kind);
    pressed[kind] = await page.evaluate(() => {
      const page = globalThis.fingerpad;
      page.ask(0, 100);
      page.advance(1500);
      const patches = page.model.patches();
      const force = patches.reduce((sum, p) => sum + 1e-3 * p.kpa * Math.PI * p.own ** 2, 0);
      return { normal: page.r.normal_n, force, touching: patches.length, depth: page.hand.at[0], max: page.model.depthMax, status: page.r.status };
    });
    const p = pressed[kind];
    assert.ok(Math.abs(p.depth - p.max) < 0.011 && p.status === 0, JSON.stringify(p));
    assert.ok(p.touching > 4 && p.touching <= 37);
  }
  assert.ok(pressed.plane.normal > 5.5 && pressed.plane.normal < 7.5, `${pressed.plane.normal} N`);
  assert.ok(Math.abs(pressed.plane.force / pressed.plane.normal - 1) < 1e-3, "pressure times area adds up to the normal force");
  for (const kind of ["sphere", "cylinder", "edge"]) assert.ok(pressed[kind].normal < 0.7 * pressed.plane.normal, kind);
  // A larger ball carries more; the finger is pressed as before.
  const before = await page.evaluate(() => globalThis.fingerpad.touch({ kind: "sphere" }) ?? globalThis.fingerpad.advance(1500) ?? globalThis.fingerpad.r.normal_n);
  const larger = await page.evaluate(() => globalThis.fingerpad.touch({ radius: 60 }) ?? globalThis.fingerpad.advance(1500) ?? globalThis.fingerpad.r.normal_n);
  assert.ok(larger > 1.1 * before, `${before} ${larger}`);
  const picture = () => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(document.getElementById("patch").toDataURL())))));
  const pressure = await picture();
  await page.check("#by-stick");
  assert.notEqual(await picture(), pressure, "the colours of the map follow the choice");
  await page.close();
});

test("the body is drawn where the core has it", async () => {
  const page = await start({ reducedMotion: "reduce" });
  // A patch that sticks moves with the body: twist and slide in turns, then compare what the page follows with a patch's way.
  const [drawn, patch] = await page.evaluate(() => {
    const page = globalThis.fingerpad;
    page.touch({ kind: "plane" });
    page.hand.target = [2, 0, 0, 0, 30, 0];
    page.advance(1500);
    const middle = (all) => all.reduce((a, b) => (b.kpa > a.kpa ? b : a));
    const from = middle(page.model.patches());
    page.hand.target = [2, 0.1, -0.05, 3, 30, 0];
    page.advance(1500);
    const to = page.model.patches().reduce((a, b) => (Math.hypot(b.x - from.x, b.y - from.y) < Math.hypot(a.x - from.x, a.y - from.y) ? b : a));
    const [x, y, angle] = page.hand.body;
    const [c, n] = [Math.cos(angle), Math.sin(angle)];
    return [[x + c * from.x - n * from.y - from.x, y + n * from.x + c * from.y - from.y], [to.x - from.x, to.y - from.y, to.stick]];
  });
  assert.ok(patch[2] > 0.9, "the patch sticks");
  assert.ok(Math.hypot(patch[0] - drawn[0], patch[1] - drawn[1]) < 0.5 * Math.hypot(...drawn), `${drawn} ${patch}`);
  await page.close();
});

test("the finger is chosen by its name, and a file of one's own is no name", async () => {
  const page = await start({ reducedMotion: "reduce" });
  const first = await text(page, "model");
  await page.selectOption("#finger", { label: "human, stiffening" });
  await page.waitForFunction((first) => document.getElementById("model").textContent !== first, first);
  assert.match(await text(page, "model"), /^human-stiffening-pad\.fpm, \d+ patches/);
  await page.setInputFiles("#open", { name: "own.fpm", mimeType: "application/octet-stream", buffer: readFileSync(MODEL) });
  await page.waitForFunction(() => document.getElementById("model").textContent.startsWith("own.fpm"));
  assert.equal(await page.inputValue("#finger"), "");
  await page.close();
});

test("a bed of springs is refused in plain words", async () => {
  const page = await start({ reducedMotion: "reduce" });
  await page.setInputFiles("#open", join(ROOT, "data/models/fingertip.fpm"));
  await page.waitForFunction(() => document.getElementById("alert").textContent !== "");
  assert.equal(await text(page, "alert"), "fingertip.fpm was not opened: a bed of springs; this page takes pads. Nothing has changed.");
  await page.close();
});

test("a number out of range is named as the core names it", async () => {
  const page = await start({ reducedMotion: "reduce" });
  // Beta of the friction law, 27 numbers before the end of the section of numbers, and then a checksum that holds.
  const file = Buffer.from(readFileSync(MODEL));
  const entry = [...Array(3).keys()].map((k) => 20 + 12 * k).find((at) => file.toString("latin1", at, at + 4) === "PADN");
  const end = file.readUInt32LE(entry + 4) + file.readUInt32LE(entry + 8);
  file.writeFloatLE(1.5, end - 4 * 27);
  file.writeUInt32LE(crc32(file.subarray(16)), 12);
  const why = withFile("beta.fpm", file, (name) => reference("refusal", name)).toString().trim();
  assert.match(why, /^PressureExponent\[0\] = 1.5 is out of range$/);
  await page.setInputFiles("#open", { name: "beta.fpm", mimeType: "application/octet-stream", buffer: file });
  await page.waitForFunction(() => document.getElementById("alert").textContent !== "");
  assert.equal(await text(page, "alert"), `beta.fpm was not opened: ${why}. Nothing has changed.`);
  await page.close();
});

test("files that are none are refused in the core's words, and nothing is lost", async () => {
  const page = await start({ reducedMotion: "reduce" });
  await page.waitForTimeout(800);
  const held = await text(page, "n-friction");
  assert.ok(parseFloat(held) > 0.05);
  const good = readFileSync(MODEL);
  const damaged = Buffer.from(good);
  damaged[3000] ^= 1;
  const older = Buffer.from(good);
  older.writeUInt32LE(3, 4);
  const files = { "cut.fpm": good.subarray(0, 5000), "damaged.fpm": damaged, "older.fpm": older, "foreign.fpm": Buffer.from("solid cube\n"), "empty.fpm": Buffer.alloc(0), "start.fpm": good.subarray(0, 10) };
  for (const [name, buffer] of Object.entries(files)) {
    await page.setInputFiles("#open", { name, mimeType: "application/octet-stream", buffer });
    await page.waitForFunction((name) => document.getElementById("alert").textContent.startsWith(name), name);
    const why = withFile(name, buffer, (file) => reference("refusal", file)).toString().trim();
    assert.equal(await text(page, "alert"), `${name} was not opened: ${why}. Nothing has changed.`);
    assert.equal(await text(page, "n-friction"), held, name);
  }
  const paths = [
    ["", "the file is empty"],
    ["t_s,depth_mm\n0,0\n", "line 1: no column `slide_x_mm`; columns are"],
    ["t_s,normal_force_n,slide_x_mm,slide_y_mm\n0,0,0,0\n", "line 1: no column `depth_mm`; the page replays motions"],
    ["t_s,depth_mm,slide_x_mm,slide_y_mm\n0,0,0,0\n\n1,NaN,0,0\n", "line 4: column `depth_mm`: `NaN` is not a finite number"],
    ["t_s,depth_mm,slide_x_mm,slide_y_mm\n0,0,0,0\n1,,0,0\n", "line 3: column `depth_mm`: `` is missing"],
    ["t_s,depth_mm,slide_x_mm,slide_y_mm\n0,0,0,0\n0,1,0,0\n", "line 3: column `t_s`: `0` is not after 0"],
    ["t_s,depth_mm,slide_x_mm,slide_y_mm\n0,0,0\n", "line 2: 3 cells where the header has 4"],
    ["t_s,depth_mm,slide_x_mm,slide_y_mm\n0,0,0,0\n", "the file ends after 1 row(s)"],
  ];
  for (const [csv, why] of paths) {
    await page.evaluate(() => { document.getElementById("alert").textContent = ""; });
    await page.setInputFiles("#open", { name: "p.csv", mimeType: "text/csv", buffer: Buffer.from(csv) });
    await page.waitForFunction(() => document.getElementById("alert").textContent !== "");
    const says = await text(page, "alert");
    assert.ok(says.startsWith(`p.csv was not opened: ${why}`), says);
    assert.equal(await text(page, "n-friction"), held, csv);
  }
  await page.setInputFiles("#open", { name: "p.csv", mimeType: "text/csv", buffer: Buffer.from([0x74, 0xff, 0xfe]) });
  await page.waitForFunction(() => document.getElementById("alert").textContent.includes("line 1: no column `t_s`"));
  await page.setInputFiles("#open", MODEL);
  await page.waitForFunction(() => document.getElementById("alert").textContent === "fingertip-pad.fpm is in use now.");
  await page.close();
});

test("the module refuses counts, lengths and bodies that it does not have", async () => {
  const page = await start({ reducedMotion: "reduce" });
  const [steps, codes, bodies, after] = await page.evaluate(() => {
    const { model } = globalThis.fingerpad;
    const { wasm } = model;
    model.motions.set([1, 0.1, 0, 0, 0.001, 30, 0, 35, 32, 2]);
    const steps = [wasm.run(0), wasm.run(model.most + 1), wasm.run(-1)];
    wasm.lift(NaN, Infinity);
    const codes = [wasm.load(wasm.incoming_bytes() + 1), wasm.load(-1), wasm.law_value(99, 99), wasm.patch_area_mm2(99)];
    const bodies = [[1, 0, 0, 0], [1, NaN, 0, 0], [2, 10, 400, 0], [3, 4, 0, 180], [4, 10, 0, 90]].map((body) => wasm.set_body(...body));
    wasm.lift(30, 0);
    return [steps, codes, bodies, wasm.run(1) === 1 && model.floats[0] > 0];
  });
  assert.deepEqual(steps, [0, 512, 512]);
  assert.deepEqual(codes, [3, 3, 0, 0]);
  assert.deepEqual(bodies, [1, 1, 1, 1, 1]);
  assert.ok(after, "the model in use goes on");
  await page.close();
});

test("a dropped path is replayed to its end", async () => {
  const page = await start({ reducedMotion: "reduce" });
  const csv = "\ufefft_s,depth_mm,slide_x_mm,slide_y_mm,operator\r\n0,0,0,0,1\r\n0.3,1,0,0,1\r\n1.2,1,2.5,0,1\r\n";
  await page.evaluate((csv) => {
    const files = new DataTransfer();
    files.items.add(new File([csv], "recorded.csv", { type: "text/csv" }));
    globalThis.dispatchEvent(new DragEvent("drop", { dataTransfer: files, cancelable: true }));
  }, csv);
  await page.waitForFunction(() => document.getElementById("walk").textContent === "recorded.csv: 3 rows. Columns passed over: operator.");
  await page.waitForFunction(() => document.getElementById("walk").textContent === "The path is at its end.");
  assert.equal(await page.evaluate(() => globalThis.fingerpad.hand.at[1]), 2.5);
  await page.close();
});

test("the switch lets the tissue relax: the force falls while the finger holds, and the words tell what will be left", async () => {
  const page = await start({ reducedMotion: "reduce" });
  const hold = () => page.evaluate(() => {
    const page = globalThis.fingerpad;
    page.hand.at = [1, 0, 0, 0, 30, 0];
    page.hand.target = [1, 1, 0, 0, 30, 0];
    page.lift();
    page.record.clear();
    page.advance(300);
    const margins = [page.r.margin, page.r.margin_relaxed, document.getElementById("n-margin")];
    page.show();
    const words = margins[2].textContent;
    page.advance(8000);
    const { trace } = page.record;
    return [trace[0].normal, trace.at(-1).normal, margins[0] - margins[1], words];
  });
  const [first, last, lost, words] = await hold();
  assert.ok(Math.abs(last / first - 1) < 0.2 && lost === 0 && !words.includes("left"), `${first} N, ${last} N, ${words}`);
  await page.check("#relaxes");
  const [peak, rest, less, told] = await hold();
  assert.ok(peak > 2 * rest && Math.abs(rest / last - 1) < 0.05 && less > 0.02 && /will be left$/.test(told), `${peak} N, ${rest} N, ${told}`);
  await page.waitForFunction(() => location.hash.includes("relaxes=1"));
  await page.uncheck("#relaxes");
  assert.ok(Math.abs((await hold())[1] / last - 1) < 1e-4);
  await page.close();
});

test("a static load does not relax under noise and vibration", async () => {
  const page = await start({ reducedMotion: "reduce" });
  for (const id of ["noisy", "vibrates"]) {
    await page.click("#reset");
    await page.evaluate(() => { globalThis.fingerpad.hand.target = [1.1, 1.6, 0, 0, 30, 0]; globalThis.fingerpad.advance(2000); });
    await page.check(`#${id}`);
    const change = await page.evaluate(() => {
      const page = globalThis.fingerpad;
      const mean = () => {
        let sum = 0;
        for (let i = 0; i < 50; i++) {
          page.advance(10);
          sum += page.model.floats[15 * 9 + 1];
        }
        return sum / 50;
      };
      page.advance(1000);
      const first = mean();
      page.advance(60_000);
      return mean() / first - 1;
    });
    console.log(`${id}: friction changes by ${(100 * change).toFixed(3)} % in a minute`);
    assert.ok(Math.abs(change) < 0.01, `${change}`);
    await page.waitForFunction(() => document.getElementById("held").textContent.startsWith("Shaken for"));
    await page.uncheck(`#${id}`);
  }
  await page.close();
});

test("moisture, temperature and speed act by the core's laws", async () => {
  const page = await start({ reducedMotion: "reduce" });
  const set = (id, value) => page.evaluate(([id, value]) => {
    const input = document.getElementById(id);
    input.value = value;
    input.dispatchEvent(new Event("input"));
  }, [id, value]);
  assert.equal(await text(page, "factor"), "");
  await set("temperature", 42);
  assert.equal(await text(page, "factor"), "strength × 1.30");
  await set("temperature", 32);
  await set("moisture", 55);
  const bell = 1 + 0.3 * (1 - Math.exp(-0.5 * (20 / 15) ** 2));
  assert.equal(await text(page, "factor"), `strength × ${bell.toFixed(2)}`);
  await set("moisture", 35);
  await set("speed", 1);
  assert.equal(await text(page, "factor"), `strength × ${(1 + 0.05 * Math.log(5)).toFixed(2)}`);
  await page.close();
});

for (const colorScheme of ["light", "dark"]) {
  test(`a phone of 400 px needs no scrolling to the side (${colorScheme})`, async () => {
    const page = await start({ viewport: { width: 400, height: 800 }, colorScheme, hasTouch: true });
    const wide = await page.evaluate(() => [document.documentElement.scrollWidth, ...[...document.querySelectorAll("main *")].map((node) => Math.ceil(node.getBoundingClientRect().right))]);
    assert.ok(Math.max(...wide) <= 400, `${Math.max(...wide)} px`);
    await page.locator("#patch").scrollIntoViewIfNeeded();
    await page.locator("#patch").tap();
    assert.equal(await page.evaluate(() => globalThis.fingerpad.hand.walk), null, "a touch takes over");
    await page.close();
  });
}

test("a link restores body, place, pose, skin, disturbance and colours", async () => {
  const page = await start({ reducedMotion: "reduce" });
  const state = () => page.evaluate(() => {
    const { hand, shape, start_deg, views } = globalThis.fingerpad;
    return { target: hand.target, shape, start_deg, skin: hand.skin, disturbance: hand.disturbance, shows: views.patch.shows };
  });
  await page.evaluate(() => {
    const page = globalThis.fingerpad;
    const set = (id, value) => { document.getElementById(id).value = value; document.getElementById(id).dispatchEvent(new Event("input")); };
    set("pitch", 40);
    set("roll", -10);
    page.advance(1000);
    page.touch({ kind: "cylinder" });
    set("radius", 25);
    set("axis", -45);
    for (const [id, value] of [["depth", 1.4], ["x", -2.5], ["y", 0.5], ["spin", 12], ["pitch", 45], ["moisture", 60], ["speed", 1], ["noise", 7]]) set(id, value);
    document.getElementById("noisy").click();
    document.getElementById("by-stick").click();
  });
  const wanted = await state();
  await page.waitForFunction(() => location.hash.includes("map=stick"));
  const { hash } = new URL(page.url());
  assert.equal(await page.getAttribute("#link", "href"), hash);
  await page.close();
  const again = await open(running, `${server.address}${hash}`, { viewport: { width: 1200, height: 850 } });
  const found = await again.page.evaluate(() => {
    const { hand, shape, start_deg, views } = globalThis.fingerpad;
    return { target: hand.target, shape, start_deg, skin: hand.skin, disturbance: hand.disturbance, shows: views.patch.shows };
  });
  assert.deepEqual(found, wanted);
  assert.deepEqual(again.seen.errors, []);
  assert.ok(await again.page.evaluate(() => { globalThis.fingerpad.advance(1000); return globalThis.fingerpad.r.normal_n > 0.1; }), "the finger is pressed");
  // A number out of range is named, and the rest is restored.
  await again.page.evaluate(() => { location.hash = "#depth=99&x=1&body=cube&radius=3&y=abc&colour=red"; });
  await again.page.waitForFunction(() => document.getElementById("alert").textContent !== "");
  const says = await text(again.page, "alert");
  for (const part of ["depth 99: -0.3 to 5.13 is allowed", "body cube: plane, sphere, cylinder, edge is allowed", "radius 3: a plane has none", "y abc: -6 to 6 is allowed", "colour: not a name of this page"]) {
    assert.ok(says.includes(part), `${part}: ${says}`);
  }
  assert.deepEqual(await again.page.evaluate(() => globalThis.fingerpad.hand.target.slice(0, 3)), [-0.3, 1, 0]);
  await again.page.close();
});

test("the trace is saved as a table that the page can replay", async () => {
  const page = await start({ reducedMotion: "reduce" });
  // The page's own clock stands still: the tissue relaxes, so a force belongs to a time.
  await page.evaluate(() => {
    const page = globalThis.fingerpad;
    globalThis.advanceByHand = page.advance.bind(page);
    page.advance = () => {};
    page.reset();
    page.hand.target = [1.3, 1.2, -0.4, 5, 32, 3];
    globalThis.advanceByHand(1500);
  });
  const [download, shown] = await Promise.all([page.waitForEvent("download"), page.evaluate(() => { document.getElementById("save").click(); return globalThis.fingerpad.record.trace.map(({ time, normal, friction }) => [time, normal, friction]); })]);
  assert.equal(download.suggestedFilename(), "fingerpad-trace.csv");
  const csv = readFileSync(await download.path(), "utf8");
  const [head, ...rows] = csv.trimEnd().split("\n").map((line) => line.split(","));
  assert.deepEqual(head, ["t_s", "depth_mm", "slide_x_mm", "slide_y_mm", "spin_deg", "pitch_deg", "roll_deg", "normal_force_n", "friction_x_n", "friction_y_n", "spin_moment_n_mm", "friction_limit_n", "slip_margin", "slip_margin_relaxed", "stick_ratio", "status"]);
  assert.ok(rows.length > 70 && rows.length === shown.length, `${rows.length} rows`);
  rows.forEach((row, i) => {
    const [time, normal, friction] = shown[i];
    assert.ok(Math.abs(row[0] - (time - shown[0][0])) < 1e-3 && Math.abs(row[7] - normal) < 1e-6 && Math.abs(Math.hypot(row[8], row[9]) - friction) < 1e-6, `row ${i}: ${row}`);
  });
  assert.ok(Number(rows.at(-1)[7]) > 0.1);
  await page.setInputFiles("#open", { name: "trace.csv", mimeType: "text/csv", buffer: Buffer.from(csv) });
  await page.waitForFunction(() => document.getElementById("walk").textContent.startsWith("trace.csv:"));
  const again = await page.evaluate(() => {
    const page = globalThis.fingerpad;
    globalThis.advanceByHand(page.hand.walk.steps + 1);
    return { at: page.hand.at, normal: page.r.normal_n, friction: Math.hypot(page.r.friction_x_n, page.r.friction_y_n) };
  });
  const last = rows.at(-1).map(Number);
  again.at.forEach((value, i) => assert.ok(Math.abs(value - last[1 + i]) < 1e-5, `place ${i}: ${value} ${last[1 + i]}`));
  assert.ok(Math.abs(again.normal / last[7] - 1) < 1e-3, `${again.normal} ${last[7]}`);
  const friction = Math.hypot(last[8], last[9]);
  assert.ok(Math.abs(again.friction / friction - 1) < 0.01, `${again.friction} ${friction}`);
  await page.close();
});

for (const width of [1200, 400]) {
  test(`arrows stay inside the pictures up to 7 N (${width} px)`, async () => {
    const page = await start({ viewport: { width, height: 800 }, reducedMotion: "reduce" });
    const [most, outside] = await page.evaluate(async () => {
      const page = globalThis.fingerpad;
      const outside = [];
      for (const name of ["side", "patch"]) {
        const { sheet } = page.views[name];
        const draw = sheet.arrow.bind(sheet);
        sheet.arrow = (x, y, dx, dy, ...more) => {
          for (const [px, py] of [[x, y], [x + dx, y + dy]]) if (!(px >= 0 && px <= sheet.w && py >= 0 && py <= sheet.h)) outside.push([name, px, py, page.r.normal_n]);
          draw(x, y, dx, dy, ...more);
        };
      }
      let most = 0;
      for (const kind of ["plane", "sphere", "cylinder", "edge"]) {
        page.reset();
        page.touch({ kind });
        for (const [x, y, pitch, roll] of [[0, 0, 25, 0], [-6, 0, 25, 0], [6, 6, 25, 0], [-6, -6, 15, 30], [0, 6, 70, -30]]) {
          page.hand.target = [page.model.depthMax, x, y, 0, pitch, roll];
          for (let i = 0; i < 12; i++) {
            page.advance(100);
            page.show();
            if (page.r.status === 0) most = Math.max(most, page.r.normal_n);
          }
        }
      }
      return [most, outside];
    });
    assert.ok(most > 7, `${most} N`);
    assert.deepEqual(outside, []);
    await page.close();
  });
}

test("a phone of 400 px shows verdict, picture and sliders of the motion on one screen", async () => {
  const page = await start({ viewport: { width: 400, height: 800 }, reducedMotion: "reduce" });
  const boxes = await page.evaluate(() => ["regime", "plain", "side", "depth", "x", "y", "spin", "pitch", "roll"].map((id) => {
    const { top, bottom, height } = document.getElementById(id).getBoundingClientRect();
    return [id, top, bottom, height];
  }));
  for (const [id, top, bottom, height] of boxes) assert.ok(top >= 0 && bottom <= 800 && (height > 10 || (id === "plain" && height === 0)), `${id}: ${top} to ${bottom}`);
  assert.ok(boxes[2][3] >= 220, "the picture keeps its size");
  await page.close();
});

test("links lead to the documentation and the source", async () => {
  const page = await start();
  const links = await page.evaluate(() => [...document.querySelectorAll("footer a")].map((a) => a.getAttribute("href")));
  assert.equal(links.length, 2);
  for (const link of links) {
    if (/^https:/.test(link)) continue;
    assert.ok(readFileSync(join(SITE, link), "utf8").length > 1000, link);
  }
  await page.close();
});

test("no errors in the console, no request to anywhere else", () => {
  assert.ok(opened.length > 8);
  assert.deepEqual(opened.flatMap((seen) => [...seen.errors, ...seen.foreign]), []);
});
