// Features of three.js with a fabric: its lights, its shadows, motion, copies, variants (three_page.js).
//
//   node three.mjs PACKAGE_FOLDER KIT_FOLDER [WAY]
//
// WAY: nodes_way.js draws; then holes are drawn in no order, and nothing is told of little memory.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { in_browser } from './browser.mjs';

const [package_folder, kit, way = 'webgl_way.js'] = process.argv.slice(2), by_nodes = way !== 'webgl_way.js';
for (const facts of by_nodes ? ['facts'] : ['facts', 'of_little_memory']) {
  await in_browser(package_folder, { kit: join(kit, 'valid') }, async ({ page, errors }) => {
    const names = await page.evaluate(async (of) => Object.keys((await import('/test/three_page.js'))[of]), facts);
    for (const name of names.filter((name) => !by_nodes || !name.startsWith('layers'))) {
      const told = await page.evaluate(async ([of, fact]) => (await import('/test/three_page.js'))[of][fact](), [facts, name]);
      console.log(`${name}: ${told}`);
    }
    // three.js tells of a context that was lost, deletes objects of it, and looks for the bounds of all places.
    const of_three = ['Device Lost', 'does not belong to this context', 'Computed radius is NaN'];
    assert.deepEqual(errors.filter((error) => !of_three.some((text) => error.includes(text))), []);
  }, { way: `/test/${way}` });
}
