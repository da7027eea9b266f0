// The part Pixels without Python: what pixels.py answers, by the kernels in WebAssembly and exact
// fractions. Tables and words come from Python (`data`, written by static.py); a test asks both sides the same questions.

import {exactCoverage} from "./exact.js";
import {SINK, TEST} from "./kernels.js";
import {asFloat, rint, wholeOf} from "./numbers.js";
import {bitsOf, checkReach, isCoverage, parseState, refuse, Refusal} from "./state.js";

const MAX_EXACT_PX = 2 ** 48;

// ---- what is drawn ---------------------------------------------------------------------------------------------

// What was asked for that a method does not have, in words.
function lacks(state, method, data) {
  const classic = data.classics[method], notes = [];
  if (bitsOf(state, method, data) !== state.subpixel_bits) notes.push(classic ? "its own grid" : "8 sub-pixel bits");
  else if (classic?.is_integer) notes.push("whole pixels");
  if (!classic) return notes;
  if (state.sampling !== "center") notes.push("at centres");
  if (state.cull !== "none") notes.push("nothing culled");
  if (state.has_depth) notes.push("no depth");
  return notes;
}

// Points and the origin of a window, moved to where samples are float64 for the exact picture.
export function nearOrigin({points, origin}, n_components) {
  if (origin.every((at) => Math.abs(at) < MAX_EXACT_PX / 2)) return {points, origin};
  const [whole, pixel] = wholeOf(points), moved = Float64Array.from(points, (value, i) => {
    const axis = i % n_components;
    if (axis > 1) return value;
    const n = whole[i] - BigInt(origin[axis]) * pixel, near = Number(n) / Number(pixel);
    return BigInt(Number(n)) === n ? near : refuse("the exact picture of a window so far away is drawn by Python alone: topleft explore");
  });
  return {points: moved, origin: [0, 0]};
}

// Takes a scene of a state to the kernels, or refuses it as Python does.
export function takeScene(kernels, {vertices, origin, size}, {bits, n_samples = 1, ...scene}) {
  if (bits === "exact" && origin.some((at, k) => Math.max(Math.abs(at), Math.abs(Number(at) + size[k])) > MAX_EXACT_PX)) {
    refuse(`origin and size must lie within ${MAX_EXACT_PX} pixels of 0 for 'exact', got (${origin.join(", ")})`);
  }
  const bad = kernels.takePixels({...scene, bits, n_samples}), grid = n_samples > 1 ? Math.max(4, bits) : bits;
  if (bad >= 0) {
    refuse(`vertices must lie within 2**${62 - grid} pixels of 0 with ${grid} sub-pixel bits, got `
      + `[${vertices[bad].map(asFloat).join(", ")}] in row ${bad}`);
  }
}

// The exact picture of areas and squares, by fractions.
function drawnExactly(state, data) {
  const start = performance.now(), {sampling, size, triangles, subpixel_bits: bits} = state;
  if (size[0] * size[1] * Math.max(1, triangles.length) > data.limits.max_slow_tests) {
    refuse(`the exact picture of '${sampling}' takes too long here: make the window smaller`);
  }
  const found = exactCoverage(state, sampling === "area" && bits === "exact" ? 8 : bits);
  return {...found, n_samples: 1, seconds: (performance.now() - start) / 1000, notes: []};
}

// What a method draws: owners and counts of each sample, (H W S), shares of pixels, and seconds.
function drawn(kernels, state, method, data) {
  if (method === "exact" && isCoverage(state)) return drawnExactly(state, data);
  const {size, n_samples, look} = state, isExact = method === "exact";
  const n = size[0] * size[1], classic = data.classics[method], notes = isExact ? [] : lacks(state, method, data);
  const bits = isExact ? "exact" : bitsOf(state, method, data);
  const n_components = state.has_depth ? 3 : 2, given = {points: Float64Array.from(state.vertices.flat()), origin: state.origin};
  const {points, origin} = isExact ? nearOrigin(given, n_components) : given;
  const scene = {points, n_components, triangles: Int32Array.from(state.triangles.flat()), cull: state.cull,
    method: isExact ? "auto" : method};
  const take = (more) => {
    takeScene(kernels, {...state, origin}, {...scene, points: points.slice(), bits, n_samples, ...more});
    kernels.window(origin, size, TEST[state.sampling] ?? 0);
  };
  return kernels.within(() => {
    const start = performance.now(), seconds = () => (performance.now() - start) / 1000;
    if (look === "wireframe") {
      take({bits: 8, n_samples: 1, cull: "none", method: "auto"});
      kernels.window(origin, size);
      const lines = kernels.wireframe();
      return {owners: Int32Array.from(lines, (value) => value ? 0 : -1), counts: Int32Array.from(lines), shares: Float32Array.from(lines), n_samples: 1, seconds: seconds(), notes};
    }
    if (classic) {
      checkReach(state, method, bits, data);
      const owners = kernels.classic(classic, scene, bits, SINK.label, origin, size), took = seconds();
      const counts = kernels.classic(classic, scene, bits, SINK.count, origin, size);
      return {owners, counts, shares: Float32Array.from(owners, (owner) => owner >= 0 ? 1 : 0), n_samples: 1, seconds: took, notes};
    }
    take();
    if (isCoverage(state)) {
      const shares = state.sampling === "area" ? kernels.area(true) : Float32Array.from(kernels.draw(SINK.mask)), took = seconds();
      const counts = state.sampling === "area" ? kernels.area(false) : kernels.draw(SINK.count);
      return {owners: Int32Array.from(shares, (value) => value > 0 ? 0 : -1), counts, shares, n_samples: 1, seconds: took, notes};
    }
    const sink = !state.has_depth ? SINK.label : state.depth_test === "less" ? SINK.nearest : SINK.farthest;
    const positions = data.samples[n_samples], planes = positions.map((at) => kernels.draw(sink, at)), took = seconds();
    const counted = positions.map((at) => kernels.draw(SINK.count, at));
    const mixed = (arrays) => Int32Array.from({length: n * n_samples}, (_, i) => arrays[i % n_samples][Math.floor(i / n_samples)]);
    const owners = mixed(planes), shares = new Float32Array(n);
    for (let i = 0; i < n * n_samples; i++) shares[Math.floor(i / n_samples)] += (owners[i] >= 0) / n_samples;
    return {owners, counts: mixed(counted), shares, n_samples, seconds: took, notes};
  });
}

const most = ({counts, n_samples}, i) => {
  let found = 0;
  for (let k = 0; k < n_samples; k++) found = Math.max(found, Math.ceil(counts[i * n_samples + k]));
  return found;
};

// The colour of a triangle: seven, then the same paler, then darker.
function colorOf(i, data) {
  const color = data.colors[i % 7], turn = Math.floor(i / 7) % 3;
  return turn === 0 ? color : color.map((c) => turn === 1 ? (c + 255) >> 1 : Math.floor(c * 2 / 3));
}
const css = (color) => `#${color.slice(0, color.length).map((c) => c.toString(16).padStart(2, "0")).join("")}`;

function picture(state, drawing, data) {
  const n = state.size[0] * state.size[1], {owners, shares, n_samples} = drawing, pixels = new Uint8ClampedArray(4 * n);
  const colors = Array.from({length: Math.max(1, state.triangles.length)}, (_, i) => colorOf(i, data));
  for (let i = 0; i < n; i++) {
    if (state.look === "overdraw") pixels.set(data.heat[Math.min(most(drawing, i), data.heat.length - 1)], 4 * i);
    else if (state.look === "wireframe" || isCoverage(state)) {
      pixels.set(state.look === "wireframe" ? data.ink : data.colors[0], 4 * i);
      pixels[4 * i + 3] = rint(Math.fround(255 * Math.min(1, Math.max(0, shares[i]))));
    } else {
      const sum = [0, 0, 0];
      let count = 0;
      for (let k = 0; k < n_samples; k++) {
        const owner = owners[i * n_samples + k];
        if (owner >= 0) count++, colors[owner].forEach((c, channel) => (sum[channel] += c));
      }
      pixels.set(sum.map((total) => rint(Math.fround(total / Math.max(1, count)))), 4 * i);
      pixels[4 * i + 3] = rint(255 * count / n_samples);
    }
  }
  return pixels;
}

// Where two drawings differ: rows of `data.differences`.
function difference(one, two, n, data) {
  const samples = Math.max(one.n_samples, two.n_samples), kinds = new Uint8Array(n);
  const at = (drawing, i, k) => drawing.owners[i * drawing.n_samples + (drawing.n_samples > 1 ? k : 0)];
  for (let i = 0; i < n; i++) {
    let isSame = true;
    for (let k = 0; k < samples; k++) isSame &&= at(one, i, k) === at(two, i, k);
    const [a, b] = [one.shares[i], two.shares[i]];
    if (a > Math.fround(b + data.area_error)) kinds[i] = 2;
    else if (Math.fround(a + data.area_error) < b) kinds[i] = 3;
    else if (!isSame) kinds[i] = 4;
    else if (a === 0) kinds[i] = 0;
    else kinds[i] = most(one, i) === most(two, i) ? 1 : 5;
  }
  return kinds;
}

const grouped = (n) => n.toLocaleString("en-US");
function told(kinds, n) {
  const counts = new Array(n).fill(0);
  for (const kind of kinds) counts[kind]++;
  return counts;
}
const panelOf = (key, title) => ({key, title, notes: "", facts: [], legend: [], refused: ""});

function described(drawing, state, data) {
  const ms = 1e3 * drawing.seconds;
  let n = 0, twice = 0;
  drawing.shares.forEach((share, i) => ((n += share > 0), (twice += most(drawing, i) > 1)));
  const facts = [[`${grouped(n)} px`, "n", "pixels that are drawn at least once"],
    [ms >= 1 ? `${ms.toFixed(1)} ms` : `${(1e3 * ms).toFixed(0)} µs`, "n", "of the call that draws it"]];
  if (twice) facts.push([`${grouped(twice)} of them more than once`, "n", "drawn for several triangles"]);
  const legend = state.look === "overdraw" ? ["once", "twice", "3 times", "4 or more"].map((word, i) => [css(data.heat[i + 1]), word]) : [];
  return {n, n_twice: twice, notes: drawing.notes.join(", "), facts, legend};
}

function compared(kinds, [a, b], data) {
  const counts = told(kinds, data.differences.length), n = counts.slice(2).reduce((x, y) => x + y);
  const words = ["", "same", `${a} alone`, `${b} alone`, "another owner", "drawn more often"];
  return {
    kinds: counts,
    facts: [[`${grouped(n)} of ${grouped(n + counts[1])} pixels differ`, n ? "bad" : "good", "of those that either of them draws"]],
    legend: counts.flatMap((count, k) => k && count ? [[css(data.differences[k]), `${grouped(count)} ${words[k]}`]] : []),
  };
}

export function drawAll(kernels, data, {state: given}) {
  const state = parseState(given, data), n = state.size[0] * state.size[1], shape = [state.size[1], state.size[0]];
  const names = {a: state.method}, arrays = {}, panels = {}, drawings = {};
  if (state.look !== "wireframe") {
    if (state.other) names.b = state.other;
    if (state.exact) names.exact = "exact";
  }
  for (const [key, method] of Object.entries(names)) {
    panels[key] = panelOf(key, state.look === "wireframe" ? "wireframe" : method);
    try {
      drawings[key] = drawn(kernels, state, method, data);
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      panels[key].refused = error.message;
      continue;
    }
    const drawing = drawings[key], {n_samples} = drawing;
    Object.assign(panels[key], described(drawing, state, data));
    arrays[key] = [picture(state, drawing, data), [...shape, 4]];
    arrays[`${key}_owners`] = [drawing.owners.filter((_, i) => i % n_samples === 0), shape];
    arrays[`${key}_counts`] = [Int32Array.from({length: n}, (_, i) => most(drawing, i)), shape];
    if (key !== "exact") continue;
    for (const other of Object.keys(drawings).filter((one) => one !== "exact")) {
      const counts = told(difference(drawings[other], drawing, n, data), data.differences.length), wrong = counts.slice(2).reduce((x, y) => x + y);
      panels[other].n_wrong = wrong;
      const kinds = ["too many", "missing", "of another triangle", "drawn too often"].flatMap((word, i) => counts[i + 2] ? [`${grouped(counts[i + 2])} ${word}`] : []);
      panels[other].facts.push(wrong ? [`${grouped(wrong)} wrong: ${kinds.join(", ")}`, "bad", data.wrong] : ["all exact", "good", data.wrong]);
    }
  }
  const pair = Object.keys(drawings).slice(0, 2);
  if (pair.length === 2) {
    const kinds = difference(drawings[pair[0]], drawings[pair[1]], n, data), pixels = new Uint8ClampedArray(4 * n);
    kinds.forEach((kind, i) => pixels.set(data.differences[kind], 4 * i));
    arrays.difference = [pixels, [...shape, 4]];
    panels.difference = {...panelOf("difference", "difference"), ...compared(kinds, pair.map((key) => names[key]), data)};
  }
  const samples = isCoverage(state) ? [] : data.samples[state.n_samples].map((at) => at.map((x) => 0.5 + x / 16));
  return {header: {panels: Object.values(panels), samples}, arrays};
}
