// What is shown, and the address's hash that holds it.

const DEFAULTS = {
  kernel: '', picture: '', mode: 'swipe', pane: 'kernel', stops: 0, gain: 1, format: 'half', jitter: 0,
  frames: 1, show: 'M0', times: 1, zoom: 1, x: 0.5, y: 0.5, split: 0.5, pins: '',
};
const MODES = ['swipe', 'flicker', 'side', 'single'];
export const PANES = ['truth', 'kernel', 'difference', 'unblurred'];
const LIMITS = {
  stops: [-8, 8], gain: [0.25, 64], jitter: [0, 1], frames: [1, 16], times: [0, 100], zoom: [1, 64], x: [0, 1], y: [0, 1], split: [0, 1],
};

// The state of a hash; what is missing, unknown or out of range is as by default.
export function stateOf(hash, kernels, pictures, sizes) {
  const given = new URLSearchParams(hash.replace(/^#/, '')), state = { ...DEFAULTS };
  for (const [key, value] of given) {
    if (!(key in DEFAULTS)) continue;
    const number = Number(value), limits = LIMITS[key];
    if (!limits) state[key] = value;
    else if (value !== '' && number >= limits[0] && number <= limits[1]) state[key] = number;
  }
  const known = (value, all, otherwise) => (all.includes(value) ? value : otherwise);
  state.times = known(state.times, sizes, DEFAULTS.times);
  state.kernel = known(state.kernel, kernels.all, kernels.first);
  state.picture = known(state.picture, pictures, pictures[0]);
  state.mode = known(state.mode, MODES, DEFAULTS.mode);
  state.pane = known(state.pane, PANES, DEFAULTS.pane);
  return state;
}

export function hashOf(state) {
  const said = Object.entries(state).filter(([key, value]) => value !== DEFAULTS[key]);
  return `#${new URLSearchParams(said.map(([k, v]) => [k, typeof v === 'number' ? String(Number(v.toFixed(4))) : v]))}`;
}

export const pinsOf = ({ pins }) => pins.split('_').map((each) => each.split('-').map(Number))
  .filter(([x, y]) => Number.isInteger(x) && Number.isInteger(y)).map(([x, y]) => ({ x, y }));

export const pinsText = (pins) => pins.map(({ x, y }) => `${x}-${y}`).join('_');
