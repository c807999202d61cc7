import { HalfFloatType, WebGLRenderTarget, RawShaderMaterial, GLSL3, Vector2 } from 'three';
import { FullScreenQuad } from 'three/addons/postprocessing/Pass.js';
import { passesOf, fragmentOf } from './passes.js';

export function split(material, skin) {
  const light = skin ? 'sssLight = vec4(totalDiffuse, 1.0); outgoingLight -= totalDiffuse;' : 'sssLight = vec4(0.0);';
  material.customProgramCacheKey = () => light;
  material.onBeforeCompile = (shader) => {
    const patched = shader.fragmentShader.replace('#include <opaque_fragment>', `${light}\n#include <opaque_fragment>`);
    shader.fragmentShader = `layout(location = 1) out highp vec4 sssLight;\n${patched}`;
  };
}

const VERTEX = 'in vec3 position; void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }';

export class Scattering {
  constructor(source) { // an export in GLSL with --coverage
    this.quad = new FullScreenQuad();
    this.passes = passesOf(source).map((pass) => ({
      ...pass,
      target: new WebGLRenderTarget(1, 1, { type: HalfFloatType, depthBuffer: false }),
      material: new RawShaderMaterial({
        glslVersion: GLSL3, vertexShader: VERTEX, fragmentShader: fragmentOf(source, pass), depthTest: false, depthWrite: false,
        uniforms: Object.fromEntries([['texel', { value: new Vector2() }], ['mm_per_pixel', { value: 0 }],
          ...pass.reads.map((_, k) => [`t${k}`, { value: null }])]),
      }),
    }));
  }

  render(renderer, light, width, height, mmPerPixel) { // light: the second texture; returns M0
    const pictures = { E: { texture: light, width, height } };
    for (const { material, target, reads, writes, size } of this.passes) {
      target.setSize(Math.ceil(width / size), Math.ceil(height / size));
      material.uniforms.texel.value.set(1 / pictures[reads[0]].width, 1 / pictures[reads[0]].height);
      material.uniforms.mm_per_pixel.value = mmPerPixel;
      reads.forEach((name, k) => { material.uniforms[`t${k}`].value = pictures[name].texture; });
      this.quad.material = material;
      renderer.setRenderTarget(target);
      this.quad.render(renderer);
      pictures[writes] = target;
    }
    return pictures.M0.texture;
  }
}
