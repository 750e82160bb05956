// The state of the page in its address, behind the #: a link to it restores body, place, pose, skin and disturbance.

/** Names in the address: the sliders' own, the chosen body, the switches, and the pose over the body's apex. */
const SWITCHES = ["noisy", "vibrates", "relaxes"];
const PLACES = ["depth", "x", "y", "spin", "pitch", "roll"];
const BODY = ["radius", "axis", "angle"];
const SKIN = ["moisture", "temperature", "speed", "noise"];

const el = (id) => document.getElementById(id);
const short = (value) => String(Number(Number(value).toFixed(4)));

/** What the controls show, without what is at rest. */
export function hashOf(page) {
  const { hand, shape, rest, start_deg, views } = page;
  const state = new URLSearchParams();
  const put = (id, value, at) => { if (short(value) !== short(at)) state.set(id, short(value)); };
  if (shape.kind !== "plane") {
    state.set("body", shape.kind);
    for (const id of BODY) if (!document.querySelector(`[for=${id}]`).hidden) state.set(id, short(shape[id]));
    put("start_pitch", start_deg[0], page.model.pitch);
    put("start_roll", start_deg[1], 0);
  }
  PLACES.forEach((id, i) => put(id, hand.target[i], rest[id]));
  for (const id of SKIN) put(id, el(id).value, rest[id]);
  for (const id of SWITCHES) if (el(id).checked) state.set(id, "1");
  if (views.patch.shows === "stick") state.set("map", "stick");
  return state.size > 0 ? `#${state}` : "";
}

/** Restores a state. Returns what was refused, each with name, value and range; the rest is restored. */
export function restore(page, hash) {
  const asked = new URLSearchParams(hash.slice(1));
  const refused = [];
  const number = (id, input) => {
    const text = asked.get(id);
    if (text === null) return null;
    const value = Number(text);
    const [low, high] = [Number(input.min), Number(input.max)];
    if (text.trim() !== "" && value >= low && value <= high) return value;
    refused.push(`${id} ${text || "is empty"}: ${low} to ${high} is allowed`);
    return null;
  };
  const one = (id, words) => {
    const word = asked.get(id);
    if (word === null || words.includes(word)) return word;
    refused.push(`${id} ${word}: ${words.join(", ")} is allowed`);
    return null;
  };
  page.reset();
  const { hand } = page;
  ["pitch", "roll"].forEach((id, i) => { hand.target[4 + i] = number(`start_${id}`, el(id)) ?? hand.target[4 + i]; });
  page.touch({ kind: one("body", [...el("kind").options].map((option) => option.value)) ?? "plane" });
  const change = {};
  for (const id of BODY) {
    const hidden = document.querySelector(`[for=${id}]`).hidden;
    if (hidden && asked.has(id)) refused.push(`${id} ${asked.get(id)}: a ${page.shape.kind} has none`);
    else change[id] = number(id, el(id)) ?? page.shape[id];
  }
  page.touch(change);
  PLACES.forEach((id, i) => { hand.target[i] = number(id, el(id)) ?? Number(page.rest[id]); });
  for (const id of SKIN) set(el(id), "value", number(id, el(id)) ?? page.rest[id]);
  for (const id of SWITCHES) set(el(id), "checked", one(id, ["1"]) === "1");
  const shows = one("map", ["stick"]) ?? "pressure";
  el(`by-${shows}`).checked = true;
  page.views.patch.shows = shows;
  const known = [...PLACES, ...BODY, ...SKIN, ...SWITCHES, "body", "map", "start_pitch", "start_roll"];
  for (const id of asked.keys()) if (!known.includes(id)) refused.push(`${id}: not a name of this page`);
  return refused;
}

function set(input, property, value) {
  input[property] = value;
  input.dispatchEvent(new Event("input"));
}
