// The page in headless Chromium: bits against the host, frames, hands, keys, files, a phone's width.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { MODEL, SITE, WEB } from "./folder.js";
import { nativeSteps, path, reference, withFile } from "./native.js";
import { browser, open, serve } from "./serve.js";

const STEPS = 20_000;
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

/** Steps in the page's module, in batches: 16 words each, those that the core answers with. */
function steps(page, motions) {
  return page.evaluate((numbers) => {
    const { model } = globalThis.fingerpad;
    const [motions, words] = [Float32Array.from(numbers, (x) => x ?? NaN), []];
    model.wasm.lift(0);
    for (let from = 0; from < motions.length / 10; from += model.most) {
      const batch = motions.subarray(10 * from, 10 * (from + model.most));
      model.motions.set(batch);
      model.run(0, batch.length / 10);
      for (let i = 0; i < batch.length / 10; i++) {
        for (const k of [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 16, 17]) words.push(model.words[18 * i + k]);
      }
    }
    return words;
  }, Array.from(motions, (x) => (Number.isNaN(x) ? null : x)));
}

function same(page, native, what) {
  assert.equal(page.length, native.length, what);
  for (let i = 0; i < native.length; i++) {
    if (page[i] !== native[i]) assert.fail(`${what}: step ${Math.floor(i / 16)}, output ${i % 16}: ${page[i].toString(16)} in the page, ${native[i].toString(16)} on the host`);
  }
}

const text = (page, id) => page.locator(`#${id}`).textContent();
const friction = async (page) => parseFloat(await text(page, "n-friction"));

for (const disturbed of [false, true]) {
  test(`the page has the host's bits on a ${disturbed ? "disturbed" : "clean"} path`, async () => {
    const seed = (Date.now() % 1e9) + Number(disturbed);
    console.log(`seed ${seed}`);
    const motions = path(STEPS, seed, disturbed);
    const native = nativeSteps(motions);
    const regimes = new Set(native.filter((_, i) => i % 16 === 14));
    assert.deepEqual([...regimes].sort(), [0, 1, 2, 3], "the path must see air, stick, partial slip and slip");
    same(await steps(shared, motions), native, `seed ${seed}`);
  });
}

test("a model with effects of its own has the host's bits", async () => {
  const page = await start();
  await page.setInputFiles("#open", join(ROOT, "firmware-example/corrected.fpm"));
  await page.waitForFunction(() => document.getElementById("model").textContent.startsWith("corrected.fpm"));
  const motions = path(5000, 7, true);
  same(await steps(page, motions), nativeSteps(motions, join(ROOT, "firmware-example/corrected.fpm")), "corrected.fpm");
  await page.close();
});

test("a contact that was copied goes on with the same bits", async () => {
  const equal = await shared.evaluate(() => {
    const { model } = globalThis.fingerpad;
    const run = (contact) => {
      for (let i = 0; i < 200; i++) model.motions.set([1 + 0.01 * Math.sin(i), 0.01, -0.004, 0.002, 0.001, 30, 0, 35, 32, 2], 10 * i);
      model.run(contact, 200);
      return Array.from(model.words.subarray(0, 18 * 200));
    };
    model.wasm.lift(0);
    const fresh = run(0);
    model.wasm.copy(0, 1);
    const [on, saved] = [run(0), run(1)];
    return [on.every((word, i) => word === saved[i]), fresh.every((word, i) => word === on[i])];
  });
  assert.deepEqual(equal, [true, false]);
});

test("a recorded path is replayed with the host's bits", async () => {
  const file = join(ROOT, "data/examples/path.csv");
  const turned = "t_s,depth_mm,slide_x_mm,slide_y_mm,spin_deg,pitch_deg,roll_deg\n0,0.3,0,0,0,30,0\n0.5,1.3,0.2,0,0,30,0\n1.1,1.3,2.5,-1,20,35,5\n1.7,0.9,-1,0.5,-15,25,-5\n2,-0.1,0,0,0,30,0\n";
  for (const csv of [readFileSync(file, "utf8"), turned]) {
    const bits = await shared.evaluate((csv) => {
      const { model, hand, parsePath, Walk } = globalThis.fingerpad;
      const before = [...hand.at];
      const walk = new Walk(parsePath(csv), 0.001, model.pitch);
      hand.follow(walk);
      model.wasm.lift(0);
      const words = [];
      while (!walk.done) {
        hand.write(model.motions, 0);
        model.run(0, 1);
        for (const k of [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 16, 17]) words.push(model.words[k]);
      }
      hand.take();
      hand.at = before;
      return words;
    }, csv);
    const out = withFile("path.csv", csv, (name) => reference("path", MODEL, name, "0.001"));
    same(bits, new Uint32Array(out.buffer.slice(out.byteOffset, out.byteOffset + out.length)), "path");
  }
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

test("keys move the plate, and the words follow", async () => {
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
  assert.equal(await page.evaluate(() => globalThis.fingerpad.hand.target[3]), 10);
  const ring = await page.evaluate(() => getComputedStyle(document.getElementById("patch")).outlineStyle);
  assert.equal(ring, "solid", "the focus is seen");
  const labels = await page.evaluate(() => [...document.querySelectorAll("input[type=range]")].map((input) => input.labels[0].firstChild.textContent.trim()));
  for (const label of ["Depth", "Slide along", "Slide across", "Twist", "Pitch", "Roll", "Moisture", "Temperature", "Speed of sliding"]) {
    assert.ok(labels.includes(label), `${label}: ${labels}`);
  }
  await page.close();
});

test("a hand drags and twists the plate", async () => {
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
  await page.waitForFunction(() => document.getElementById("alert").textContent === "fingertip.fpm is in use now.");
  await page.close();
});

test("the module bears contacts, counts and lengths that it does not have", async () => {
  const page = await start({ reducedMotion: "reduce" });
  const [steps, codes, after] = await page.evaluate(() => {
    const { model } = globalThis.fingerpad;
    const { wasm } = model;
    model.motions.set([1, 0.1, 0, 0, 0.001, 30, 0, 35, 32, 2]);
    const steps = [wasm.run(2, 1), wasm.run(-1, 1), wasm.run(0, 0), wasm.run(0, model.most + 1)];
    wasm.lift(7);
    wasm.copy(7, 0);
    wasm.copy(0, 7);
    const codes = [wasm.load(wasm.incoming_bytes() + 1), wasm.load(-1), wasm.law_value(99, 99)];
    wasm.lift(0);
    return [steps, codes, wasm.run(0, 1) === 1 && model.floats[0] > 0];
  });
  assert.deepEqual(steps, [0, 0, 0, 512]);
  assert.deepEqual(codes, [3, 3, 0]);
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

test("a held load stays under noise and vibration", async () => {
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
          sum += page.model.floats[18 * 9 + 1];
        }
        return sum / 50;
      };
      page.advance(1000);
      const first = mean();
      page.advance(120_000);
      return mean() / first - 1;
    });
    console.log(`${id}: friction changes by ${(100 * change).toFixed(3)} % in two minutes`);
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

test("no errors in the console, no request to anywhere else", () => {
  assert.ok(opened.length > 8);
  assert.deepEqual(opened.flatMap((seen) => [...seen.errors, ...seen.foreign]), []);
});
