// The page: controls change the state, the state is drawn and kept in the address.

import { Passes } from './passes.js';
import { PANES, stateOf, hashOf, pinsOf, pinsText } from './state.js';
import { copy, startTables } from './tables.js';
import { startCharts } from './charts.js';
import { Pane, drawnErrors, drawnLight } from './view.js';
import { exrOf } from './exr.js';
import { Model } from './model.js';
import { drawHistogram, drawWorst, listPins, pixelWords, short, tellFigures, tellPixel } from './panel.js';
import { get, fillControls, startControls, startKeys } from './controls.js';

const FLICKER = 600; // ms that a picture stays

class Page {
  constructor() {
    const data = JSON.parse(get('data').textContent), passes = Passes.on(document.createElement('canvas'));
    this.model = new Model(data, passes);
    get('no-webgl').hidden = passes !== null;
    const handlers = {
      zoom: (factor, x, y) => this.zoom(factor, x, y),
      pan: (x, y) => this.change({ x, y }),
      split: (split) => { this.change({ split }); get('split').value = this.state.split; },
      hover: (at) => this.look(at),
      click: (at) => this.pin(at),
      focus: (pane) => pane.canvas.focus({ preventScroll: true }),
    };
    this.panes = new Map([...document.querySelectorAll('canvas.pane')].map((each) => [each.dataset.pane, new Pane(each, handlers)]));
    this.single = new Pane(get('single'), handlers);
    this.mark = startCharts((label) => this.model.names.all.includes(label) && this.change({ kernel: label }));
    this.readHash();
    startTables(get('status'));
    startControls(this);
    startKeys(this);
    window.addEventListener('hashchange', () => { this.readHash(); this.update(); });
    new ResizeObserver(() => this.draw()).observe(get('stage'));
    setInterval(() => this.flick(), FLICKER);
    this.update();
  }

  readHash() { this.state = stateOf(location.hash, this.model.names, this.model.keys, this.model.sizes); }

  change(given) {
    Object.assign(this.state, given);
    for (const key of ['x', 'y', 'split']) this.state[key] = Math.min(Math.max(this.state[key], 0), 1);
    history.replaceState(null, '', hashOf(this.state));
    const views = ['x', 'y', 'zoom', 'split', 'mode', 'pane', 'pins'];
    return Object.keys(given).every((key) => views.includes(key)) ? this.draw() : this.update();
  }

  // Renders again; where the state changed meanwhile, only the newest is shown.
  async update() {
    const turn = this.turn = (this.turn ?? 0) + 1;
    fillControls(this);
    document.body.dataset.busy = 'true';
    try {
      const shown = await this.model.shown({ ...this.state });
      if (turn !== this.turn) return;
      this.shown = shown;
      this.paint();
    } catch (error) {
      get('status').textContent = `The kernel cannot be drawn: ${error.message}`;
      throw error;
    } finally {
      if (turn === this.turn) document.body.dataset.busy = 'false';
    }
  }

  paint() {
    const { truth, made, unblurred, errors, exposure } = this.shown, { width, height } = truth;
    this.drawn = {
      truth: drawnLight(truth, exposure),
      kernel: drawnLight(made, exposure),
      difference: drawnErrors(errors ?? new Float32Array(width * height), width, height, this.state.gain),
      unblurred: drawnLight(unblurred, exposure),
    };
    tellFigures(this.shown, this.model.kernels.get(this.state.kernel));
    drawHistogram(this.shown.figures);
    drawWorst(this.shown, this.drawn, (x, y) => this.change({ zoom: 12, x: (x + 0.5) / width, y: (y + 0.5) / height }));
    this.mark(this.state.kernel);
    this.look(this.seen ?? { x: width / 2, y: height / 2 });
    this.draw();
  }

  look(at) {
    this.seen = at;
    if (this.shown) tellPixel(this.shown, this.drawn, at);
  }

  layer(name, from) {
    const { truth, made, unblurred, errors } = this.shown, light = { truth, kernel: made, unblurred }[name];
    const values = (x, y) => (name === 'difference' ? [pixelWords(this.shown, x, y).error]
      : light.width === truth.width ? [0, 1, 2].map((c) => short(light.pixels[3 * (y * truth.width + x) + c])) : []);
    const isKnown = name !== 'difference' || errors !== null;
    return { drawn: this.drawn[name], from, values: isKnown ? values : null };
  }

  draw() {
    if (!this.shown) return;
    const { mode, pane, split } = this.state, pins = this.pins();
    get('stage').dataset.mode = mode;
    const names = mode === 'swipe' ? ['truth', pane === 'truth' ? 'kernel' : pane] : [mode === 'flicker' && this.isOdd ? 'truth' : pane];
    if (mode === 'side') {
      for (const [name, each] of this.panes) each.show([{ ...this.layer('truth'), ...this.layer(name) }], this.state, pins);
    } else {
      this.single.show(names.map((name, k) => this.layer(name, k === 0 ? undefined : split)), this.state, pins);
    }
    const title = { truth: 'Truth', kernel: this.state.kernel, difference: 'Difference', unblurred: 'No blur' };
    get('single-title').textContent = names.map((each) => title[each]).join(' ◂ ▸ ');
    listPins(pins, this.shown, (k) => this.change({ pins: pinsText(pins.filter((_, own) => own !== k)) }));
    document.body.dataset.drawn = String((Number(document.body.dataset.drawn) || 0) + 1);
  }

  flick() {
    if (this.state.mode !== 'flicker' || document.hidden || get('pause').checked) return;
    this.isOdd = !this.isOdd;
    this.draw();
  }

  pins() {
    const { width, height } = this.shown.truth;
    return pinsOf(this.state).filter(({ x, y }) => x < width && y < height);
  }

  pin({ x, y }) {
    const { width, height } = this.shown.truth, at = { x: Math.floor(x), y: Math.floor(y) };
    if (at.x < 0 || at.y < 0 || at.x >= width || at.y >= height) return;
    this.look(at);
    this.change({ pins: pinsText([...this.pins(), at].slice(-9)) });
  }

  zoom(factor, x = this.state.x, y = this.state.y) {
    const zoom = Math.min(Math.max(this.state.zoom * factor, 1), 64), kept = this.state.zoom / zoom;
    if (zoom === 1) return this.change({ zoom, x: 0.5, y: 0.5 });
    return this.change({ zoom, x: x + (this.state.x - x) * kept, y: y + (this.state.y - y) * kept });
  }

  // Keys 1 to 4 show one picture alone; 5 to 9 are kernels of the front, from the cheapest.
  flip(number) {
    if (number <= PANES.length) return this.change({ mode: 'single', pane: PANES[number - 1] });
    const kernel = this.model.front[number - PANES.length - 1];
    return kernel ? this.change({ mode: 'single', pane: 'kernel', kernel }) : undefined;
  }

  async export(form, button) {
    const text = await this.model.text(this.state.kernel, form);
    get('export-text').textContent = text;
    if (button) await copy(text, button, get('status'));
  }

  download(name) {
    const { truth, made, unblurred, errors } = this.shown;
    const difference = errors && { ...truth, pixels: Float32Array.from(truth.pixels, (_, k) => errors[Math.floor(k / 3)]) };
    const chosen = { truth, kernel: made, unblurred, difference }[name];
    if (!chosen) return void (get('status').textContent = 'A picture between the passes has no difference; show the result.');
    const { pixels, width, height } = chosen;
    const link = document.createElement('a');
    link.href = URL.createObjectURL(exrOf(pixels, width, height));
    link.download = `${this.state.picture}-${name === 'kernel' ? this.state.kernel.replace(/[^\w.-]+/g, '-') : name}.exr`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
    get('status').textContent = `Wrote ${link.download}.`;
  }
}

new Page();
