// quality_table.mjs SWEEP...: the means of sweeps over one grid as converter/presets/presets_table.cpp, on standard output.
import fs from "node:fs";

const sweeps = process.argv.slice(2).map((folder) => JSON.parse(fs.readFileSync(`${folder}/trade.json`, "utf8")));
const mean = (values) => values.reduce((a, b) => a + b) / values.length;
const rows = [];
for (const first of sweeps[0].points) {
  const points = sweeps.map((sweep) => sweep.points.find((p) => p.name === first.name)).filter((p) => p);
  // A stitch whose yarns need more texels has no such point.
  if (points.length < sweeps.length) continue;
  // Knobs that are not those of the grid's centre, which has the defaults.
  const changed = Object.entries(first.knobs).filter(([name, value]) => value !== sweeps[0].points[0].knobs[name]);
  const knobs = changed.map(([name, value]) => `"${name}": ${JSON.stringify(value)}`).join(", ");
  const figures = [
    Math.round(mean(points.map((p) => p.bytes))),
    mean(points.map((p) => p.processorSeconds)).toFixed(2),
    mean(points.map((p) => p.heldOut[0].psnr)).toFixed(2),
    mean(points.map((p) => p.pictures.all.psnr)).toFixed(2),
  ];
  rows.push(`    {R"({${knobs}})", ${figures.join(", ")}},`);
}
const { machine } = sweeps[0].identity;
console.log(`// Written by tests/bench/trade: means over ${sweeps.map((s) => s.identity.stitch).join(", ")}, measured on
// ${machine.processor}, ${machine.cores} cores.
#include "converter/presets/presets.h"

namespace selvedge {

std::span<const MeasuredSetting> measured_settings() {
  static constexpr std::array<MeasuredSetting, ${rows.length}> rows{{
${rows.join("\n")}
  }};
  return rows;
}

}  // namespace selvedge`);
