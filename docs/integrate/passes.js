const ROW = /^\/\/ (SSS_\w+)(?:\((\d+), ([xy])\))? +(.+?) {2,}(\w+) +1(?:\/(\d+))? +\d+$/gm;

export const passesOf = (source) => [...source.matchAll(ROW)].map(
  ([, name, stage, axis, reads, writes, size]) =>
    ({ name, stage, axis, reads: reads.split(' '), writes, size: Number(size ?? 1) }));

export function fragmentOf(source, { name, stage, axis, reads }) {
  const takesMm = new RegExp(`vec4 ${name}\\([^)]*mm_per_pixel`).test(source);
  const words = [
    ...(axis ? [`${stage}u`, axis === 'x' ? 'vec2(1.0, 0.0)' : 'vec2(0.0, 1.0)'] : []),
    ...reads.map((_, k) => `t${k}`), 'gl_FragCoord.xy', 'texel', ...(takesMm ? ['mm_per_pixel'] : []),
  ];
  return `precision highp float;
precision highp int;
precision highp sampler2D;
${reads.map((_, k) => `uniform sampler2D t${k};`).join('\n')}
uniform vec2 texel;
uniform float mm_per_pixel;
out vec4 made;
${source}
void main() { made = ${name}(${words.join(', ')}); }`;
}
