// Prints us a step of the page's module in Chromium, and of the core on the host over the same motions, then how long frames take
// while the example plays, clean and with noise and vibration on the depth, on a desk and a phone; as lines of JSON.

import { MODEL, SITE } from "./folder.js";
import { path, reference, withFile } from "./native.js";
import { browser, open, serve } from "./serve.js";

const motions = path(512, 20, false);
const server = await serve(SITE);
const running = await browser();
const { page } = await open(running, server.address, { reducedMotion: "reduce" });
const us = await page.evaluate((numbers) => {
  const { model } = globalThis.fingerpad;
  model.motions.set(numbers);
  const ROUNDS = 4;
  let best = Infinity;
  for (let trial = 0; trial < 30; trial++) {
    const start = performance.now();
    for (let i = 0; i < ROUNDS; i++) model.run(512);
    best = Math.min(best, (performance.now() - start) / (ROUNDS * 512));
  }
  return best * 1e3;
}, [...motions]);
console.log(JSON.stringify({ row: "wasm", us_per_step: Number(us.toFixed(2)) }));
process.stdout.write(withFile("motions", Buffer.from(motions.buffer), (file) => reference("bench", MODEL, "0,20,0,90,30,0", file)));

for (const [width, height] of [[1200, 900], [400, 800]]) {
  for (const disturbed of [false, true]) {
    const { page } = await open(running, server.address, { viewport: { width, height } });
    if (disturbed) for (const id of ["noisy", "vibrates"]) await page.locator(`#${id}`).check();
    await page.waitForTimeout(6000);
    const frames = await page.evaluate(() => {
      const { work } = globalThis.fingerpad;
      const between = work.slice(1).map(([now], i) => now - work[i][0]).sort((a, b) => a - b);
      const ms = (share) => Number(between[Math.floor(share * between.length)].toFixed(1));
      return { median_ms: ms(0.5), p95_ms: ms(0.95), frames: between.length };
    });
    console.log(JSON.stringify({ row: "frames", width, disturbed, ...frames }));
    await page.close();
  }
}
await running.close();
server.close();
