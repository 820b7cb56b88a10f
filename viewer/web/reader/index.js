// Reads fabric files (spec/fabric.md), in browsers and in Node.
export {joined, latin1, latin1_bytes, utf8} from './bytes.js';
export {
  BYTES, COMPRESSIONS, LINES_PER_CHUNK, PIXEL_TYPES, chain_length, channel_values, level_size, read_headers,
  read_level
} from './exr.js';
export {SIDES, header_digest, open_fabric, pixel_digest, read_layer} from './fabric.js';
export {Issue} from './issue.js';
export {is_object, parse_json} from './json.js';
export {
  ANGLES, COLOURS, LAYERS, LIGHTS, PARAMETERS, SPREAD, TRANSFER_VALUES, base_count, direction_name, grid_size,
  layer_channels, level_of_texels, needs_lights, pairs_at, used_count
} from './layers.js';
export {read_map, read_repeat, repeat_size} from './map.js';
export {xxh3_128} from './xxh3.js';
