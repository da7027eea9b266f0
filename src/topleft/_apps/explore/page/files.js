// Reads meshes without Python: OBJ, PLY, STL and GLB, triangles and polygons; of OBJ and PLY colours and normals of vertices,
// too. What is left out a note tells. A broken file gets the sentence that Python's readers have.
// In: bytes and a name. Out: {vertices: Float32Array or Float64Array (3 n), polygons or triangles, isSplit, lacks: [text],
// colors: Uint8Array (4 n), normals: Float64Array (3 n)}; triangles are an Int32Array (3 t), polygons lists of vertices;
// isSplit: equal vertices are apart where an edge is sharp.

import {rint} from "./pixels.js";

const NOT_HERE = "textures, materials, opacity, colours of faces, and of GLB files colours and normals, are drawn by Python alone";

class Broken extends Error {}
const broken = (text) => {
  throw new Broken(text);
};

export function readMesh(bytes, name) {
  const suffix = /\.[^.]*$/.exec(name)?.[0].toLowerCase() ?? "", read = READERS[suffix];
  if (!/^\.[a-z0-9]{1,11}$/.test(suffix)) throw new Error(`the end of the name must tell the format, as in bunny.ply, got '${name.slice(-40)}'`);
  if (!read) throw new Error(`cannot read '${name}': this page reads ${Object.keys(READERS).map((one) => one.slice(1).toUpperCase()).join(", ")}; Python reads more`);
  try {
    const found = read(bytes);
    const n = found.vertices.length / 3, faces = found.polygons ?? [found.triangles];
    if (n && !faces.some((face) => face.length)) throw new Error(`'${name}' holds points and no triangles; topleft.render draws them`);
    if (!faces.some((face) => face.length > 2)) throw new Error(`'${name}' has no triangles`);
    for (const face of faces) {
      for (const index of face) if (!(index >= 0 && index < n)) broken(`a face names vertex ${index} of ${n}`);
    }
    return found;
  } catch (error) {
    if (error instanceof Broken || error instanceof SyntaxError || error instanceof TypeError) {
      throw new Error(`cannot read '${name}': broken, or not a '${suffix}' file (${error.message})`);
    }
    throw error;
  }
}

function readStl(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength), n = bytes.length >= 84 ? view.getUint32(80, true) : 0;
  const start = new TextDecoder("latin1").decode(bytes.subarray(0, 84)).trimStart().slice(0, 5).toLowerCase();
  if (start === "solid" && bytes.length !== 84 + 50 * n) return stlOfText(new TextDecoder().decode(bytes));
  if (bytes.length < 84 || 84 + 50 * n > bytes.length) broken(`it has ${Math.floor(Math.max(0, bytes.length - 84) / 50)} of ${n} triangles`);
  const vertices = new Float32Array(9 * n);
  for (let i = 0; i < n; i++) {
    for (let k = 0; k < 9; k++) vertices[9 * i + k] = view.getFloat32(84 + 50 * i + 12 + 4 * k, true);
  }
  return {vertices, triangles: Int32Array.from({length: 3 * n}, (_, i) => i), lacks: []};
}

function stlOfText(text) {
  const lines = text.toLowerCase().replaceAll("\r", "\n").replace(/^[ \t]*(?:outer|end|facet|solid)[^\n]*$/gm, "").replaceAll("vertex", " ");
  const words = lines.split(/\s+/).filter(Boolean), numbers = words.map(Number);
  if (numbers.length % 9) broken(`it has ${numbers.length} numbers, which are not 9 a triangle`);
  if (numbers.some(Number.isNaN)) broken("a number in it is none");
  return {vertices: Float64Array.from(numbers), triangles: Int32Array.from({length: numbers.length / 3}, (_, i) => i), lacks: []};
}

// Colours of bytes, 4 a vertex, of three or four columns; and whether all are opaque, as they are drawn here.
function colorsOf(columns, scale) {
  const colors = new Uint8Array(4 * columns[0].length).fill(255), byteOf = (value) => rint(Math.min(255, Math.max(0, (value || 0) * scale)));
  columns.slice(0, 3).forEach((column, k) => column.forEach((value, i) => (colors[4 * i + k] = byteOf(value))));
  return {colors, isOpaque: (columns[3] ?? []).every((value) => byteOf(value) === 255)};
}
const mostOf = (columns, least) => columns.reduce((high, column) => column.reduce((most, value) => value > most ? value : most, high), least);

// Columns as rows.
function together(columns, kind = Float64Array) {
  const rows = new kind(columns.length * columns[0].length);
  columns.forEach((column, k) => column.forEach((value, i) => (rows[columns.length * i + k] = value)));
  return rows;
}

function readObj(bytes) {
  if (bytes.includes(0)) broken("it is not text");
  const positions = [], colors = [], normals = [], faces = [], other = new Set();
  let nUv = 0, leastWidth = Infinity;
  for (const line of new TextDecoder().decode(bytes).replace(/\\\r?\n/g, " ").split(/[\r\n]+/)) {
    const words = line.replace(/#.*/, "").trim().split(/\s+/);
    if (words[0] === "v") {
      if (words.length < 4) broken(`its vertex ${positions.length / 3 + 1} has ${words.length - 1} of 3 numbers`);
      for (let k = 1; k < 4; k++) positions.push(Number(words[k]));
      leastWidth = Math.min(leastWidth, words.length - 1);
      if (leastWidth >= 6) colors.push(words.slice(4, 8).map(Number));
    } else if (words[0] === "vn") normals.push([1, 2, 3].map((k) => Number(words[k] ?? 0)));
    else if (words[0] === "vt") nUv++;
    else if (words[0] === "f" || words[0] === "fo") {
      const above = [positions.length / 3, nUv, normals.length];
      faces.push(words.slice(1).map((word) => {
        if (!/^-?\d+(?:\/-?\d*){0,2}$/.test(word)) broken(/^[-\d/]+$/.test(word) ? "a face of it is no list of indices" : "a number in it is none");
        return word.split("/").map((text, k) => {
          const index = Number.parseInt(text || "0", 10), key = ["v", "vt", "vn"][k];
          if (index === 0 && k === 0) broken("a face names v 0: they count from 1");
          if (index < 0 && above[k] + index < 0) broken(`a face names a ${key} line before the first`);
          return index < 0 ? above[k] + index : index - 1;
        });
      }));
    } else if (words[0] === "usemtl") other.add(words[0]);
  }
  const n = positions.length / 3, most = faces.reduce((high, face) => face.reduce((found, [v]) => Math.max(found, v), high), -1) + 1;
  if (most > n) broken(`a face names v ${most} of ${n}`);
  const found = {vertices: Float64Array.from(positions), polygons: faces.map((face) => face.map(([v]) => v)), lacks: other.size || nUv ? [NOT_HERE] : []};
  if (n && leastWidth >= 6) {
    const columns = [0, 1, 2, 3].slice(0, leastWidth >= 7 ? 4 : 3).map((k) => Float64Array.from(colors, (row) => row[k]));
    const {colors: own, isOpaque} = colorsOf(columns, mostOf(columns, -Infinity) <= 1 ? 255 : 1);
    found.colors = own;
    if (!isOpaque) found.lacks = [NOT_HERE];
  }
  const corners = faces.filter((face) => face.length > 2).flat();
  if (!corners.some(([, , vn]) => vn >= 0)) return found;
  if (corners.every(([, , vn]) => vn >= 0 && vn < normals.length)) return withNormals(found, faces, normals);
  return {...found, lacks: [NOT_HERE]};
}

// Vertices that have one normal each: a row of positions, texture coordinates and normals that faces name together.
function withNormals(found, allFaces, normals) {
  const faces = allFaces.filter((face) => face.length > 2), corners = faces.flat(), hasUv = corners.some(([, vt]) => vt >= 0);
  if (!hasUv && corners.every(([v, , vn]) => v === vn)) {
    const n = found.vertices.length / 3;
    return {...found, normals: Float64Array.from(Array.from({length: n}, (_, i) => normals[i % normals.length]).flat())};
  }
  const rows = new Map(), used = [];
  const polygons = faces.map((face) => face.map(([v, vt = -1, vn]) => {
    const key = `${v} ${hasUv ? vt : ""} ${vn}`;
    if (!rows.has(key)) rows.set(key, used.push([v, vn]) - 1);
    return rows.get(key);
  }));
  return {
    ...found, polygons, vertices: Float64Array.from(used.flatMap(([v]) => Array.from(found.vertices.subarray(3 * v, 3 * v + 3)))),
    normals: Float64Array.from(used.flatMap(([, vn]) => normals[vn])),
    colors: found.colors && Uint8Array.from(used.flatMap(([v]) => Array.from(found.colors.subarray(4 * v, 4 * v + 4)))),
  };
}

const TYPES = {
  char: ["Int8", 1], uchar: ["Uint8", 1], short: ["Int16", 2], ushort: ["Uint16", 2], int: ["Int32", 4], uint: ["Uint32", 4],
  float: ["Float32", 4], double: ["Float64", 8], int8: ["Int8", 1], uint8: ["Uint8", 1], int16: ["Int16", 2], uint16: ["Uint16", 2],
  int32: ["Int32", 4], uint32: ["Uint32", 4], float32: ["Float32", 4], float64: ["Float64", 8],
};

function plyHeader(bytes) {
  const text = new TextDecoder("latin1").decode(bytes.subarray(0, 1 << 20));
  if (!text.startsWith("ply")) broken("it does not begin with ply");
  const elements = [], end = /^end_header[ \t]*\r?\n/m.exec(text);
  if (!end) broken("its header does not end");
  let format = null;
  for (const line of text.slice(0, end.index).split("\n")) {
    const words = line.split(/\s+/).filter(Boolean), [key, ...rest] = words;
    if (key === "format" && ["ascii", "binary_little_endian", "binary_big_endian"].includes(rest[0])) format = rest[0];
    else if (key === "element" && /^\d{1,15}$/.test(rest[1])) elements.push({name: rest[0], n: Number(rest[1]), properties: []});
    else if (key === "property" && elements.length && rest[0] === "list" && rest[1] in TYPES && rest[2] in TYPES) {
      elements.at(-1).properties.push({name: rest[3], count: TYPES[rest[1]], type: TYPES[rest[2]]});
    } else if (key === "property" && elements.length && rest[0] in TYPES) elements.at(-1).properties.push({name: rest[1], type: TYPES[rest[0]]});
    else if (["element", "property", "format"].includes(key)) broken(`its header says '${words.join(" ").slice(0, 60)}'`);
  }
  if (format === null) broken("its header names no format");
  return {format, elements, start: end.index + end[0].length};
}

// Hands out one number after the other, of text or of bytes; null behind the end.
function numbersOf(bytes, {format, start}) {
  if (format === "ascii") {
    const words = new TextDecoder().decode(bytes.subarray(start)).split(/\s+/).filter(Boolean);
    let i = 0;
    return () => i < words.length ? Number(words[i++]) : null;
  }
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength), isLittle = format === "binary_little_endian";
  let at = start;
  return ([kind, size]) => {
    if (at + size > bytes.length) return null;
    at += size;
    return view[`get${kind}`](at - size, isLittle);
  };
}

// A number as its type holds it: text may have others.
const LIMITS = {Int8: [-128, 127], Uint8: [0, 255], Int16: [-32768, 32767], Uint16: [0, 65535], Int32: [-(2 ** 31), 2 ** 31 - 1], Uint32: [0, 2 ** 32 - 1]};
function castTo([kind], value) {
  if (!(kind in LIMITS)) return kind === "Float32" ? Math.fround(value) : value;
  const [low, high] = LIMITS[kind];
  return Math.trunc(Math.min(high, Math.max(low, value || 0)));
}

// Where the columns of one of several choices of names are, in the order of the names; null where none is there.
function columnsOf(properties, choices) {
  const found = choices.map((names) => names.map((name) => properties.findIndex((one) => one.name === name && !one.count)));
  return found.find((columns) => !columns.includes(-1)) ?? null;
}

// The colours of vertices: bytes, 16 bits, or floats of 0 to 1.
function plyColors(properties, columns) {
  const at = columnsOf(properties, [["red", "green", "blue"], ["diffuse_red", "diffuse_green", "diffuse_blue"]]);
  if (!at) return null;
  const prefix = properties[at[0]].name.slice(0, -3), alpha = columnsOf(properties, [[`${prefix}alpha`], ["alpha"]]) ?? [];
  const [kind] = properties[at[0]].type, own = [...at, ...alpha].map((k) => columns[k]);
  return colorsOf(own, kind === "Uint16" ? 1 / 257 : kind.startsWith("Float") && mostOf(own, 0) <= 1 ? 255 : 1);
}

// What the columns of the vertices are, and whether the file says more of them.
function plyVertices(properties, columns) {
  const axes = columnsOf(properties, [["x", "y", "z"]]), normals = columnsOf(properties, [["nx", "ny", "nz"]]);
  const isNarrow = axes.every((k) => properties[k].type[0] === "Float32"), picked = (at) => at.map((k) => columns[k]);
  const colors = plyColors(properties, columns), hasUv = columnsOf(properties, [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]]) !== null;
  return {
    vertices: together(picked(axes), isNarrow ? Float32Array : Float64Array), hasMore: hasUv || colors?.isOpaque === false,
    ...normals && {normals: together(picked(normals))}, ...colors && {colors: colors.colors},
  };
}

function readPly(bytes) {
  const header = plyHeader(bytes), next = numbersOf(bytes, header), polygons = [];
  let found = null, hasMore = false;
  for (const {name, n, properties} of header.elements) {
    const ended = () => broken(`it ends within its ${n} rows of ${name}`), take = (type) => next(type) ?? ended();
    const columns = name === "vertex" ? properties.map(() => new Float64Array(Math.min(n, bytes.length))) : null;
    if (columns && !columnsOf(properties, [["x", "y", "z"]])) broken("its vertices have no x, y and z");
    const takeList = (type, count) => {
      const many = take(count);
      if (!(many >= 0 && Number.isInteger(many))) broken(`a list of it has ${many} entries`);
      return Array.from({length: Math.min(many, bytes.length)}, () => take(type));
    };
    for (let i = 0; i < n; i++) {
      properties.forEach(({name: own, type, count}, k) => {
        const value = count ? takeList(type, count) : take(type);
        if (columns && !count) columns[k][i] = castTo(type, value);
        if (name === "face" && count && /^vertex_ind/.test(own)) polygons.push(value);
      });
    }
    if (columns) found = plyVertices(properties, columns);
    if (name === "face") hasMore ||= properties.some((one) => /^texcoord|^texnumber|^(diffuse_)?red$/.test(one.name));
  }
  if (!found) broken("it has no vertices");
  return {...found, polygons, lacks: hasMore || found.hasMore ? [NOT_HERE] : []};
}

// Binary glTF: the meshes of all nodes of the scene, placed by their matrices.
const COMPONENTS = {5120: "Int8", 5121: "Uint8", 5122: "Int16", 5123: "Uint16", 5125: "Uint32", 5126: "Float32"};
const WIDTHS = {SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT4: 16};

function readGlb(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.length < 20 || view.getUint32(0, true) !== 0x46546c67) broken("it does not begin with glTF");
  const chunks = {};
  for (let at = 12; at + 8 <= bytes.length;) {
    const n = view.getUint32(at, true), kind = view.getUint32(at + 4, true);
    if (at + 8 + n > bytes.length) broken("it ends within a chunk");
    chunks[kind] ??= bytes.subarray(at + 8, at + 8 + n);
    at += 8 + n;
  }
  const gltf = JSON.parse(new TextDecoder().decode(chunks[0x4e4f534a] ?? broken("it has no JSON"))), data = chunks[0x004e4942];
  if (gltf.extensionsRequired?.length) broken(`it needs ${gltf.extensionsRequired.join(", ")}, which this page does not read`);
  const accessor = (i) => {
    const {bufferView, byteOffset = 0, componentType, count, type} = gltf.accessors[i], {byteOffset: start = 0, byteStride} = gltf.bufferViews[bufferView];
    const kind = COMPONENTS[componentType], size = Number(kind.replace(/\D/g, "")) / 8, width = WIDTHS[type], stride = byteStride ?? size * width;
    const own = new DataView(data.buffer, data.byteOffset, data.byteLength), values = new Float64Array(count * width);
    if (start + byteOffset + stride * (count - 1) + size * width > data.length) broken(`accessor ${i} reaches beyond its buffer`);
    for (let row = 0; row < count; row++) {
      for (let k = 0; k < width; k++) values[row * width + k] = own[`get${kind}`](start + byteOffset + stride * row + size * k, true);
    }
    return values;
  };
  const vertices = [], triangles = [], seen = new Set();
  let hasNormals = false, isMoved = false;
  const place = ({attributes, indices: names, mode = 4}, matrix) => {
    if (mode !== 4) return;
    const points = accessor(attributes.POSITION), n = points.length / 3, first = vertices.length / 3, isFlat = attributes.NORMAL === undefined;
    const indices = names === undefined ? Float64Array.from({length: n}, (_, i) => i) : accessor(names);
    const put = (i) => {
      for (let k = 0; k < 3; k++) vertices.push(matrix ? matrix[k] * points[i] + matrix[4 + k] * points[i + 1] + matrix[8 + k] * points[i + 2] + matrix[12 + k] : points[i + k]);
    };
    hasNormals ||= !isFlat, isMoved ||= matrix !== null;
    for (const index of indices) if (index >= n) broken(`a face names vertex ${index} of ${n}`);
    if (isFlat) indices.forEach((index) => put(3 * index)); // triangles without normals are flat: each has its own corners
    else for (let i = 0; i < points.length; i += 3) put(i);
    indices.forEach((index, i) => triangles.push(first + (isFlat ? i : index)));
  };
  const walk = (i, matrix) => {
    if (seen.has(i)) broken(`nodes[${i}] is below itself, or shown twice`);
    seen.add(i);
    const node = gltf.nodes[i], own = times(matrix, matrixOf(node));
    if (node.mesh !== undefined) for (const primitive of gltf.meshes[node.mesh].primitives) place(primitive, own);
    for (const child of node.children ?? []) walk(child, own);
  };
  for (const root of gltf.scenes?.[gltf.scene ?? 0]?.nodes ?? gltf.nodes?.map((_, i) => i) ?? []) walk(root, null);
  return {vertices: (isMoved ? Float64Array : Float32Array).from(vertices), triangles: Int32Array.from(triangles), isSplit: true, lacks: hasNormals || gltf.materials || gltf.animations ? [NOT_HERE] : []};
}

// The matrix of a node, by columns; null where it moves nothing.
function matrixOf({matrix, translation: t = [0, 0, 0], rotation: [x, y, z, w] = [0, 0, 0, 1], scale: s = [1, 1, 1], ...node}) {
  if (matrix) return matrix;
  if (!("translation" in node) && t.every((v) => v === 0) && s.every((v) => v === 1) && w === 1) return null;
  const turn = [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w),
    2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)];
  return [0, 1, 2].flatMap((k) => [...turn.slice(3 * k, 3 * k + 3).map((v) => v * s[k]), 0]).concat([...t, 1]);
}
function times(a, b) {
  if (!a || !b) return a ?? b;
  return Array.from({length: 16}, (_, i) => [0, 1, 2, 3].reduce((sum, k) => sum + a[4 * k + i % 4] * b[4 * (i >> 2) + k], 0));
}

const READERS = {".obj": readObj, ".ply": readPly, ".stl": readStl, ".glb": readGlb};
