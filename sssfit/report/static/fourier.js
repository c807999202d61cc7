// Discrete Fourier transforms of square arrays of complex numbers, whose side is a power of two.

// Cosines and sines of the first half of a turn, and where each index goes when its bits are turned round.
function planOf(side) {
  const bits = Math.log2(side), cosines = new Float64Array(side / 2), sines = new Float64Array(side / 2);
  for (let k = 0; k < side / 2; k++) {
    cosines[k] = Math.cos(2 * Math.PI * k / side);
    sines[k] = -Math.sin(2 * Math.PI * k / side);
  }
  const turned = Uint32Array.from({ length: side }, (_, k) => {
    let found = 0;
    for (let bit = 0; bit < bits; bit++) found |= ((k >> bit) & 1) << (bits - 1 - bit);
    return found;
  });
  return { side, cosines, sines, turned };
}

// One line in place, by the radix-2 algorithm of Cooley and Tukey.
function transformLine({ side, cosines, sines, turned }, re, im) {
  for (let k = 0; k < side; k++) {
    const other = turned[k];
    if (other > k) {
      [re[k], re[other]] = [re[other], re[k]];
      [im[k], im[other]] = [im[other], im[k]];
    }
  }
  for (let half = 1; half < side; half *= 2) {
    const step = side / (2 * half);
    for (let begin = 0; begin < side; begin += 2 * half) {
      for (let k = 0; k < half; k++) {
        const a = begin + k, b = a + half, c = cosines[k * step], s = sines[k * step];
        const x = re[b] * c - im[b] * s, y = re[b] * s + im[b] * c;
        re[b] = re[a] - x;
        im[b] = im[a] - y;
        re[a] += x;
        im[a] += y;
      }
    }
  }
}

export class Fourier {
  constructor(side) {
    this.plan = planOf(side);
    this.side = side;
  }

  // A picture of complex numbers, in place: lines along x, then along y.
  forward({ re, im }) {
    const { side, plan } = this, [x, y] = [new Float64Array(side), new Float64Array(side)];
    for (let row = 0; row < side; row++) {
      transformLine(plan, re.subarray(row * side, (row + 1) * side), im.subarray(row * side, (row + 1) * side));
    }
    for (let column = 0; column < side; column++) {
      for (let row = 0; row < side; row++) {
        x[row] = re[row * side + column];
        y[row] = im[row * side + column];
      }
      transformLine(plan, x, y);
      for (let row = 0; row < side; row++) {
        re[row * side + column] = x[row];
        im[row * side + column] = y[row];
      }
    }
  }

  // The inverse transform has real and imaginary parts exchanged, and is divided by the number of places.
  backward({ re, im }) {
    this.forward({ re: im, im: re });
    const count = this.side ** 2;
    for (let k = 0; k < count; k++) re[k] /= count;
    for (let k = 0; k < count; k++) im[k] /= count;
  }

  empty() { return { re: new Float64Array(this.side ** 2), im: new Float64Array(this.side ** 2) }; }
}
