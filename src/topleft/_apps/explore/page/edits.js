// Edits of a state: a triangle is added, split, turned round or removed.
// In: {vertices, triangles, size, origin}, a word, the triangle. Out: {vertices, triangles}, and the next triangle.

export function edited({vertices, triangles, size, origin = [0, 0]}, what, triangle) {
  [vertices, triangles] = [[...vertices], [...triangles]];
  const n = vertices.length, [a, b, c] = triangles[triangle] ?? [];
  if (what === "add") {  // in the middle of the window, at the depth of the first vertex
    const [x, y] = size.map((side, k) => origin[k] + (side >> 1)), r = Math.max(2, Math.min(...size) >> 2);
    const depth = vertices[0]?.slice(2) ?? [];
    vertices.push([x - r, y + r, ...depth], [x, y - r, ...depth], [x + r, y + r, ...depth]);
    triangle = triangles.push([n, n + 1, n + 2]) - 1;
  } else if (a === undefined) return {vertices, triangles, triangle};
  else if (what === "split") {
    triangles.splice(triangle, 1, [a, b, n], [b, c, n], [c, a, n]);
    vertices.push(vertices[a].map((value, k) => Math.round((value + vertices[b][k] + vertices[c][k]) / 3 * 256) / 256));
  } else if (what === "flip") triangles[triangle] = [a, c, b];
  else {
    triangles.splice(triangle, 1);
    const used = [...new Set(triangles.flat())].sort((i, j) => i - j);
    triangles = triangles.map((row) => row.map((i) => used.indexOf(i)));
    vertices = used.map((i) => vertices[i]);
  }
  return {vertices, triangles, triangle: Math.max(0, Math.min(triangle, triangles.length - 1))};
}
