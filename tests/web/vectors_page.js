// In the browser: evaluates queries of the conformance kit with the package's shader texts, one pixel each.
import { evaluate, fabric_words, footprint, word_layout, yarn } from 'selvedge/glsl.js';
import { pack_fabric } from 'selvedge/pack.js';
import { open_fabric } from 'selvedge/reader/index.js';

const VERTEX = `#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`;

const FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
uniform highp sampler2D queries;  // row 0: view, level; 1: light, whether a texel is asked for; 2: texel or (u, v), whether from behind
out vec4 result;
vec4 query(int row) { return texelFetch(queries, ivec2(int(gl_FragCoord.x), row), 0); }
uint light_count() { return 1u; }
void light_at(uint i, out vec3 direction, out vec3 irradiance) {
  direction = query(1).xyz;
  irradiance = vec3(1.0);
}
${word_layout}${fabric_words}${evaluate}${yarn}${footprint}
void main() {
  vec4 view_level = query(0);
  vec4 place = query(2);
  uint turned = word(0u) + fabric_turned;
  uint seen = place.z == 1.0 && word(turned) != 0u ? turned : 0u;
  uint fabric = word(seen);
  // Light on texels: from the other side, mirrored, transmitted light.
  uint lit = seen;
  if (query(1).z < 0.0 && word(fabric + fabric_through) != 0u) {
    lit = fabric + fabric_through;
    lit_side = -1.0;
  }
  vec4 sum = vec4(0.0);
  if (query(1).w == 1.0) {
    uint level = uint(view_level.w);
    uint width = word(word(fabric + fabric_level_places + level) + level_width);
    shade_texel(lit, level, uint(place.y) * width + uint(place.x), view_level.xyz, mat3(1.0), 1.0, sum);
  } else {
    float least = word(fabric + fabric_yarns) != 0u ? -1.0 : 0.0;
    float level = clamp(view_level.w, least, float(word(fabric + fabric_level_count)) - 1.0);
    for (int k = 0; k < 2; ++k) {
      float share = k == 0 ? 1.0 - fract(level) : fract(level);
      int at = int(floor(level)) + k;
      if (share == 0.0) continue;
      if (at < 0) {
        shade_yarn(fabric, fract(place.xy), view_level.xyz, nowhere, 1.0, mat3(1.0), 0.0, share, sum);
        continue;
      }
      uint of_level = word(fabric + fabric_level_places + uint(at));
      ivec2 size = ivec2(int(word(of_level + level_width)), int(word(of_level + level_height)));
      ivec2 texel = min(ivec2(fract(place.xy) * vec2(size)), size - 1);
      shade_texel(lit, uint(at), uint(texel.y * size.x + texel.x), view_level.xyz, mat3(1.0), share, sum);
    }
  }
  result = sum;
}`;

const gl = document.createElement('canvas').getContext('webgl2');
if (!gl.getExtension('EXT_color_buffer_float')) throw new Error('no float targets');

function program() {
  const result = gl.createProgram();
  for (const [type, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(result, shader);
  }
  gl.linkProgram(result);
  if (!gl.getProgramParameter(result, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(result));
  return result;
}

function texture(unit, internal, width, height, format, type, data) {
  const made = gl.createTexture();
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  gl.texImage2D(gl.TEXTURE_2D, 0, internal, width, height, 0, format, type, data);
  return made;
}

let made;

/** alpha * (rgb, 1) of every query to a fabric file, four numbers each. */
export async function evaluated(file, queries) {
  const bytes = new Uint8Array(await (await fetch(file)).arrayBuffer());
  const { words } = pack_fabric(await open_fabric(bytes));
  if (!made) {
    made = program();
    gl.useProgram(made);
    gl.uniform1i(gl.getUniformLocation(made, 'fabric_words'), 0);
    gl.uniform1i(gl.getUniformLocation(made, 'queries'), 1);
  }
  const rows = Math.ceil(words.length / 2048), padded = new Uint32Array(2048 * rows);
  padded.set(words);
  const n = queries.length, data = new Float32Array(12 * n);
  queries.forEach(({ view, light, level, texel, uv, behind }, i) => {
    data.set([...view, level], 4 * i);
    data.set([...light, texel ? 1 : 0], 4 * (n + i));
    data.set([...texel ?? uv, behind ? 1 : 0], 4 * (2 * n + i));
  });
  const textures = [
    texture(0, gl.R32UI, 2048, rows, gl.RED_INTEGER, gl.UNSIGNED_INT, padded),
    texture(1, gl.RGBA32F, n, 3, gl.RGBA, gl.FLOAT, data),
    texture(2, gl.RGBA32F, n, 1, gl.RGBA, gl.FLOAT, null),
  ];
  const framebuffer = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, textures[2], 0);
  gl.viewport(0, 0, n, 1);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  const results = new Float32Array(4 * n);
  gl.readPixels(0, 0, n, 1, gl.RGBA, gl.FLOAT, results);
  if (gl.getError() !== gl.NO_ERROR) throw new Error('a WebGL error');
  gl.deleteFramebuffer(framebuffer);
  for (const each of textures) gl.deleteTexture(each);
  return [...results];
}
