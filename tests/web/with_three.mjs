// A module of viewer/web that imports three.js, for Node.js.
import { createRequire } from 'node:module';
import { fileURLToPath } from 'node:url';

const modules = fileURLToPath(new URL('../node/node_modules', import.meta.url));
export async function with_three(file) {
  const { build } = createRequire(`${modules}/node`)('esbuild');
  const { outputFiles: [{ text }] } = await build({ entryPoints: [file], bundle: true, format: 'esm', write: false, nodePaths: [modules] });
  return import(`data:text/javascript;base64,${Buffer.from(text).toString('base64')}`);
}
