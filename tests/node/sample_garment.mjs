// A sample garment: a copy of that which CTest's fixture has made in $SELVEDGE_GARMENTS, or a new one.
import { execFileSync } from 'node:child_process';
import { copyFileSync, existsSync } from 'node:fs';

/** The file of the garment of this name in `folder`; without the fixture it is made by the program in `bin`. */
export function sample_garment(bin, name, folder) {
  const file = `${folder}/${name}-plain.glb`, made = process.env.SELVEDGE_GARMENTS;
  if (existsSync(file)) return file;
  if (made) copyFileSync(`${made}/${name}.glb`, file);
  else execFileSync(`${bin}/selvedge-samples`, [name, '-o', file]);
  return file;
}
