// The atlas of cell_images.js as a WebGLRenderer has it.
import {FramebufferTexture, HalfFloatType, LinearFilter, NearestFilter, RGBAFormat, RedFormat, UnsignedByteType} from 'three';
import {ATLAS_WIDTH} from './cell_images.js';

/** A texture that tiles are written into: three.js gives such ones memory alone. */
const texture_of = (format, type, filter) =>
  Object.assign(new FramebufferTexture(ATLAS_WIDTH, 1), {format, type, minFilter: filter, magFilter: filter});
const atlas = texture_of(RGBAFormat, HalfFloatType, LinearFilter), heights = texture_of(RedFormat, UnsignedByteType, NearestFilter);

export const webgl_atlas = {
  uniforms: {cell_atlas: {value: atlas}, cell_heights: {value: heights}},
  find_viewport: (renderer, viewport) => renderer.getCurrentViewport(viewport),
  handle: (renderer) => renderer.properties.get(atlas).__webglTexture,
  begin(renderer, rows) {
    for (const texture of [atlas, heights]) {
      texture.image.height = rows;
      renderer.initTexture(texture);
    }
  },
  write(renderer, uploads) {
    // By three.js's copyTextureToTexture() a tile is eight calls in place of one.
    const gl = renderer.getContext(), {state} = renderer, {places} = uploads;
    // three.js remembers these since 0.184.
    const store = state.pixelStorei ? state : gl;
    store.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, false);
    store.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
    store.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    for (const [texture, channels, ...format] of [[atlas, 4, gl.RGBA, gl.HALF_FLOAT, uploads.halves], [heights, 1, gl.RED, gl.UNSIGNED_BYTE, uploads.heights]]) {
      state.bindTexture(gl.TEXTURE_2D, renderer.properties.get(texture).__webglTexture);
      for (let i = 0, at = 0; i < places.length; at += channels * places[i + 2] * places[i + 3], i += 4)
        gl.texSubImage2D(gl.TEXTURE_2D, 0, ...places.subarray(i, i + 4), ...format, at);
    }
  },
};
