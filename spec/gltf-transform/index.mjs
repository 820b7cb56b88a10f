// The glTF extension SELVEDGE_materials_fabric for glTF-Transform 4: see README.md.
import {
  BufferUtils, Extension, ExtensionProperty, Format, PropertyType, Texture, TextureInfo,
} from '@gltf-transform/core';

const NAME = 'SELVEDGE_materials_fabric';
const TRANSFORM = 'KHR_texture_transform';
/** What the garment brings: textures, and numbers with their defaults. */
const TEXTURES = ['maskTexture', 'normalTexture', 'tintTexture'];
const NUMBERS = { maskCutoff: 0.5, normalScale: 1, tintFactor: [1, 1, 1] };
const is_same = (a, b) => JSON.stringify(a) === JSON.stringify(b);

/**
 * A fabric file: its bytes, or the URI where it is, or both.
 *
 * It is a Texture to the rest of glTF-Transform, because `prune` keeps the texture coordinates of textures and of
 * nothing else. But it is no child of the root, so it is never written into images[], compressed or resized.
 */
export class FabricFile extends Texture {
  constructor(graph, name) {
    super(graph, name);
    for (const edge of graph.listParentEdges(this)) {
      if (edge.getParent().propertyType === PropertyType.ROOT) edge.dispose();
    }
  }

  init() {
    this.propertyType = 'FabricFile';
  }

  getDefaults() {
    return Object.assign(super.getDefaults(), { mimeType: 'image/x-exr' });
  }

  /** Relative to the glTF; empty for a fabric that is embedded. */
  setURI(uri) {
    return this.set('uri', uri);
  }
}

/** What a material has: a FabricFile, and the UV set and transform by which it lies on the surface. */
export class FabricReference extends ExtensionProperty {
  static EXTENSION_NAME = NAME;

  init() {
    this.extensionName = NAME;
    this.propertyType = 'FabricReference';
    this.parentTypes = [PropertyType.MATERIAL];
  }

  // The two children are named as for all textures: "...Texture" and "...TextureInfo".
  getDefaults() {
    return Object.assign(super.getDefaults(), {
      fabricTexture: null,
      fabricTextureInfo: new TextureInfo(this.graph, 'fabricTextureInfo'),
      ...Object.fromEntries(TEXTURES.flatMap((name) => [
        [name, null], [`${name}Info`, new TextureInfo(this.graph, `${name}Info`)],
      ])),
      ...NUMBERS,
    });
  }

  /** `name`: maskTexture, normalTexture or tintTexture. */
  getTexture(name) {
    return this.getRef(name);
  }

  setTexture(name, texture) {
    return this.setRef(name, texture);
  }

  getTextureInfo(name) {
    return this.getTexture(name) ? this.getRef(`${name}Info`) : null;
  }

  /** `name`: maskCutoff, normalScale or tintFactor. */
  getNumber(name) {
    return this.get(name);
  }

  setNumber(name, value) {
    return this.set(name, value);
  }

  getFabric() {
    return this.getRef('fabricTexture');
  }

  setFabric(file) {
    return this.setRef('fabricTexture', file);
  }

  /** The UV set, and KHR_texture_transform as an extension of it; null without a fabric. */
  getFabricInfo() {
    return this.getFabric() ? this.getRef('fabricTextureInfo') : null;
  }
}

export class MaterialsFabric extends Extension {
  static EXTENSION_NAME = NAME;

  extensionName = NAME;
  // Before meshes: when KHR_texture_transform reads and writes the transforms, the references have to be known.
  prereadTypes = [PropertyType.MESH];
  prewriteTypes = [PropertyType.BUFFER, PropertyType.MESH];

  createFabricFile(name = '') {
    return new FabricFile(this.document.getGraph(), name);
  }

  createFabricReference() {
    return new FabricReference(this.document.getGraph());
  }

  preread(context) {
    const { json } = context.jsonDoc;
    const files = (json.extensions?.[NAME]?.fabrics ?? []).map((def) => this.#readFile(context, def));
    (json.materials ?? []).forEach((materialDef, index) => {
      const def = materialDef.extensions?.[NAME];
      if (!def) return;
      const file = files[def.fabric?.index];
      if (!file) throw new Error(`/materials/${index}/extensions/${NAME}/fabric/index: there is no such fabric`);
      const reference = this.createFabricReference().setFabric(file);
      const info = reference.getFabricInfo().setTexCoord(def.fabric.texCoord ?? 0);
      if (def.fabric.extras) info.setExtras(def.fabric.extras);
      if (def.extras) reference.setExtras(def.extras);
      if (def.fabric.extensions?.[TRANSFORM] && !this.document.hasExtension(TRANSFORM)) {
        this.document.getLogger().warn(`${NAME}: without ${TRANSFORM} the repeats of material ${index} are lost`);
      }
      context.textureInfos.set(info, def.fabric);
      this.#readParts(context, def, reference);
      context.materials[index].setExtension(NAME, reference);
    });
    return this;
  }

  read() {
    return this;
  }

  #readParts(context, def, reference) {
    for (const name of TEXTURES) {
      if (def[name] === undefined) continue;
      const { source } = context.jsonDoc.json.textures[def[name].index];
      reference.setTexture(name, context.textures[source]);
      context.setTextureInfo(reference.getTextureInfo(name), def[name]);
    }
    const numbers = { ...def, normalScale: def.normalTexture?.scale };
    for (const [name, otherwise] of Object.entries(NUMBERS)) reference.setNumber(name, numbers[name] ?? otherwise);
  }

  #readFile(context, def) {
    const file = this.createFabricFile(def.name);
    if (def.extras) file.setExtras(def.extras);
    if (def.mimeType) file.setMimeType(def.mimeType);
    if (def.bufferView !== undefined) return file.setImage(context.bufferViews[def.bufferView].slice());
    return def.uri.startsWith('data:') ? file.setImage(BufferUtils.createBufferFromDataURI(def.uri)) : file.setURI(def.uri);
  }

  /** The fabrics that materials refer to, each once; others are not written. */
  #listFiles() {
    const references = this.document.getRoot().listMaterials().map((material) => material.getExtension(NAME));
    return [...new Set(references.map((reference) => reference?.getFabric()).filter(Boolean))];
  }

  prewrite(context, propertyType) {
    if (propertyType === PropertyType.BUFFER) this.#writeBytes(context);
    else this.#writeReferences(context);
    return this;
  }

  /** Bytes go into a buffer, except for a .gltf file with a URI for them. */
  #writeBytes(context) {
    const root = this.document.getRoot();
    for (const file of this.#listFiles()) {
      const bytes = file.getImage();
      if (!bytes) continue;
      if (file.getURI() && context.options.format !== Format.GLB) {
        context.assignResourceURI(file.getURI(), bytes, true);
        continue;
      }
      const buffer = root.listBuffers()[0] ?? this.document.createBuffer();
      context.otherBufferViews.set(buffer, [...(context.otherBufferViews.get(buffer) ?? []), bytes]);
    }
  }

  #writeReferences(context) {
    const files = this.#listFiles();
    for (const material of this.document.getRoot().listMaterials()) {
      const reference = material.getExtension(NAME);
      if (!reference?.getFabric()) continue;
      const info = reference.getFabricInfo();
      const def = { index: files.indexOf(reference.getFabric()) };
      if (info.getTexCoord() !== 0) def.texCoord = info.getTexCoord();
      if (Object.keys(info.getExtras()).length > 0) def.extras = info.getExtras();
      const materialDef = context.jsonDoc.json.materials[context.materialIndexMap.get(material)];
      const extension = { ...context.createPropertyDef(reference), fabric: def, ...this.#partsOf(context, reference) };
      materialDef.extensions = { ...materialDef.extensions, [NAME]: extension };
      context.textureInfoDefMap.set(info, def);
    }
  }

  #partsOf(context, reference) {
    const parts = {};
    for (const name of TEXTURES) {
      const texture = reference.getTexture(name);
      if (texture) parts[name] = context.createTextureInfoDef(texture, reference.getTextureInfo(name));
    }
    for (const [name, otherwise] of Object.entries(NUMBERS)) {
      const number = reference.getNumber(name);
      if (is_same(number, otherwise)) continue;
      if (name !== 'normalScale') parts[name] = number;
      else if (parts.normalTexture) parts.normalTexture.scale = number;
    }
    return parts;
  }

  write(context) {
    const { json } = context.jsonDoc;
    const fabrics = this.#listFiles().map((file) => {
      const def = { ...context.createPropertyDef(file), mimeType: file.getMimeType() };
      const view = context.otherBufferViewsIndexMap.get(file.getImage());
      return view === undefined ? { ...def, uri: file.getURI() } : { ...def, bufferView: view };
    });
    if (fabrics.length > 0) json.extensions = { ...json.extensions, [NAME]: { fabrics } };
    return this;
  }
}
