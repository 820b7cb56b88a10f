// Makes the sample garments, dresses them in a small knit, and demands a clean bill of health.
//
//   node samples.mjs BIN_FOLDER OUTPUT_FOLDER
//
// Exit 0: no errors and no warnings in any of them. Exit 77 (skipped): the validator is not installed (npm ci).
import { execFileSync } from 'node:child_process';
import { existsSync, mkdirSync, rmSync } from 'node:fs';

const [bin, output] = process.argv.slice(2);
if (!existsSync(new URL('node_modules/gltf-validator', import.meta.url))) {
  console.log('skipped: no node_modules');
  process.exit(77);
}
const { validate } = await import('./validate.mjs');
const run = (program, ...options) => execFileSync(`${bin}/${program}`, options, { stdio: 'inherit' });
rmSync(output, { recursive: true, force: true });
mkdirSync(output, { recursive: true });
const small = '--texels 16 --views 16 --lights 16 --samples 4 --truth-samples 2'.split(' ');
run('selvedge', 'make', 'plain-knit', ...small, '-o', `${output}/knit.fabric.exr`, '--quiet');
let bad = 0;
for (const garment of ['sweater', 'tablecloth']) {
  run('selvedge-samples', garment, '-o', `${output}/${garment}-plain.glb`);
  for (const form of ['glb', 'gltf']) {
    const dressed = `${output}/${garment}.${form}`;
    run('selvedge', 'dress', `${output}/${garment}-plain.glb`, `${output}/knit.fabric.exr`, '-o', dressed, '--all');
    const report = await validate(dressed);
    console.log(`${garment}.${form}: ${report.errors} errors, ${report.warnings} warnings`);
    if (report.errors > 0 || report.warnings > 0) {
      bad += 1;
      console.log(JSON.stringify(report.messages.slice(0, 8)));
    }
  }
}
rmSync(output, { recursive: true, force: true });
process.exit(bad > 0 ? 1 : 0);
