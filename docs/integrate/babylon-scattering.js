import { Constants, EffectRenderer, EffectWrapper, PostProcess, RenderTargetTexture, ShaderStore, Texture } from '@babylonjs/core';
import { passesOf, fragmentOf } from './passes.js';

export function scatter(scene, source, light, add, mmPerPixel) { // source: with --coverage; light, add: as below
  const engine = scene.getEngine();
  const [width, height] = [engine.getRenderWidth(), engine.getRenderHeight()];
  const drawing = new EffectRenderer(engine);
  const irradiance = Constants.PREPASS_IRRADIANCE_LEGACY_TEXTURE_TYPE ?? Constants.PREPASS_IRRADIANCE_TEXTURE_TYPE; // new, old
  const prepass = (type) => scene.prePassRenderer.getRenderTarget().textures[scene.prePassRenderer.getIndex(type)];
  const pictures = {};
  const passOf = (reads, writes, size, fragmentShader) => {
    const target = new RenderTargetTexture(writes, { width: Math.ceil(width / size), height: Math.ceil(height / size) }, scene,
      { type: Constants.TEXTURETYPE_HALF_FLOAT, samplingMode: Texture.BILINEAR_SAMPLINGMODE, generateDepthBuffer: false });
    target.wrapU = target.wrapV = Texture.CLAMP_ADDRESSMODE;
    pictures[writes] = target;
    const pass = new EffectWrapper({ engine, name: writes, fragmentShader: `#version 300 es\n${fragmentShader}`,
      uniformNames: ['texel', 'mm_per_pixel'], samplerNames: reads.map((_, k) => `t${k}`) });
    pass.onApplyObservable.add(() => {
      const { width: across, height: down } = pictures[reads[0]]?.renderTarget ?? { width, height };
      pass.effect.setFloat2('texel', 1 / across, 1 / down);
      pass.effect.setFloat('mm_per_pixel', mmPerPixel);
      reads.forEach((name, k) => pass.effect.setTexture(`t${k}`, pictures[name] ?? prepass(irradiance)));
    });
    return () => drawing.render(pass, target);
  };
  const draws = [passOf(['irradiance'], 'E', 1, light),
    ...passesOf(source).map((pass) => passOf(pass.reads, pass.writes, pass.size, fragmentOf(source, pass)))];

  ShaderStore.ShadersStore.sssAddFragmentShader = add;
  const last = new PostProcess('sss', 'sssAdd', [], ['scattered', 'rootAlbedo'], 1, null, Texture.BILINEAR_SAMPLINGMODE, engine);
  last.autoClear = false;
  last.onActivateObservable.add(() => draws.forEach((draw) => draw()));
  last.onApplyObservable.add((effect) => {
    effect.setTexture('scattered', pictures.M0);
    effect.setTexture('rootAlbedo', prepass(Constants.PREPASS_ALBEDO_SQRT_TEXTURE_TYPE));
  });
  scene.enableSubSurfaceForPrePass().postProcess = last; // in place of the built-in blur
}
