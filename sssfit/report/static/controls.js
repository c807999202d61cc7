// The controls: each sets a part of the state, and shows it when the state changes by other ways.

import { SCALE_END } from './colour.js';

export const get = (id) => document.getElementById(id);
const NUMBERS = ['stops', 'gain', 'frames', 'split'];

const option = (value, words) => Object.assign(document.createElement('option'), { value, textContent: words });

function fill(select, options, value) {
  select.replaceChildren(...options.map(([key, words]) => option(key, words)));
  select.value = value;
  select.disabled = options.length < 2;
}

// Kernels of the front first, then the others.
function fillKernels(select, { data, names, kernels }, value) {
  const groups = [['On the Pareto front', (each) => data.front.includes(each)], ['Others', (each) => !data.front.includes(each)]];
  select.replaceChildren(...groups.map(([label, belongs]) => {
    const group = Object.assign(document.createElement('optgroup'), { label });
    group.append(...names.all.filter(belongs).map((each) => option(each, `${each} · ${kernels.get(each).fetches.toPrecision(3)} fetches`)));
    return group;
  }).filter((group) => group.children.length));
  select.value = value;
}

function stageWords(name, kernel) {
  if (name === 'M0') return 'the result';
  const label = kernel.plan.find(({ writes }) => writes.includes(name)).label;
  return `${name}: ${label}`;
}

// A head is at some distances; pixels of a flat picture can have any size.
function fillDistances(model, picture, same, state) {
  const isFlat = model.isFlat(state);
  const sizes = model.sizes.map((each) => [String(each), `${Number((each * picture.mm_per_pixel).toPrecision(3))} mm a pixel`]);
  const distances = [...new Set(same.map(({ distance }) => distance))].map((each) => [String(each), metres(each)]);
  fill(get('distance'), isFlat ? sizes : distances, String(isFlat ? state.times : picture.distance));
}

// The dearest kernel of the front that takes no more fetches than the one shown.
function fillFetches({ front, kernels }, { fetches }) {
  const within = front.filter((each) => kernels.get(each).fetches <= fetches);
  Object.assign(get('most'), { max: front.length - 1, value: Math.max(within.length - 1, 0), disabled: front.length < 2 });
  get('most-words').textContent = `${fetches.toPrecision(3)} a pixel`;
}

const lightWords = (degrees) => (degrees === null ? '-' : degrees === 0 ? 'from the front' : `${degrees}° to the left`);

const metres = (mm) => `${(mm / 1000).toFixed(1)} m`;

export function fillControls({ model, state }) {
  const kernel = model.kernels.get(state.kernel), picture = model.pictures.get(state.picture);
  const all = model.keys.map((key) => model.pictures.get(key)), same = all.filter((each) => each.name === picture.name);
  fillKernels(get('kernel'), model, state.kernel);
  const distinct = (list, key) => [...new Set(list.map((each) => each[key]))];
  fill(get('scene'), distinct(all, 'name').map((each) => [each, each]), picture.name);
  fill(get('light'), distinct(same, 'light').map((each) => [String(each), lightWords(each)]), String(picture.light));
  fillDistances(model, picture, same, state);
  fillFetches(model, kernel);
  fill(get('format'), (model.passes?.formats ?? ['half']).map((each) => [each, each]), state.format);
  const shows = model.passes ? kernel.plan.flatMap(({ writes }) => writes) : ['M0'];
  fill(get('show'), [...new Set(['M0', ...shows])].map((each) => [each, stageWords(each, kernel)]), shows.includes(state.show) ? state.show : 'M0');
  get('jitter').checked = state.jitter === 1;
  get('jitter').disabled = !model.passes || !kernel.jittered;
  get('frames').disabled = !model.passes;
  for (const id of NUMBERS) get(id).value = state[id];
  get('stops-words').textContent = `${state.stops > 0 ? '+' : ''}${state.stops} stops`;
  get('frames-words').textContent = String(state.frames);
  get('gain-words').textContent = `× ${state.gain}`;
  get('scale-end').textContent = `${Number((SCALE_END / state.gain).toPrecision(3))} and more`;
  for (const each of document.querySelectorAll('input[name=mode]')) each.checked = each.value === state.mode;
  for (const each of document.querySelectorAll('input[name=pane]')) each.checked = each.value === state.pane;
  get('command').textContent = kernel.command;
  get('structure').textContent = `${kernel.method}, stages ${kernel.structure}`;
  get('export-kernel').textContent = state.kernel;
}

// The picture of a scene with a light and a distance, or the nearest to it that there is.
function pictureFor(model, wanted) {
  const all = model.keys.map((key) => model.pictures.get(key)).filter(({ name }) => name === wanted.scene);
  const fits = (each) => (String(each.light) === wanted.light) + (String(each.distance) === wanted.distance);
  return all.reduce((best, each) => (fits(each) > fits(best) ? each : best)).key;
}

export function startControls(page) {
  const on = (id, change) => get(id).addEventListener('input', (event) => change(event.target));
  on('kernel', ({ value }) => page.change({ kernel: value, show: 'M0' }));
  on('most', ({ value }) => page.change({ kernel: page.model.front[Number(value)], show: 'M0' }));
  const chosen = () => ({ scene: get('scene').value, light: get('light').value, distance: get('distance').value });
  for (const id of ['scene', 'light']) on(id, () => page.change({ picture: pictureFor(page.model, chosen()) }));
  on('distance', ({ value }) => page.change(page.model.isFlat(page.state)
    ? { times: Number(value) } : { picture: pictureFor(page.model, chosen()) }));
  for (const id of ['format', 'show']) on(id, ({ value }) => page.change({ [id]: value }));
  for (const id of NUMBERS) on(id, ({ value }) => page.change({ [id]: Number(value) }));
  on('jitter', ({ checked }) => page.change({ jitter: Number(checked) }));
  for (const name of ['mode', 'pane']) {
    for (const each of document.querySelectorAll(`input[name=${name}]`)) each.addEventListener('change', () => page.change({ [name]: each.value }));
  }
  const click = (id, act) => get(id).addEventListener('click', act);
  click('zoom-in', () => page.zoom(1.5));
  click('zoom-out', () => page.zoom(1 / 1.5));
  click('fit', () => page.change({ zoom: 1, x: 0.5, y: 0.5 }));
  click('pin', () => page.pin({ x: page.state.x * page.shown.truth.width, y: page.state.y * page.shown.truth.height }));
  for (const each of document.querySelectorAll('[data-download]')) each.addEventListener('click', () => page.download(each.dataset.download));
  for (const each of document.querySelectorAll('[data-export]')) each.addEventListener('click', () => page.export(each.dataset.export, each));
}

const TYPED = ['INPUT', 'SELECT', 'TEXTAREA'];

export function startKeys(page) {
  const stops = (by) => page.change({ stops: Math.min(Math.max(page.state.stops + by, -8), 8) });
  const step = (x, y) => page.change({ x: page.state.x + x / (8 * page.state.zoom), y: page.state.y + y / (8 * page.state.zoom) });
  const keys = {
    e: () => stops(-0.5), E: () => stops(0.5), '+': () => page.zoom(1.5), '-': () => page.zoom(1 / 1.5), 0: () => page.change({ zoom: 1, x: 0.5, y: 0.5 }),
    p: () => get('pin').click(), t: () => page.flip(1),
    s: () => page.change({ mode: 'swipe', pane: 'kernel' }), f: () => page.change({ mode: 'flicker', pane: 'kernel' }), b: () => page.change({ mode: 'side' }),
  };
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || TYPED.includes(event.target.tagName)) return;
    const act = /^[1-9]$/.test(event.key) ? () => page.flip(Number(event.key)) : keys[event.key];
    const arrow = event.target.tagName === 'CANVAS' && arrows[event.key];
    if (!act && !arrow) return;
    event.preventDefault();
    if (act) act();
    else step(...arrow);
  });
}
