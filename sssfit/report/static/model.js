// The data of the page, decoded once when it is needed, and a kernel's picture by its passes.

import { pictureOf, inflated, numbersOf, textOf } from './half.js';
import { differences } from './colour.js';
import { figuresOf } from './figures.js';
import { truthOf } from './truth.js';

export const TIMES = [0.5, 1, 2, 3]; // how many times as large pixels of flat pictures may be

export class Model {
  constructor(data, passes) {
    Object.assign(this, { data, passes, kept: new Map(), lit: null });
    this.kernels = new Map(data.kernels.map((each) => [each.label, each]));
    this.pictures = new Map(data.pictures.map((each) => [each.key, each]));
  }

  // Without WebGL2 only some kernels have a picture, all on the first lit scene.
  get names() {
    const drawn = Object.keys(this.data.drawn);
    const best = this.data.front.at(-1) ?? this.data.kernels[0].label;
    return this.passes
      ? { all: [...this.kernels.keys()], first: best }
      : { all: drawn, first: drawn.at(-1) };
  }

  get keys() { return this.passes ? [...this.pictures.keys()] : [this.data.pictures[0].key]; }

  get sizes() { return this.passes ? TIMES : [1]; }

  // Kernels of the front that can be shown, cheapest first.
  get front() { return this.data.front.filter((each) => this.names.all.includes(each)); }

  once(key, make) {
    if (!this.kept.has(key)) this.kept.set(key, make());
    return this.kept.get(key);
  }

  picture(key) {
    return this.once(`picture ${key}`, async () => {
      const { irradiance, truth, mask } = this.pictures.get(key);
      const [light, true_, counts] = await Promise.all([pictureOf(irradiance), pictureOf(truth), inflated(mask)]);
      return { light, truth: true_, mask: counts };
    });
  }

  profile() {
    return this.once('profile', async () => {
      const { radii, densities, reflectance } = this.data.profile;
      const [edges, values] = await Promise.all([numbersOf(radii), numbersOf(densities)]);
      return { radii: edges, densities: values, reflectance, channels: reflectance.length };
    });
  }

  isFlat({ picture }) { return this.pictures.get(picture).distance === null; }

  // Pixels of flat pictures may be larger; those of a head have pictures of their own.
  mmOf(state) {
    const { mm_per_pixel: mm } = this.pictures.get(state.picture);
    return this.isFlat(state) ? mm * state.times : mm;
  }

  // Light, mask and truth; the latter is computed here for pixels that the page has no truth for.
  async seen(state) {
    const own = await this.picture(state.picture), mm = this.mmOf(state);
    const { mm_per_pixel: made, border } = this.pictures.get(state.picture);
    if (mm === made) return own;
    const truth = await this.once(`truth ${state.picture} ${mm}`, async () => truthOf(await this.profile(), own.light, mm, border));
    return { ...own, truth };
  }

  text(label, form) {
    const { texts, jittered } = this.kernels.get(label);
    return this.once(`${form} ${label}`, () => textOf(form === 'jittered' ? jittered : texts[form]));
  }

  // The picture by a kernel at the settings of a state, with its milliseconds where it was drawn here.
  async rendered(state) {
    const { light } = await this.picture(state.picture);
    if (!this.passes) return { ...await this.once(`drawn ${state.kernel}`, () => pictureOf(this.data.drawn[state.kernel])) };
    const kernel = this.kernels.get(state.kernel), moves = Boolean(state.jitter && kernel.jittered);
    const source = await this.text(state.kernel, moves ? 'jittered' : 'glsl');
    const { border } = this.pictures.get(state.picture), mm = this.mmOf(state);
    if (this.lit !== state.picture) this.passes.setLight(light, border);
    this.lit = state.picture;
    const plan = moves ? kernel.jitter_plan : kernel.plan;
    const show = plan.some(({ writes }) => writes.includes(state.show)) ? state.show : 'M0';
    return this.passes.run(source, plan, {
      mm, format: state.format, frames: state.frames, albedo: kernel.albedo, show,
    });
  }

  // Everything that is shown at a state: pictures, errors and figures.
  async shown(state) {
    const { light, truth, mask } = await this.seen(state);
    const made = await this.rendered(state), exposure = this.exposure(state);
    const whole = made.width === truth.width;
    const errors = whole ? differences(made.pixels, truth.pixels, exposure) : null;
    const unblurred = { ...light, pixels: light.pixels.map((each, k) => each * this.albedo(state)[k % 3]) };
    return { truth, made, unblurred, mask, errors, exposure, figures: errors && figuresOf(errors, mask) };
  }

  // The light that no blur would show has the material's colour, as all other pictures have.
  albedo({ kernel }) {
    const { albedo } = this.kernels.get(kernel);
    return [0, 1, 2].map((c) => albedo[c % albedo.length]);
  }

  exposure({ picture, stops }) { return this.pictures.get(picture).exposure * 2 ** stops; }
}
