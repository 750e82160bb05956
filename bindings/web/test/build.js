// Puts the page together: one static folder, `site`, beside the workspace. The module must have been compiled.

import { execFileSync } from "node:child_process";
import { cpSync, mkdirSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { build, transform } from "esbuild";
import * as math from "./math.js";
import { MODEL, MODULE, SITE, WEB } from "./folder.js";

/** Most bytes of module, scripts, styles and page together. */
const MOST = 62_800;
/** What is counted; the model file is data. */
const COUNTED = ["index.html", "style.css", "main.js", "fingerpad.wasm"];

/** Letters by which the colours' names differ. */
const LETTERS = 2;
/** Names of objects' parts that are shortened; none of them is one of the browser's, an element's id or used by the tests. */
const OWN = [
  "align", "angle", "arrow", "ask", "average", "base", "begin", "bottom", "box", "canvas", "cap", "clear", "closed", "columns",
  "contact", "cross", "ctx", "depthMax", "disturbance", "dot", "dots", "draw", "duration", "ended", "finger", "fit", "forces",
  "furnish", "ghost", "grid", "held", "last", "left", "loops", "middle", "named", "origin", "outline", "passedOver", "polyline",
  "poses", "power", "pressed", "probe", "raised", "record", "regime", "response", "ridges", "right", "ring", "rounded", "rows",
  "seen", "share", "sheet", "show", "since", "skinChanged", "slope", "slopeFrom", "slopeOver", "span", "steps", "strength",
  "tell", "tellHeld", "text", "thick", "told", "top", "touch", "touching", "trace", "trail", "travel", "turning", "twists",
  "used", "vibrates", "walked", "way", "weight",
];

rmSync(SITE, { recursive: true, force: true });
mkdirSync(SITE);
await build({
  entryPoints: [join(WEB, "page/main.js")],
  outfile: join(SITE, "main.js"),
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  charset: "utf8",
  inject: [join(WEB, "test/math.js")],
  define: { LETTERS: String(LETTERS), ...Object.fromEntries(Object.keys(math).map((name) => [name.replace("math_", "Math."), name])) },
  // Names of the page's own that are long and frequent; strings with the mark __KEY__ follow, the module's exports do not.
  reserveProps: /^depth_max_mm$/,
  mangleProps: new RegExp(`^(\\w+_(n|mm|mm2|n_mm|ratio|um|au|c|mm_s)|${OWN.join("|")})$`),
});
const style = await transform(readFileSync(join(WEB, "page/style.css"), "utf8"), { loader: "css", minify: true, charset: "utf8" });
writeFileSync(join(SITE, "style.css"), style.code.replace(new RegExp(`--([a-z]{${LETTERS}})[a-z]+`, "g"), "--$1"));
writeFileSync(join(SITE, "index.html"), readFileSync(join(WEB, "page/index.html"), "utf8").replace(/\n\s+/g, "\n").replace(/="([\w.-]+)"/g, "=$1").replace(/<\/(p|dt|dd|body|html)>/g, "").trim());
const optimiser = join(dirname(createRequire(import.meta.url).resolve("binaryen/package.json")), "bin/wasm-opt");
const small = ["--flatten", "--rereloop", "-Oz", "-Oz", "--converge", "--low-memory-unused", "--all-features", "--strip-debug", "--strip-producers", "--strip-target-features"];
execFileSync(process.execPath, [optimiser, ...small, MODULE, "-o", join(SITE, "fingerpad.wasm")], { stdio: "inherit" });
cpSync(MODEL, join(SITE, "fingertip.fpm"));

const module = new WebAssembly.Module(readFileSync(join(SITE, "fingerpad.wasm")));
const imports = WebAssembly.Module.imports(module);
if (imports.length > 0) throw new Error(`the module imports ${imports.map((i) => `${i.module}.${i.name}`).join(", ")}: a panic or a foreign function is linked`);

const sizes = COUNTED.map((name) => [name, statSync(join(SITE, name)).size]);
const all = sizes.reduce((sum, [, bytes]) => sum + bytes, 0);
for (const [name, bytes] of [...sizes, ["together", all]]) console.log(`${name.padEnd(16)} ${String(bytes).padStart(6)} bytes`);
if (all > MOST) throw new Error(`${all} bytes, at most ${MOST} are allowed`);
