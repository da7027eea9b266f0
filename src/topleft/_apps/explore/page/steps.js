// The part Steps without Python: what trace.py answers. The kernels tell their steps; here they are put into words.

import {asFloat, sixDigits} from "./numbers.js";
import {takeScene} from "./pixels.js";
import {bitsOf, checkMethod, checkReach, refuse} from "./state.js";

const isNumber = (value) => typeof value === "bigint" || typeof value === "number";

// Python's "{:.6g}" and "{:+.6g}".
function real(x) {
  if (!Number.isFinite(x)) return Number.isNaN(x) ? "nan" : x < 0 ? "-inf" : "inf";
  return Object.is(x, -0) ? "-0" : sixDigits(x);
}
const textOf = (value) => Array.isArray(value) ? value.map(textOf).join(", ") : typeof value === "bigint" ? `${value}` : real(value);
function changeOf(before, value) {
  if (!isNumber(before) || !isNumber(value)) return "";
  const text = real(Number(value - before));
  return text.startsWith("-") ? text : `+${text}`;
}

// The steps in a stream of words, as steps.h of the classics describes it.
function* stepsOf({n, words}, kinds) {
  const reals = new Float64Array(words.buffer);
  for (let at = 0, i = 0; i < n; i++) {
    const [kind, triangle, x, y, last, isDrawn] = Array.from(words.subarray(at, at + 6), Number), [name, side, isReal, numbers] = kinds[kind];
    at += 6;
    const values = numbers.map(([word, length]) => {
      const own = Array.from({length}, (_, k) => isReal ? reals[at + 2 * k] : (words[at + 2 * k + 1] << 64n) + BigInt.asUintN(64, words[at + 2 * k]));
      at += 2 * length;
      return [word, length === 1 ? own[0] : own];
    });
    yield {name, side, triangle, x, y, last, isDrawn: isDrawn === 1, values: Object.fromEntries(values)};
  }
}

function sentenceOf({name, side, triangle, x, y, last, isDrawn, values}) {
  switch (name) {
    case "triangle": return `Triangle ${triangle} is set up.`;
    case "row": return `Row ${y} of triangle ${triangle}.`;
    case "line": return `The ${side} line passes pixel ${x}, ${y}.`;
    case "test": return `Pixel ${x}, ${y} of triangle ${triangle}: ${isDrawn ? "drawn" : values.is_inside ? "inside" : "outside"}.`;
    default: return `Pixels ${x} to ${last} of row ${y} are drawn.`;
  }
}

export function trace(kernels, data, {vertices, triangles, size, origin = [0, 0], method, subpixel_bits: bits = 8}) {
  const {kinds, methods, about, max_steps: most, max_side_px: side, max_triangles: many} = data.steps;
  checkMethod(method, data);
  if (!methods.includes(method)) refuse(`method must be one of ${methods.map((name) => `'${name}'`).join(", ")} to be traced, got '${method}'`);
  if (Math.max(...size) > side || triangles.length > many) {
    refuse(`a trace must have ${side} pixels a side and ${many} triangles at most, got (${size.join(", ")}) and ${triangles.length}`);
  }
  const classic = data.classics[method], state = {vertices: vertices.map((row) => row.slice(0, 2)), triangles, subpixel_bits: bits, sampling: "center"};
  const own = bitsOf(state, method, data), scene = {points: Float64Array.from(state.vertices.flat()), n_components: 2, triangles: Int32Array.from(triangles.flat())};
  if (classic) checkReach(state, method, own, data);
  else {
    kernels.within(() => takeScene(kernels, {...state, origin, size}, {...scene, points: scene.points.slice(), bits: own}));
    const far = Math.max(0, ...triangles.flat().flatMap((i) => state.vertices[i]).map(Math.abs)) * 2 ** own;
    if (far >= 2 ** 60) refuse(`vertices must lie within 2**60 sub-pixels of 0 to be traced, got ${sixDigits(far)}`);
  }
  const walk = {number: data.n_classics, form: ["edge", "scanline"].indexOf(method)};
  const found = kernels.trace(classic ?? walk, scene, own, origin, size, most);
  if (!found) refuse(`a trace must have ${most} steps at most: draw fewer triangles, or a smaller picture`);
  const before = {}, steps = [];
  for (const step of stepsOf(found, kinds)) {
    const key = `${step.name} ${step.triangle}`, last = before[key] ?? {};
    const values = Object.entries(step.values).filter(([name]) => name !== "is_inside").map(([name, value]) => [name, textOf(value), changeOf(last[name], value)]);
    steps.push([step.x, step.y, step.last, step.isDrawn, step.triangle, step.name, sentenceOf(step), values]);
    before[key] = step.values;
  }
  const outlines = triangles.map((row) => row.map((i) => state.vertices[i].map((x, k) => asFloat(x - origin[k])).join(",")).join(" "));
  return {header: {size, steps, about: about[method], methods, outlines}, arrays: {counts: [found.counts, [size[1], size[0]]]}};
}
