// quality_table.mjs SWEEP...: the means of sweeps over one grid as converter/presets/presets_table.cpp, on standard output.
import fs from "node:fs";

const sweeps = process.argv.slice(2).map((folder) => JSON.parse(fs.readFileSync(`${folder}/trade.json`, "utf8")));
const layers = { paper: "paper", "no-table": "no_table", "light-table": "light_table", products: "products", slabs: "slabs" };
const storage = { mixed: "mixed", half: "half", float: "whole" };
const mean = (values) => values.reduce((a, b) => a + b) / values.length;
const rows = [];
for (const first of sweeps[0].points) {
  const points = sweeps.map((sweep) => sweep.points.find((p) => p.name === first.name)).filter((p) => p);
  // A stitch whose yarns need more texels has no such point.
  if (points.length < sweeps.length) continue;
  const k = first.knobs;
  const bounces = k.bounces === "unlimited" ? "unlimited_bounces" : k.bounces;
  const figures = [
    Math.round(mean(points.map((p) => p.bytes))),
    mean(points.map((p) => p.processorSeconds)).toFixed(2),
    mean(points.map((p) => p.heldOut[0].psnr)).toFixed(2),
    mean(points.map((p) => p.pictures.all.psnr)).toFixed(2),
  ];
  rows.push(`    {{${k.texels}, ${k.views}, ${k.lights}, ${k.samples}, ${bounces}, ${k.lobes}, LayerChoice::${layers[k.layers]}, ` +
    `${k.budget ?? 0}, Storage::${storage[k.storage]}}, ${figures.join(", ")}},`);
}
const { machine } = sweeps[0].identity;
console.log(`// Written by tests/bench/trade: means over ${sweeps.map((s) => s.identity.stitch).join(", ")}, measured on
// ${machine.processor}, ${machine.cores} cores.
#include "converter/presets/presets.h"

namespace selvedge {

std::span<const ExpectedPoint> expected_points() {
  static const std::array<ExpectedPoint, ${rows.length}> rows{{
${rows.join("\n")}
  }};
  return rows;
}

}  // namespace selvedge`);
