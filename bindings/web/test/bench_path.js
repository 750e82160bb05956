// Prints `call ns` lines for the page's module over the path on standard input (depth, slide x, slide y, spin; a step a line): the
// least of twenty rounds, in Node, whose V8 is Chromium's as well. Contacts have spin, pose and the skin's laws in every call.

import { readFileSync } from "node:fs";
import { MODEL, OPTIMISED } from "./folder.js";

const ROUNDS = 20;
const NUMBERS = 10;
const { instance } = await WebAssembly.instantiate(readFileSync(OPTIMISED));
const wasm = instance.exports;
const model = readFileSync(MODEL);
new Uint8Array(wasm.memory.buffer, wasm.incoming(), model.length).set(model);
if (wasm.load(model.length) !== 0) throw new Error(`${MODEL} was refused`);
const most = wasm.most_steps();
const motions = new Float32Array(wasm.memory.buffer, wasm.motions(), NUMBERS * most);

const path = readFileSync(0, "utf8").trim().split("\n").map((line) => line.split(" ").map(Number));

/** Least time of a step, ns; each batch of motions is written before it is run, as the page does. */
function least(spins) {
  const rows = Float32Array.from(path.flatMap(([depth, x, y, spin]) => [depth, x, y, spins ? spin : 0, 0.001, wasm.fitted_pitch_deg(), 0, 35, 32, 2]));
  let best = Infinity;
  for (let round = 0; round < ROUNDS; round++) {
    wasm.lift(0);
    const start = performance.now();
    for (let from = 0; from < rows.length; from += NUMBERS * most) {
      const batch = rows.subarray(from, from + NUMBERS * most);
      motions.set(batch);
      wasm.run(0, batch.length / NUMBERS);
    }
    best = Math.min(best, performance.now() - start);
  }
  return (1e6 * best) / path.length;
}

console.log(`step ${least(false).toFixed(2)}`);
console.log(`spin_step ${least(true).toFixed(2)}`);
