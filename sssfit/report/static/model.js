// The data of the page, decoded once when it is needed, and a kernel's picture by its passes.

import { pictureOf, inflated, textOf } from './half.js';
import { differences } from './colour.js';
import { figuresOf } from './figures.js';

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
    const { border, mm_per_pixel: mm } = this.pictures.get(state.picture);
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
    const { light, truth, mask } = await this.picture(state.picture);
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
