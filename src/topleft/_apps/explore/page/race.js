// The atlas, live: a family of scenes, its parameters under sliders, and where each method is wrong.
// In: the name of a family, where its sliders stand, a seed. Out: a picture of the faults of each method, counts, and a column
// of the chart of the atlas. Scenes come from Python, what methods make of them from the engine; faults are found here.

import {drawScene, nearOrigin} from "./engine.js";
import {cross, rint, wholeOf} from "./numbers.js";

// Of faults; shades of grey tell the triangles of what is right.
export const FAULTS = [["another triangle shows", [204, 121, 167]], ["a gap", [213, 94, 0]], ["drawn more than once", [20, 130, 210]]];

// Colours of shares of wrong pixels by their logarithm: ColorBrewer's YlGnBu, which all eyes see.
const SHARES = ["#ffffcc", "#c7e9b4", "#7fcdbb", "#41b6c4", "#225ea8", "#0c2c84"];

// Vertices after what a method makes of them first.
const SNAPS = {exact: (x) => x, float32: Math.fround, px: (x) => Math.trunc(x) + 0.5};
const snapOf = (snap) => SNAPS[snap] ?? ((x) => rint(x * 2 ** snap) * 2 ** -snap);

// Triangles with the winding that a method draws.
function oriented({points, triangles}, {snap, winding}) {
  if (winding === "either") return triangles;
  const oriented = triangles.slice(), [whole] = wholeOf(points.map(snapOf(snap)));
  for (let i = 0; i < triangles.length; i += 3) {
    const area = cross(...[0, 1, 2].map((k) => whole.slice(2 * triangles[i + k], 2 * triangles[i + k] + 2)));
    if ((area > 0n) !== (winding === "clockwise")) oriented.subarray(i, i + 3).reverse();
  }
  return oriented;
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

// What is wrong with each pixel beside the exact picture, and how many pixels are; or why a method refuses the scene.
function faultsOf({refused, shown, counts}, exact) {
  if (refused) return {refused: refused.split(", got")[0]};
  const faults = {wrong: shown.map((id, i) => id !== exact.shown[i]), gaps: counts.map((n, i) => n < exact.counts[i]), overdrawn: counts.map((n, i) => n > exact.counts[i])};
  const sum = (array) => array.reduce((total, value) => total + value, 0);
  return {...faults, n_gaps: sum(faults.gaps), n_overdrawn: sum(faults.overdrawn), n_bad: sum(faults.wrong.map((value, i) => value | faults.gaps[i] | faults.overdrawn[i]))};
}

// A scene where the sliders of its family stand, how their values are written, what must show, and the faults of each method.
async function raced(line, entries, {family, positions, seed}) {
  const {values, size, origin, copies, arrays: {vertices, triangles}} = await line.ask("race.scene", {family, positions, seed});
  const scene = {points: vertices, triangles, size, origin, copies}, turned = {};
  const drawings = entries.map(({method, bits, snap, winding}) =>
    ({method, subpixel_bits: bits, triangles: turned[`${snap} ${winding}`] ??= oriented(scene, {snap, winding})}));
  const [drawn, [exact]] = await Promise.all([
    drawScene(line, scene, drawings), drawScene(line, {...nearOrigin(scene), copies: 1}, [{method: "auto", subpixel_bits: "exact", triangles}])]);
  const more = (copies - 1) * triangles.length / 3;
  const wanted = {shown: exact.shown.map((id) => id < 0 ? id : id + more), counts: exact.counts.map((n) => n * copies)};
  return {scene, values, ids: wanted.shown, faults: drawn.map((one) => faultsOf(one, wanted))};
}

function rowOf(name, {refused, n_bad: bad, wrong, n_gaps: gaps, n_overdrawn: overdrawn}) {
  if (refused) return {name, bad: null, text: "refuses", title: refused};
  return {name, bad, text: bad ? `${bad} wrong` : "right", title: `${bad} of ${wrong.length} pixels: ${gaps} gaps, ${overdrawn} drawn more than once`};
}

// Faults in their colours, triangles in shades of grey.
function faultPicture({refused, wrong, gaps, overdrawn}, ids, [width, height]) {
  const pixels = new Uint8ClampedArray(4 * width * height);
  if (!refused) ids.forEach((id, i) => {
    const kind = gaps[i] ? 1 : overdrawn[i] ? 2 : wrong[i] ? 0 : null;
    pixels.set(kind === null ? [128, 128, 128, id < 0 ? 0 : 40 + 30 * (id % 3)] : [...FAULTS[kind][1], 255], 4 * i);
  });
  return Object.assign(pixels, {shape: [height, width, 4]});
}

function cellOf({refused, n_bad: bad, n_gaps: gaps}, n_edge_px) {
  if (refused) return {text: "", color: "", kind: "refused", title: "refuses to draw"};
  const share = bad / Math.max(1, n_edge_px), level = bad ? Math.min(5, Math.max(0, Math.floor(1.5 * Math.log10(share) + 6))) : 0;
  return {
    text: bad ? (100 * share).toFixed(share < 0.01 ? 1 : 0) : "", color: bad ? SHARES[level] : "",
    kind: (level > 3 ? "dark" : "light") + (gaps ? " gaps" : ""), title: `${bad} wrong pixels${gaps ? ", with gaps" : ""}`,
  };
}

// Promises {values, rows, pictures}: a row and a picture of each method.
export async function race(line, {race: {entries}}, view) {
  const {scene, values, ids, faults} = await raced(line, entries, view);
  return {values, rows: faults.map((one, k) => rowOf(entries[k].name, one)), pictures: faults.map((one) => faultPicture(one, ids, scene.size))};
}

// Promises the cells of all methods in a column of the chart, and how many pixels an edge meets.
export async function raceColumn(line, {race: {entries}}, view) {
  const {scene, faults} = await raced(line, entries, view), n_edge_px = countEdgePixels(scene);
  return {n_edge_px, cells: faults.map((one) => cellOf(one, n_edge_px))};
}
