// Reads meshes without Python: OBJ, PLY, STL and GLB, triangles and polygons, without colours, textures and normals, which
// a note tells. A broken file gets the sentence that Python's readers have.
// In: bytes and a name. Out: {vertices: Float32Array or Float64Array (3 n), polygons or triangles, isSplit, lacks: [text]};
// triangles are an Int32Array (3 t), polygons lists of vertices; isSplit: equal vertices are apart where an edge is sharp.

const NOT_HERE = "colours, textures, materials and normals of files are drawn by Python alone";

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

function readObj(bytes) {
  if (bytes.includes(0)) broken("it is not text");
  const vertices = [], polygons = [], other = new Set();
  for (const line of new TextDecoder().decode(bytes).replace(/\\\r?\n/g, " ").split(/[\r\n]+/)) {
    const words = line.replace(/#.*/, "").trim().split(/\s+/);
    if (words[0] === "v") {
      if (words.length < 4) broken(`its vertex ${vertices.length / 3 + 1} has ${words.length - 1} of 3 numbers`);
      for (let k = 1; k < 4; k++) vertices.push(Number(words[k]));
    } else if (words[0] === "f" || words[0] === "fo") {
      const n = vertices.length / 3;
      polygons.push(words.slice(1).map((word) => {
        const index = /^-?\d+(?:\/-?\d*){0,2}$/.test(word) ? Number.parseInt(word, 10)
          : broken(/^[-\d/]+$/.test(word) ? "a face of it is no list of indices" : "a number in it is none");
        if (index === 0) broken("a face names v 0: they count from 1");
        if (n + index < 0) broken("a face names a v line before the first");
        return index < 0 ? n + index : index - 1;
      }));
    } else if (["vt", "vn", "usemtl"].includes(words[0])) other.add(words[0]);
  }
  const n = vertices.length / 3, most = polygons.reduce((high, face) => face.reduce((a, b) => Math.max(a, b), high), -1) + 1;
  if (most > n) broken(`a face names v ${most} of ${n}`);
  return {vertices: Float64Array.from(vertices), polygons, lacks: other.size ? [NOT_HERE] : []};
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

function readPly(bytes) {
  const header = plyHeader(bytes), next = numbersOf(bytes, header);
  let vertices = null, polygons = [], lacks = [];
  for (const {name, n, properties} of header.elements) {
    const ended = () => broken(`it ends within its ${n} rows of ${name}`), take = (type) => next(type) ?? ended();
    const axes = ["x", "y", "z"].map((axis) => properties.findIndex((one) => one.name === axis));
    if (name === "vertex") {
      if (axes.includes(-1)) broken("its vertices have no x, y and z");
      const isWide = axes.some((k) => properties[k].type[0] === "Float64");
      vertices = new (isWide ? Float64Array : Float32Array)(3 * Math.min(n, bytes.length));
      if (properties.length > 3) lacks = [NOT_HERE];
    }
    for (let i = 0; i < n; i++) {
      properties.forEach((property, k) => {
        if (!property.count) {
          const value = take(property.type), axis = axes.indexOf(k);
          if (name === "vertex" && axis >= 0) vertices[3 * i + axis] = value;
          return;
        }
        const many = take(property.count);
        if (!(many >= 0 && Number.isInteger(many))) broken(`a list of it has ${many} entries`);
        const row = Array.from({length: Math.min(many, bytes.length)}, () => take(property.type));
        if (name === "face" && /^vertex_ind/.test(property.name)) polygons.push(row);
      });
    }
  }
  if (!vertices) broken("it has no vertices");
  return {vertices, polygons, lacks};
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
