// The part Mesh without Python: what mesh_view.py answers of opening, drawing and picking.

import {cameraOf, cosineAndSine, raysOf} from "./camera.js";
import {readMesh} from "./files.js";
import {SINK} from "./kernels.js";
import {refuse} from "./pixels.js";

let shown = null;  // {name, lacks, bounds, table, counts, given}

function take(kernels, data, {polygons, ...file}, name) {
  const given = {...file, triangles: file.triangles ?? kernels.cut(polygons, file.vertices)};
  try {
    shown = taken(kernels, data, given, name);
  } catch (error) {
    if (shown) taken(kernels, data, shown.given, shown.name);  // of a mesh that memory does not hold: back to the one before
    throw error;
  }
}

// The kernels hold one mesh; what it was made of stays here.
function taken(kernels, data, given, name) {
  const cosine = given.isSplit ? -2 : cosineAndSine(data.mesh.crease)[0], decode = Float32Array.from(data.mesh.light_of_srgb);
  const bounds = kernels.takeMesh({...given, decode}, cosine);
  return {name, lacks: given.lacks, bounds, counts: kernels.counts, given};
}

function ensure(kernels, data) {
  if (shown) return;
  const {bytes, n_vertices: n, name, is_f64: isF64} = data.mesh, kind = isF64 ? Float64Array : Float32Array;
  const vertices = new kind(bytes, 0, 3 * n), triangles = new Int32Array(bytes, vertices.byteLength);
  take(kernels, data, {vertices, triangles, lacks: []}, name);
}

export function open(kernels, data, {name = ""}, parts) {
  if (parts.length) {
    const last = name.split(/[\\/]/).at(-1);
    take(kernels, data, readMesh(parts[0], last), last);
  }
  ensure(kernels, data);
  return {header: {name: shown.name, ...shown.counts, lacks: shown.lacks, layers: data.mesh.layers, heat: data.mesh.heat, controls: data.mesh.controls}};
}

// A view, checked as MeshView checks it.
function parse(given, data) {
  const view = {...data.mesh.view, ...given};
  if (view.sampling === "at rest") view.sampling = "background" in given ? "center" : "msaa4";
  for (const name of ["azimuth", "elevation", "zoom", "fov"]) if (!Number.isFinite(view[name])) refuse(`${name} must be finite, got ${view[name]}`);
  const {max_side_px: side, max_pixels: most} = data.mesh, [width, height] = view.size;
  if (!(Math.min(width, height) >= 1 && Math.max(width, height) <= side && width * height <= most)) {
    refuse(`size must be two numbers of 1 to ${side}, ${most} pixels, got (${width}, ${height})`);
  }
  if (!(view.zoom >= 1e-3 && view.zoom <= 1e4)) refuse(`zoom must lie in 0.001 to 10000, got ${view.zoom}`);
  if (!data.mesh.layers.includes(view.layer)) refuse(`layer must be one of ${data.mesh.layers.join(", ")}, got '${view.layer}'`);
  return view;
}

// What web_look of web.c holds, as bytes.
function lookOf(view, camera, data) {
  const {hasPerspective, eye, ray, eyeFrom} = raysOf(camera, shown.bounds.origin, view.size), {light, material} = data.mesh;
  const toLight = [0, 1, 2].map((i) => eyeFrom.reduce((sum, row, k) => sum + row[i] * light.to[k], 0));
  const numbers = [...eye, ...ray.flat(), ...eyeFrom.flat(), ...toLight, light.color, light.ambient, ...(shown.given.colors ? [1, 1, 1] : material.color), material.specular, material.shininess, 0, 0, 0, 0];
  const look = new Uint8Array(4 * numbers.length + 20), [red, green, blue] = view.background ?? [0, 0, 0], isOpaque = "background" in view;
  numbers.splice(-4, 4, ...[red, green, blue].map((value) => data.mesh.light_of_srgb[value]), isOpaque ? 1 : 0);
  new Float32Array(look.buffer, 0, numbers.length).set(numbers);
  new Int32Array(look.buffer, 4 * numbers.length, 4).set([hasPerspective, view.layer === "flat", view.layer === "unlit", view.layer === "normals"]);
  look.set([red, green, blue, isOpaque ? 255 : 0], 4 * numbers.length + 16);
  return look;
}

// A colour for each triangle, and a last one for none: those of table_of in mesh_view.py.
function tableOf(n) {
  const table = new Uint32Array(n + 1), factor = 0x9E3779B97F4A7C15n;
  for (let i = 0; i < n; i++) {
    const shuffled = Number(BigInt.asUintN(64, BigInt(i) * factor) >> 40n);
    let color = 255 << 24;
    for (let k = 0; k < 3; k++) color |= (64 + Math.floor(((shuffled >> (8 * k)) & 255) * 3 / 4)) << (8 * k);
    table[i] = color >>> 0;
  }
  return table;
}

// A colour for each number, in the numbers' own memory.
function colored(numbers, colorOf) {
  const colors = new Uint32Array(numbers.buffer);
  for (let i = 0; i < numbers.length; i++) colors[i] = colorOf(numbers[i]);
  return colors;
}

function numbersShown(kernels, view, data) {
  const background = new Uint8Array([...(view.background ?? [0, 0, 0]), "background" in view ? 255 : 0]), none = new Uint32Array(background.buffer)[0];
  if (view.layer === "overdraw") {
    const heat = new Uint32Array(Uint8Array.from(data.mesh.heat_table.flat()).buffer), classes = data.mesh.heat_classes;
    heat[0] = none;
    const last = classes.length - 1;
    return colored(kernels.draw(SINK.count), (n) => heat[classes[n < last ? n : last]]);
  }
  const table = (shown.table ??= tableOf(shown.counts.n_triangles));
  return colored(kernels.draw(SINK.nearest), (i) => i < 0 ? none : table[i]);
}

// x, y, width and height of pixels that hold all that can show.
function boxOf(camera, [width, height]) {
  const {ends} = shown.bounds, corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [4, 2, 1].map((bit, k) => ends[i & bit ? 3 + k : k]));
  const seen = corners.map((point) => camera.clip.map((row) => row[0] * point[0] + row[1] * point[1] + row[2] * point[2] + row[3]));
  if (seen.some(([, , , w]) => w <= 1e-6)) return [0, 0, width, height];
  const places = seen.map(([x, y, , w]) => [(x / w + 1) / 2 * width, (1 - y / w) / 2 * height]);
  const [x0, y0] = [0, 1].map((k) => Math.max(0, Math.floor(Math.min(...places.map((at) => at[k]))) - 2));
  const [x1, y1] = [0, 1].map((k) => Math.min([width, height][k], Math.ceil(Math.max(...places.map((at) => at[k]))) + 2));
  return [Math.min(x0, width), Math.min(y0, height), Math.max(0, x1 - x0), Math.max(0, y1 - y0)];
}

export function draw(kernels, data, question) {
  ensure(kernels, data);
  const view = parse(question, data), camera = cameraOf(view, shown.bounds), start = performance.now();
  const isLit = data.mesh.lit.includes(view.layer), samples = data.samples[isLit && view.sampling !== "center" ? Number(view.sampling.slice(4)) : 1];
  const picture = kernels.viewing(camera.clip, view.size, view.cull, () =>
    isLit ? kernels.render(lookOf(view, camera, data), samples) : new Uint8ClampedArray(numbersShown(kernels, view, data).buffer));
  const took = performance.now() - start, [x, y, width, height] = boxOf(camera, view.size);
  let pixels = picture;
  if (width !== view.size[0] || height !== view.size[1]) {
    pixels = new Uint8ClampedArray(4 * width * height);
    for (let row = 0; row < height; row++) {
      const at = 4 * ((y + row) * view.size[0] + x);
      pixels.set(picture.subarray(at, at + 4 * width), 4 * width * row);
    }
  }
  const header = {box: [x, y, width, height], size: view.size, draw_ms: took, encode_ms: 0, n_triangles: shown.counts.n_triangles, is_jpeg: false};
  return {header, arrays: {pixels: [pixels, [height, width, 4]]}};
}

export function pick(kernels, data, question) {
  ensure(kernels, data);
  const view = parse(question, data), camera = cameraOf(view, shown.bounds), {x, y} = question;
  const ids = kernels.viewing(camera.clip, view.size, view.cull, () => kernels.draw(SINK.nearest)), triangle = ids[y * view.size[0] + x];
  const rows = triangle < 0 ? [["shows", "nothing"]] : [["triangle", String(triangle)]];
  return {header: {triangle, x, y, rows, corners_px: []}};
}
