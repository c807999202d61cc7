// Canvases that show pictures under one pan and zoom, with figures in the pixels when they are large.

import { clipped, encoded, falseColour, SCALE_END } from './colour.js';

const NUMBERS_FROM = 44; // CSS pixels a pixel of the picture must have for three figures in it
const NEAR = 12; // CSS pixels around the divider in which it is taken hold of
const LOUPE = 9; // pixels on a side of the loupe

// A picture as a canvas of its own size, in sRGB codes.
export function drawnLight({ pixels, width, height }, exposure) {
  return painted(width, height, (k) => [0, 1, 2].map((c) => 255 * encoded(clipped(pixels[3 * k + c] * exposure))));
}

export const drawnErrors = (errors, width, height, gain) =>
  painted(width, height, (k) => falseColour(errors[k] * gain / SCALE_END));

function painted(width, height, colourOf) {
  const canvas = document.createElement('canvas');
  Object.assign(canvas, { width, height });
  const context = canvas.getContext('2d'), image = context.createImageData(width, height);
  for (let k = 0; k < width * height; k++) {
    const colour = colourOf(k);
    for (let c = 0; c < 3; c++) image.data[4 * k + c] = Math.round(colour[c]);
    image.data[4 * k + 3] = 255;
  }
  context.putImageData(image, 0, 0);
  return canvas;
}

// Where a picture lies in a pane: its scale, and the place of its upper left corner.
export function placed(pane, { zoom, x, y }, { width, height }) {
  const scale = Math.min(pane.width / width, pane.height / height) * zoom;
  return { scale, left: pane.width / 2 - x * width * scale, top: pane.height / 2 - y * height * scale };
}

export class Pane {
  constructor(canvas, handlers) {
    Object.assign(this, { canvas, handlers, layers: [], pins: [] });
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      const at = this.at(event);
      handlers.zoom(event.deltaY < 0 ? 1.25 : 0.8, at.x / this.size.width, at.y / this.size.height);
    }, { passive: false });
    canvas.addEventListener('pointerdown', (event) => this.grab(event));
    canvas.addEventListener('pointermove', (event) => this.move(event));
    canvas.addEventListener('pointerup', (event) => this.drop(event));
    canvas.addEventListener('pointercancel', () => { this.held = null; });
  }

  // The pixel under a pointer, in pixels of the picture.
  at({ clientX, clientY }) {
    const box = this.canvas.getBoundingClientRect(), ratio = this.canvas.width / box.width;
    const { scale, left, top } = placed(this.canvas, this.view, this.size);
    return { x: ((clientX - box.left) * ratio - left) / scale, y: ((clientY - box.top) * ratio - top) / scale };
  }

  // The share of the pane's width that a pointer is at.
  across({ clientX }) {
    const { left, width } = this.canvas.getBoundingClientRect();
    return (clientX - left) / width;
  }

  isOnDivider(event) {
    const split = this.layers[1]?.from;
    return split !== undefined && Math.abs(this.across(event) - split) * this.canvas.clientWidth < NEAR;
  }

  grab(event) {
    this.canvas.setPointerCapture(event.pointerId);
    const { clientX: x, clientY: y } = event;
    this.held = { x, y, view: { ...this.view }, moved: false, divides: this.isOnDivider(event) };
    this.handlers.focus(this);
  }

  move(event) {
    if (!this.size) return;
    if (!this.held) {
      this.canvas.style.cursor = this.isOnDivider(event) ? 'ew-resize' : '';
      return void this.handlers.hover(this.at(event));
    }
    if (this.held.divides) return void this.handlers.split(this.across(event));
    const [dx, dy] = [event.clientX - this.held.x, event.clientY - this.held.y];
    this.held.moved ||= Math.hypot(dx, dy) > 4;
    if (!this.held.moved) return;
    const ratio = this.canvas.width / this.canvas.getBoundingClientRect().width;
    const { scale } = placed(this.canvas, this.view, this.size), { view } = this.held;
    this.handlers.pan(view.x - dx * ratio / scale / this.size.width, view.y - dy * ratio / scale / this.size.height);
  }

  drop(event) {
    const wasClick = this.held && !this.held.moved && !this.held.divides;
    this.held = null;
    if (wasClick) this.handlers.click(this.at(event));
  }

  // Layers are drawn over each other, each from its share of the pane's width on.
  show(layers, view, pins) {
    Object.assign(this, { layers, view, pins, size: layers[0].drawn });
    const ratio = window.devicePixelRatio || 1, { clientWidth, clientHeight } = this.canvas;
    this.canvas.width = Math.max(1, Math.round(clientWidth * ratio));
    this.canvas.height = Math.max(1, Math.round(clientHeight * ratio));
    const context = this.canvas.getContext('2d');
    for (const { drawn, from, values } of layers) this.layer(context, drawn, from ?? 0, values, ratio);
    const split = layers[1]?.from;
    if (split !== undefined) this.line(context, split * this.canvas.width, ratio);
    pins.forEach((pin, k) => this.pin(context, pin, k + 1, ratio));
  }

  layer(context, drawn, from, values, ratio) {
    const { scale, left, top } = placed(this.canvas, this.view, this.size), { width, height } = this.canvas;
    context.save();
    context.beginPath();
    context.rect(from * width, 0, width, height);
    context.clip();
    context.fillStyle = getComputedStyle(this.canvas).backgroundColor;
    context.fillRect(0, 0, width, height);
    context.imageSmoothingEnabled = scale < 2;
    context.drawImage(drawn, left, top, this.size.width * scale, this.size.height * scale);
    if (scale / ratio >= NUMBERS_FROM && values) this.numbers(context, values, scale, left, top, ratio);
    context.restore();
  }

  numbers(context, values, scale, left, top, ratio) {
    const first = [left, top].map((each) => Math.max(0, Math.floor(-each / scale)));
    const last = [
      Math.min(this.size.width, Math.ceil((this.canvas.width - left) / scale)),
      Math.min(this.size.height, Math.ceil((this.canvas.height - top) / scale)),
    ];
    context.font = `${11 * ratio}px ui-monospace, monospace`;
    context.textAlign = 'center';
    for (let y = first[1]; y < last[1]; y++) {
      for (let x = first[0]; x < last[0]; x++) {
        const words = values(x, y);
        words.forEach((word, k) => {
          const at = [left + (x + 0.5) * scale, top + (y + 0.5) * scale + (k - (words.length - 1) / 2) * 13 * ratio + 4 * ratio];
          outlined(context, word, ...at, ratio);
        });
      }
    }
  }

  line(context, x, ratio) {
    context.fillStyle = '#000';
    context.fillRect(x - 1.5 * ratio, 0, 3 * ratio, this.canvas.height);
    context.fillStyle = '#fff';
    context.fillRect(x - 0.5 * ratio, 0, ratio, this.canvas.height);
  }

  pin(context, { x, y }, number, ratio) {
    const { scale, left, top } = placed(this.canvas, this.view, this.size);
    const at = [left + (x + 0.5) * scale, top + (y + 0.5) * scale];
    for (const [colour, width] of [['#000', 4], ['#fff', 2]]) {
      context.beginPath();
      context.arc(...at, 7 * ratio, 0, 2 * Math.PI);
      Object.assign(context, { strokeStyle: colour, lineWidth: width * ratio });
      context.stroke();
    }
    context.font = `bold ${12 * ratio}px system-ui, sans-serif`;
    context.textAlign = 'left';
    outlined(context, String(number), at[0] + 10 * ratio, at[1] + 4 * ratio, ratio);
  }
}

function outlined(context, words, x, y, ratio) {
  Object.assign(context, { strokeStyle: '#000', fillStyle: '#fff', lineWidth: 3 * ratio, lineJoin: 'round' });
  context.strokeText(words, x, y);
  context.fillText(words, x, y);
}

// A small part of a picture, enlarged around a pixel.
export function drawLoupe(canvas, drawn, x, y) {
  const context = canvas.getContext('2d'), half = Math.floor(LOUPE / 2), cell = canvas.width / LOUPE;
  context.imageSmoothingEnabled = false;
  context.fillStyle = '#000';
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.drawImage(drawn, x - half, y - half, LOUPE, LOUPE, 0, 0, canvas.width, canvas.height);
  for (const [colour, inset] of [['#000', 0], ['#fff', 1.5]]) {
    context.strokeStyle = colour;
    context.strokeRect(half * cell + inset, half * cell + inset, cell - 2 * inset, cell - 2 * inset);
  }
}
