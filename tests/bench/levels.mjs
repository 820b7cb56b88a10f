// levels.mjs BIN [STITCH...]: held-out PSNR of every level of what `make` makes by every preset, at its own size and at
// 32 x 32 texels, of these stitches or of all built-in ones. Levels average over more cloth the coarser they are, so each
// should be better than the one before it; exits with 1 where one is not.
import { execFileSync } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";

const [bin, ...named] = process.argv.slice(2);
const run = (...words) => JSON.parse(execFileSync(path.join(bin, "selvedge"), [...words, "--json"], { maxBuffer: 1 << 26 }));
const stitches = named.length > 0 ? named : run("stitch", "--list").stitches.map((stitch) => stitch.name);
const folder = fs.mkdtempSync(path.join(os.tmpdir(), "selvedge-levels-"));
let falling = 0;
console.log("| stitch | preset | texels | level 0, 1, ... dB |\n|---|---|---|---|");
for (const stitch of stitches) {
  for (const quality of ["draft", "standard", "paper"]) {
    const output = path.join(folder, "f.fabric.exr");
    const sizes = new Set();
    for (const texels of [[], ["--texels", "32"]]) {
      run("make", stitch, "--quality", quality, ...texels, "-o", output);
      const { content } = run("info", output);
      const size = content.texels.join("x");
      if (sizes.has(size)) continue;
      sizes.add(size);
      const values = content.accuracy.front;
      const falls = values.some((value, k) => k > 0 && value < values[k - 1]);
      falling += falls ? 1 : 0;
      console.log(`| ${stitch} | ${quality} | ${size} | ${values.map((v) => v.toFixed(2)).join(" ")}${falls ? " **falls**" : ""} |`);
    }
  }
}
fs.rmSync(folder, { recursive: true });
process.exit(falling > 0 ? 1 : 0);
