// A state of the part Pixels without Python, checked as state.py checks it, and the sentences of what is refused.
// In: the object of a question. Out: a state, with the sub-pixel bits and the range of a method.

import {asFloat} from "./numbers.js";

const MAX_COORDINATE = 2 ** 52;

// Python's words for a mistake: what a page gets is the sentence.
export class Refusal extends Error {}
export const refuse = (text) => {
  throw new Refusal(text);
};
const shown = (value) => Array.isArray(value) ? `[${value.map(repr).join(", ")}]` : typeof value === "boolean" ? (value ? "True" : "False") : value === null ? "None" : Number.isInteger(value) ? `${BigInt(value)}` : String(value);
const repr = (value) => typeof value === "string" ? `'${value}'` : shown(value);
const quoted = (words) => words.map((word) => `'${word}'`).join(", ");

function pairOf(name, value, least, greatest) {
  if (!Array.isArray(value) || value.length !== 2 || !value.every(Number.isInteger)) {
    refuse(`${name} must be two whole numbers, got ${shown(value).slice(0, 40)}`);
  }
  if (!value.every((number) => least <= number && number <= greatest)) {
    refuse(`${name} must be from ${least} to ${greatest}, got ${value.map(shown).join(", ")}`);
  }
  return value;
}

function chosen(name, value, words) {
  if (!words.includes(value)) refuse(`${name} must be one of ${quoted(words)}, got ${repr(value)}`);
}

// A method is one of the kernels' or of the literature.
export function checkMethod(name, {hello: {methods}}) {
  const names = (isClassic) => methods.filter((one) => one.is_classic === isClassic).map((one) => one.name);
  if (methods.some((one) => one.name === name)) return;
  refuse(`method must be one of ${quoted(names(false))}, got ${repr(name)}; methods to compare with are ${quoted(names(true))}`);
}

export function parseState(given, data) {
  const {max_side_px, max_triangles, max_vertices, words} = data.limits;
  if (given === null || typeof given !== "object" || Array.isArray(given)) {
    refuse(`a state must be an object, got ${Array.isArray(given) ? "list" : typeof given}`);
  }
  const known = ["vertices", "triangles", "size", "scene", ...Object.keys(data.defaults)];
  const unknown = Object.keys(given).filter((name) => !known.includes(name)).sort();
  if (unknown.length) refuse(`a state has no ${unknown.join(", ").slice(0, 80)}`);
  const missing = ["vertices", "triangles", "size"].filter((name) => !(name in given));
  if (missing.length) refuse(`a state must have ${missing.join(" and ")}`);
  const state = {...data.defaults, ...given};
  pairOf("size", state.size, 1, max_side_px);
  pairOf("origin", state.origin, -MAX_COORDINATE, MAX_COORDINATE);
  const {vertices, triangles, subpixel_bits: bits} = state;
  if (!Array.isArray(vertices)) refuse("vertices must be a list of rows");
  if (vertices.length > max_vertices) refuse(`at most ${max_vertices} vertices are drawn magnified, got ${vertices.length}`);
  const n = vertices[0]?.length ?? 2;
  if ((n !== 2 && n !== 3) || !vertices.every(Array.isArray) || !vertices.every((row) => row.length === n && row.every((value) => typeof value === "number"))) {
    refuse("vertices must be rows of two or three numbers each, all of one length");
  }
  if (!vertices.every(([x, y, z = 0]) => Math.abs(x) <= MAX_COORDINATE && Math.abs(y) <= MAX_COORDINATE && Math.abs(z) < 1e38)) {
    refuse(`vertices must lie within ${MAX_COORDINATE} pixels of 0`);
  }
  if (bits !== "exact" && !(Number.isInteger(bits) && 0 <= bits && bits <= 16)) {
    refuse(`subpixel_bits must be from 0 to 16, or 'exact', got '${shown(bits).slice(0, 40)}'`);
  }
  if (typeof state.exact !== "boolean") refuse("exact must be true or false");
  for (const name of [state.method, state.other]) if (name) checkMethod(name, data);
  for (const [name, options] of Object.entries(words)) chosen(name, state[name], options);
  if (triangles.length > max_triangles) refuse(`at most ${max_triangles} triangles are drawn magnified, got ${triangles.length}`);
  for (const [i, row] of triangles.entries()) {
    if (!row.every((index) => 0 <= index && index < vertices.length)) {
      refuse(`triangles must hold indices in [0, ${vertices.length}), the number of vertices; row ${i} is ${shown(row)}`);
    }
  }
  const areaOf = ([a, b, c]) => (vertices[b][0] - vertices[a][0]) * (vertices[c][1] - vertices[a][1])
    - (vertices[b][1] - vertices[a][1]) * (vertices[c][0] - vertices[a][0]);
  const isWrong = {clockwise: (area) => area < 0, "counter-clockwise": (area) => area > 0}[state.winding] ?? (() => false);
  state.triangles = triangles.map((row) => isWrong(areaOf(row)) ? [row[0], row[2], row[1]] : row);
  state.has_depth = n === 3;
  state.n_samples = state.sampling.startsWith("msaa") ? Number(state.sampling.slice(4)) : 1;
  return state;
}

// A picture of it holds coverage alone.
export const isCoverage = (state) => ["area", "outer", "inner"].includes(state.sampling);

// The sub-pixel bits that a method draws with.
export function bitsOf(state, method, data) {
  const classic = data.classics[method];
  if (classic) return classic.has_bits && state.subpixel_bits !== "exact" ? state.subpixel_bits : 8;
  return state.sampling === "area" && state.subpixel_bits === "exact" ? 8 : state.subpixel_bits;
}

// Refuses vertices beyond the range of a classic.
export function checkReach(state, method, bits, data) {
  const {limit, has_bits: hasBits} = data.classics[method], most = hasBits ? limit / 2 ** Math.max(1, bits) : limit ?? Infinity;
  const bad = new Set(state.triangles.flat().filter((i) => !state.vertices[i].slice(0, 2).every((x) => Math.abs(x) < most)));
  if (!bad.size) return;
  const i = Math.min(...bad);
  refuse(`vertices must lie within ${most} pixels of 0 for method '${method}', got [${state.vertices[i].map(asFloat).join(", ")}] in row ${i}`);
}
