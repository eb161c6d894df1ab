"use strict";
// The block in three dimensions: WebGL 2 without a library. Every face that shows at some time is a
// triangle of a rigid body; the vertex shader moves it by the displacement and turn of its body.

const VERTEX = `#version 300 es
precision highp float;
precision highp sampler2D;
in vec3 arm;
in float body, breaks;
in vec3 edges;
uniform sampler2D motion, colours;
uniform mat3 turn;
uniform vec3 middle, scale;
uniform vec2 shift;
uniform float magnify, now;
out vec3 place, corner, colour;
flat out vec3 crack;
flat out float opened;
vec4 texel(sampler2D of, int k) { int w = textureSize(of, 0).x; return texelFetch(of, ivec2(k % w, k / w), 0); }
void main() {
  int k = int(body + 0.5);
  vec3 centre = texel(motion, 3 * k).xyz, moved = texel(motion, 3 * k + 1).xyz;
  vec3 turned = texel(motion, 3 * k + 2).xyz;
  float angle = length(turned), half_sine = sin(0.5 * angle);
  if (angle > 0.0) {
    vec3 axis = turned / angle;
    moved += sin(angle) * cross(axis, arm) + 2.0 * half_sine * half_sine * (axis * dot(axis, arm) - arm);
  }
  place = turn * (centre + arm + magnify * moved - middle);
  corner = vec3(gl_VertexID % 3 == 0, gl_VertexID % 3 == 1, gl_VertexID % 3 == 2);
  colour = texel(colours, k).rgb;
  crack = edges;
  opened = breaks;
  gl_Position = breaks > now ? vec4(2.0, 2.0, 2.0, 1.0) : vec4(place * scale + vec3(shift, 0.0), 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
precision highp sampler2D;
in vec3 place, corner, colour;
flat in vec3 crack;
flat in float opened;
uniform sampler2D table;
uniform vec3 crackColour, stone;
uniform float now, high, byFace, mesh, line;
out vec4 pixel;
vec3 ofTime(float time) { return texture(table, vec2(clamp(time / high, 0.002, 0.998), 0.5)).rgb; }
void main() {
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  float light = min(1.0, 0.72 + 0.34 * abs(dot(normal, vec3(-0.4, 0.1, 0.91))));
  vec3 shade = byFace > 0.5 ? (opened < 0.0 ? stone : ofTime(opened)) : colour;
  shade *= light;
  vec3 away = corner / fwidth(corner);
  float nearest = min(away.x, min(away.y, away.z));
  shade = mix(shade, vec3(0.35), mesh * 0.35 * (1.0 - smoothstep(0.3, 1.1, nearest)));
  for (int k = 0; k < 3; k++) {
    // Lines are thin on small faces: they would hide them.
    float wide = min(line, 0.12 / fwidth(corner[k]));
    float inside = 1.0 - smoothstep(wide - 0.5, wide + 0.5, away[k]);
    if (crack[k] <= now) shade = mix(shade, byFace > 0.5 ? ofTime(crack[k]) : crackColour, inside);
  }
  pixel = vec4(shade, 1.0);
}`;

const LOCAL_FACES = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
const NAMES = [
  ...["motion", "colours", "table", "turn", "middle", "scale", "shift", "magnify", "now"],
  ...["crackColour", "stone", "high", "byFace", "mesh", "line"],
];
const CRACK = [0.08, 0.08, 0.09], STONE = [0.894, 0.878, 0.839];

/** Vertices of all faces: arm, body, time of breaking, times at which cracks reach the edges. */
function vertices() {
  const points = unpack(view.points), corners = unpack(view.tetrahedra), centres = unpack(view.centres);
  const bodies = unpack(view.faceBody), local = unpack(view.faceLocal);
  const breaks = unpack(view.faceBreaks), edges = unpack(view.edgeBreaks);
  const made = new Float32Array(bodies.length * 24);
  bodies.forEach((body, face) => LOCAL_FACES[local[face]].forEach((end, k) => {
    const point = corners[4 * body + end], row = 24 * face + 8 * k;
    for (let i = 0; i < 3; i++) {
      made[row + i] = points[3 * point + i] - centres[3 * body + i];
      made[row + 5 + i] = edges[3 * face + i];
    }
    made[row + 3] = body;
    made[row + 4] = breaks[face];
  }));
  return made;
}

/** Product of two rotations, columns first. */
function product(a, b) {
  const made = new Float32Array(9);
  for (let c = 0; c < 3; c++) for (let r = 0; r < 3; r++)
    for (let k = 0; k < 3; k++) made[3 * c + r] += a[3 * k + r] * b[3 * c + k];
  return made;
}

/** Rotation of the view about the axis to the right, then about the axis upwards [rad]. */
function rotation(down, right) {
  const [c, s, d, t] = [Math.cos(down), Math.sin(down), Math.cos(right), Math.sin(right)];
  return product([1, 0, 0, 0, c, s, 0, -s, c], [d, 0, -t, 0, 1, 0, t, 0, d]);
}

const LOOKS = {
  "3-D": rotation(0.45, -0.55),
  x: [0, 0, 1, 1, 0, 0, 0, 1, 0], y: [0, 1, 0, 0, 0, 1, 1, 0, 0], z: [1, 0, 0, 0, 1, 0, 0, 0, 1],
};

/** Where the viewer stands: turn (columns first), zoom, and shift as a share of the canvas. */
class Camera {
  constructor() {
    Object.assign(this, { turn: LOOKS["3-D"], zoom: 1, shift: [0, 0] });
  }

  look(turn) {
    Object.assign(this, { turn, zoom: 1, shift: [0, 0] });
  }

  turnBy(right, down) {
    this.turn = product(rotation(down, right), this.turn);
  }

  zoomBy(factor) {
    const zoom = Math.min(200, Math.max(0.05, this.zoom * factor));
    this.shift = this.shift.map((one) => (one * zoom) / this.zoom);
    this.zoom = zoom;
  }
}

class BlockView {
  constructor(canvas, gl) {
    Object.assign(this, { canvas, gl, camera: new Camera(), magnify: 1, mesh: true });
    this.displacement = unpackFrames(view.displacement);
    this.turns = unpackFrames(view.turns);
    this.centres = unpack(view.centres);
    this.count = this.centres.length / 3;
    this.scales = view.modes.map((mode) => new ColourScale(mode));
    this.values = view.modes.map((mode) => (mode.scaled ? unpackFrames(mode.values) : unpack(mode.values)));
    this.build();
  }

  build() {
    const { gl } = this, program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    gl.useProgram(program);
    gl.enable(gl.DEPTH_TEST);
    const data = vertices();
    this.corners = data.length / 8;
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    for (const [name, size, at] of [["arm", 3, 0], ["body", 1, 12], ["breaks", 1, 16], ["edges", 3, 20]]) {
      const place = gl.getAttribLocation(program, name);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 32, at);
    }
    this.at = Object.fromEntries(NAMES.map((name) => [name, gl.getUniformLocation(program, name)]));
    this.textures = ["motion", "colours", "table"].map((name, unit) => {
      gl.uniform1i(this.at[name], unit);
      return gl.createTexture();
    });
  }

  /** Fill a texture with rows of four numbers, floats or bytes. */
  fill(unit, values, width) {
    const { gl } = this, floats = values instanceof Float32Array;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, this.textures[unit]);
    for (const name of ["TEXTURE_MIN_FILTER", "TEXTURE_MAG_FILTER"])
      gl.texParameteri(gl.TEXTURE_2D, gl[name], gl.NEAREST);
    const height = Math.ceil(values.length / 4 / width);
    const padded = new values.constructor(4 * width * height);
    padded.set(values);
    const kind = floats ? [gl.RGBA32F, gl.FLOAT] : [gl.RGBA8, gl.UNSIGNED_BYTE];
    gl.texImage2D(gl.TEXTURE_2D, 0, kind[0], width, height, 0, gl.RGBA, kind[1], padded);
  }

  /** Hand displacements, turns and colours of a frame to the shaders. */
  load(frame, mode) {
    const moved = this.displacement(frame), turns = this.turns(frame);
    const motion = new Float32Array(12 * this.count), colours = new Uint8Array(4 * this.count).fill(255);
    const scale = this.scales[mode], { kind, keys } = view.modes[mode], now = view.times[frame];
    const values = view.modes[mode].scaled ? this.values[mode](frame) : this.values[mode];
    const start = kind === "levels" ? frame * this.count : 0;
    for (let body = 0; body < this.count; body++) {
      for (let k = 0; k < 3; k++) {
        motion[12 * body + k] = this.centres[3 * body + k];
        motion[12 * body + 4 + k] = moved[3 * body + k];
        motion[12 * body + 8 + k] = turns[3 * body + k];
      }
      const value = values[start + body];
      colours.set(kind === "since" && !(value <= now) ? keys[0].colour : scale.colour(value), 4 * body);
    }
    const table = new Uint8Array(1024);
    for (let k = 0; k < 256; k++) table.set(scale.table.subarray(3 * k, 3 * k + 3), 4 * k);
    this.fill(0, motion, 1023);
    this.fill(1, colours, 1024);
    this.fill(2, table, 256);
    this.loaded = `${frame} ${mode}`;
  }

  draw(frame, mode) {
    if (this.loaded !== `${frame} ${mode}`) this.load(frame, mode);
    const { gl, at, canvas, camera } = this, ratio = fitCanvas(canvas);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const pixels = this.pixels() * ratio, farthest = 1.8 * 32767 * view.displacement.scale[frame];
    const deepest = view.radius + this.magnify * (farthest + 2 * view.arm);
    gl.uniformMatrix3fv(at.turn, false, camera.turn);
    gl.uniform3fv(at.middle, view.middle);
    gl.uniform3f(at.scale, (2 * pixels) / canvas.width, (2 * pixels) / canvas.height, -1 / deepest);
    gl.uniform2f(at.shift, 2 * camera.shift[0], -2 * camera.shift[1]);
    gl.uniform3fv(at.crackColour, CRACK);
    gl.uniform3fv(at.stone, STONE);
    gl.uniform1f(at.magnify, this.magnify);
    gl.uniform1f(at.now, view.times[frame]);
    gl.uniform1f(at.high, view.modes[mode].high);
    gl.uniform1f(at.byFace, view.modes[mode].kind === "faces" ? 1 : 0);
    gl.uniform1f(at.mesh, this.mesh ? 1 : 0);
    gl.uniform1f(at.line, 0.9 * ratio);
    gl.drawArrays(gl.TRIANGLES, 0, this.corners);
  }

  /** Pixels of the page for a metre: at zoom 1 the block at rest fits. */
  pixels() {
    const { turn, zoom } = this.camera, half = [0, 1].map((row) =>
      [0, 1, 2].reduce((sum, k) => sum + Math.abs(turn[3 * k + row]) * view.half[k], 0));
    const { clientWidth: width, clientHeight: height } = this.canvas;
    return 0.42 * zoom * Math.min(width / half[0], height / half[1]);
  }
}
