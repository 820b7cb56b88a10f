// The data sheet of a fabric file, and its picture.
import {unpack} from 'selvedge/reader/exr.js';
import {channel_values, read_headers, read_level} from 'selvedge/reader/index.js';

/** The preview in the file of a LoadedFabric as PNG, as bright as its base colour. */
export async function preview_png(bytes, {fallback}) {
  const {parts: [part]} = read_headers(bytes);
  await unpack(part, [0]);
  const {width, height} = part.levels[0], channels = read_level(part, 0), image = new ImageData(width, height);
  for (const [c, name] of [...'RGB'].entries()) {
    const values = channel_values(channels.get(name)), mean = values.reduce((sum, x) => sum + x, 0) / values.length;
    const factor = (fallback.baseColor?.[c] ?? mean) / (mean || 1);
    values.forEach((x, k) => image.data[4 * k + c] = 255 * linear_to_srgb(Math.min(1, x * factor)) + 0.5);
  }
  for (let k = 3; k < image.data.length; k += 4) image.data[k] = 255;
  const canvas = new OffscreenCanvas(width, height);
  canvas.getContext('2d').putImageData(image, 0, 0);
  return new Uint8Array(await (await canvas.convertToBlob()).arrayBuffer());
}
/** A linear component, sRGB-coded. */
export const linear_to_srgb = (x) => x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055;

/** Lines of the data sheet: members of `sheet` (spec/fabric.md), with units. */
const SHEET = [
  ['walesPerCentimetre', 'Wales', '/cm'], ['coursesPerCentimetre', 'Courses', '/cm'],
  ['plainWalesPerCentimetre', 'Wales of plain knit', '/cm'], ['plainCoursesPerCentimetre', 'Courses of plain knit', '/cm'],
  ['endsPerCentimetre', 'Ends', '/cm'],
  ['picksPerCentimetre', 'Picks', '/cm'], ['gramsPerSquareMetre', 'Weight', 'g/m²'], ['tex', 'Count', 'tex'], ['thicknessMm', 'Thickness', 'mm'],
  ['cover', 'Cover', ''], ['coverWithHairs', 'Cover with hairs', ''], ['tightness', 'Tightness', ''], ['composition', 'Fibres', ''],
];
/** The data sheet of a LoadedFabric in a file of `count` bytes: pairs of a name and a value. */
export function data_sheet_lines({sheet, mm_per_repeat, accuracy}, count) {
  const number = (x) => typeof x === 'number' ? String(Number(x.toPrecision(3))) : String(x);
  const lines = SHEET.filter(([member]) => sheet[member] !== undefined).map(([member, name, unit]) =>
    [name, [[sheet[member]].flat().map(number).join(', '), unit].filter(Boolean).join(' ')]);
  if (mm_per_repeat) lines.push(['Repeat', `${mm_per_repeat.map(number).join(' x ')} mm`]);
  const {front, yarn} = accuracy;
  if (Array.isArray(front)) lines.push(['Accuracy', `${front.map(number).join(', ')}${yarn ? `; yarn ${number(yarn)}` : ''} dB`]);
  return [...lines, ['File', `${(count / 1000).toFixed(1)} KB`]];
}
