// The data sheet of a fabric file.
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
