// The book in Chromium: node book.js SITE [FOLDER]. Every page loads its pictures and fits into 1200 and 400 px; with FOLDER, pictures of the pages.

import { mkdirSync, readdirSync } from "node:fs";
import { join } from "node:path";
import { browser, serve } from "./serve.js";

/** Heights beyond this are cut from a picture, px. */
const TALLEST = 6000;

const [site, folder] = process.argv.slice(2);
const pages = readdirSync(site, { recursive: true }).filter((name) => name.endsWith(".html") && !["404.html", "toc.html"].includes(name));
if (folder) mkdirSync(folder, { recursive: true });
const server = await serve(site);
const running = await browser();
const wrong = [];
for (const width of [1200, 400]) {
  const page = await running.page({ viewport: { width, height: 900 }, colorScheme: "light" });
  page.on("pageerror", (error) => wrong.push(`${page.url()}: ${error}`));
  for (const name of pages) {
    await page.goto(server.address + name);
    const [widest, unseen] = await page.evaluate(() => [
      Math.max(document.documentElement.scrollWidth, document.querySelector("main").getBoundingClientRect().right),
      [...document.images].filter((image) => image.naturalWidth === 0).map((image) => image.getAttribute("src")),
    ]);
    if (widest > width) wrong.push(`${name}: ${widest} px wide in a window of ${width}`);
    for (const picture of unseen) wrong.push(`${name}: ${picture} does not load`);
    if (folder) {
      const height = Math.min(TALLEST, await page.evaluate(() => document.documentElement.scrollHeight));
      await page.screenshot({ path: join(folder, `${name.replaceAll("/", "-").replace(".html", "")}-${width}.png`), fullPage: true, clip: { x: 0, y: 0, width, height } });
    }
  }
  await page.close();
}
await running.close();
server.close();
if (wrong.length > 0) throw new Error(wrong.join("\n"));
console.log(`${pages.length} pages fit into 1200 and 400 px`);
