// The exported GLSL itself, pass by pass, on half float textures of WebGL2.

const VERTEX = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0), 0.0, 1.0); }`;

// What pictures between passes can be stored as: internal format, format and type of WebGL2.
const FORMATS = {
  half: ['RGBA16F', 'RGBA', 'HALF_FLOAT'],
  float32: ['RGBA32F', 'RGBA', 'FLOAT'],
  r11g11b10: ['R11F_G11F_B10F', 'RGB', 'FLOAT'],
  rgba8: ['RGBA8', 'RGBA', 'UNSIGNED_BYTE'],
};
const ONE = 0x3c00; // of half floats
const TIMED = 5; // runs of which the milliseconds are the median

function fragment(source, { call, reads, writes }) {
  const outs = writes.map((_, k) => `layout(location = ${k}) out vec4 out${k};`).join('\n');
  const body = writes.length === 1 ? `out0 = ${call};`
    : `SSS_Terms all = ${call}; ${writes.map((_, k) => `out${k} = all.term[${k}];`).join(' ')}`;
  return `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
${source}
${reads.map((_, k) => `uniform sampler2D t${k};`).join('\n')}
uniform vec2 texel;
uniform float mm;
uniform uint frame;
${outs}
void main() { vec2 position = gl_FragCoord.xy; ${body} }`;
}

export class Passes {
  constructor(gl) {
    this.gl = gl;
    this.programs = new Map();
    this.targets = new Map();
    this.light = null;
    this.attachments = gl.getParameter(gl.MAX_COLOR_ATTACHMENTS);
    gl.getExtension('OES_texture_float_linear');
    gl.getExtension('EXT_float_blend');
  }

  // Passes on a new context, or null where the browser has none that renders to half floats.
  static on(canvas) {
    const gl = canvas.getContext('webgl2', { antialias: false, depth: false });
    return gl && gl.getExtension('EXT_color_buffer_float') ? new Passes(gl) : null;
  }

  get formats() {
    const floats = this.gl.getExtension('OES_texture_float_linear') && this.gl.getExtension('EXT_float_blend');
    return Object.keys(FORMATS).filter((each) => each !== 'float32' || floats);
  }

  texture(width, height, [inside, format, type], border, data = null) {
    const { gl } = this, made = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, made);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl[inside], width, height, 0, gl[format], gl[type], data);
    const wrap = border === 'mirror' ? gl.MIRRORED_REPEAT : gl.CLAMP_TO_EDGE;
    for (const each of ['WRAP_S', 'WRAP_T']) gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_${each}`], wrap);
    for (const each of ['MIN_FILTER', 'MAG_FILTER']) gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_${each}`], gl.LINEAR);
    return { texture: made, width, height };
  }

  // Lights the passes with a picture of irradiance, in half floats with a coverage of 1.
  setLight({ width, height, channels, bits }, border) {
    const data = new Uint16Array(4 * width * height).fill(ONE);
    for (let i = 0; i < width * height; i++) {
      for (let c = 0; c < 3; c++) data[4 * i + c] = bits[i * channels + c % channels];
    }
    for (const each of [this.light, ...this.targets.values()]) if (each) this.gl.deleteTexture(each.texture);
    this.targets.clear();
    this.border = border;
    this.light = this.texture(width, height, FORMATS.half, border, data);
  }

  program(source, pass) {
    const { gl } = this, key = `${pass.call}|${pass.writes.length}|${source}`;
    if (this.programs.has(key)) return this.programs.get(key);
    const program = gl.createProgram();
    for (const [kind, text] of [['VERTEX_SHADER', VERTEX], ['FRAGMENT_SHADER', fragment(source, pass)]]) {
      const shader = gl.createShader(gl[kind]);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    this.programs.set(key, program);
    return program;
  }

  // The result is kept in half floats at least, whatever lies between the passes.
  target(name, level, format) {
    const kind = name === 'M0' && format !== 'float32' ? 'half' : format, key = `${name} ${level} ${kind}`;
    if (!this.targets.has(key)) {
      const [width, height] = [this.light.width, this.light.height].map((side) => Math.ceil(side / 2 ** level));
      this.targets.set(key, this.texture(width, height, FORMATS[kind], this.border));
    }
    return this.targets.get(key);
  }

  draw(source, pass, pictures, format, mm, frame) {
    const { gl } = this, program = this.program(source, pass);
    const targets = pass.writes.map((name) => this.target(name, pass.level, format));
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.buffer ??= gl.createFramebuffer());
    for (let k = 0; k < this.attachments; k++) {
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + k, gl.TEXTURE_2D, targets[k]?.texture ?? null, 0);
    }
    gl.drawBuffers(targets.map((_, k) => gl.COLOR_ATTACHMENT0 + k));
    gl.viewport(0, 0, targets[0].width, targets[0].height);
    gl.useProgram(program);
    const first = pictures.get(pass.reads[0]);
    gl.uniform2f(gl.getUniformLocation(program, 'texel'), 1 / first.width, 1 / first.height);
    gl.uniform1f(gl.getUniformLocation(program, 'mm'), mm);
    gl.uniform1ui(gl.getUniformLocation(program, 'frame'), frame);
    pass.reads.forEach((name, k) => {
      gl.activeTexture(gl.TEXTURE0 + k);
      gl.bindTexture(gl.TEXTURE_2D, pictures.get(name).texture);
      gl.uniform1i(gl.getUniformLocation(program, `t${k}`), k);
    });
    if (pass.added) { gl.enable(gl.BLEND); gl.blendFunc(gl.ONE, gl.ONE); }
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.BLEND);
    pass.writes.forEach((name, k) => pictures.set(name, targets[k]));
  }

  drawAll(source, plan, format, mm, frame) {
    const pictures = new Map([['E', this.light]]);
    for (const pass of plan) this.draw(source, pass, pictures, format, mm, frame);
    return pictures;
  }

  // Four floats a pixel of a picture.
  read({ texture, width, height }, columns = width, rows = height) {
    const { gl } = this, found = new Float32Array(4 * columns * rows);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.reader ??= gl.createFramebuffer());
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    const type = gl.getParameter(gl.IMPLEMENTATION_COLOR_READ_TYPE);
    if (type === gl.UNSIGNED_BYTE) {
      const bytes = new Uint8Array(found.length);
      gl.readPixels(0, 0, columns, rows, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
      return Float32Array.from(bytes, (each) => each / 255);
    }
    gl.readPixels(0, 0, columns, rows, gl.RGBA, gl.FLOAT, found);
    return found;
  }

  // The mean of some frames, or one picture between the passes; and the milliseconds of a frame.
  run(source, plan, { mm, format, frames, albedo, show }) {
    let sum = null, last = null;
    for (let frame = 0; frame < frames; frame++) {
      last = this.drawAll(source, plan, format, mm, frame);
      const found = this.read(last.get(show));
      sum = sum ? sum.map((each, k) => each + found[k]) : found;
    }
    const { width, height } = last.get(show), pixels = new Float32Array(3 * width * height);
    for (let i = 0; i < width * height; i++) {
      for (let c = 0; c < 3; c++) {
        pixels[3 * i + c] = sum[4 * i + c] * albedo[c % albedo.length] / frames;
      }
    }
    return { pixels, width, height, milliseconds: this.timed(source, plan, format, mm) };
  }

  timed(source, plan, format, mm) {
    const found = Array.from({ length: TIMED }, (_, k) => {
      const begun = performance.now();
      this.read(this.drawAll(source, plan, format, mm, k).get('M0'), 1, 1);
      return performance.now() - begun;
    });
    return found.sort((a, b) => a - b)[(TIMED - 1) / 2];
  }
}
