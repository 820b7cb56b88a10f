import {MeshPhysicalNodeMaterial} from 'three/webgpu';
import {FabricMaterial as WebGLFabricMaterial} from './index.js';

export {GarmentParts, Lay, LoadedFabric, SelvedgeFabric, Source, Surroundings, cell_images, plain_lay, use_memory, use_worker} from './index.js';

/** FabricMaterial of `selvedge/three` for a WebGPURenderer. */
export class FabricMaterial extends MeshPhysicalNodeMaterial {
  constructor(parameters?: ConstructorParameters<typeof WebGLFabricMaterial>[0]);
}
export interface FabricMaterial extends Pick<WebGLFabricMaterial,
  'parts' | 'isFabricMaterial' | 'fabric' | 'lay' | 'shows' | 'ready' | 'shows_fabric' | 'level' | 'set_fabric' | 'set_tint'> {}
