// trade_table.mjs SWEEP...: sweeps of selvedge trade, with the viewer's settings, as the page
// docs/trade_figures.md, on standard output.
import fs from "node:fs";

const views = ["near", "middle", "far", "grazing"];
const sweeps = process.argv.slice(2).map((folder) => JSON.parse(fs.readFileSync(`${folder}/trade.json`, "utf8")));
const db = (pictures) => [...views, "all"].map((view) => pictures[view].psnr.toFixed(2)).join(" | ");
const fronts = (row, names) => names.filter((name) => row.front[name]).join(", ");
const after = (command, start) => command.replace(start, "").replace(/ --seed .*/, "").replace(/ -o .*/, "").trim() || "(none)";

const { machine } = sweeps[0].identity;
console.log(`# What the settings cost, and what they are worth

The built-in stitches over the committed grid \`tests/bench/trade_grid.json\`, each judged as [\`trade.md\`](trade.md) has it. Written by
\`tests/bench/trade\`, which measures all anew; on ${machine.processor}, ${machine.cores} cores.

Of fabrics: seconds of all cores' work to bake and fit, milliseconds to open and read the file; PSNR (dB) and relative L2 of
held-out directions at 64 x 64 texels; PSNR (dB) of the four swatches and of all of them, and their mean SSIM; milliseconds of
a frame of 640 x 480 with the viewer's usual settings on ${machine.cores} cores, a mean over the four places. Of the viewer's settings, for the
fabric of the grid's first point: the same. **front**: no other point of that table has pictures as good for less of it (bytes, work,
frame).
`);
for (const sweep of sweeps) {
  const noise = views.map((view) => `${view} ${sweep.truth[view].noisePsnr?.toFixed(1) ?? "none"}`).join(", ");
  const runs = sweep.identity.repeats;
  console.log(`## ${sweep.identity.stitch}

${runs === 1 ? "One run." : `Times are medians of ${runs} runs.`} The truth's own noise, in dB: ${noise}.

| options beside \`make --quality paper\` | bytes | work s | load ms | frame ms | held out | rel. L2 | near | middle | far | grazing | all | SSIM | front |
|---|---|---|---|---|---|---|---|---|---|---|---|---|---|`);
  for (const p of sweep.points) {
    const frame = p.frameMs === undefined ? "" : p.frameMs.toFixed(0);
    console.log(`| \`${after(p.command, /^selvedge make \S+ --quality paper/)}\` | ${p.bytes.toLocaleString("en")} | ${p.processorSeconds.toFixed(1)} | ` +
      `${p.loadMs.toFixed(1)} | ${frame} | ${p.heldOut[0].psnr.toFixed(2)} | ${p.heldOut[0].relativeL2.toFixed(3)} | ${db(p.pictures)} | ` +
      `${p.pictures.all.ssim.toFixed(3)} | ${fronts(p, ["bytes", "work", "frame"])} |`);
  }
  const swept = (sweep.frames ?? []).filter((frame) => frame.swept);
  if (swept.length > 0) {
    console.log(`
| options of \`render\` | frame ms | near | middle | far | grazing | all | SSIM | front |
|---|---|---|---|---|---|---|---|---|`);
    for (const f of swept) {
      const options = after(f.command, /^selvedge-view render \S+ --place \S+ --size \S+/);
      console.log(`| \`${options}\` | ${f.frameMs.toFixed(0)} | ${db(f.pictures)} | ${f.pictures.all.ssim.toFixed(3)} | ${fronts(f, ["frame"])} |`);
    }
  }
  console.log("");
}
