// Dresses the garments of the shared data and holds the result against the input.
//
//   node garments.mjs DRESS_GARMENTS DATA_FOLDER OUTPUT_FOLDER
//
// Exit 0: no dressed file has an error or warning whose code its input lacks. Exit 77 (skipped): no data, or the
// validator is not installed (npm ci).
import { execFileSync } from 'node:child_process';
import { existsSync, rmSync } from 'node:fs';

const [program, data, output] = process.argv.slice(2);
const folder = `${data}/garments`;
if (!existsSync(folder) || !existsSync(new URL('node_modules/gltf-validator', import.meta.url))) {
  console.log('skipped: no shared data or no node_modules');
  process.exit(77);
}
const { compare } = await import('./validate.mjs');
rmSync(output, { recursive: true, force: true });
const lines = execFileSync(program, [folder, output], { encoding: 'utf8', maxBuffer: 1 << 26 }).trim().split('\n');
let dressed = 0;
let written = 0;
let bad = 0;
for (const line of lines) {
  const [before, after, reason] = line.split('\t');
  if (after === '') {
    console.log(`refused: ${reason}`);
    continue;
  }
  const { fresh, messages } = await compare(before, after);
  if (reason === '') dressed += 1;
  else written += 1;
  if (fresh.length > 0) {
    bad += 1;
    console.log(`new in ${after} (from ${before}): ${JSON.stringify(messages)}`);
  }
}
console.log(`${dressed} dressed, ${written} written again, ${bad} with something new`);
rmSync(output, { recursive: true, force: true });
process.exit(bad > 0 || dressed < 40 ? 1 : 0);
