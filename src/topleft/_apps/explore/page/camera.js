// The camera of the part Mesh without Python: what matrices.pxi, camera/matrices.py and MeshView.camera compute, operation
// by operation. Numbers are float64 there and here, so the matrices have the same bits.

const PI = 3.141592653589793, RADIANS_A_DEGREE = PI / 180, MARGIN = 1.05;

// C's rint: halves to even.
function rint(x) {
  const low = Math.floor(x), rest = x - low;
  return rest > 0.5 || (rest === 0.5 && low % 2 !== 0) ? low + 1 : low;
}

// The cosine and the sine of an angle in degrees.
export function cosineAndSine(degrees) {
  const turns = degrees % 360, quarter = rint(turns / 90), x = (turns - 90 * quarter) * RADIANS_A_DEGREE, square = x * x;
  let sine = 1 / 355687428096000;
  for (const [sign, value] of [[-1, 1307674368000], [1, 6227020800], [-1, 39916800], [1, 362880], [-1, 5040], [1, 120], [-1, 6]]) {
    sine = sine * square + sign * (1 / value);
  }
  sine = x + x * (square * sine);
  let cosine = 1 / 20922789888000;
  for (const [sign, value] of [[-1, 87178291200], [1, 479001600], [-1, 3628800], [1, 40320], [-1, 720], [1, 24]]) {
    cosine = cosine * square + sign * (1 / value);
  }
  cosine = 1 - (0.5 * square - square * (square * cosine));
  if (quarter & 1) [cosine, sine] = [-sine, cosine];
  if (quarter & 2) [cosine, sine] = [-cosine, -sine];
  return [cosine + 0, sine + 0];
}

const tangent = (degrees) => {
  const [cosine, sine] = cosineAndSine(degrees);
  return sine / cosine;
};
const dot = (a, b) => a.reduce((total, value, k) => total + value * b[k], 0);
const length = (vector) => Math.sqrt(dot(vector, vector));
const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];
const product = (a, b) => a.map((row) => b[0].map((_, j) => row.reduce((total, value, k) => total + value * b[k][j], 0)));

function viewMatrix(eye, target, up) {
  const forward = target.map((value, k) => value - eye[k]), far = length(forward), ahead = forward.map((value) => value / far);
  const right = cross(ahead, up), wide = length(right), side = right.map((value) => value / wide), above = cross(side, ahead);
  const rows = [side, above, ahead.map((value) => -value)];
  return [...rows.map((row) => [...row, dot(row.map((value) => -value), eye)]), [0, 0, 0, 1]];
}

function orbitView(target, distance, azimuth, elevation, up) {
  const [cosine, sine] = cosineAndSine(azimuth), [level, height] = cosineAndSine(elevation);
  let outward = [level * sine, height, level * cosine], axis = [0, 1, 0];
  if (Math.abs(elevation) > 89) axis = [-sine, 0, -cosine].map((value) => value * Math.sign(elevation));
  if (up === "z") [outward, axis] = [outward, axis].map(([x, y, z]) => [x, -z, y]);
  return viewMatrix(target.map((value, k) => value + distance * outward[k]), target, axis);
}

// View and projection of a view of the page, for a box and the radius round it.
export function cameraOf(view, {center, radius}) {
  const [width, height] = view.size, aspect = width / height, tan = tangent((view.fov || 40) / 2), narrow = tan * Math.min(1, aspect);
  const distance = view.fov ? radius * MARGIN / (narrow / Math.sqrt(1 + narrow * narrow)) / view.zoom : 4 * radius;
  const tall = 2 * radius * MARGIN / Math.min(1, aspect) / view.zoom, matrix = orbitView(center, distance, view.azimuth, view.elevation, view.up);
  const half = view.fov ? distance * tan : tall / 2, reach = 1.01 * radius;
  view.pan.forEach((value, k) => (matrix[k][3] += value * half));
  const near = view.fov ? Math.max(distance - reach, 1e-3 * distance, 1e-4 * radius) : distance - reach, far = distance + reach;
  const scale = view.fov ? 1 / tangent(view.fov / 2) : 2 / tall;
  const projection = view.fov
    ? [[scale, 0, 0, 0], [0, scale, 0, 0], [0, 0, (far + near) / (near - far), 2 * far * near / (near - far)], [0, 0, -1, 0]]
    : [[scale, 0, 0, 0], [0, scale, 0, 0], [0, 0, 2 / (near - far), (far + near) / (near - far)], [0, 0, 0, 1]];
  projection[0] = projection[0].map((value) => value * height / width);
  return {view: matrix, projection, clip: product(projection, matrix)};
}

// How a camera sees a space whose origin is at `center`: find_rays of matrices.pxi, for a view that turns and moves alone.
export function raysOf({view, projection}, center, [width, height]) {
  const clip = product(projection, view), hasPerspective = clip[3].slice(0, 3).some((value) => value !== 0);
  const own = [0, 1, hasPerspective ? 3 : 2], turned = inverse(own.map((i) => clip[i].slice(0, 3)));
  const offset = turned.map((row) => dot(row, own.map((i) => clip[i][3])));
  const ends = [[-1, 1, hasPerspective ? 1 : -1], [2 / width, 0, 0], [0, -2 / height, 0], [0, 0, 2]];
  const ray = ends.map((end) => turned.map((row) => dot(end, row)));
  let eye = offset.map((value, k) => -value - center[k]);
  if (!hasPerspective) {
    ray[0] = ray[0].map((value, k) => value - (offset[k] + center[k]));
    const unit = Math.sqrt((ray[3][0] * ray[3][0] + ray[3][1] * ray[3][1]) + ray[3][2] * ray[3][2]);
    eye = ray[3].map((value) => -value / unit);
  }
  const scale = cubeRoot(determinant(view));
  return {hasPerspective, eye, ray, eyeFrom: view.slice(0, 3).map((row) => row.slice(0, 3).map((value) => value / scale))};
}

function determinant(m) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
    + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

// Newton's method on 1/2 to 4.
function cubeRoot(a) {
  if (a === 0) return a;
  let exponent = Math.floor(Math.log2(Math.abs(a))) + 1, m = Math.abs(a) / 2 ** exponent, root = 1;
  if (m < 0.5) (m *= 2), exponent--;
  if (m >= 1) (m /= 2), exponent++;
  const thirds = Math.floor(exponent / 3);
  m *= 2 ** (exponent - 3 * thirds);
  for (let k = 0; k < 7; k++) root = (2 * root + m / (root * root)) / 3;
  return Math.sign(a) * root * 2 ** thirds;
}

function inverse(given) {
  const n = given.length, rows = given.map((row, i) => [...row, ...row.map((_, j) => i === j ? 1 : 0)]);
  for (let k = 0; k < n; k++) {
    let best = k;
    for (let i = k + 1; i < n; i++) if (Math.abs(rows[i][k]) > Math.abs(rows[best][k])) best = i;
    if (best !== k) [rows[k], rows[best]] = [rows[best], rows[k]];
    for (let i = 0; i < n; i++) {
      if (i === k) continue;
      const factor = rows[i][k] / rows[k][k];
      for (let j = k; j < 2 * n; j++) rows[i][j] -= factor * rows[k][j];
    }
  }
  return rows.map((row, i) => row.slice(n).map((value) => value / row[i]));
}
