// The kernels of topleft in WebAssembly: arrays in, pictures out. `wasm/web.c` says what its functions do; nothing is
// drawn here. Runs in a worker of a page and in node.

export const SINK = {mask: 0, count: 1, label: 2, nearest: 4, farthest: 5};
export const TEST = {outer: 1, inner: 2};
export const CULL = {none: 0, back: 1, front: 2};
export const METHOD = {auto: 0, edge: 1, scanline: 2};
const FULL = -2;

// What this machine has no memory for: the sentence that Python has.
export class OutOfMemory extends Error {
  constructor() {
    super("not enough memory");
  }
}

export class Kernels {
  // `module`: a WebAssembly.Module, or the bytes of one.
  static async of(module) {
    const made = await WebAssembly.instantiate(module, {});
    return new Kernels((made.instance ?? made).exports);
  }

  constructor(exports) {
    this.exports = exports;
  }

  // Calls `work`, and frees what it has taken of memory, whatever it ends with.
  within(work) {
    const before = this.exports.web_used();
    try {
      return work();
    } finally {
      this.exports.web_release(before);
    }
  }

  // The address of so many bytes.
  room(bytes) {
    const at = this.exports.web_room(bytes) >>> 0;
    if (!at) throw new OutOfMemory();
    return at;
  }

  // The address of a copy of a typed array.
  put(array) {
    const at = this.room(array.byteLength);
    new array.constructor(this.exports.memory.buffer, at, array.length).set(array);
    return at;
  }

  // A copy of what stands there: `kind` is that of a typed array. A page that is short of memory lives on.
  get(kind, at, n) {
    try {
      return new kind(this.exports.memory.buffer, at, n).slice();
    } catch (error) {
      throw error instanceof RangeError ? new OutOfMemory() : error;
    }
  }

  check(status) {
    if (status === FULL) throw new OutOfMemory();
    return status;
  }

  // Takes a scene in pixels, {points, n_components, triangles, bits, n_samples, cull, method}: bits are sub-pixel bits, or
  // "exact". Returns -1, or the lowest vertex that a triangle uses and that cannot be drawn.
  takePixels({points, n_components, triangles, bits, n_samples = 1, cull = "none", method = "auto"}) {
    const own = bits === "exact" ? 8 : bits, grid = n_samples > 1 ? Math.max(4, own) : own;
    return this.check(this.exports.web_take_pixels(
      this.put(points), n_components, points.length / n_components, this.put(triangles), triangles.length / 3,
      bits === "exact" ? -1 : bits, grid, CULL[cull], METHOD[method]));
  }

  window([x, y], [width, height], test = 0) {
    this.size = [width, height];
    this.exports.web_window(BigInt(x), BigInt(y), width, height, test);
  }

  // A mask (Uint8Array), or counts, or ids (Int32Array), as one sample sees them: `at`, in sixteenths of a pixel.
  draw(sink, at = [0, 0]) {
    return this.within(() => {
      const n = this.size[0] * this.size[1], kind = sink === SINK.mask ? Uint8Array : Int32Array;
      const pixels = this.room(n * kind.BYTES_PER_ELEMENT), depth = sink >= SINK.nearest ? this.room(4 * n) : 0;
      this.check(this.exports.web_draw(sink, ...at, pixels, depth));
      return this.get(kind, pixels, n);
    });
  }

  // How much of each pixel triangles cover, their sum or at most 1 of it: Float32Array.
  area(isClamped) {
    return this.within(() => {
      const n = this.size[0] * this.size[1], pixels = this.room(4 * n);
      this.check(this.exports.web_area(pixels, Number(isClamped)));
      return this.get(Float32Array, pixels, n);
    });
  }

  // The counts, or labels, that a classic draws: {number, form} of it.
  classic({number, form}, {points, n_components, triangles}, bits, sink, [x, y], [width, height]) {
    return this.within(() => {
      const n = width * height, pixels = this.room(4 * n);
      this.exports.web_classic(number, form, bits, this.put(points), n_components, this.put(triangles), triangles.length / 3,
        sink, BigInt(x), BigInt(y), width, height, pixels);
      return this.get(Int32Array, pixels, n);
    });
  }

  // The counts that a method draws, and its steps as words of int64 (steps.h of the classics); null for more than `most`.
  trace({number, form}, {points, n_components, triangles}, bits, [x, y], [width, height], most) {
    return this.within(() => {
      const n = width * height, counts = this.room(4 * n), n_words = 24 * (most + triangles.length / 3), words = this.room(8 * n_words);
      const found = this.exports.web_trace(number, form, bits, this.put(points), n_components, this.put(triangles),
        triangles.length / 3, BigInt(x), BigInt(y), width, height, counts, words, n_words);
      return found > most ? null : {n: found, counts: this.get(Int32Array, counts, n), words: this.get(BigInt64Array, words, n_words)};
    });
  }

  wireframe() {
    return this.within(() => {
      const n = this.size[0] * this.size[1], pixels = this.room(n);
      this.check(this.exports.web_wireframe(pixels));
      return this.get(Uint8Array, pixels, n);
    });
  }
}
