// A picture as OpenEXR: scan lines of 32 bit floats, not compressed.

const TEXT = new TextEncoder();

class Writer {
  constructor() { this.parts = []; this.length = 0; }
  bytes(values) { this.parts.push(values); this.length += values.length; }
  text(words) { this.bytes(TEXT.encode(`${words}\0`)); }
  number(kind, value, size) {
    const view = new DataView(new ArrayBuffer(size));
    view[`set${kind}`](0, value, true);
    this.bytes(new Uint8Array(view.buffer));
  }
  int(value) { this.number('Int32', value, 4); }
  attribute(name, kind, write) {
    const own = new Writer();
    write(own);
    this.text(name);
    this.text(kind);
    this.int(own.length);
    own.parts.forEach((each) => this.bytes(each));
  }
}

function header(width, height) {
  const out = new Writer();
  const box = (own) => [0, 0, width - 1, height - 1].forEach((each) => own.int(each));
  out.int(20000630);
  out.int(2);
  out.attribute('channels', 'chlist', (own) => {
    for (const name of ['B', 'G', 'R']) {
      own.text(name);
      [2, 0, 1, 1].forEach((each) => own.int(each)); // float; not perceptually linear; every pixel
    }
    own.bytes(new Uint8Array(1));
  });
  out.attribute('compression', 'compression', (own) => own.bytes(new Uint8Array(1)));
  out.attribute('dataWindow', 'box2i', box);
  out.attribute('displayWindow', 'box2i', box);
  out.attribute('lineOrder', 'lineOrder', (own) => own.bytes(new Uint8Array(1)));
  out.attribute('pixelAspectRatio', 'float', (own) => own.number('Float32', 1, 4));
  out.attribute('screenWindowCenter', 'v2f', (own) => { own.int(0); own.int(0); });
  out.attribute('screenWindowWidth', 'float', (own) => own.number('Float32', 1, 4));
  out.bytes(new Uint8Array(1));
  return out;
}

export function exrOf(pixels, width, height) {
  const out = header(width, height), line = 12 * width, first = out.length + 8 * height;
  for (let y = 0; y < height; y++) out.number('BigUint64', BigInt(first + y * (line + 8)), 8);
  for (let y = 0; y < height; y++) {
    out.int(y);
    out.int(line);
    const row = new Float32Array(3 * width);
    for (let x = 0; x < width; x++) {
      for (let c = 0; c < 3; c++) row[c * width + x] = pixels[3 * (y * width + x) + 2 - c];
    }
    out.bytes(new Uint8Array(row.buffer));
  }
  return new Blob(out.parts, { type: 'image/x-exr' });
}
