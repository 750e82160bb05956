// What happens, in plain words.

import { fixed } from "./draw.js";

const REGIMES = [
  ["In the air", "Drag the body up, or raise the depth, until it touches the pad."],
  ["It sticks", "All of the contact holds on. Push, and it stretches like rubber; let go, and it comes back."],
  ["It slips at the rim", "The middle of the contact still holds, its rim already slides. The grip is not lost, but its reserve shrinks."],
  ["It slips", "The whole contact slides, and friction cannot grow. Press harder or turn back."],
];

const FLAGS = [[2, "a motion was not a number"], [8, "deeper than the pad was fitted for"], [16, "a step beyond 64 mm was cut"], [128, "the contact was reset"], [256, "an effect is at the end of its range"], [512, "a pose beyond the range of the pad: the nearest one"], [1024, "no equilibrium in a step: the motion is too fast"], [2048, "a body sharper than the patches: the least radius"]];

const ALMOST = ["It sticks", "Almost all of the contact holds on. Push, and it stretches like rubber; let go, and it comes back."];

export const verdict = (r) => (r.regime === 1 && r.stick_ratio < 1 ? ALMOST : REGIMES[r.regime]);

export const remarks = (r) => FLAGS.filter(([flag]) => r.status & flag).map(([, words]) => words).join("; ");

/** The numbers beside the views. */
export function numbers(r) {
  const percent = (share) => `${fixed(100 * share, 0)} %`;
  return {
    normal: `${fixed(r.normal_n, 3)} N`,
    friction: `${fixed(Math.hypot(r.friction_x_n, r.friction_y_n), 3)} N`,
    limit: `${fixed(r.limit_n, 3)} N`,
    stick: percent(r.stick_ratio),
    margin: r.regime ? percent(r.margin) + (Math.abs(r.margin - r.margin_relaxed) < 5e-3 ? "" : `, ${percent(r.margin_relaxed)} will be left`) : "no contact",
    moment: `${fixed(r.moment_n_mm, 2)} N mm`,
    area: `${fixed(r.area_mm2, 0)} mm²`,
    band: `± ${fixed(r.band_friction_n, 3)} N`,
  };
}

/** Formulas of the skin's laws, with the sizes that their sources give as typical. */
export function formulas(model, laws) {
  const of = (kind, i) => fixed(model.value(kind, i), 3).replace(/\.?0+$/, "");
  const { moisture: m, speed: v, temperature: t } = laws;
  return [
    `Moisture h: × 1 + ${of(m, 0)} [g(h) − g(35)], g(h) = exp(−½ ((h − ${of(m, 1)})/${of(m, 2)})²).`,
    `Temperature T: × 1 + ${of(t, 0)} (T − 32 °C).`,
    `Speed v: × 1 + ${of(v, 0)} ln(v / 2 mm/s) while the body moves.`,
    "Sizes are typical ones of the laws' sources.",
  ];
}

/** How a held load has changed under a disturbance. */
export function held(then, now, seconds) {
  const change = then > 1e-4 ? `, a change of ${fixed((100 * (now - then)) / then, 2)} %` : "";
  return `Shaken for ${fixed(seconds, 0)} s: friction was ${fixed(then, 4)} N and is ${fixed(now, 4)} N${change}.`;
}
