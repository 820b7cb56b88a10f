// trade_table.mjs SWEEP...: sweeps of selvedge trade as Markdown tables for spec/trade.md, on standard output.
import fs from "node:fs";

for (const folder of process.argv.slice(2)) {
  const sweep = JSON.parse(fs.readFileSync(`${folder}/trade.json`, "utf8"));
  const { machine, stitch, repeats } = sweep.identity;
  const noise = Object.entries(sweep.truth).map(([view, t]) => `${view} ${t.noisePsnr.toFixed(1)}`).join(", ");
  console.log(`**${stitch}** (${machine.processor}, ${machine.cores} cores; medians of ${repeats}; the truth's own noise in dB: ${noise}).\n`);
  console.log("| options of `make` | bytes | s, all cores | held out | near | middle | far | grazing | all | SSIM | front |");
  console.log("|---|---|---|---|---|---|---|---|---|---|---|");
  for (const p of sweep.points) {
    const options = p.command.replace(/^selvedge make \S+/, "").replace(/ --seed .*/, "").trim() || "(default)";
    const db = (view) => p.pictures[view].psnr.toFixed(2);
    const front = [p.front.bytes && "bytes", p.front.work && "work"].filter(Boolean).join(", ");
    console.log(`| \`${options}\` | ${p.bytes.toLocaleString("en")} | ${p.processorSeconds.toFixed(1)} | ${p.heldOut[0].psnr.toFixed(2)} | ` +
      `${db("near")} | ${db("middle")} | ${db("far")} | ${db("grazing")} | ${db("all")} | ${p.pictures.all.ssim.toFixed(3)} | ${front} |`);
  }
  console.log("");
}
