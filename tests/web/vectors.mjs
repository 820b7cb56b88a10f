// The conformance kit's queries of one light, evaluated on the graphics path of a browser into float targets:
// each within the kit's own tolerance. Two things differ for a reason: a picture has no colour where alpha is 0, and it
// holds radiance of at most 1e30, so that sums of pixels stay finite (evaluate.glsl).
//
//   node vectors.mjs PACKAGE_FOLDER KIT_FOLDER
import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import { in_browser } from './browser.mjs';

const MOST_RADIANCE = 1e30;
const [package_folder, kit] = process.argv.slice(2);

/** How far a number is from the expected one, in units of its tolerance. */
const distance = (given, expected, allowed) => given === expected ? 0 : Math.abs(given - expected) / allowed;

function worst_of({ rgb, alpha, tolerance }, [r, g, b, of_pixel]) {
  const colours = alpha === 0 ? [] : [r, g, b].map((x, c) => {
    const expected = Math.min(rgb[c], MOST_RADIANCE);
    return distance(x / of_pixel, expected, tolerance.relative * Math.abs(expected) + tolerance.absolute);
  });
  return Math.max(distance(of_pixel, alpha, tolerance.alpha), ...colours);
}

let count = 0, worst = 0;
await in_browser(package_folder, { kit }, async ({ page, errors }) => {
  for (const name of readdirSync(join(kit, 'vectors')).sort()) {
    const vectors = JSON.parse(readFileSync(join(kit, 'vectors', name), 'utf8'));
    const queries = vectors.queries.filter((query) => !query.error && !query.op);
    const results = await page.evaluate(async ([file, asked]) => {
      const { evaluated } = await import('/test/vectors_page.js');
      return evaluated(file, asked);
    }, [`/kit/${vectors.file}`, queries]);
    queries.forEach((query, i) => {
      const error = worst_of(query, results.slice(4 * i, 4 * i + 4));
      assert.ok(error <= 1, `${name}: ${error} of the tolerance; ${JSON.stringify(query)}`);
      worst = Math.max(worst, error);
      ++count;
    });
  }
  assert.deepEqual(errors, []);
});
assert.ok(count > 3000, `${count} queries`);
console.log(`${count} queries, worst error ${worst.toFixed(3)} of its tolerance`);
