// The plugin for three.js's GLTFLoader: materials with SELVEDGE_materials_fabric show their fabric.
import {LoaderUtils} from 'three';
import {issue_of, throw_issue} from '../reader/issue.js';
import {LoadedFabric} from './fabric.js';
import {load_parts} from './garment_parts.js';

const NAME = 'SELVEDGE_materials_fabric';
const TRANSFORM = 'KHR_texture_transform';
const is_object = (x) => typeof x === 'object' && x !== null && !Array.isArray(x);
const is_index = (x) => Number.isInteger(x) && x >= 0;
const are_numbers = (x, n) => Array.isArray(x) && x.length === n && x.every((a) => Number.isFinite(Math.fround(a)));

const refuse = (place, message) => throw_issue('GLTF_EXTENSION', place, message);

/** The lay that a reference describes. */
function lay_of(reference, place) {
  const transform = reference.extensions?.[TRANSFORM] ?? {};
  const {offset = [0, 0], rotation = 0, scale = [1, 1]} = transform, uv_set = transform.texCoord ?? reference.texCoord ?? 0;
  if (!are_numbers(offset, 2) || !are_numbers(scale, 2) || !are_numbers([rotation], 1))
    refuse(`${place}/extensions/${TRANSFORM}`, 'has no finite numbers');
  if (scale.some((x) => Math.abs(x) < 2 ** -126)) refuse(`${place}/extensions/${TRANSFORM}/scale`, 'is no scale');
  if (uv_set !== 0 && uv_set !== 1) refuse(`${place}/texCoord`, 'is neither set 0 nor set 1');
  return {uv_set, offset, rotation, scale};
}

/** The plugin that makes materials of a class: fabric_material()'s. */
export const plugin_of = (FabricMaterial) => class SelvedgeFabric {
  constructor(parser) {
    this.name = NAME;
    this.parser = parser;
    this.fabrics = new Map();
  }

  /** The source of an item of `fabrics`, for LoadedFabric. */
  #source_of(item, place) {
    if (!is_object(item)) refuse(place, 'is not an object');
    if (item.mimeType !== 'image/x-exr') refuse(`${place}/mimeType`, 'is not "image/x-exr"');
    if ((item.uri === undefined) === (item.bufferView === undefined))
      refuse(place, 'has not exactly one of uri and bufferView');
    if (item.bufferView !== undefined) {
      if (!is_index(item.bufferView) || !this.parser.json.bufferViews?.[item.bufferView])
        refuse(`${place}/bufferView`, 'is not a buffer view');
      return this.parser.getDependency('bufferView', item.bufferView);
    }
    if (typeof item.uri !== 'string' || item.uri === '') refuse(`${place}/uri`, 'is not a string, or empty');
    const {manager, path, requestHeader, withCredentials} = this.parser.options;
    const url = new URL(manager.resolveURL(LoaderUtils.resolveURL(item.uri, path)), document.baseURI).href;
    const credentials = withCredentials ? 'include' : 'same-origin';
    return {place: `${place}/uri`, url, headers: requestHeader ?? {}, credentials};
  }

  /** The loading manager counts a fabric as it counts other files. */
  async #tell_manager(url, fabric) {
    const {manager} = this.parser.options;
    manager.itemStart(url);
    await fabric.settled;
    if (fabric.issue) manager.itemError(url);
    manager.itemEnd(url);
  }

  /** The LoadedFabric of an item; every item is loaded once. */
  fabric(index) {
    if (!this.fabrics.has(index)) {
      const place = `/extensions/${NAME}/fabrics/${index}`, item = this.parser.json.extensions?.[NAME]?.fabrics?.[index];
      const source = (async () => this.#source_of(item, place))();
      const fabric = new LoadedFabric(source, typeof item?.name === 'string' ? item.name : place);
      this.fabrics.set(index, fabric);
      source.then(({url}) => url && this.#tell_manager(url, fabric), () => {});
    }
    return this.fabrics.get(index);
  }

  loadMaterial(index) {
    const definition = this.parser.json.materials?.[index], extension = definition?.extensions?.[NAME];
    if (extension === undefined) return null;
    // Excluded beside a fabric: a renderer ignores it.
    delete definition.extensions.KHR_materials_unlit;
    return Promise.all([this.parser.loadMaterial(index), load_parts(this.parser, extension)]).then(([fallback, parts]) => {
      try {
        const place = `/materials/${index}/extensions/${NAME}`, reference = is_object(extension) ? extension.fabric : null;
        if (!is_object(reference) || !is_index(reference.index)) refuse(place, 'refers to no fabric');
        const {alphaMode = 'OPAQUE'} = definition;
        const material = new FabricMaterial({
          fallback,
          fabric: this.fabric(reference.index),
          lay: lay_of(reference, `${place}/fabric`),
          keeps_opacity: alphaMode !== 'OPAQUE',
          parts,
        });
        this.parser.associations.set(material, this.parser.associations.get(fallback));
        return material;
      } catch (error) {
        const {code, place, message} = issue_of(error);
        console.warn(`selvedge: ${code}: ${place}: ${message}; the fallback is shown`);
        return fallback;
      }
    });
  }

  /** Surfaces without the coordinates of their fabric show the fallback. */
  afterRoot({scenes}) {
    for (const scene of scenes) {
      scene.traverse((object) => {
        const {material, geometry} = object;
        if (!material?.isFabricMaterial) return;
        if (object.name) material.fabric?.meshes.add(object.name);
        const {normal} = geometry.attributes;
        // As `render` has it: such normals are no directions.
        if (normal && Array.from({length: normal.count}, (_, i) => normal.getX(i) || normal.getY(i) || normal.getZ(i)).some((x) => !x))
          geometry.computeVertexNormals();
        if (geometry.attributes[material.lay.uv_set === 1 ? 'uv1' : 'uv']) return;
        console.warn(`selvedge: GARMENT_NO_UVS: ${object.name}: no TEXCOORD_${material.lay.uv_set}; the fallback is shown`);
        object.material = material.clone().set_fabric(null);
      });
    }
    return null;
  }
};
