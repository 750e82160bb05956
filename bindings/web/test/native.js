// The reference on the host: the same motions by the core itself.

import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { MODEL, WEB } from "./folder.js";

const PROGRAM = join(WEB, "target/release/fingerpad-web-reference");

/** Runs the reference; returns what it wrote. */
export function reference(...words) {
  return execFileSync(PROGRAM, words, { maxBuffer: 1 << 28 });
}

/** With a file of these bytes in place of its name. */
export function withFile(name, bytes, use) {
  const folder = mkdtempSync(join(tmpdir(), "fingerpad-web-"));
  try {
    const file = join(folder, name);
    writeFileSync(file, bytes);
    return use(file);
  } finally {
    rmSync(folder, { recursive: true, force: true });
  }
}

/** Whole numbers of 32 bits that the reference wrote. */
export function words(out) {
  return new Uint32Array(out.buffer.slice(out.byteOffset, out.byteOffset + out.length));
}

/** The reference's input for a body over whose apex the finger is in a pose. */
export function bodyWords({ kind, radius, axis, angle }, [pitch, roll]) {
  return [["plane", "sphere", "cylinder", "edge"].indexOf(kind), radius, axis, angle, pitch, roll].join(",");
}

/** Words of the responses to motions, 15 each, then those of the patches, 9 each. */
export function nativeSteps(motions, body, pose) {
  return words(withFile("motions", Buffer.from(motions.buffer), (file) => reference("steps", MODEL, bodyWords(body, pose), file)));
}

/** Numbers between 0 and 1 from a seed (Marsaglia 2003, xorshift). */
export function random(seed) {
  let x = seed >>> 0 || 1;
  return () => {
    x ^= x << 13;
    x ^= x >>> 17;
    x ^= x << 5;
    return (x >>> 0) / 2 ** 32;
  };
}

/**
 * A random path of `count` motions: presses, slides with reversals, spins, lift-offs. Disturbed, it also has noise on the depth,
 * poses that change, a skin that changes, and at times a motion that is not a number.
 */
export function path(count, seed, disturbed) {
  const next = random(seed);
  const between = (low, high) => low + (high - low) * next();
  const motions = new Float32Array(10 * count);
  let [depth, aim, x, y, spin, pitch, roll] = [0, 1, 0, 0, 0, 30, 0];
  let [skin, turn] = [[35, 32, 2], [0, 0]];
  for (let i = 0; i < count; i++) {
    if (i % 97 === 0) {
      aim = between(-0.2, 2.7);
      [x, y, spin] = [between(-0.05, 0.05), between(-0.05, 0.05), next() < 0.5 ? 0 : between(-0.02, 0.02)];
    }
    if (disturbed && i % 61 === 0) {
      turn = [(between(15, 65) - pitch) / 61, (between(-25, 25) - roll) / 61];
      skin = [between(5, 100), between(20, 42), next() < 0.3 ? 0 : between(0.2, 50)];
    }
    depth += 0.1 * (aim - depth);
    pitch += turn[0];
    roll += turn[1];
    const shake = disturbed ? between(-0.01, 0.01) : 0;
    motions.set([depth + shake, x, y, spin, 0.001, pitch, roll, ...skin], 10 * i);
    if (disturbed && i % 1009 === 500) motions[10 * i + (i % 4)] = NaN;
  }
  return motions;
}
