// The true picture at a pixel size that the page has none of: as sssfit.render.reference, by the
// convolution of the continued picture with the profile's pixels.

import { Fourier } from './fourier.js';
import { quadrantOf } from './kernel.js';

const LEAST = 256; // pixels that a kernel covers at least, also of a small picture

// The pixel that stands at a place beyond the picture.
function sourceOf(place, size, border) {
  if (border !== 'mirror') return Math.min(Math.max(place, 0), size - 1);
  const at = ((place % (2 * size)) + 2 * size) % (2 * size);
  return Math.min(at, 2 * size - 1 - at);
}

const sideFor = (least) => 2 ** Math.ceil(Math.log2(least));

function continued(fourier, { pixels, width, height }, channel, half, border) {
  const found = fourier.empty(), { side } = fourier;
  const columns = Int32Array.from({ length: width + 2 * half }, (_, k) => sourceOf(k - half, width, border));
  for (let y = 0; y < height + 2 * half; y++) {
    const row = sourceOf(y - half, height, border) * width;
    for (let x = 0; x < columns.length; x++) found.re[y * side + x] = pixels[3 * (row + columns[x]) + channel];
  }
  return found;
}

// The real spectrum of an even kernel.
function spectrumOf(fourier, quadrant, channels, channel, half) {
  const found = fourier.empty(), { side } = fourier, n = half + 1;
  for (let i = -half; i <= half; i++) {
    const row = (i + side) % side * side;
    for (let k = -half; k <= half; k++) {
      found.re[row + (k + side) % side] = quadrant[(Math.abs(i) * n + Math.abs(k)) * channels + channel];
    }
  }
  fourier.forward(found);
  return found.re;
}

// What a picture's continuation has far away: its mean, or that of its corners.
function farLight({ pixels, width, height }, channel, border) {
  const at = (x, y) => pixels[3 * (y * width + x) + channel];
  if (border !== 'mirror') return (at(0, 0) + at(width - 1, 0) + at(0, height - 1) + at(width - 1, height - 1)) / 4;
  let sum = 0;
  for (let k = channel; k < pixels.length; k += 3) sum += pixels[k];
  return sum / (width * height);
}

function energyOf(quadrant, channels, channel, half) {
  let sum = 0;
  for (let i = 0; i <= half; i++) {
    for (let k = 0; k <= half; k++) {
      sum += (i ? 2 : 1) * (k ? 2 : 1) * quadrant[(i * (half + 1) + k) * channels + channel];
    }
  }
  return sum;
}

// The truth of light (three channels) on pixels of `pitch` mm, with border "mirror" or "clamp".
export function truthOf(profile, light, pitch, border) {
  const { width, height } = light, { radii, channels, reflectance } = profile;
  const covering = Math.max(Math.ceil(radii.at(-1) / pitch - 0.5) - 1, 0) + 1;
  const half = Math.min(covering, Math.max(width, height, LEAST) - 1);
  const fourier = new Fourier(sideFor(Math.max(width, height) + 2 * half));
  const quadrant = quadrantOf(profile, pitch, half), pixels = new Float32Array(3 * width * height);
  for (let channel = 0; channel < 3; channel++) {
    const own = channel % channels, spectrum = spectrumOf(fourier, quadrant, channels, own, half);
    const picture = continued(fourier, light, channel, half, border);
    fourier.forward(picture);
    for (let k = 0; k < spectrum.length; k++) { picture.re[k] *= spectrum[k]; picture.im[k] *= spectrum[k]; }
    fourier.backward(picture);
    const rest = (reflectance[own] - energyOf(quadrant, channels, own, half)) * farLight(light, channel, border);
    for (let y = 0; y < height; y++) {
      for (let x = 0; x < width; x++) {
        pixels[3 * (y * width + x) + channel] = Math.max(picture.re[(y + half) * fourier.side + x + half] + rest, 0);
      }
    }
  }
  return { width, height, channels: 3, pixels };
}
