// The exact picture of areas and of conservative coverage, in whole numbers of any length.
// In: a state. Out: how much of each pixel triangles cover, and how many.

import {cross, quotient, rint, wholeOf} from "./numbers.js";

// Triangles with an area that are not culled, positive corners [x, y] each, from the corner of the window, and the unit.
function trianglesOf({vertices, triangles, origin, cull}, bits) {
  const flat = vertices.flatMap(([x, y]) => bits === "exact" ? [x, y] : [x, y].map((value) => rint(value * 2 ** bits) * 2 ** -bits));
  const [whole, unit] = wholeOf(flat), at = (i) => [0, 1].map((k) => whole[2 * i + k] - BigInt(origin[k]) * unit), found = [];
  for (const [i, j, k] of triangles) {
    const [a, b, c] = [at(i), at(j), at(k)], area = cross(a, b, c);
    if (area && cull !== (area > 0n ? "back" : "front")) found.push(area > 0n ? [a, b, c] : [a, c, b]);
  }
  return [found, unit];
}

const edgesOf = (polygon) => polygon.map((a, i) => [a, polygon[(i + 1) % polygon.length]]);
const squareOf = (column, row, unit) => [[0, 0], [1, 0], [1, 1], [0, 1]].map(([x, y]) => [BigInt(column + x) * unit, BigInt(row + y) * unit]);

// The interiors meet: no edge of either has the other wholly outside or on its line.
const outer = (triangle, square) => ![[triangle, square], [square, triangle]].some(([polygon, other]) =>
  edgesOf(polygon).some(([a, b]) => other.every((p) => cross(a, b, p) <= 0n)));
// Every corner of the square is inside or on every edge.
const inner = (triangle, square) => edgesOf(triangle).every(([a, b]) => square.every((p) => cross(a, b, p) >= 0n));

// The part of a convex polygon above (side 1) or below (-1) a limit on one axis; points are [x, y, w], at (x / w, y / w).
function cut(polygon, axis, limit, side) {
  return edgesOf(polygon).flatMap(([a, b]) => {
    const [da, db] = [a, b].map((p) => side * (p[axis] - limit * p[2])), kept = da >= 0n ? [a] : [];
    const [m, n] = da < 0n ? [db, -da] : [-db, da];
    return da * db < 0n ? [...kept, a.map((value, k) => value * m + b[k] * n)] : kept;
  });
}

// The area of triangle and square, twice, as a fraction.
function sharedArea(triangle, [low, , high]) {
  let polygon = triangle.map((p) => [...p, 1n]), n = 0n, d = 1n;
  for (const axis of [0, 1]) polygon = cut(cut(polygon, axis, low[axis], 1n), axis, high[axis], -1n);
  for (const [a, b] of edgesOf(polygon)) {
    const w = a[2] * b[2];
    [n, d] = [n * w + (a[0] * b[1] - a[1] * b[0]) * d, d * w];
  }
  return [n < 0n ? -n : n, d];
}

export function exactCoverage(state, bits) {
  const [triangles, unit] = trianglesOf(state, bits), [width, height] = state.size, n = width * height;
  const shares = new Float32Array(n), counts = new Int32Array(n), test = {outer, inner}[state.sampling];
  for (let i = 0; i < n; i++) {
    const square = squareOf(i % width, Math.floor(i / width), unit);
    if (test) {
      counts[i] = triangles.filter((triangle) => test(triangle, square)).length;
      shares[i] = counts[i] > 0 ? 1 : 0;
    } else {
      const [area, d] = triangles.map((triangle) => sharedArea(triangle, square)).reduce(([a, b], [c, e]) => [a * e + c * b, b * e], [0n, 1n]);
      shares[i] = Math.min(1, quotient(area, 2n * d * unit * unit));
      counts[i] = shares[i] > 0 ? 1 : 0;
    }
  }
  return {owners: Int32Array.from(shares, (share) => share > 0 ? 0 : -1), counts, shares};
}
