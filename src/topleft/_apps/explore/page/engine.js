// What draws for the page: the kernels in WebAssembly in a worker (local.js), or Python behind the server (engine.py). Both
// answer the questions asked here, with the same arrays.

import {wholeOf} from "./numbers.js";

// Why something is not drawn, as a reader is told; other errors are faults.
export class Refusal extends Error {}

const bytesOf = (array) => new Uint8Array(array.buffer, array.byteOffset, array.byteLength);

// Asks about drawings of a scene; `parts` go behind its numbers.
export function askScene(line, what, {points, n_components = 2, size, origin, copies = 1}, drawings, more = {}, parts = []) {
  const triangles = [...new Set(drawings.map((one) => one.triangles))];
  const asked = drawings.map((one) => ({...one, triangles: 1 + triangles.indexOf(one.triangles)}));
  const question = {...more, n_components, size, origin: origin.map(String), copies, drawings: asked};
  return line.ask(what, question, [points, ...triangles, ...parts].map(bytesOf));
}

// Draws a scene, {points: Float64Array, n_components, size, origin, copies}, in several ways, {triangles: Int32Array, method,
// subpixel_bits, sampling, cull, depth_test, is_wireframe} each. Promises for each {shown, counts, seconds}: the triangle
// that each sample shows (Int32Array) or the coverage of each pixel (Float32Array), how many cover it; or {refused}.
export async function drawScene(line, scene, drawings) {
  const {drawings: drawn, arrays} = await askScene(line, "engine.draw", scene, drawings);
  return drawn.map((one, i) => ({...one, shown: arrays[`shown${i}`], counts: arrays[`counts${i}`]}));
}

// The steps of a method, {triangles, method, subpixel_bits}: {n, arrays: {counts, words}}, words as steps.h describes them.
export const traceScene = (line, scene, drawing) => askScene(line, "engine.trace", scene, [drawing]);

const MAX_EXACT_PX = 2 ** 48;

// A scene of pixels far away, moved to where exact pictures are drawn: near 0.
export function nearOrigin({points, n_components = 2, origin, ...scene}) {
  if (origin.every((at) => Math.abs(Number(at)) < MAX_EXACT_PX / 2)) return {...scene, points, n_components, origin};
  const [whole, pixel] = wholeOf(points), moved = points.map((value, i) => {
    if (i % n_components > 1) return value;
    const n = whole[i] - BigInt(origin[i % n_components]) * pixel;
    if (BigInt(Number(n)) !== n) throw new Refusal("the exact picture of a window so far away is drawn of vertices near it alone");
    return Number(n) / Number(pixel);
  });
  return {...scene, points: moved, n_components, origin: [0, 0]};
}
