// The part Race without Python: what race.py answers. Scenes and words come from Python, the scenes as a file of numbers;
// what each method makes of them is drawn and counted here.

import {SINK} from "./kernels.js";
import {cross, rint, wholeOf} from "./numbers.js";
import {nearOrigin, takeScene} from "./pixels.js";
import {bitsOf, checkReach, refuse, Refusal} from "./state.js";

// The scene of a family where its sliders stand: the nearest of those that were written.
function sceneAt({race}, {family, positions, seed = 0}) {
  if (!(family in race.families)) refuse(`family must be one of ${Object.keys(race.families).map((name) => `'${name}'`).join(", ")}, got '${family}'`);
  const {axes} = race.families[family];
  if (positions.length !== axes.length) refuse(`family '${family}' has ${axes.length} parameters, got ${positions.length} positions`);
  if (!(Number.isInteger(seed) && 0 <= seed && seed < race.n_seeds)) refuse(`seed must be from 0 to ${race.n_seeds - 1} without Python, got ${seed}`);
  const steps = positions.map((at, i) => Math.min(Math.max(rint(at), 0), axes[i].steps.length - 1));
  const row = race.scenes[family][steps.reduce((sum, at, i) => sum * axes[i].steps.length + at, 0)], {n_vertices: n, copies, size, origin} = row;
  const points = new Float64Array(race.bytes, row.at + 16 * n * seed, 2 * n);
  const triangles = new Int32Array(race.bytes, row.at + 16 * n * race.n_seeds, 3 * row.n_triangles);
  return {points, triangles, copies, size, origin, values: steps.map((at, i) => axes[i].steps[at])};
}

const rowsOf = (array, n) => Array.from({length: array.length / n}, (_, i) => Array.from(array.subarray(n * i, n * i + n)));

// Vertices after what a method makes of them first.
const SNAPS = {exact: (x) => x, float32: Math.fround, px: (x) => Math.trunc(x) + 0.5};
const snapOf = (snap) => SNAPS[snap] ?? ((x) => rint(x * 2 ** snap) * 2 ** -snap);

// Triangles with the winding that a method draws.
function oriented({points, triangles}, {snap, winding}) {
  if (winding === "either") return triangles;
  const turned = triangles.slice(), [whole] = wholeOf(points.map(snapOf(snap)));
  for (let i = 0; i < triangles.length; i += 3) {
    const area = cross(...[0, 1, 2].map((k) => whole.slice(2 * triangles[i + k], 2 * triangles[i + k] + 2)));
    if ((area > 0n) !== (winding === "clockwise")) turned.subarray(i, i + 3).reverse();
  }
  return turned;
}

function repeated(triangles, copies) {
  const found = new Int32Array(copies * triangles.length);
  for (let i = 0; i < copies; i++) found.set(triangles, i * triangles.length);
  return found;
}

// Counts and ids of production.
function produced(kernels, scene, triangles, bits, method = "auto") {
  return kernels.within(() => {
    takeScene(kernels, {...scene, vertices: rowsOf(scene.points, 2)}, {points: scene.points.slice(), n_components: 2, triangles, bits, method});
    kernels.window(scene.origin, scene.size);
    return {counts: kernels.draw(SINK.count), labels: kernels.draw(SINK.label)};
  });
}

// What must show, and how often a pixel is drawn, of the vertices as they are.
function exactOf(kernels, scene) {
  const {counts, labels} = produced(kernels, {...scene, ...nearOrigin(scene, 2)}, scene.triangles, "exact"), more = (scene.copies - 1) * scene.triangles.length / 3;
  return {ids: labels.map((id) => id < 0 ? id : id + more), counts: counts.map((n) => n * scene.copies)};
}

function drawn(kernels, data, scene, entry) {
  const grid = entry.bits === "exact" ? 8 : entry.bits, limit = 2n ** BigInt(61 - grid);
  if (!scene.origin.every((at) => -limit < BigInt(at) && BigInt(at) < limit)) {
    refuse(`origin must lie within ${limit} pixels of 0 with ${grid} sub-pixel bits, got (${scene.origin.join(", ")})`);
  }
  const triangles = repeated(oriented(scene, entry), scene.copies), classic = data.classics[entry.method];
  if (!classic) return produced(kernels, scene, triangles, entry.bits, entry.method);
  const state = {vertices: rowsOf(scene.points, 2), triangles: rowsOf(scene.triangles, 3), subpixel_bits: entry.bits};
  const bits = bitsOf(state, entry.method, data), own = {points: scene.points, n_components: 2, triangles};
  checkReach(state, entry.method, bits, data);
  const [counts, labels] = [SINK.count, SINK.label].map((sink) => kernels.classic(classic, own, bits, sink, scene.origin, scene.size));
  return {counts, labels};
}

const floorOf = (a, b) => a / b - BigInt(a % b < 0n), below = (a, b) => -floorOf(-a, b) - 1n;
const between = (low, high, n) => [low > 0n ? Number(low) : 0, high < n ? Number(high) : n - 1];

// How many pixels an edge of a triangle meets, their borders included: each row cuts a piece from the edge.
function countEdgePixels({points, triangles, size: [width, height], origin}) {
  const [whole, pixel] = wholeOf(points), met = new Uint8Array(width * height), done = new Set();
  const at = (i) => [0, 1].map((k) => whole[2 * i + k] - BigInt(origin[k]) * pixel);
  triangles.forEach((i, corner) => {
    const j = triangles[corner % 3 < 2 ? corner + 1 : corner - 2], key = Math.min(i, j) * points.length + Math.max(i, j);
    if (done.has(key)) return;
    done.add(key);
    const [[px, py], [qx, qy]] = [at(i), at(j)].sort((a, b) => (a[1] > b[1]) - (a[1] < b[1])), dx = qx - px, dy = qy - py;
    const [first, last] = between(below(py, pixel), floorOf(qy, pixel), height);
    for (let row = first; row <= last; row++) {
      const rows = [BigInt(row) * pixel, BigInt(row + 1) * pixel], ends = [rows[0] > py ? rows[0] : py, rows[1] < qy ? rows[1] : qy];
      const [a, b] = dy ? ends.map((y) => px * dy + dx * (y - py)) : [px, qx], unit = pixel * (dy || 1n);
      const [left, right] = between(below(a < b ? a : b, unit), floorOf(a < b ? b : a, unit), width);
      if (left <= right) met.fill(1, row * width + left, row * width + right + 1);
    }
  });
  return met.reduce((sum, one) => sum + one, 0);
}

// What is wrong with each pixel, and how many pixels are; or the sentence of a method that refuses.
function faultsOf(kernels, data, scene, exact, entry) {
  let found;
  try {
    found = drawn(kernels, data, scene, entry);
  } catch (error) {
    if (error instanceof Refusal) return {refusal: error.message.split(", got")[0]};
    throw error;
  }
  const faults = {wrong: found.labels.map((id, i) => id !== exact.ids[i]), gaps: found.counts.map((n, i) => n < exact.counts[i]), overdrawn: found.counts.map((n, i) => n > exact.counts[i])};
  const sum = (array) => array.reduce((total, value) => total + value, 0);
  return {...faults, n_gaps: sum(faults.gaps), n_overdrawn: sum(faults.overdrawn), bad: sum(faults.wrong.map((value, i) => value | faults.gaps[i] | faults.overdrawn[i]))};
}

function rowOf(name, {refusal, bad, wrong, n_gaps: gaps, n_overdrawn: overdrawn}) {
  if (refusal) return {name, bad: null, text: "refuses", title: refusal};
  return {name, bad, text: bad ? `${bad} wrong` : "right", title: `${bad} of ${wrong.length} pixels: ${gaps} gaps, ${overdrawn} drawn more than once`};
}

// Faults in their colours, triangles in shades of grey.
function pictureOf({refusal, ...faults}, ids, colors, pixels) {
  if (refusal) return;
  ids.forEach((id, i) => {
    pixels.set([128, 128, 128, id < 0 ? 0 : 40 + 30 * (id % 3)], 4 * i);
    for (const [kind, k] of [["wrong", 0], ["overdrawn", 2], ["gaps", 1]]) if (faults[kind][i]) pixels.set([...colors[k], 255], 4 * i);
  });
}

// Digits as Python writes them: a number in the middle between two is rounded to the even one.
function fixed(x, n) {
  const scaled = x * 10 ** n, isMiddle = x % 0.25 === 0 && Number.isInteger(2 * scaled);
  return (isMiddle ? rint(scaled) / 10 ** n : x).toFixed(n);
}

function cellOf({refusal, bad, n_gaps: gaps}, edges, shares) {
  if (refusal) return {text: "", color: "", kind: "refused", title: "refuses to draw"};
  const share = bad / Math.max(1, edges), level = bad ? Math.min(5, Math.max(0, Math.floor(1.5 * Math.log10(share) + 6))) : 0;
  return {
    text: bad ? fixed(100 * share, share < 0.01 ? 1 : 0) : "", color: bad ? shares[level] : "",
    kind: (level > 3 ? "dark" : "light") + (gaps ? " gaps" : ""), title: `${bad} wrong pixels${gaps ? ", with gaps" : ""}`,
  };
}

export const families = (kernels, {race: {families: known, methods, key, n_seeds}}) => ({header: {families: known, methods, key, n_seeds}});

export function draw(kernels, data, question) {
  const scene = sceneAt(data, question), exact = exactOf(kernels, scene), {entries, key} = data.race, [width, height] = scene.size;
  const found = entries.map((entry) => faultsOf(kernels, data, scene, exact, entry)), pixels = new Uint8ClampedArray(4 * width * height * entries.length);
  found.forEach((one, k) => pictureOf(one, exact.ids, key.map(([, color]) => color), pixels.subarray(4 * width * height * k)));
  return {header: {values: scene.values, rows: found.map((one, k) => rowOf(entries[k].name, one))}, arrays: {pictures: [pixels, [entries.length, height, width, 4]]}};
}

export function column(kernels, data, question) {
  const scene = sceneAt(data, question), exact = exactOf(kernels, scene), {entries, shares} = data.race, edges = countEdgePixels(scene);
  return {header: {cells: entries.map((entry) => cellOf(faultsOf(kernels, data, scene, exact, entry), edges, shares))}};
}
