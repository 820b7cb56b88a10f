// make_presets.mjs SWEEP...: what the presets of `make --quality` come to in these sweeps, and which points of their grid
// beat them: as small, made with as little work, with pictures and held-out directions as good, beyond the noise, and better in one of
// them. Exits with 1 where a point beats a preset for one of the stitches or in the means over them.
import fs from "node:fs";

const noise = { bytes: 0.01, work: 0.1, picture: 0.05 };
const sweeps = process.argv.slice(2).map((folder) => JSON.parse(fs.readFileSync(`${folder}/trade.json`, "utf8")));
const figures = (p) => ({ bytes: p.bytes, work: p.processorSeconds, picture: p.pictures.all.psnr, heldOut: p.heldOut[0].psnr, frame: p.frameMs });
const mean = (all) => Object.fromEntries(Object.keys(all[0]).map((key) => [key, all.reduce((sum, f) => sum + f[key], 0) / all.length]));
const beats = (a, b) => {
  const noWorse = a.bytes <= b.bytes * (1 + noise.bytes) && a.work <= b.work * (1 + noise.work) && a.picture >= b.picture - noise.picture &&
    a.heldOut >= b.heldOut - noise.picture;
  const better = a.bytes < b.bytes * (1 - noise.bytes) || a.work < b.work * (1 - noise.work) || a.picture > b.picture + noise.picture ||
    a.heldOut > b.heldOut + noise.picture;
  return noWorse && better;
};

const tables = sweeps.map((sweep) => ({ name: sweep.identity.stitch, points: new Map(sweep.points.map((p) => [p.name, figures(p)])) }));
const common = [...tables[0].points.keys()].filter((name) => tables.every((table) => table.points.has(name)));
tables.push({ name: "mean", points: new Map(common.map((name) => [name, mean(tables.map((table) => table.points.get(name)))])) });

let beaten = 0;
console.log("| preset | stitch | bytes | work, s | held out, dB | pictures, dB | ms a frame | beaten by |\n|---|---|---|---|---|---|---|---|");
for (const [preset, name] of Object.entries(sweeps[0].presets)) {
  for (const table of tables) {
    const own = table.points.get(name);
    if (!own) {
      console.log(`| ${preset} | ${table.name} | is no point of this grid |`);
      beaten += 1;
      continue;
    }
    const better = [...table.points].filter(([other, f]) => other !== name && beats(f, own)).map(([other]) => other);
    beaten += better.length;
    console.log(`| \`${preset}\` | ${table.name} | ${Math.round(own.bytes).toLocaleString("en")} | ${own.work.toFixed(1)} | ${own.heldOut.toFixed(2)} | ` +
      `${own.picture.toFixed(2)} | ${own.frame?.toFixed(0) ?? ""} | ${better.join(", ")} |`);
  }
}
process.exit(beaten > 0 ? 1 : 0);
