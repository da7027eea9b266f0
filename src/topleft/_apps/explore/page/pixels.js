// Draws the part Pixels: a state becomes pictures of its methods and of the exact one, where they differ, and counts.

import {COLORS, colorOf, css} from "./colors.js";
import {askScene, drawScene, nearOrigin, Refusal} from "./engine.js";
import {exactCoverage} from "./exact.js";
import {rint} from "./numbers.js";
import {drawingOf, EXACT, isCoverage, parseState} from "./state.js";

// Pixels times triangles of exact pictures of areas and conservative coverage: about half a second.
const MAX_SLOW_TESTS = 6000;

// Areas that differ by less are the same: those of the library are within 9e-8 of the exact ones.
const AREA_ERROR = 2 ** -20;

// Of 0, 1, 2, 3, and more triangles on a pixel.
const HEAT = [[0, 0, 0, 0], [158, 202, 225, 255], [230, 159, 0, 255], [213, 94, 0, 255], [122, 31, 92, 255]];

// Of nothing, no difference, the first alone, the second alone, another owner, another count; none is one of a triangle.
const DIFFERENCES = [[0, 0, 0, 0], [128, 128, 128, 70], [94, 60, 153, 255], [166, 206, 57, 255], [190, 20, 60, 255], [20, 130, 210, 255]];

const INK = [60, 72, 88];
const BESIDE_EXACT = "beside the exact picture of the vertices as they are: each pixel counts once";

// ---- what is drawn ---------------------------------------------------------------------------------------------

// What was asked for that a method does not have, in words.
function lacks(state, drawing, method) {
  const notes = [];
  if (drawing.subpixel_bits !== state.subpixel_bits) notes.push(method.is_classic ? "its own grid" : "8 sub-pixel bits");
  else if (method.is_integer) notes.push("whole pixels");
  if (drawing.sampling !== state.sampling) notes.push("at centres");
  if (drawing.cull !== state.cull) notes.push("nothing culled");
  if (method.is_classic && state.n_components > 2) notes.push("no depth");
  return notes;
}

// The exact picture of areas and squares, by whole numbers.
function coveredExactly(state) {
  const start = performance.now(), {sampling, size, triangles, subpixel_bits: bits} = state;
  if (size[0] * size[1] * Math.max(1, triangles.length) > MAX_SLOW_TESTS) {
    throw new Refusal(`the exact picture of '${sampling}' takes too long here: make the window smaller`);
  }
  const {owners, counts, shares} = exactCoverage(state, sampling === "area" && bits === EXACT ? 8 : bits);
  return {owners, counts, shares, n_samples: 1, seconds: (performance.now() - start) / 1000, notes: []};
}

// What a method draws: owners of each sample, shares of pixels, the most triangles on a sample of them, and seconds.
async function drawnBy(line, hello, state, method) {
  if (method === EXACT && isCoverage(state)) return coveredExactly(state);
  const drawing = {...drawingOf(state, method, hello), is_wireframe: state.look === "wireframe"}, n = state.size[0] * state.size[1];
  const [{refused, shown, counts, seconds}] = await drawScene(line, method === EXACT ? nearOrigin(state) : state, [drawing]);
  if (refused) throw new Refusal(refused);
  const notes = method === EXACT ? [] : lacks(state, drawing, hello.methods.find(({name}) => name === method)), n_samples = shown.length / n;
  const most = new Int32Array(n), shares = new Float32Array(n);
  for (let i = 0; i < counts.length; i++) most[Math.floor(i / n_samples)] = Math.max(most[Math.floor(i / n_samples)], Math.ceil(counts[i]));
  if (shown instanceof Float32Array) return {owners: shown.map((share) => share > 0 ? 0 : -1), counts: most, shares: shown, n_samples, seconds, notes};
  for (let i = 0; i < shown.length; i++) shares[Math.floor(i / n_samples)] += (shown[i] >= 0) / n_samples;
  return {owners: shown, counts: most, shares, n_samples, seconds, notes};
}

// ---- pictures --------------------------------------------------------------------------------------------------

function colorAt(state, drawing, i) {
  const {owners, counts, shares, n_samples} = drawing, sum = [0, 0, 0];
  if (state.look === "overdraw") return HEAT[Math.min(counts[i], HEAT.length - 1)];
  const alpha = rint(255 * Math.min(1, Math.max(0, shares[i])));
  if (state.look === "wireframe" || isCoverage(state)) return [...state.look === "wireframe" ? INK : COLORS[0], alpha];
  let n = 0;
  for (let k = i * n_samples; k < (i + 1) * n_samples; k++) {
    if (owners[k] < 0) continue;
    const color = colorOf(owners[k]);
    for (let c = 0; c < 3; c++) sum[c] += color[c];
    n++;
  }
  return [...sum.map((total) => rint(total / Math.max(1, n))), alpha];
}

// A picture, a colour of each pixel.
function painted([width, height], at) {
  const pixels = new Uint8ClampedArray(4 * width * height);
  for (let i = 0; i < width * height; i++) pixels.set(at(i), 4 * i);
  return Object.assign(pixels, {shape: [height, width, 4]});
}

// Where two drawings differ: rows of `DIFFERENCES`.
export function differenceOf(one, two) {
  const samples = Math.max(one.n_samples, two.n_samples), at = ({owners, n_samples}, i, k) => owners[i * n_samples + (n_samples > 1 ? k : 0)];
  return Uint8Array.from(one.shares, (a, i) => {
    const b = two.shares[i];
    if (a > Math.fround(b + AREA_ERROR)) return 2;
    if (Math.fround(a + AREA_ERROR) < b) return 3;
    for (let k = 0; k < samples; k++) if (at(one, i, k) !== at(two, i, k)) return 4;
    if (a === 0) return 0;
    return one.counts[i] === two.counts[i] ? 1 : 5;
  });
}

// ---- words -----------------------------------------------------------------------------------------------------

const grouped = (n) => n.toLocaleString("en-US");
function tally(kinds, n = DIFFERENCES.length) {
  const counts = Array(n).fill(0);
  for (const kind of kinds) counts[kind]++;
  return counts;
}
const sumOf = (counts, first) => counts.slice(first).reduce((a, b) => a + b);
const countsOf = (counts, words) => words.flatMap((word, k) => word && counts[k] ? [`${grouped(counts[k])} ${word}`] : []).join(", ");

// What is written over and below a picture.
function described({counts, notes, seconds}, {look}) {
  const ms = 1e3 * seconds, facts = [[ms >= 1 ? `${ms.toFixed(1)} ms` : `${(1e3 * ms).toFixed(0)} µs`, "n", "of the call that draws it"]];
  const often = tally(counts.map((n) => Math.min(n, HEAT.length - 1)), HEAT.length), words = ["once", "twice", "3 times", "4 times or more"];
  const legend = look === "overdraw" ? words.map((word, i) => [css(HEAT[i + 1]), `${grouped(often[i + 1])} ${word}`]) : [];
  return {notes: notes.join(", "), facts, legend};
}

// Counts the pixels of a drawing: numbers before the semicolon add up. `kinds` are its differences from the exact drawing.
function sentenceOfPixels({counts, shares}, kinds) {
  const isDrawn = (_, i) => shares[i] > 0, often = tally(counts.filter(isDrawn).map((n) => Math.min(n, 2)), 3), n = sumOf(often, 0);
  const start = `${grouped(n)} ${n === 1 ? "pixel" : "pixels"} drawn`, title = "drawn for at least one triangle";
  if (!kinds) return [often[2] ? `${start}: ${countsOf(often, ["", "once", "more often"])}` : start, "n", title];
  const drawn = tally(kinds.filter(isDrawn)), n_missing = tally(kinds)[3] - drawn[3];
  if (drawn[1] === n && !n_missing) return [`${start}, all exact`, "good", BESIDE_EXACT];
  const words = countsOf(drawn, ["", "exact", "too many", "covered too little", "of another triangle", "drawn too often"]);
  return [`${start}${words && ": "}${words}${n_missing ? `; ${grouped(n_missing)} missing` : ""}`, "bad", BESIDE_EXACT];
}

// Differences that are the failure of a failure scene, by the word in its name.
const FAILURES = {gap: [3], overdraw: [2, 5], wrong: [2, 3, 4]};

// The pixel nearest to the middle of those that differ, if there are such in the way that a failure scene is about, [x, y]; null
// where none does.
function nearestDifference(kinds, {size: [width, height], scene = ""}) {
  const wanted = FAILURES[/-(gap|overdraw|wrong)(-|$)/.exec(scene)?.[1]] ?? [];
  let nearest = null, least = [Infinity, Infinity];
  for (const [i, kind] of kinds.entries()) {
    const x = i % width, y = Math.floor(i / width), far = [wanted.includes(kind) ? 0 : 1, Math.hypot(x - (width >> 1), y - (height >> 1))];
    if (kind > 1 && (far[0] - least[0] || far[1] - least[1]) < 0) [nearest, least] = [[x, y], far];
  }
  return nearest;
}

// What is written over and below a difference.
function compared(counts, [a, b]) {
  const n = sumOf(counts, 2), words = ["", "same", `${a} alone`, `${b} alone`, "another owner", "drawn more often"];
  return {
    kinds: counts, facts: [[`${grouped(n)} of ${grouped(n + counts[1])} pixels differ`, n ? "bad" : "good", "of those that either of them draws"]],
    legend: counts.flatMap((count, k) => k && count ? [[css(DIFFERENCES[k]), `${grouped(count)} ${words[k]}`]] : []),
  };
}

const panelOf = (key, title) => ({key, title, notes: "", facts: [], legend: [], refused: ""});

// Promises {panels, samples}: pictures of a state, of its methods, the exact one, and where they differ, with what is written
// over and below them, or why there is none, and a pixel that differs; and where samples lie in each pixel, 0 to 1.
export async function drawPixels(line, hello, given) {
  const state = parseState(given, hello), {size, look} = state;
  const names = {a: state.method, ...look === "wireframe" ? {} : {...state.other && {b: state.other}, ...state.exact && {exact: EXACT}}};
  const keys = Object.keys(names), drawings = {};
  const panels = await Promise.all(keys.map(async (key) => {
    const panel = panelOf(key, look === "wireframe" ? look : names[key]);
    try {
      const drawing = drawings[key] = await drawnBy(line, hello, state, names[key]), {owners, counts, n_samples} = drawing;
      return {
        ...panel, ...described(drawing, state), picture: painted(size, (i) => colorAt(state, drawing, i)),
        owners: owners.filter((_, i) => i % n_samples === 0), counts,
      };
    } catch (error) {  // a limit of a classic: the other pictures are drawn
      if (!(error instanceof Refusal)) throw error;
      return {...panel, refused: error.message};
    }
  }));
  const drawn = keys.filter((key) => drawings[key]);
  for (const [k, key] of keys.entries()) {
    const kinds = key !== EXACT && drawings[key] && drawings.exact ? differenceOf(drawings[key], drawings.exact) : null;
    if (drawings[key]) panels[k].facts.unshift(sentenceOfPixels(drawings[key], kinds));
  }
  if (drawn.length > 1) {
    const pair = drawn.slice(0, 2), kinds = differenceOf(...pair.map((key) => drawings[key]));
    panels.push({
      ...panelOf("difference", "difference"), ...compared(tally(kinds), pair.map((key) => names[key])),
      picture: painted(size, (i) => DIFFERENCES[kinds[i]]), pixel: nearestDifference(kinds, state),
    });
  }
  return {panels, samples: isCoverage(state) ? [] : hello.samples[state.n_samples].map((at) => at.map((x) => 0.5 + x / 16))};
}

// Asks Python about what the first method of a state draws: its plan, or files of it and its picture.
export function askAbout(line, hello, given, what, more = {}, parts = []) {
  const state = parseState(given, hello);
  return askScene(line, what, state, [drawingOf(state, state.method, hello)], more, parts);
}
