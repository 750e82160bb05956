// Pictures of the page: node pictures.js FOLDER, all sizes and schemes; node pictures.js --readme FILE, the one of README.

import { mkdirSync, statSync } from "node:fs";
import { join } from "node:path";
import { SITE } from "./folder.js";
import { PATH } from "./paths.js";
import { browser, open, serve } from "./serve.js";

const MOST = 200_000;

/** Goes along the path and holds still at its end. */
export async function pose(page) {
  await page.evaluate((text) => {
    const page = globalThis.fingerpad;
    page.reset();
    page.play(page.parsePath(text), false, "The path is at its end.");
    page.advance(9000);
    page.take();
  }, PATH);
  await page.waitForTimeout(400);
}

const [first, second] = process.argv.slice(2);
const server = await serve(SITE);
const running = await browser();
if (first === "--readme") {
  const { page } = await open(running, server.address, { viewport: { width: 1200, height: 807 }, colorScheme: "light" });
  await pose(page);
  await page.screenshot({ path: second });
  const { size } = statSync(second);
  console.log(`${second}: ${size} bytes`);
  if (size > MOST) throw new Error(`at most ${MOST} are allowed`);
} else {
  mkdirSync(first, { recursive: true });
  for (const width of [1200, 400]) {
    for (const colorScheme of ["light", "dark"]) {
      const { page } = await open(running, server.address, { viewport: { width, height: 860 }, colorScheme });
      await pose(page);
      await page.screenshot({ path: join(first, `${width}-${colorScheme}.png`), fullPage: true });
      await page.close();
    }
  }
}
await running.close();
server.close();
