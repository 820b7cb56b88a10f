// The rules of glTF 2.0 itself, as far as a viewer's safety and its picture depend on them. The tables come
// first; what refers to one another is looked at only where they find nothing wrong.
import {media_type, resolve_uri} from './gltf_container.mjs';
import {Accessors, MeshCheck, ViewUses, check_views} from './gltf_data.mjs';
import {check_hierarchy} from './gltf_nodes.mjs';
import {check_schema} from './gltf_schema.mjs';
import {Issue} from './issue.mjs';

/** Extensions that may be required: those that change how data is read, and that this program knows. */
const READ = ['KHR_texture_transform', 'KHR_mesh_quantization'];
const PICTURES = [
  ['image/png', Buffer.from('\x89PNG\r\n\x1A\n', 'latin1')], ['image/jpeg', Buffer.from([0xFF, 0xD8, 0xFF])],
  ['image/ktx2', Buffer.from('\xABKTX 20\xBB\r\n\x1A\n', 'latin1')]
];
const PNG_HEADER_END = 33;

function check_asset({asset}, report) {
  const {version, minVersion} = asset;
  for (const [name, text] of Object.entries({version, minVersion})) {
    const place = `/asset/${name}`;
    if (text === undefined) continue;
    if (!/^[0-9]+\.[0-9]+$/.test(text))
      report('GLTF_MALFORMED', place, 'is no version');
    else if (!text.startsWith('2.') || (name === 'minVersion' && text !== '2.0' && text === version))
      report('GLTF_UNSUPPORTED', place, `glTF ${text}`);
    else if (name === 'minVersion' && Number(text) > Number(version))
      report('GLTF_MALFORMED', place, 'is above the version');
  }
}

function check_lists({extensionsUsed = [], extensionsRequired = [], ...rest}, ours, report) {
  for (const name of extensionsRequired) {
    if (!extensionsUsed.includes(name))
      report('GLTF_MALFORMED', '/extensionsRequired', `${name} is not in extensionsUsed`);
    else if (!READ.includes(name) && name !== ours)
      report('GLTF_UNSUPPORTED', '/extensionsRequired', `${name} is required`);
  }
  const visit = (value, place) => {
    for (const [name, x] of Object.entries(value)) {
      if (typeof x !== 'object' || x === null || name === 'extras') continue;
      if (name === 'extensions') {
        for (const extension of Object.keys(x)) {
          if (!extensionsUsed.includes(extension) && extension !== ours)
            report('GLTF_MALFORMED', `${place}/extensions/${extension}`, 'is not in extensionsUsed');
        }
      }
      visit(x, `${place}/${name}`);
    }
  };
  visit(rest, '');
}

function check_image(file, gltf, buffers, image, place, report) {
  const {uri, mimeType, bufferView} = image;
  if ((uri === undefined) === (bufferView === undefined)) {
    if (uri !== undefined || !image.extensions)
      report('GLTF_MALFORMED', place, 'needs either a uri or a bufferView');
    return;
  }
  let bytes;
  try {
    bytes = uri === undefined ? view_bytes(gltf, buffers, bufferView) : resolve_uri(file, uri, place);
  } catch (error) {
    if (!(error instanceof Issue)) throw error;
    return report('IMAGE_UNREADABLE', place, error.message);
  }
  if (!bytes) return;
  const type = PICTURES.find(([, magic]) => magic.equals(bytes.subarray(0, magic.length)))?.[0];
  if (!type) return report('GLTF_ADVICE', place, 'is in no known format');
  for (const said of [mimeType, uri && media_type(uri)])
    if (said && said !== type) report('GLTF_MALFORMED', place, `${said} is in truth ${type}`);
  if (type === 'image/png' && bytes.length < PNG_HEADER_END)
    report('IMAGE_UNREADABLE', place, 'is cut short');
}

/** The bytes of a buffer view of check_views; null where its buffer is not there. */
export function view_bytes({bufferViews}, buffers, i) {
  const {buffer, byteOffset = 0, byteLength} = bufferViews[i];
  return buffers[buffer]?.subarray(byteOffset, byteOffset + byteLength) ?? null;
}

/** Reports what breaks the rules of glTF. `ours`: the extension whose own rules are checked elsewhere. */
export function check_core(file, gltf, buffers, ours, report) {
  let errors = 0;
  const note = (code, place, message) => {
    if (code !== 'GLTF_ADVICE') ++errors;
    report(code, place, message);
  };
  check_schema(gltf, note);
  if (errors > 0) return;
  check_asset(gltf, note);
  check_lists(gltf, ours, note);
  check_views(gltf, note);
  if (errors > 0) return;
  const accessors = new Accessors(gltf, buffers, note);
  new ViewUses(gltf, note).use_all();
  new MeshCheck(gltf, accessors, note).check();
  check_hierarchy(gltf, note);
  (gltf.images ?? []).forEach((image, i) => check_image(file, gltf, buffers, image, `/images/${i}`, note));
}
