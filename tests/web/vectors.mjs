// The conformance kit's queries of one light, answered by the WebAssembly module: each within the kit's own tolerance.
//
//   node vectors.mjs PACKAGE_FOLDER KIT_FOLDER
import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { join, resolve } from 'node:path';

const [package_folder, kit] = process.argv.slice(2).map((path) => resolve(path));
const { CellModule } = await import(join(package_folder, 'cells.js'));
const { open_fabric } = await import(join(package_folder, 'reader/index.js'));
const cells = new CellModule(new WebAssembly.Module(readFileSync(join(package_folder, 'cells.wasm'))));

/** How far a number is from the expected one, in units of its tolerance. */
const distance = (given, expected, allowed) => given === expected ? 0 : Math.abs(given - expected) / allowed;

let count = 0, worst = 0;
for (const name of readdirSync(join(kit, 'vectors')).sort()) {
  const { file, queries } = JSON.parse(readFileSync(join(kit, 'vectors', name), 'utf8'));
  const fabric = cells.add_fabric(await open_fabric(new Uint8Array(readFileSync(join(kit, file)))));
  for (const query of queries.filter(({ error, op }) => !error && !op)) {
    const { rgb, alpha, tolerance } = query, given = cells.query(fabric, query);
    const errors = rgb.map((x, c) => distance(given[c], x, tolerance.relative * Math.abs(x) + tolerance.absolute));
    const error = Math.max(distance(given[3], alpha, tolerance.alpha), ...errors);
    assert.ok(error <= 1, `${name}: ${error} of the tolerance; ${JSON.stringify(query)}`);
    worst = Math.max(worst, error);
    ++count;
  }
}
assert.ok(count > 3000, `${count} queries`);
console.log(`${count} queries, worst error ${worst.toFixed(3)} of its tolerance`);
