// Files of Node.js for run().
import { spawn } from 'node:child_process';
import { accessSync, constants, readdirSync, readFileSync, renameSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { dirname, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { deflateSync } from 'node:zlib';

/** A name as the program takes it: a file: address as a path; of Windows with slashes. */
export function plain_word(word, windows = process.platform === 'win32') {
  const name = /^file:\/\//.test(word) ? fileURLToPath(word, { windows }) : word;
  return windows ? name.replaceAll('\\', '/') : name;
}

/** A page with `text_of` each module that the package has as a file, too. */
export const page_with = (page, text_of) => Object.entries({ program: 'selvedge.wasm', cells: '../cells.wasm' }).reduce(
  (page, [id, file]) => page.replace(new RegExp(`(id="${id}">)[^<]*`), (_, start) => start + text_of(file)), page);

/** The command that opens a file in the browser of a system. */
export const opener = (path, system = process.platform) =>
  system === 'win32' ? ['cmd', ['/c', 'start', '""', `"${path}"`]] : [system === 'darwin' ? 'open' : 'xdg-open', [path]];

/** The host of a process: its files, its standard output and error. */
export const node_host = () => ({
  folder: plain_word(process.cwd()),
  shared: plain_word(new URL('.', import.meta.url).href.replace(/\/$/, '')),
  exists: (path) => {
    const status = statSync(path, { throwIfNoEntry: false });
    return status && (status.isDirectory() ? 'folder' : status.isFile() ? 'file' : 'other');
  },
  read(path) {
    if (![`${this.shared}/page.html`, `${this.shared}/design.html`].includes(path)) return readFileSync(path);
    const packed = (file) => deflateSync(readFileSync(`${this.shared}/${file}`), { level: 9 }).toString('base64');
    return Buffer.from(page_with(readFileSync(path, 'utf8'), packed));
  },
  list: (path) => readdirSync(path),
  refusal: (path) => {
    try {
      accessSync(dirname(path), constants.W_OK);
    } catch (error) {
      return error.code;
    }
  },
  write: (path, bytes) => {
    const part = `${path}.part-${process.pid}`;
    try {
      writeFileSync(part, bytes);
      renameSync(part, path);
    } catch (error) {
      rmSync(part, { force: true });
      throw error;
    }
  },
  open: (path) => {
    const [program, words] = opener(resolve(path));
    const child = spawn(program, words, { detached: true, stdio: 'ignore', windowsVerbatimArguments: true });
    child.on('error', () => {}).unref();
    return child.pid !== undefined;
  },
  stdout: (text) => process.stdout.write(text),
  stderr: (text) => process.stderr.write(text)
});
