// The pictures of the index of materials.

import { pictureOf } from './half.js';
import { clipped, encoded } from './colour.js';

async function drawSwatches() {
  const { swatches } = JSON.parse(document.getElementById('data').textContent);
  const canvases = document.querySelectorAll('canvas.swatch');
  await Promise.all(swatches.map(async (packed, k) => {
    const { width, height, pixels } = await pictureOf(packed);
    const context = canvases[k].getContext('2d'), image = context.createImageData(width, height);
    Object.assign(canvases[k], { width, height });
    for (let i = 0; i < width * height; i++) {
      for (let c = 0; c < 3; c++) image.data[4 * i + c] = Math.round(255 * encoded(clipped(pixels[3 * i + c])));
      image.data[4 * i + 3] = 255;
    }
    context.putImageData(image, 0, 0);
  }));
  document.body.dataset.drawn = '1';
}

drawSwatches();
