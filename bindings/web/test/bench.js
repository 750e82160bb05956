// Prints ns a step of the page's module in Chromium, and of the core on the host over the same motions, as lines of JSON.

import { MODEL, SITE } from "./folder.js";
import { path, reference, withFile } from "./native.js";
import { browser, open, serve } from "./serve.js";

const motions = path(512, 20, false);
const server = await serve(SITE);
const running = await browser();
const { page } = await open(running, server.address, { reducedMotion: "reduce" });
const ns = await page.evaluate((numbers) => {
  const { model } = globalThis.fingerpad;
  model.motions.set(numbers);
  const ROUNDS = 40;
  let best = Infinity;
  for (let trial = 0; trial < 30; trial++) {
    const start = performance.now();
    for (let i = 0; i < ROUNDS; i++) model.run(0, 512);
    best = Math.min(best, (performance.now() - start) / (ROUNDS * 512));
  }
  return best * 1e6;
}, [...motions]);
await running.close();
server.close();
console.log(JSON.stringify({ row: "wasm", ns_per_step: Number(ns.toFixed(1)) }));
process.stdout.write(withFile("motions", Buffer.from(motions.buffer), (file) => reference("bench", MODEL, file)));
