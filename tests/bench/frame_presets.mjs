// frame_presets.mjs [--processor] SWEEP...: whether a preset of `selvedge-view render --quality` is beaten by another setting that
// `selvedge-view trade` has measured in the sweeps: as cheap to 10 % of the time of a frame, pictures as good (all of them,
// to 0.005 dB and 0.001 of SSIM: they are of one fabric and have no noise of their own), and better in one of these. Means
// over the sweeps, of settings that all of them have; without `--path paper`, which not every fabric can be drawn by.
// --processor: by the work of all cores, which other programs on the machine change less than the time by the clock.
// Markdown on standard output; exit status 1 where one is beaten, 2 where there is nothing to compare.
import fs from "node:fs";

const noiseOfTime = 0.1;
const noiseOfPictures = 0.005;
const noiseOfSsim = 0.001;

function refuse(line) {
  console.error(`frame_presets.mjs: ${line}`);
  process.exit(2);
}
const folders = process.argv.slice(2);
const cost = folders[0] === "--processor" ? "frameProcessorMs" : "frameMs";
if (cost === "frameProcessorMs") folders.shift();
if (folders.length === 0) refuse("no sweep; usage: frame_presets.mjs [--processor] SWEEP...");
const sweeps = folders.map((folder) => JSON.parse(fs.readFileSync(`${folder}/trade.json`, "utf8")));

// Settings by name; a record is called FABRIC--SETTING.
const nameOf = (record) => record.split("--").at(-1);
const measured = sweeps.map((sweep) => new Map(sweep.frames.map((frame) => [nameOf(frame.name), frame])));
const mean = (values) => values.reduce((a, b) => a + b) / values.length;
const settings = [...measured[0].keys()].filter((name) => !name.startsWith("paper") && measured.every((of) => of.has(name))).map((name) => {
  const of = measured.map((frames) => frames.get(name));
  return {
    name,
    options: of[0].command.replace(/.* --size \S+ ?/, "").replace(/ ?-o \S+$/, ""),
    db: mean(of.map((f) => f.pictures.all.psnr)),
    ssim: mean(of.map((f) => f.pictures.all.ssim)),
    ms: mean(of.map((f) => f[cost])),
  };
});
const presets = Object.entries(sweeps[0].framePresets ?? {}).map(([preset, record]) => {
  const setting = settings.find((s) => s.name === nameOf(record));
  if (!setting) refuse(`${preset}: ${nameOf(record)} is not measured in all sweeps`);
  return { preset, setting };
});
if (presets.length === 0) refuse("no presets: run selvedge-view trade over the sweeps");
for (const sweep of sweeps) {
  if (presets.some(({ preset, setting }) => nameOf(sweep.framePresets?.[preset] ?? "") !== setting.name))
    refuse("the sweeps mean different settings by a preset's name");
}

const beats = (a, b) => {
  const noWorse = a.ms <= b.ms * (1 + noiseOfTime) && a.db >= b.db - noiseOfPictures && a.ssim >= b.ssim - noiseOfSsim;
  const better = a.ms < b.ms * (1 - noiseOfTime) || a.db > b.db + noiseOfPictures || a.ssim > b.ssim + noiseOfSsim;
  return noWorse && better;
};
const row = ({ options, db, ssim, ms }, first, last) =>
  `| ${first} | \`${options}\` | ${db.toFixed(3)} | ${ssim.toFixed(4)} | ${ms.toFixed(1)} | ${last} |`;

let beaten = 0;
console.log(`Means over ${sweeps.map((s) => s.identity.stitch).join(", ")}.\n`);
console.log("| preset | options of `render` | pictures, dB | SSIM | ms a frame | beaten by |\n|---|---|---|---|---|---|");
for (const { preset, setting } of presets) {
  const by = settings.filter((other) => beats(other, setting));
  beaten += by.length > 0 ? 1 : 0;
  console.log(row(setting, preset, by.map((other) => `\`${other.options}\``).join(", ")));
}
console.log("\n| | all settings, by time | pictures, dB | SSIM | ms a frame | front |\n|---|---|---|---|---|---|");
for (const setting of settings.sort((a, b) => a.ms - b.ms)) {
  const names = presets.filter((p) => p.setting === setting).map((p) => p.preset).join(", ");
  const front = settings.every((other) => !beats(other, setting));
  console.log(row(setting, names, front ? "yes" : ""));
}
process.exit(beaten > 0 ? 1 : 0);
