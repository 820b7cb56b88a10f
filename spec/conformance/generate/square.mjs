// A square of two triangles without a fabric, to break the rules of glTF itself.

const data_uri = (bytes, type = 'application/octet-stream') =>
  `data:${type};base64,${bytes.toString('base64')}`;
const f32 = (...numbers) => Buffer.from(new Float32Array(numbers).buffer);
const u16 = (...numbers) => Buffer.from(new Uint16Array(numbers).buffer);
const u8 = (...numbers) => Buffer.from(numbers);
export const bytes_of = {f32, u16, u8};

/** Where the values of the square's accessors begin: 0 POSITION, 1 NORMAL, 2 TANGENT, 3 TEXCOORD_0, 4 indices. */
export const AT = [0, 48, 96, 160, 192];
const VERTICES = 34962, INDICES = 34963;

/** { json, bytes }: a glTF and its only buffer, sound, with nothing to advise. */
function square() {
  const bytes = Buffer.concat([
    f32(0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0), f32(0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1),
    f32(1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1), f32(0, 1, 1, 1, 1, 0, 0, 0), u16(0, 1, 2, 0, 2, 3)
  ]);
  const view = (i, byteLength, target) => ({buffer: 0, byteOffset: AT[i], byteLength, target});
  const json = {
    asset: {version: '2.0'},
    scene: 0,
    scenes: [{nodes: [0]}],
    nodes: [{mesh: 0}],
    meshes: [{
      primitives: [{attributes: {POSITION: 0, NORMAL: 1, TANGENT: 2, TEXCOORD_0: 3}, indices: 4, material: 0}]
    }],
    materials: [{name: 'cloth'}],
    accessors: [
      {bufferView: 0, componentType: 5126, count: 4, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0]},
      {bufferView: 1, componentType: 5126, count: 4, type: 'VEC3'},
      {bufferView: 2, componentType: 5126, count: 4, type: 'VEC4'},
      {bufferView: 3, componentType: 5126, count: 4, type: 'VEC2'},
      {bufferView: 4, componentType: 5123, count: 6, type: 'SCALAR'}
    ],
    bufferViews: [
      view(0, 48, VERTICES), view(1, 48, VERTICES), view(2, 64, VERTICES), view(3, 32, VERTICES),
      view(4, 12, INDICES)
    ],
    buffers: [{byteLength: bytes.length}],
  };
  return {json, bytes};
}

/** Appends bytes to the buffer, aligned to 4, and a view of them; gives the view's index. */
export function add_view(s, bytes, more = {}) {
  const byteOffset = Math.ceil(s.bytes.length / 4) * 4;
  s.bytes = Buffer.concat([s.bytes, Buffer.alloc(byteOffset - s.bytes.length), bytes]);
  s.json.buffers[0].byteLength = s.bytes.length;
  return s.json.bufferViews.push({buffer: 0, byteOffset, byteLength: bytes.length, ...more}) - 1;
}

/** The same with an accessor of it; gives the accessor's index. */
export function add_accessor(s, bytes, componentType, type, count, more = {}) {
  const bufferView = add_view(s, bytes, more.view);
  const {view, ...rest} = more;
  return s.json.accessors.push({bufferView, componentType, type, count, ...rest}) - 1;
}

export const primitive_of = ({json}) => json.meshes[0].primitives[0];

/** The bytes of a GLB of chunks, [type, bytes] each; its header may say something else. */
export function glb_of(chunks, {version = 2, length} = {}) {
  const body = chunks.map(([type, bytes]) => {
    const head = Buffer.alloc(8);
    head.writeUInt32LE(bytes.length, 0);
    head.write(type, 4, 'latin1');
    return Buffer.concat([head, bytes]);
  });
  const size = body.reduce((sum, bytes) => sum + bytes.length, 12);
  const head = Buffer.alloc(12);
  head.write('glTF');
  head.writeUInt32LE(version, 4);
  head.writeUInt32LE(length ?? size, 8);
  return Buffer.concat([head, ...body]);
}

/** Bytes filled up to a multiple of 4. */
export const padded = (bytes, fill) => Buffer.concat([bytes, Buffer.alloc(-bytes.length & 3, fill)]);
const json_bytes = (json) => Buffer.from(JSON.stringify(json));
const fixture = (code, what, about, place, files, more) =>
  ({name: `${[code].flat()[0]}-${what}`, about, issues: [{code, place}], others: 'none', files, ...more});

/**
 * A fixture of the square, changed: `change` takes { json, bytes } and may write the buffer's `uri`.
 * more: `issues` instead of code and place, `others`, `text`: changes the file's text, `beside`: other files.
 */
export function of_square(code, what, about, place, change, {text = (t) => t, beside = {}, ...more} = {}) {
  const s = square();
  change(s);
  const [buffer] = s.json.buffers ?? [];
  if (buffer && !('uri' in buffer)) buffer.uri = data_uri(s.bytes);
  if (buffer && buffer.uri === null) delete buffer.uri;
  return fixture(code, what, about, place, {'garment.gltf': Buffer.from(text(JSON.stringify(s.json)) + '\n'), ...beside}, more);
}

/** The same as a GLB: `make` gives its bytes from the JSON's and the buffer's. */
export function of_glb(code, what, about, place, make, more = {}) {
  const s = square();
  return fixture(code, what, about, place, {'garment.glb': make(padded(json_bytes(s.json), ' '), padded(s.bytes, 0), s)}, more);
}
