// The functions of Math by names of their own, which the minifier shortens: build.js puts them in place of `Math.abs` and the others.

export const { abs: math_abs, atan2: math_atan2, cos: math_cos, exp: math_exp, floor: math_floor, hypot: math_hypot, log: math_log, log10: math_log10, max: math_max, min: math_min, PI: math_PI, random: math_random, round: math_round, sign: math_sign, sin: math_sin, sqrt: math_sqrt } = Math;
