// Environments of other layouts than pictures of numbers, drawn by a WebGLRenderer and read back.
import {
  Camera, EquirectangularReflectionMapping, EquirectangularRefractionMapping, FloatType, Mesh, PlaneGeometry, ShaderMaterial, WebGLRenderTarget
} from 'three';
import {DRAWN_WIDTH, picture_of} from './environment.js';

/** The mapping of PMREMGenerator's textures before 0.187, which three.js does not export; later ones are cubes. */
const CUBE_UV = 306;
/** Samples of a pixel: a sun is smaller. */
const SAMPLES = 16;

/** The material that draws a texture of any layout from all around, and its colour from a direction `d`. */
function drawing_material(texture) {
  const {mapping, isCubeTexture, isRenderTargetTexture, image} = texture, is_cube_uv = mapping === CUBE_UV;
  const levels = is_cube_uv ? Math.log2(image.height) - 2 : 0, towards = isRenderTargetTexture ? 'd' : 'vec3(-d.x, d.yz)';
  const colour = is_cube_uv ? 'textureCubeUV(picture, d, 0.0)' : isCubeTexture ? `textureLod(picture, ${towards}, 0.0)` : 'texture2D(picture, equirectUv(d))';
  return new ShaderMaterial({
    uniforms: {picture: {value: texture}},
    // As three.js's WebGLProgram has them.
    defines: is_cube_uv ? {
      ENVMAP_TYPE_CUBE_UV: '', CUBEUV_TEXEL_WIDTH: 1 / (3 * Math.max(2 ** levels, 112)), CUBEUV_TEXEL_HEIGHT: 1 / image.height,
      CUBEUV_MAX_MIP: levels.toFixed(1)
    } : {},
    depthTest: false, depthWrite: false, toneMapped: false,
    vertexShader: 'varying vec2 place; void main() { place = uv; gl_Position = vec4(position.xy, 0.0, 1.0); }',
    fragmentShader: `#include <common>
      ${is_cube_uv ? '#include <cube_uv_reflection_fragment>' : ''}
      varying vec2 place; uniform ${isCubeTexture ? 'samplerCube' : 'sampler2D'} picture;
      void main() {
        vec2 part = vec2(dFdx(place.x), dFdy(place.y)) * 0.25;
        gl_FragColor = vec4(0.0, 0.0, 0.0, 1.0);
        for (int i = 0; i < ${SAMPLES}; ++i) {
          vec2 a = (place - 0.5 + (vec2(i & 3, i >> 2) - 1.5) * part) * vec2(2.0, 1.0) * PI;
          vec3 d = vec3(cos(a.x) * cos(a.y), sin(a.y), sin(a.x) * cos(a.y));
          gl_FragColor.rgb += ${colour}.rgb * ${1 / SAMPLES};
        }
      }`,
  });
}
/** The picture of any texture that three.js takes for an environment, drawn and read back; null of others. */
export function picture_drawn(texture, renderer) {
  const {mapping, isCubeTexture} = texture;
  if (!isCubeTexture && ![CUBE_UV, EquirectangularReflectionMapping, EquirectangularRefractionMapping].includes(mapping)) return null;
  const width = DRAWN_WIDTH, height = width / 2, target = new WebGLRenderTarget(width, height, {type: FloatType, depthBuffer: false});
  const quad = new Mesh(new PlaneGeometry(2, 2), drawing_material(texture)), data = new Float32Array(4 * width * height), {xr} = renderer;
  const drawn_to = [renderer.getRenderTarget(), renderer.getActiveCubeFace(), renderer.getActiveMipmapLevel()], is_xr = xr.enabled;
  quad.frustumCulled = xr.enabled = false;
  renderer.setRenderTarget(target);
  renderer.render(quad, new Camera());
  renderer.readRenderTargetPixels(target, 0, 0, width, height, data);
  renderer.setRenderTarget(...drawn_to);
  xr.enabled = is_xr;
  for (const each of [target, quad.geometry, quad.material]) each.dispose();
  return picture_of({mapping: EquirectangularReflectionMapping, type: FloatType, flipY: false, image: {data, width, height}});
}
