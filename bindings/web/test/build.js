// Puts the page together: one static folder, `site`, beside the workspace. The module must have been compiled.

import { execFileSync } from "node:child_process";
import { cpSync, mkdirSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { basename, dirname, join } from "node:path";
import { deflateRawSync } from "node:zlib";
import { build, transform } from "esbuild";
import { MODEL, MODULE, OPTIMISED, PACKAGE, SITE, STIFFENING, WEB } from "./folder.js";

/** Most bytes of module, scripts, styles, page and model file together. */
const MOST = 120_000;
const COUNTED = ["index.html", "style.css", "main.js", "fingerpad.wasm.deflate", "fingertip-pad.fpm"];

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
});
const style = await transform(readFileSync(join(WEB, "page/style.css"), "utf8"), { loader: "css", minify: true, charset: "utf8" });
writeFileSync(join(SITE, "style.css"), style.code);
// Links lead to the repository that the workspace names, or else to the files beside the page in a checkout.
const workspace = readFileSync(join(WEB, "../../Cargo.toml"), "utf8");
const repository = /^repository = "(https:[^"]+)"/m.exec(workspace)?.[1];
const links = repository ? { DOCS: `${repository}/blob/main/docs/pad.md`, REPOSITORY: repository } : { DOCS: "../../../docs/pad.md", REPOSITORY: "../../../README.md" };
const html = readFileSync(join(WEB, "page/index.html"), "utf8").replace(/@(DOCS|REPOSITORY)@/g, (_, name) => links[name]);
writeFileSync(join(SITE, "index.html"), html);
const optimiser = join(dirname(createRequire(import.meta.url).resolve("binaryen/package.json")), "bin/wasm-opt");
const small = ["-Oz", "--converge", "--all-features", "--strip-debug", "--strip-producers", "--strip-target-features"];
execFileSync(process.execPath, [optimiser, ...small, MODULE, "-o", OPTIMISED], { stdio: "inherit" });
// The page inflates the module itself, so that any server will do, also one without the module's type and without compression.
writeFileSync(join(SITE, "fingerpad.wasm.deflate"), deflateRawSync(readFileSync(OPTIMISED), { level: 9 }));
for (const model of [MODEL, STIFFENING]) cpSync(model, join(SITE, basename(model)));

const module = new WebAssembly.Module(readFileSync(OPTIMISED));
const imports = WebAssembly.Module.imports(module);
if (imports.length > 0) throw new Error(`the module imports ${imports.map((i) => `${i.module}.${i.name}`).join(", ")}: a panic or a foreign function is linked`);

const sizes = COUNTED.map((name) => [name, statSync(join(SITE, name)).size]);
const all = sizes.reduce((sum, [, bytes]) => sum + bytes, 0);
for (const [name, bytes] of [...sizes, ["together", all]]) console.log(`${name.padEnd(24)} ${String(bytes).padStart(6)} bytes`);
if (all > MOST) throw new Error(`${all} bytes, at most ${MOST} are allowed`);

// The npm package: the module with its scripts and types.
rmSync(PACKAGE, { recursive: true, force: true });
cpSync(join(WEB, "npm"), PACKAGE, { recursive: true });
const version = /^version = "([^"]+)"/m.exec(workspace)?.[1];
if (!version) throw new Error("the workspace names no version");
const description = readFileSync(join(PACKAGE, "package.json"), "utf8").replace("@VERSION@", version);
writeFileSync(join(PACKAGE, "package.json"), description);
cpSync(join(WEB, "page/model.js"), join(PACKAGE, "model.js"));
cpSync(OPTIMISED, join(PACKAGE, "fingerpad.wasm"));
cpSync(MODEL, join(PACKAGE, "fingertip-pad.fpm"));
for (const licence of ["LICENSE-APACHE", "LICENSE-MIT"]) cpSync(join(WEB, "../..", licence), join(PACKAGE, licence));
