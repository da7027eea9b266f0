// Answers the page in the place of Python: its engine, by the kernels in WebAssembly, and the scenes that Python has written.
// In: a question {do, id, ...} and its parts. Out: a promise of [header, parts], as messages.py splits an answer.

import {SINK, TEST} from "./kernels.js";
import {asFloat, sixDigits} from "./numbers.js";

const MAX_EXACT_PX = 2 ** 48, MAX_DRAWN = 2 ** 18, HEAD_WORDS = 6;
const NAMES = new Map([[Uint8Array, "uint8"], [Int32Array, "int32"], [Float32Array, "float32"], [Float64Array, "float64"], [BigInt64Array, "int64"]]);

// Python's words for what a method cannot draw.
class Refusal extends Error {}
const refuse = (text) => {
  throw new Refusal(text);
};

// The scene of a question, and its drawings with their triangles.
function sceneOf({n_components, size, origin, copies, drawings, parts}) {
  const arrayOf = (kind, {buffer, byteOffset, byteLength}) => new kind(buffer.slice(byteOffset, byteOffset + byteLength));
  const read = drawings.map((drawing) => ({...drawing, triangles: repeated(arrayOf(Int32Array, parts[drawing.triangles]), copies)}));
  return [{points: arrayOf(Float64Array, parts[0]), n_components, size, origin: origin.map(BigInt)}, read];
}

function repeated(triangles, copies) {
  if (copies * triangles.length > 3 * MAX_DRAWN) throw new Error(`at most ${MAX_DRAWN} triangles are drawn, got ${copies} times ${triangles.length / 3}`);
  const all = new Int32Array(copies * triangles.length);
  for (let i = 0; i < copies; i++) all.set(triangles, i * triangles.length);
  return all;
}

const rowOf = ({points, n_components: n}, i) => `[${Array.from(points.subarray(n * i, n * i + n), asFloat).join(", ")}] in row ${i}`;

function checkOrigin({origin: [x, y]}, grid) {
  const limit = 2n ** BigInt(61 - grid), isIn = (at) => -limit < at && at < limit;
  if (!isIn(x) || !isIn(y)) refuse(`origin must lie within ${limit} pixels of 0 with ${grid} sub-pixel bits, got (${x}, ${y})`);
}

// Refuses vertices beyond the range of a classic.
function checkReach(classics, {points, n_components: n}, {method, triangles, subpixel_bits: bits}) {
  const {limit, has_bits: hasBits} = classics[method], most = hasBits ? limit / 2 ** Math.max(1, bits) : limit ?? Infinity;
  const isFar = (i) => !(Math.abs(points[n * i]) < most && Math.abs(points[n * i + 1]) < most);
  const bad = triangles.reduce((least, i) => isFar(i) ? Math.min(least, i) : least, Infinity);
  if (bad < Infinity) refuse(`vertices must lie within ${most} pixels of 0 for method '${method}', got ${rowOf({points, n_components: n}, bad)}`);
}

// Gives a scene to the kernels of production, or refuses it.
function take(kernels, scene, {triangles, method, subpixel_bits: bits, sampling = "center", cull}) {
  const {points, n_components, size, origin} = scene, n_samples = sampling.startsWith("msaa") ? Number(sampling.slice(4)) : 1;
  const own = bits === "exact" ? 8 : bits, grid = n_samples > 1 ? Math.max(4, own) : own;
  checkOrigin(scene, grid);
  if (bits === "exact" && origin.some((at, k) => Math.max(Math.abs(Number(at)), Math.abs(Number(at) + size[k])) > MAX_EXACT_PX)) {
    refuse(`origin and size must lie within ${MAX_EXACT_PX} pixels of 0 for 'exact', got (${origin.join(", ")})`);
  }
  const bad = kernels.takePixels({points: points.slice(), n_components, triangles, bits, n_samples, cull, method});
  if (bad >= 0) refuse(`vertices must lie within 2**${62 - grid} pixels of 0 with ${grid} sub-pixel bits, got ${rowOf(scene, bad)}`);
  kernels.window(origin, size, TEST[sampling] ?? 0);
  return n_samples;
}

// Planes of samples, mixed: those of a pixel stand together.
function mixed(planes) {
  const n = planes.length;
  return n === 1 ? planes[0] : planes[0].constructor.from({length: n * planes[0].length}, (_, i) => planes[i % n][Math.floor(i / n)]);
}

// What a method shows, and counts.
function drawn(kernels, {classics, hello: {samples}}, scene, drawing) {
  const {method, subpixel_bits: bits, sampling = "center", depth_test: depthTest = "less", is_wireframe: isWireframe} = drawing;
  const start = performance.now(), since = () => (performance.now() - start) / 1000;
  return kernels.within(() => {
    if (isWireframe) {
      take(kernels, scene, {...drawing, method: "auto", subpixel_bits: 8, sampling: "center", cull: "none"});
      const lines = kernels.wireframe();
      return {shown: Float32Array.from(lines), counts: Int32Array.from(lines), seconds: since()};
    }
    if (classics[method]) {
      checkOrigin(scene, bits);
      checkReach(classics, scene, drawing);
      const own = {...scene, triangles: drawing.triangles}, draw = (sink) => kernels.classic(classics[method], own, bits, sink, scene.origin, scene.size);
      return {shown: draw(SINK.label), seconds: since(), counts: draw(SINK.count)};
    }
    const n_samples = take(kernels, scene, drawing);
    if (sampling === "area") return {shown: kernels.area(true), seconds: since(), counts: kernels.area(false)};
    if (sampling in TEST) return {shown: Float32Array.from(kernels.draw(SINK.mask)), seconds: since(), counts: kernels.draw(SINK.count)};
    const sink = scene.n_components < 3 ? SINK.label : depthTest === "less" ? SINK.nearest : SINK.farthest;
    const draw = (sink) => mixed(samples[n_samples].map((at) => kernels.draw(sink, at)));
    return {shown: draw(sink), seconds: since(), counts: draw(SINK.count)};
  });
}

function draw(kernels, data, question) {
  const [scene, drawings] = sceneOf(question), arrays = {};
  const answers = drawings.map((drawing, i) => {
    try {
      const {shown, counts, seconds} = drawn(kernels, data, scene, drawing);
      Object.assign(arrays, {[`shown${i}`]: shown, [`counts${i}`]: counts});
      return {seconds};
    } catch (error) {
      if (error instanceof Refusal) return {refused: error.message};
      throw error;
    }
  });
  return {header: {drawings: answers}, arrays};
}

function trace(kernels, {classics, hello: {kinds, limits: {max_steps: most}}}, question) {
  const [scene, [drawing]] = sceneOf(question), {triangles, method, subpixel_bits: bits} = drawing, classic = classics[method], {points, n_components: n} = scene;
  if (method === "auto") refuse("method must be a walker or a classic to be traced, got 'auto'");
  if (classic) checkOrigin(scene, bits), checkReach(classics, scene, drawing);
  else {
    kernels.within(() => take(kernels, scene, drawing));
    const far = triangles.reduce((most, i) => Math.max(most, Math.abs(points[n * i]), Math.abs(points[n * i + 1])), 0) * 2 ** bits;
    if (far >= 2 ** 60) refuse(`vertices must lie within 2**60 sub-pixels of 0 to be traced, got ${sixDigits(far)}`);
  }
  const walk = {number: Object.values(classics).reduce((most, {number}) => Math.max(most, number + 1), 0), form: ["edge", "scanline"].indexOf(method)};
  const found = kernels.trace(classic ?? walk, {...scene, triangles}, bits, scene.origin, scene.size, most);
  if (!found) refuse(`a trace must have ${most} steps at most: draw fewer triangles, or a smaller picture`);
  const lengths = kinds.map(([, , , numbers]) => numbers.reduce((sum, [, length]) => sum + 2 * length, HEAD_WORDS));
  let end = 0;
  for (let i = 0; i < found.n; i++) end += lengths[found.words[end]];
  return {header: {n: found.n}, arrays: {counts: found.counts, words: found.words.slice(0, end)}};
}

// The scene of a family where its sliders stand: the nearest of the scenes that were written.
function raceScene(kernels, {hello: {race: {families, n_seeds}}, races}, {family, positions, seed}) {
  const {axes} = families[family] ?? refuse(`family must be one of ${Object.keys(families).map((name) => `'${name}'`).join(", ")}, got '${family}'`);
  if (positions.length !== axes.length) refuse(`family '${family}' has ${axes.length} parameters, got ${positions.length} positions`);
  if (!(Number.isInteger(seed) && 0 <= seed && seed < n_seeds)) refuse(`seed must be from 0 to ${n_seeds - 1}, got ${seed}`);
  const steps = positions.map((at, i) => Math.min(Math.max(Math.round(at), 0), axes[i].steps.length - 1));
  const {at, n_vertices: n, n_triangles, ...scene} = races.scenes[family][steps.reduce((sum, step, i) => sum * axes[i].steps.length + step, 0)];
  const vertices = new Float64Array(races.bytes, at + 16 * n * seed, 2 * n).slice(), triangles = new Int32Array(races.bytes, at + 16 * n * n_seeds, 3 * n_triangles).slice();
  return {header: {...scene, values: steps.map((step, i) => axes[i].steps[step])}, arrays: {vertices, triangles}};
}

const HANDLERS = {
  hello: (kernels, {hello}) => ({header: hello}),
  "engine.draw": draw,
  "engine.trace": trace,
  "race.scene": raceScene,
  "pixels.moved": () => ({header: {}}),
  "pixels.scene": (kernels, {hello, states}, {name}) => {
    if (!(name in states)) refuse(`scene must be one of ${hello.scenes.join(", ")}, got '${name}'`);
    return {header: {state: states[name]}};
  },
};

export class Answerer {
  // `load(name)` promises the bytes of a file of the folder.
  constructor(kernels, data, load) {
    Object.assign(this, {kernels, data, load});
  }

  async answer(question) {
    const {id} = question;
    try {
      if (question.do === "race.scene") this.data.races.bytes ??= await this.load("race.bin");
      if (!(question.do in HANDLERS)) throw new Error(`nothing is called '${question.do}' here`);
      const {header, arrays = {}} = HANDLERS[question.do](this.kernels, this.data, question);
      const parts = Object.values(arrays), listed = Object.keys(arrays).map((name, part) => [name, {dtype: NAMES.get(parts[part].constructor), shape: [parts[part].length], part}]);
      return [{...header, id, arrays: Object.fromEntries(listed)}, parts.map((array) => new Uint8Array(array.buffer))];
    } catch (error) {
      const isFull = error instanceof RangeError && /memory|length|allocation/i.test(error.message);
      const sentence = isFull ? "not enough memory" : error.message.split(/\s+/).join(" ").slice(0, 400);
      return [{id, error: sentence}, []];
    }
  }
}
