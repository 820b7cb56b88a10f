// Fabrics in three.js's WebGLRenderer, from its GLTFLoader:
//
//   loader.register((parser) => new SelvedgeFabric(parser));
import {FabricMaterial} from './material.js';
import {plugin_of} from './plugin.js';

export const SelvedgeFabric = plugin_of(FabricMaterial);
export {FabricMaterial};
export {use_memory, use_worker} from '../background.js';
export {cell_images} from './cell_images.js';
export {LoadedFabric} from './fabric.js';
export {plain_lay} from './fabric_material.js';
export {Surroundings} from './surroundings.js';
