// Numbers as NumPy rounds them and as Python writes them; float64 values as whole numbers of any length.

export const abs = (n) => n < 0n ? -n : n;
export const cross = (a, b, p) => (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);

// Rounded as NumPy rounds: halves to even.
export function rint(x) {
  const low = Math.floor(x), rest = x - low;
  return rest > 0.5 || (rest === 0.5 && low % 2 !== 0) ? low + 1 : low;
}

// A float64 as (whole number, power of two below it): exact.
export function dyadic(x) {
  let k = 0;
  while (!Number.isInteger(x)) (x *= 2), k++;
  return [BigInt(x), k];
}

// Coordinates as whole numbers of a unit, and how many of it are a pixel: exact.
export function wholeOf(points) {
  const own = Array.from(points, dyadic), k = own.reduce((most, [, power]) => Math.max(most, power), 0);
  return [own.map(([n, power]) => n << BigInt(k - power)), 1n << BigInt(k)];
}

// The float64 nearest to n / d, d > 0: 64 bits of the quotient, the last of them telling whether something is left.
export function quotient(n, d) {
  const shift = 66 - (abs(n).toString(2).length - d.toString(2).length), by = BigInt(Math.abs(shift));
  const [a, b] = shift > 0 ? [abs(n) << by, d] : [abs(n), d << by];
  const whole = a / b, bits = whole * b === a ? whole : whole | 1n;
  return (n < 0n ? -1 : 1) * Number(bits) * 2 ** -shift;
}

// A number in at most six digits.
export const sixDigits = (x) => x.toPrecision(6).replace(/(\.\d*?)0+(?=e|$)/, "$1").replace(/\.(?=e|$)/, "");

// A float64 as Python writes it.
export function asFloat(x) {
  const [digits, power] = x.toExponential().split("e"), exponent = Number(power);
  if (exponent < -4 || exponent >= 16) return `${digits}e${exponent < 0 ? "-" : "+"}${String(Math.abs(exponent)).padStart(2, "0")}`;
  return Number.isInteger(x) ? x.toFixed(1) : exponent < 0 ? x.toFixed(digits.replace(/[-.]/g, "").length - 1 - exponent) : String(x);
}
