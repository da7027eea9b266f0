// Puts the steps of a method into words. In: what the engine tells, words of int64 as steps.h of the classics describes them.
// Out: each step with the numbers that decide it, and what they have changed by.

import {traceScene} from "./engine.js";
import {sixDigits} from "./numbers.js";
import {refuse} from "./state.js";

const isNumeric = (value) => typeof value === "bigint" || typeof value === "number";

const textOf = (value) => Array.isArray(value) ? value.map(textOf).join(", ") : typeof value === "bigint" ? `${value}` : sixDigits(value);
function changeOf(before, value) {
  if (!isNumeric(before) || !isNumeric(value)) return "";
  const text = sixDigits(Number(value - before));
  return text.startsWith("-") ? text : `+${text}`;
}

// The steps in a stream of words, as steps.h of the classics describes it.
function* stepsOf({n, words}, kinds) {
  const reals = new Float64Array(words.buffer, words.byteOffset, words.length);
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

// Promises {size, steps, outlines, counts} of a method that draws a state: steps are lists [x, y, last, is drawn, triangle, kind,
// sentence, values].
export async function recorded(line, {kinds, methods}, {vertices, triangles, size, origin = [0, 0]}, name, bits) {
  const method = methods.find((one) => one.name === name) ?? refuse(`method must be one of ${methods.map((one) => one.name).join(", ")}, got ${name}`);
  const points = Float64Array.from(vertices.flatMap(([x, y]) => [x, y])), subpixel_bits = method.is_classic && !method.has_bits ? 8 : bits;
  const {n, arrays} = await traceScene(line, {points, size, origin}, {triangles: Int32Array.from(triangles.flat()), method: name, subpixel_bits});
  const before = {}, steps = [];
  for (const step of stepsOf({n, words: arrays.words}, kinds)) {
    const key = `${step.name} ${step.triangle}`, last = before[key] ?? {};
    const values = Object.entries(step.values).filter(([word]) => word !== "is_inside").map(([word, value]) => [word, textOf(value), changeOf(last[word], value)]);
    steps.push([step.x, step.y, step.last, step.isDrawn, step.triangle, step.name, sentenceOf(step), values]);
    before[key] = step.values;
  }
  const outlines = triangles.map((row) => row.map((i) => [0, 1].map((k) => vertices[i][k] - origin[k]).join(",")).join(" "));
  return {size, steps, outlines, counts: arrays.counts};
}

// What is said of a method.
export const aboutOf = ({summary, source}) => `${summary[0].toUpperCase()}${summary.slice(1)}. ${source}.`;
