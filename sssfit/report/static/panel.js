// What stands beside the pictures: figures, scale, histogram, pins, loupe and the worst pixels.

import { histogramOf, placeOf, worstOf } from './figures.js';
import { drawLoupe } from './view.js';

const BINS = 40, LOWEST = 0.001, HIGHEST = 100, // Delta E at the ends of the histogram
  WORST = 3, APART = 12; // pixels between two of the worst places
const byId = (id) => document.getElementById(id);
const SVG = 'http://www.w3.org/2000/svg';

export const short = (value) => (value === null || value === undefined || Number.isNaN(value) ? '-'
  : value === 0 ? '0' : Math.abs(value) >= 100 ? value.toFixed(0) : value.toPrecision(3));

export function tellFigures(shown, kernel) {
  const { figures, made } = shown;
  const words = {
    mean: short(figures?.mean), p95: short(figures?.p95), p99: short(figures?.p99),
    fetches: short(kernel.fetches), passes: String(kernel.passes),
    milliseconds: made.milliseconds === undefined ? '-' : short(made.milliseconds),
  };
  for (const [key, each] of Object.entries(words)) byId(`figure-${key}`).textContent = each;
}

const element = (name, attributes) => {
  const made = document.createElementNS(SVG, name);
  for (const [key, each] of Object.entries(attributes)) made.setAttribute(key, each);
  return made;
};

export function drawHistogram(figures) {
  const svg = byId('histogram');
  svg.replaceChildren();
  if (!figures) return;
  const { bins, quartiles } = histogramOf(figures.sorted, LOWEST, HIGHEST, BINS), top = Math.max(...bins, 1e-9);
  bins.forEach((share, k) => svg.append(element('rect', {
    class: 'bin', x: 4 + k * 6, width: 5, y: 64 - 60 * share / top, height: 60 * share / top })));
  for (const each of quartiles) {
    const x = 4 + 240 * placeOf(each, LOWEST, HIGHEST);
    svg.append(element('line', { class: 'quartile', x1: x, x2: x, y1: 2, y2: 64 }));
  }
  for (let value = LOWEST; value <= HIGHEST; value *= 10) {
    const place = placeOf(value, LOWEST, HIGHEST), x = 4 + 240 * place;
    svg.append(element('line', { class: 'axis', x1: x, x2: x, y1: 64, y2: 67 }));
    const side = place < 0.01 ? 'start' : place > 0.99 ? 'end' : 'middle';
    const text = element('text', { class: `tick ${side}`, x, y: 75 });
    text.textContent = Number(value.toPrecision(1));
    svg.append(text);
  }
  const name = element('text', { class: 'tick middle', x: 124, y: 86 });
  name.textContent = 'ΔE of a pixel; height: share of the error';
  svg.append(name);
  byId('quartiles').textContent = quartiles.length
    ? `Quartiles of the error: ${quartiles.map(short).join(', ')}` : 'There is no error.';
}

const rgb = ({ pixels, width }, x, y) => [0, 1, 2].map((c) => pixels[3 * (y * width + x) + c]);

export function pixelWords(shown, x, y) {
  const { truth, made, errors } = shown, whole = errors !== null;
  return {
    truth: rgb(truth, x, y).map(short).join(' '),
    kernel: whole ? rgb(made, x, y).map(short).join(' ') : '-',
    error: whole ? short(errors[y * truth.width + x]) : '-',
  };
}

export function tellPixel(shown, drawn, { x, y }) {
  const [column, row] = [Math.floor(x), Math.floor(y)], { width, height } = shown.truth;
  if (!(column >= 0 && row >= 0 && column < width && row < height)) return;
  const words = pixelWords(shown, column, row);
  byId('pixel-place').textContent = `${column}, ${row}`;
  byId('pixel-truth').textContent = words.truth;
  byId('pixel-kernel').textContent = words.kernel;
  byId('pixel-error').textContent = words.error;
  drawLoupe(byId('loupe-truth'), drawn.truth, column, row);
  drawLoupe(byId('loupe-kernel'), drawn.kernel, column, row);
}

export function listPins(pins, shown, remove) {
  byId('pins').replaceChildren(...pins.map((pin, k) => {
    const item = document.createElement('li'), button = document.createElement('button');
    const words = pixelWords(shown, pin.x, pin.y);
    item.textContent = `${pin.x}, ${pin.y}: ΔE ${words.error}; truth ${words.truth}; kernel ${words.kernel} `;
    button.textContent = 'Remove';
    button.setAttribute('aria-label', `Remove pin ${k + 1}`);
    button.addEventListener('click', () => remove(k));
    item.append(button);
    return item;
  }));
}

export function drawWorst(shown, drawn, go) {
  const { errors, mask, truth } = shown, list = byId('worst');
  const found = errors ? worstOf(errors, mask, truth.width, WORST, APART) : [];
  list.replaceChildren(...found.map(({ x, y, error }) => {
    const button = document.createElement('button'), words = document.createElement('span');
    button.className = 'inset';
    words.textContent = `ΔE ${short(error)}`;
    button.setAttribute('aria-label', `Go to pixel ${x}, ${y}, Delta E ${short(error)}: truth, then kernel`);
    for (const name of ['truth', 'kernel']) {
      const canvas = document.createElement('canvas');
      Object.assign(canvas, { width: 72, height: 72 });
      drawLoupe(canvas, drawn[name], x, y);
      button.append(canvas);
    }
    button.append(words);
    button.addEventListener('click', () => go(x, y));
    return button;
  }));
}
