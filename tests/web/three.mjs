// Features of three.js with a fabric: its lights, its shadows, motion, copies, variants (three_page.js).
//
//   node three.mjs PACKAGE_FOLDER KIT_FOLDER
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { here, in_browser } from './browser.mjs';

const [package_folder, kit] = process.argv.slice(2);
await in_browser(package_folder, { kit: join(kit, 'valid'), repository: join(here, '../..') }, async ({ page, errors }) => {
  const names = await page.evaluate(async () => Object.keys((await import('/test/three_page.js')).facts));
  for (const name of names) {
    const told = await page.evaluate(async (fact) => (await import('/test/three_page.js')).facts[fact](), name);
    console.log(`${name}: ${told}`);
  }
  // three.js deletes objects of a context that was lost.
  assert.deepEqual(errors.filter((error) => !error.includes('does not belong to this context')), []);
});
