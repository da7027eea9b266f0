// Says why a pixel is whose: edge values, top and left edges, the owner, who else could be, depth and barycentrics.
// In: a state, a pixel of its window, which sample of it. Out: a sentence or two, and a row for each triangle near by. All is
// computed in whole numbers of any length; what a method makes of the pixel is drawn by the engine.

import {drawScene} from "./engine.js";
import {abs, cross, dyadic, quotient, rint, sixDigits} from "./numbers.js";
import {colorOf, css} from "./colors.js";
import {drawingOf, parseState, refuse} from "./state.js";

const MAX_ROWS = 6, MAX_DRAWN = 64;
const gcd = (a, b) => b ? gcd(b, a % b) : abs(a);

const number = (n, d) => n === 0n ? "0" : sixDigits(quotient(n, d));
function fraction(n, d) {
  const g = gcd(n, d);
  return d / g === 1n ? `${n / g}` : `${n / g}/${d / g}`;
}

const isTopLeft = (a, b) => (a[1] === b[1] && b[0] > a[0]) || b[1] < a[1];
const side = (a, b) => a[1] === b[1] ? (isTopLeft(a, b) ? "top" : "bottom") : isTopLeft(a, b) ? "left" : "right";

// Each triangle with an area at a sample: edges with twice their areas in units of 4^-k px, and what that makes of it.
function verdicts(state, pixel, sample, bits) {
  const own = state.vertices.map(([x, y]) => [x, y].map((value) => bits === "exact" ? dyadic(value) : [BigInt(rint(value * 2 ** bits)), bits]));
  const k = Math.max(4, ...own.flat().map(([, power]) => power)), unit = 4 ** k;
  const points = own.map((row) => row.map(([n, power]) => n << BigInt(k - power)));
  const at = [0, 1].map((i) => BigInt(16 * (pixel[i] + state.origin[i]) + 8 + sample[i]) << BigInt(k - 4));
  const found = [];
  for (const [triangle, numbers] of state.triangles.entries()) {
    const corners = numbers.map((i) => points[i]), area = cross(...corners);
    if (!area || state.cull === (area > 0n ? "back" : "front")) continue;
    const edges = [0, 1, 2].map((i) => {
      const [p, q] = area > 0n ? [(i + 1) % 3, (i + 2) % 3] : [(i + 2) % 3, (i + 1) % 3];
      return {ends: [numbers[p], numbers[q]], kind: side(corners[p], corners[q]), value: cross(corners[p], corners[q], at)};
    });
    const isTouched = edges.every(({value}) => value >= 0n);
    const isCovered = edges.every(({value, kind}) => value > 0n || (value === 0n && (kind === "top" || kind === "left")));
    const least = edges.reduce((low, {value}) => value < low ? value : low, edges[0].value);
    found.push({triangle, numbers, edges, area: abs(area), d: BigInt(unit), isTouched, isCovered, least, depth: depthOf(state, numbers, edges, abs(area))});
  }
  return found.sort((a, b) => b.isCovered - a.isCovered || b.isTouched - a.isTouched || (a.least < b.least ? 1 : a.least > b.least ? -1 : 0));
}

// The depth of the plane at the sample, as a fraction.
function depthOf(state, numbers, edges, area) {
  if (state.n_components < 3) return null;
  const z = numbers.map((i) => dyadic(state.vertices[i][2])), k = Math.max(...z.map(([, power]) => power));
  const sum = edges.reduce((total, {value}, i) => total + value * (z[i][0] << BigInt(k - z[i][1])), 0n);
  return [sum, area << BigInt(k)];
}

// The triangle that shows: the nearest depth as float32 has it, else the one that is drawn last.
function winner(covered, state) {
  const inOrder = [...covered].sort((a, b) => a.triangle - b.triangle);
  if (state.n_components < 3) return inOrder.at(-1) ?? null;
  const near = (one) => (state.depth_test === "less" ? -1 : 1) * Math.fround(quotient(...one.depth));
  return inOrder.reduce((best, one) => best === null || near(one) > near(best) ? one : best, null);
}

const named = ({ends}) => `${Math.min(...ends)}\u2013${Math.max(...ends)}`;

function edgeStory(one) {
  const through = one.edges.filter(({value}) => value === 0n), ends = through.map(named).join(" and "), kinds = through.map(({kind}) => kind).join(" and a ");
  const story = through.length === 1 ? `Edge ${ends} is a ${kinds} edge` : `Edges ${ends} are a ${kinds} edge`;
  return `${story} of triangle ${one.triangle}, so the pixel ${one.isCovered ? "belongs" : "does not belong"} to it.`;
}

function sentences(state, found, owner, [x, y], k) {
  const what = `The ${state.n_samples > 1 ? `sample ${k}` : "centre"} of pixel (${x}, ${y})`, told = [];
  const onEdge = found.filter((one) => one.isTouched && one.edges.some(({value}) => value === 0n)), covered = found.filter((one) => one.isCovered);
  if (onEdge.length) told.push(`${what} lies on an edge. ${onEdge.slice(0, 4).map(edgeStory).join(" ")}`);
  else if (owner) told.push(`${what} lies inside triangle ${owner.triangle}: all three edge values are positive.`);
  else told.push(`${what} lies in no triangle: each has an edge value below zero.`);
  if (covered.length > 1 && owner) {
    const others = covered.filter((one) => one !== owner).map((one) => one.triangle);
    const listed = `${others.length === 1 ? "triangle" : "triangles"} ${others.slice(0, 4).join(", ")}${others.length > 4 ? " and others" : ""}`;
    told.push(`Triangle ${owner.triangle} shows because ${state.n_components > 2 ? "it is nearer" : "it is drawn last"}; ${listed} ${covered.length === 2 ? "is" : "are"} hidden.`);
  }
  return told;
}

// How often each classic draws a pixel for each triangle, [triangle, times]; null where that cannot be told.
async function timesDrawn(line, hello, state, origin, classics) {
  const {points, n_components, corners} = state, n = state.triangles.length;
  if (n > MAX_DRAWN || !classics.length) return classics.map(() => null);
  const rows = Array.from({length: n}, (_, i) => corners.slice(3 * i, 3 * i + 3));
  const drawings = classics.flatMap((method) => rows.map((triangles) => ({...drawingOf(state, method, hello), triangles})));
  const drawn = await drawScene(line, {points, n_components, size: [1, 1], origin}, drawings);
  return classics.map((_, k) => {
    const own = drawn.slice(n * k, n * k + n);  // a vertex beyond the range of a classic: nothing is told of it
    return own.some(({refused}) => refused) ? null : own.flatMap(({counts: [times]}, i) => times ? [[i, times]] : []);
  });
}

// What a classic makes of the pixel, beside the exact rule.
function classicStory(method, times, owner) {
  if (!times) return "";
  const n = times.reduce((sum, [, k]) => sum + k, 0);
  const rule = owner ? `by the exact rule it is triangle ${owner.triangle}'s` : "no triangle should have it";
  if (!n) return `${method} leaves it out${owner ? `; ${rule}: a gap.` : ", as it should."}`;
  if (owner && times.length === 1 && times[0][0] === owner.triangle && n === 1) {
    return `${method} draws it once, for triangle ${owner.triangle}, as it should.`;
  }
  const drawn = times.map(([i, k]) => `triangle ${i}${k > 1 ? ` (${k} times)` : ""}`).join(" and ");
  return `${method} draws it ${n === 1 ? "once" : `${n} times`}, for ${drawn}; ${rule}.`;
}

export async function probe(line, hello, {state: given, pixel, sample = 0, method: asked}) {
  const state = parseState(given, hello), method = asked ?? state.method, {subpixel_bits: bits} = drawingOf(state, method, hello);
  const positions = hello.samples[state.n_samples];
  if (!pixel.every((at, k) => at >= 0 && at < state.size[k])) refuse(`pixel must lie in the window of ${state.size.join(" x ")}, got ${pixel.join(", ")}`);
  const found = verdicts(state, pixel, positions[sample], bits);
  const place = pixel.map((at, k) => at + state.origin[k]), owner = winner(found.filter((one) => one.isCovered), state);
  const rows = found.slice(0, MAX_ROWS).map((one) => ({
    triangle: one.triangle,
    color: css(colorOf(one.triangle)),
    verdict: one === owner ? "owner" : one.isCovered ? "hidden" : one.isTouched ? "on its edge" : "outside",
    edges: one.edges.map((edge) => ({ends: named(edge), kind: edge.kind, value: number(edge.value, one.d), exact: fraction(edge.value, one.d)})),
    depth: one.depth && number(...one.depth),
    weights: one.edges.map(({value}) => number(value, one.area)).join(", "),
  }));
  const classics = [...new Set([method, state.method, state.other])].filter((name) => hello.methods.some((one) => one.name === name && one.is_classic));
  const times = await timesDrawn(line, hello, state, place, classics), stories = classics.map((name, k) => classicStory(name, times[k], owner)).filter(Boolean);
  return {pixel: place, sentences: [...sentences(state, found, owner, place, sample), ...stories], owner: owner?.triangle ?? -1, rows, n_more: Math.max(0, found.length - MAX_ROWS)};
}
