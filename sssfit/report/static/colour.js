// Displayed colours, CIE Delta E 2000 and false colours; the formulas are those of sssfit.measure.

const ROWS = [
  [0.4123907992659595, 0.35758433938387796, 0.1804807884018343],
  [0.21263900587151036, 0.7151686787677559, 0.07219231536073371],
  [0.01933081871559185, 0.11919477979462599, 0.9505321522496606],
];
const WHITE = ROWS.map((row) => row[0] + row[1] + row[2]);
const DEGREES = Math.PI / 180, POWER = 25 ** 7;

export const encoded = (v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
export const clipped = (v) => (v < 0 ? 0 : v > 1 ? 1 : v);

const root = (t) => (t > 216 / 24389 ? Math.cbrt(t) : (24389 / 27 * t + 16) / 116);

// L, a, b of linear sRGB that is clipped already.
export function labOf(r, g, b) {
  const [x, y, z] = ROWS.map((row, k) => root((row[0] * r + row[1] * g + row[2] * b) / WHITE[k]));
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

const angle = (b, a) => (a === 0 && b === 0 ? 0 : (Math.atan2(b, a) / DEGREES + 360) % 360);

// Sharma, Wu and Dalal 2005, equations 2 to 22, with k_L = k_C = k_H = 1.
export function deltaE([l1, a1, b1], [l2, a2, b2]) {
  const mean = ((Math.hypot(a1, b1) + Math.hypot(a2, b2)) / 2) ** 7;
  const g = 1.5 - 0.5 * Math.sqrt(mean / (mean + POWER));
  const c1 = Math.hypot(g * a1, b1), c2 = Math.hypot(g * a2, b2);
  const h1 = angle(b1, g * a1), h2 = angle(b2, g * a2), isGrey = c1 * c2 === 0;
  let turn = isGrey ? 0 : h2 - h1;
  turn += turn > 180 ? -360 : turn < -180 ? 360 : 0;
  const far = Math.abs(h1 - h2) > 180;
  const hue = isGrey ? h1 + h2 : (h1 + h2 + (far ? (h1 + h2 < 360 ? 360 : -360) : 0)) / 2;
  const l = (l1 + l2) / 2, c = (c1 + c2) / 2, cosine = (degrees) => Math.cos(degrees * DEGREES);
  const t = 1 - 0.17 * cosine(hue - 30) + 0.24 * cosine(2 * hue) + 0.32 * cosine(3 * hue + 6)
    - 0.2 * cosine(4 * hue - 63);
  const sl = 1 + 0.015 * (l - 50) ** 2 / Math.sqrt(20 + (l - 50) ** 2);
  const dl = (l2 - l1) / sl, dc = (c2 - c1) / (1 + 0.045 * c);
  const dh = 2 * Math.sqrt(c1 * c2) * Math.sin(turn / 2 * DEGREES) / (1 + 0.015 * c * t);
  const twist = Math.sin(60 * DEGREES * Math.exp(-(((hue - 275) / 25) ** 2)));
  const rt = -2 * Math.sqrt(c ** 7 / (c ** 7 + POWER)) * twist;
  return Math.sqrt(Math.max(dl * dl + dc * dc + dh * dh + rt * dc * dh, 0));
}

// Delta E of every pixel of two pictures (3 n) at an exposure.
export function differences(pixels, truth, exposure) {
  const found = new Float32Array(pixels.length / 3);
  const lab = (from, i) => labOf(
    clipped(from[i] * exposure), clipped(from[i + 1] * exposure), clipped(from[i + 2] * exposure));
  for (let k = 0, i = 0; k < found.length; k++, i += 3) {
    const same = pixels[i] === truth[i] && pixels[i + 1] === truth[i + 1] && pixels[i + 2] === truth[i + 2];
    found[k] = same ? 0 : deltaE(lab(pixels, i), lab(truth, i));
  }
  return found;
}

export const SCALE_END = 5; // Delta E at the end of the false colours, the same for every kernel
const VIRIDIS = ['440154', '472c7a', '3b518b', '2c718e', '21908d', '27ad81', '5cc863', 'aadc32', 'fde725']
  .map((hex) => [0, 2, 4].map((k) => parseInt(hex.slice(k, k + 2), 16)));

// The false colour of a share of the scale, as three numbers to 255.
export function falseColour(share) {
  const at = clipped(share) * (VIRIDIS.length - 1), k = Math.min(Math.floor(at), VIRIDIS.length - 2);
  return VIRIDIS[k].map((low, c) => low + (at - k) * (VIRIDIS[k + 1][c] - low));
}
