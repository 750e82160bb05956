// Where things are.

import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

export const WEB = dirname(dirname(fileURLToPath(import.meta.url)));
/** The built page. */
export const SITE = join(WEB, "site");
export const MODULE = join(WEB, "target/wasm32-unknown-unknown/release/fingerpad_web.wasm");
/** The same without what is not needed. */
export const OPTIMISED = join(WEB, "target/fingerpad.wasm");
export const MODEL = join(WEB, "../../data/models/fingertip-pad.fpm");
/** The pad of the finger whose tissue stiffens. */
export const STIFFENING = join(WEB, "../../data/models/human-stiffening-pad.fpm");
/** The npm package as it is published. */
export const PACKAGE = join(WEB, "target/npm");
