// The state of the part Pixels: what is drawn and how, checked, and what the engine is asked for.

const MAX_COORDINATE = 2 ** 52;

export const STATE_DEFAULTS = {
  origin: [0, 0], method: "auto", other: "", exact: false, subpixel_bits: 8, sampling: "center", cull: "none",
  depth_test: "less", winding: "as given", look: "owners",
};
const OWN_WORDS = {winding: ["as given", "clockwise", "counter-clockwise"], look: ["owners", "overdraw", "wireframe"]};

export const refuse = (text) => {
  throw new Error(text);
};
const shown = (value) => (JSON.stringify(value) ?? "nothing").slice(0, 40);
const listed = (words) => words.map((word) => `'${word}'`).join(", ");

function checkPair(name, value, least, greatest) {
  if (!Array.isArray(value) || value.length !== 2 || !value.every(Number.isInteger)) refuse(`${name} must be two whole numbers, got ${shown(value)}`);
  if (!value.every((number) => least <= number && number <= greatest)) refuse(`${name} must be from ${least} to ${greatest}, got ${value.join(", ")}`);
}

function checkVertices(vertices, most) {
  if (!Array.isArray(vertices)) refuse("vertices must be a list of rows");
  if (vertices.length > most) refuse(`at most ${most} vertices are drawn magnified, got ${vertices.length}`);
  const n = vertices[0]?.length ?? 2, isRow = (row) => Array.isArray(row) && row.length === n && row.every((value) => typeof value === "number");
  if (![2, 3].includes(n) || !vertices.every(isRow)) refuse("vertices must be rows of two or three numbers each, all of one length");
  if (!vertices.every(([x, y, z = 0]) => Math.abs(x) <= MAX_COORDINATE && Math.abs(y) <= MAX_COORDINATE && Math.abs(z) < 1e38)) {
    refuse(`vertices must lie within ${MAX_COORDINATE} pixels of 0`);
  }
  return n;
}

function checkTriangles(triangles, n, most) {
  if (!Array.isArray(triangles)) refuse("triangles must be a list of rows");
  if (triangles.length > most) refuse(`at most ${most} triangles are drawn magnified, got ${triangles.length}`);
  const isIndex = (i) => Number.isInteger(i) && 0 <= i && i < n, bad = triangles.findIndex((row) => !(Array.isArray(row) && row.length === 3 && row.every(isIndex)));
  if (bad >= 0) refuse(`triangles must be rows of three indices in [0, ${n}), the number of vertices; row ${bad} is ${shown(triangles[bad])}`);
}

// The state in an object that a link or a file holds, with what the engine takes: points, corners, n_components, n_samples.
// `hello` is what Python begins with.
export function parseState(given, {limits, words, methods}) {
  if (given === null || typeof given !== "object" || Array.isArray(given)) refuse(`a state must be an object, got ${shown(given)}`);
  const needed = ["vertices", "triangles", "size"], known = [...needed, "scene", ...Object.keys(STATE_DEFAULTS)];
  const unknown = Object.keys(given).filter((name) => !known.includes(name)), missing = needed.filter((name) => !(name in given));
  if (unknown.length) refuse(`a state has no ${unknown.join(", ").slice(0, 80)}`);
  if (missing.length) refuse(`a state must have ${missing.join(" and ")}`);
  const state = {...STATE_DEFAULTS, ...given}, {vertices, subpixel_bits: bits, sampling} = state, names = methods.map(({name}) => name);
  checkPair("size", state.size, 1, limits.max_side_px);
  checkPair("origin", state.origin, -MAX_COORDINATE, MAX_COORDINATE);
  const n_components = checkVertices(vertices, limits.max_vertices);
  checkTriangles(state.triangles, vertices.length, limits.max_triangles);
  if (bits !== "exact" && !(Number.isInteger(bits) && 0 <= bits && bits <= 16)) refuse(`subpixel_bits must be from 0 to 16, or 'exact', got ${shown(bits)}`);
  if (typeof state.exact !== "boolean") refuse("exact must be true or false");
  for (const [name, options] of Object.entries({...words, ...OWN_WORDS, method: names, other: ["", ...names]})) {
    if (!options.includes(state[name])) refuse(`${name} must be one of ${listed(options)}, got ${shown(state[name])}`);
  }
  const triangles = state.triangles.map((row) => turned(row, vertices, state.winding));
  return {
    ...state, triangles, n_components, n_samples: sampling.startsWith("msaa") ? Number(sampling.slice(4)) : 1,
    points: Float64Array.from(vertices.flat()), corners: Int32Array.from(triangles.flat()),
  };
}

// A triangle that turns one way on the screen, where y points down.
function turned([i, j, k], vertices, winding) {
  const [a, b, c] = [vertices[i], vertices[j], vertices[k]], area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  return (winding === "clockwise" && area < 0) || (winding === "counter-clockwise" && area > 0) ? [i, k, j] : [i, j, k];
}

// A picture of it holds coverage alone.
export const isCoverage = ({sampling}) => ["area", "outer", "inner"].includes(sampling);

export const EXACT = "exact";

// What the engine is asked for: a method, or the exact picture, with what of the state it has.
export function drawingOf(state, method, {methods}) {
  const {corners: triangles, sampling, cull, depth_test, subpixel_bits: bits} = state;
  if (method === EXACT) return {triangles, method: "auto", subpixel_bits: EXACT, sampling, cull, depth_test};
  const {is_classic: isClassic, has_bits: hasBits} = methods.find(({name}) => name === method);
  if (isClassic) return {triangles, method, subpixel_bits: hasBits && bits !== EXACT ? bits : 8, sampling: "center", cull: "none"};
  return {triangles, method, subpixel_bits: sampling === "area" && bits === EXACT ? 8 : bits, sampling, cull, depth_test};
}
