const LIST = /^\/\/ call .*\r?\n((?:\/\/ .* \d+\r?\n)*)/m;
const ROW = /^\/\/ (SSS_\w+)(?:\((\d+)(?:, (x|y|[\d.]+ deg))?\))? +(.+?) {2,}(\w+) +1(?:\/(\d+))? +\d+$/;
const OTHER = /uint (?:frame|profile)\b|vec2 mm_per_pixel|\bD0\b/;

export function passesOf(source) {
  const rows = (LIST.exec(source)?.[1] ?? '').split(/\r?\n/).filter(Boolean);
  const fault = rows.length ? rows.find((row) => !ROW.test(row)) ?? OTHER.exec(source)?.[0] : 'no list of passes';
  if (fault) throw new Error(`This script cannot draw an export with "${fault}"; docs/integrate.md says which it can.`);
  return rows.map((row) => ROW.exec(row)).map(([, name, stage, axis, reads, writes, size]) =>
    ({ name, stage, axis, reads: reads.split(' '), writes, size: Number(size ?? 1) }));
}

export function fragmentOf(source, { name, stage, axis, reads }) {
  const takesMm = new RegExp(`vec4 ${name}\\([^)]*mm_per_pixel`).test(source);
  const angle = ({ x: 0, y: 90 }[axis] ?? parseFloat(axis)) * Math.PI / 180;
  const words = [
    ...(stage ? [`${stage}u`] : []), ...(axis ? [`vec2(${Math.cos(angle).toFixed(9)}, ${Math.sin(angle).toFixed(9)})`] : []),
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
