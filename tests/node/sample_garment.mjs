// The sample garment without its compression, which programs of others may not read.
import { execFileSync } from 'node:child_process';
import { existsSync } from 'node:fs';
import { fileURLToPath } from 'node:url';

/** The file of the garment of this name in `folder`, which the program in `bin` writes. */
export function sample_garment(bin, name, folder) {
  const file = `${folder}/${name}-plain.glb`;
  if (!existsSync(file)) execFileSync(`${bin}/expand-garment`, [fileURLToPath(new URL(`../../samples/${name}.glb`, import.meta.url)), file]);
  return file;
}
