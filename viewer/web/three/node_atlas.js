// The atlas of cell_images.js as a WebGPURenderer has it, with either back end; and environments that it draws and reads back.
import {
  BufferAttribute, BufferGeometry, DataTexture, EquirectangularReflectionMapping, EquirectangularRefractionMapping, FloatType, HalfFloatType,
  LinearFilter, Mesh, NearestFilter, OrthographicCamera, PlaneGeometry, RGBAFormat, RedFormat, Scene, UnsignedByteType, WebGPUCoordinateSystem
} from 'three';
import {NodeMaterial, RenderTarget} from 'three/webgpu';
import {attribute, cos, float, int, ivec2, pmremTexture, positionGeometry, sin, texture, uniform, uv, varying, vec2, vec3, vec4} from 'three/tsl';
import {ATLAS_WIDTH} from './cell_images.js';
import {DRAWN_WIDTH, picture_of} from './environment.js';

/** An atlas of each renderer, which three.js would empty as soon as another one has it. */
const atlases = new WeakMap(), camera = new OrthographicCamera(), rows = uniform(1), none = new DataTexture();

/** Draws a mesh alone into a target, over what is there. */
function draw_into(renderer, target, mesh) {
  const {autoClear, xr} = renderer, {enabled} = xr, mrt = renderer.getMRT();
  const drawn_to = [renderer.getRenderTarget(), renderer.getActiveCubeFace(), renderer.getActiveMipmapLevel()];
  renderer.autoClear = mesh.frustumCulled = xr.enabled = false;
  renderer.setMRT(null);
  renderer.setRenderTarget(target);
  renderer.render(new Scene().add(mesh), camera);
  renderer.setRenderTarget(...drawn_to);
  renderer.setMRT(mrt);
  Object.assign(renderer, {autoClear});
  Object.assign(xr, {enabled});
}
const drawing = (members) => Object.assign(new NodeMaterial(), {depthTest: false, depthWrite: false, ...members});

/** A target that tiles are drawn into, as quads of texels that lie one after the other in a texture. */
function tiles_of(height, format, type, filter, Numbers, channels) {
  const target = new RenderTarget(ATLAS_WIDTH, height, {format, type, minFilter: filter, magFilter: filter, depthBuffer: false});
  const staged = texture(new DataTexture(new Numbers(channels), 1, 1, format, type));
  // A tile: place, first texel, width.
  const tile = attribute('tile', 'vec4'), flat = varying(tile).setInterpolation('flat', 'first'), inside = ivec2(varying(positionGeometry.xy));
  const texel = int(flat.z).add(inside.y.mul(int(flat.w))).add(inside.x);
  const quads = new Mesh(new BufferGeometry(), drawing({
    // three.js has the first row of a target at its top, whatever graphics do.
    vertexNode: vec4(tile.xy.add(positionGeometry.xy).div(vec2(ATLAS_WIDTH, rows)).mul(vec2(2, -2)).add(vec2(-1, 1)), 0, 1),
    fragmentNode: staged.load(ivec2(texel.mod(int(ATLAS_WIDTH)), texel.div(int(ATLAS_WIDTH)))),
  }));
  const write = (renderer, texels, geometry) => {
    const data = new Numbers(channels * ATLAS_WIDTH * Math.ceil(texels.length / channels / ATLAS_WIDTH));
    data.set(texels);
    staged.value = new DataTexture(data, ATLAS_WIDTH, data.length / channels / ATLAS_WIDTH, format, type);
    staged.value.needsUpdate = true;
    quads.geometry = geometry;
    draw_into(renderer, target, quads);
    staged.value.dispose();
  };
  return {target, write};
}

function quads_of(places) {
  const geometry = new BufferGeometry(), count = places.length / 4, tiles = new Float32Array(16 * count), corners = new Float32Array(12 * count), index = [];
  for (let i = 0, first = 0; i < count; ++i) {
    const [x, y, width, height] = places.subarray(4 * i);
    for (let k = 0; k < 4; ++k) {
      tiles.set([x, y, first, width], 4 * (4 * i + k));
      corners.set([k & 1 ? width : 0, k & 2 ? height : 0, 0], 3 * (4 * i + k));
    }
    index.push(...[0, 2, 1, 1, 2, 3].map((k) => 4 * i + k));
    first += width * height;
  }
  geometry.setIndex(index);
  geometry.setAttribute('position', new BufferAttribute(corners, 3));
  return geometry.setAttribute('tile', new BufferAttribute(tiles, 4));
}

export const node_atlas = {
  uniforms: (renderer) => Object.fromEntries(['cell_atlas', 'cell_heights'].map((name, i) => [name, {value: atlases.get(renderer)?.[i].target.texture ?? none}])),
  find_viewport(renderer, viewport) {
    const target = renderer.getRenderTarget();
    if (target) viewport.copy(target.viewport);
    else renderer.getViewport(viewport).multiplyScalar(renderer.getPixelRatio());
  },
  handle: (renderer) => atlases.get(renderer),
  begin(renderer, height) {
    rows.value = height;
    atlases.set(renderer, [
      tiles_of(height, RGBAFormat, HalfFloatType, LinearFilter, Uint16Array, 4), tiles_of(height, RedFormat, UnsignedByteType, NearestFilter, Uint8Array, 1)
    ]);
  },
  write(renderer, uploads) {
    if (uploads.places.length === 0) return;
    const geometry = quads_of(uploads.places), [atlas, heights] = atlases.get(renderer);
    atlas.write(renderer, uploads.halves, geometry);
    heights.write(renderer, uploads.heights, geometry);
    geometry.dispose();
  },
};

/** A promise of the picture of any texture that three.js takes for an environment; null of others. */
export function picture_drawn(of, renderer) {
  if (!of.isCubeTexture && !of.isPMREMTexture && ![EquirectangularReflectionMapping, EquirectangularRefractionMapping].includes(of.mapping)) return null;
  return (async () => {
    // Not within a frame.
    await new Promise((end) => setTimeout(end));
    const width = DRAWN_WIDTH, height = width / 2, target = new RenderTarget(width, height, {type: FloatType, depthBuffer: false});
    const samples = Array.from({length: 16}, (_, i) => {
      const a = uv().sub(0.5).add(vec2(((i & 3) - 1.5) / 4 / width, ((i >> 2) - 1.5) / 4 / height)).mul(vec2(2 * Math.PI, Math.PI));
      return pmremTexture(of, vec3(cos(a.x).mul(cos(a.y)), sin(a.y), sin(a.x).mul(cos(a.y))), float(0)).mul(1 / 16);
    });
    const quad = new Mesh(new PlaneGeometry(2, 2), drawing({vertexNode: vec4(positionGeometry.xy, 0, 1), fragmentNode: vec4(samples.reduce((a, b) => a.add(b)), 1)}));
    draw_into(renderer, target, quad);
    const data = await renderer.readRenderTargetPixelsAsync(target, 0, 0, width, height);
    for (const each of [target, quad.geometry, quad.material]) each.dispose();
    return picture_of({
      mapping: EquirectangularReflectionMapping, type: FloatType, flipY: renderer.coordinateSystem === WebGPUCoordinateSystem, image: {data, width, height}
    });
  })().catch(() => null);
}
