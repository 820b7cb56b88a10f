// Makes the package: its modules, with the shader texts of viewer/shader in the module glsl.js.
//
//   node make.mjs FOLDER      FOLDER is made
import {cpSync, mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';

const here = dirname(fileURLToPath(import.meta.url)), root = join(here, '../..');
const TEXTS = {
  word_layout: 'format/fabric/word_layout.glsl',
  fabric_words: 'viewer/shader/fabric_words_texture.glsl',
  around: 'viewer/shader/around.glsl',
  evaluate: 'viewer/shader/evaluate.glsl',
  yarn: 'viewer/shader/yarn.glsl',
  footprint: 'viewer/shader/footprint.glsl',
  fabric_surface: 'viewer/shader/fabric_surface.glsl',
};
const [folder] = process.argv.slice(2);
if (!folder) {
  console.error('node make.mjs FOLDER');
  process.exit(2);
}
mkdirSync(folder, {recursive: true});
const {files} = JSON.parse(readFileSync(join(here, 'package.json'), 'utf8'));
for (const name of ['package.json', ...files.filter((file) => !['LICENSE', 'glsl.js'].includes(file))])
  cpSync(join(here, name), join(folder, name), {recursive: true});
cpSync(join(root, 'LICENSE'), join(folder, 'LICENSE'));
const modules = Object.entries(TEXTS).map(([name, path]) => {
  const text = readFileSync(join(root, path), 'utf8');
  return `export const ${name} = ${JSON.stringify(text)};\n`;
});
writeFileSync(join(folder, 'glsl.js'), `// The shader texts, from viewer/web/make.mjs.\n${modules.join('')}`);
