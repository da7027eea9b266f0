// Colours of triangles and of counts, told apart by the colour-blind.

// M. Okabe, K. Ito, Color Universal Design, 2008, without its black.
export const COLORS = [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [213, 94, 0], [240, 228, 66]];

// The colour of a triangle: seven, then the seven paler, then darker.
export function colorOf(i) {
  const color = COLORS[i % 7], turn = Math.floor(i / 7) % 3;
  return turn === 0 ? color : color.map((c) => turn === 1 ? (c + 255) >> 1 : Math.floor(c * 2 / 3));
}

export const css = ([...color]) => `#${color.map((c) => c.toString(16).padStart(2, "0")).join("")}`;
