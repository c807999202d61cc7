// The energy of a profile in square pixels; the formulas are those of sssfit.profile.pixels.

// Half the chord of a disk at a distance from its centre.
const chord = (radius, x) => Math.sqrt(Math.max((radius - x) * (radius + x), 0));

// Area between a chord and its arc. Both terms cancel for short chords, and the series does not.
function segment(radius, share) {
  const square = share * share;
  if (square > 0.0025) {
    const s = Math.min(share, 1);
    return radius * radius * (Math.asin(s) - s * Math.sqrt(1 - s * s));
  }
  const series = 3 / 28 + square * (5 / 72 + square * (35 / 704 + square * 63 / 1664));
  return radius * radius * share * square * (2 / 3 + square * (0.2 + square * series));
}

function underArc(radius, xa, ya, xb, yb, y0) {
  const along = (xb - xa) / (2 * radius), down = (ya - yb) / (2 * radius);
  return (xb - xa) * 0.5 * (ya - y0 + (yb - y0)) + segment(radius, Math.hypot(along, down));
}

// The area of a disk in [x0, x1] x [y0, y1], all from 0 up, if its edge cuts this.
function diskArea(radius, x0, x1, y0, y1) {
  if (chord(radius, y0) <= x0 || radius <= y0) return 0;
  const isCutAbove = chord(radius, x0) > y1 && radius > y1;
  const [xa, ya] = isCutAbove ? [Math.min(chord(radius, y1), x1), y1] : [x0, chord(radius, x0)];
  const isCutRight = chord(radius, x1) > y0 && radius > x1;
  const [xb, yb] = isCutRight ? [x1, chord(radius, x1)] : [chord(radius, y0), y0];
  if (xb <= xa) return (Math.min(xa, x1) - x0) * (y1 - y0);
  return (xa - x0) * (y1 - y0) + underArc(radius, xa, ya, xb, yb, y0);
}

// A pixel on an axis is cut in half there and counted twice.
const span = (k, pitch) => (k === 0 ? [0, 0.5 * pitch, 2] : [(k - 0.5) * pitch, (k + 0.5) * pitch, 1]);

function addPixel(found, at, { radii, densities, channels }, first, i, k, pitch) {
  const [x0, x1, across] = span(k, pitch), [y0, y1, down] = span(i, pitch), farthest = Math.hypot(x1, y1);
  let inner = 0;
  for (let j = first; j < radii.length; j++) {
    const isWhole = radii[j] >= farthest, area = isWhole ? (x1 - x0) * (y1 - y0) : diskArea(radii[j], x0, x1, y0, y1);
    const part = across * down * Math.max(area - inner, 0);
    for (let c = 0; c < channels; c++) found[at + c] += part * densities[j * channels + c];
    if (isWhole) return;
    inner = area;
  }
}

// The energies of pixels (half + 1, half + 1, channels) of one quadrant with both axes, of an annulus
// inside each of `radii` with a density of its own.
export function quadrantOf(profile, pitch, half) {
  const { radii, channels } = profile, n = half + 1, found = new Float64Array(n * n * channels);
  const beyond = (first, i, k) => {
    const nearest = Math.hypot(span(i, pitch)[0], span(k, pitch)[0]);
    let at = first;
    while (at < radii.length && radii[at] <= nearest) at++;
    return at;
  };
  let diagonal = 0;
  for (let k = 0; k < n; k++) {
    diagonal = beyond(diagonal, k, k);
    for (let i = k, first = diagonal; i < n; i++) {
      first = beyond(first, i, k);
      if (first === radii.length) break;
      const at = (i * n + k) * channels;
      addPixel(found, at, profile, first, i, k, pitch);
      for (let c = 0; c < channels; c++) found[(k * n + i) * channels + c] = found[at + c];
    }
  }
  return found;
}
