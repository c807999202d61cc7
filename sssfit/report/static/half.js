// Pictures and texts as sssfit.report.pack packs them: base64 of deflated bytes, half floats.

const HALVES = (() => {
  const table = new Float32Array(65536);
  for (let bits = 0; bits < 65536; bits++) {
    const sign = bits & 0x8000 ? -1 : 1, exponent = (bits >> 10) & 31, part = bits & 1023;
    const size = exponent === 0 ? part * 2 ** -24
      : exponent === 31 ? (part ? NaN : Infinity) : (1 + part / 1024) * 2 ** (exponent - 15);
    table[bits] = sign * size;
  }
  return table;
})();

export async function inflated(base64) {
  const bytes = Uint8Array.from(atob(base64), (each) => each.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Numbers of 64 bits.
export const numbersOf = async (base64) => new Float64Array((await inflated(base64)).buffer);

export const textOf = async (base64) => new TextDecoder().decode(await inflated(base64));

// Sums up the steps from the left and upper neighbours, modulo 2^16; channels stand apart.
export function bitsOf(raw, [height, width, channels]) {
  const count = height * width, bits = new Uint16Array(count * channels);
  const plane = new Uint16Array(count);
  for (let c = 0; c < channels; c++) {
    const high = c * count, low = (channels + c) * count;
    for (let y = 0, i = 0; y < height; y++) {
      let along = 0;
      for (let x = 0; x < width; x++, i++) {
        along += raw[high + i] * 256 + raw[low + i];
        plane[i] = along + (y > 0 ? plane[i - width] : 0);
        bits[i * channels + c] = plane[i];
      }
    }
  }
  return bits;
}

// A picture of three channels; a grey one is repeated.
export async function pictureOf({ shape, data }) {
  const [height, width, channels] = shape;
  const bits = bitsOf(await inflated(data), shape), pixels = new Float32Array(height * width * 3);
  for (let i = 0; i < height * width; i++) {
    for (let c = 0; c < 3; c++) pixels[3 * i + c] = HALVES[bits[i * channels + c % channels]];
  }
  return { height, width, channels, bits, pixels };
}
