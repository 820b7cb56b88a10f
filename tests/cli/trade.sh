#!/usr/bin/env bash
# Speed against accuracy: swatches of fabrics and of stitches, sweeps, and their pages.
# shellcheck source=tests/cli/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

test_a_swatch_of_a_lambert_plane_is_the_same_traced_fitted_and_drawn() {
  make_plane_fabric
  # A plane's held-out directions are met to half precision; so are these pictures, in steps of 8 bits.
  for view in near grazing; do
    exits 0 selvedge swatch --truth plane.obj --period 2x2 --albedo 0.8,0.4,0.2 --place "$view" --size 40x30 --samples 4 \
      -o truth.png --json
    holds 'r.verb === "swatch" && r.truth === true && r.samples === 4 && r.noise < 1e-6 && r.alphaNoise === 0'
    exits 0 selvedge swatch plane.fabric.exr --place "$view" --size 40x30 -o fabric.png
    exits 0 selvedge-view render plane.fabric.exr --place "$view" --size 40x30 -o viewer.png
    exits 0 selvedge-view compare truth.png fabric.png --json
    holds '(r.psnr === null || r.psnr > 40) && r.ssim > 0.99'
    exits 0 selvedge-view compare fabric.png viewer.png --max 0.004
  done
}

test_a_traced_swatch_has_the_same_bytes_for_any_threads_and_others_for_another_seed() {
  swatch() { selvedge swatch --truth plain-knit --set yarn=tube --size 32x24 --samples 4 --quiet "$@"; }
  swatch -o a.exr --threads 1
  swatch -o b.exr --threads 3
  same a.exr b.exr
  swatch -o c.exr --seed 2
  differ a.exr c.exr
}

test_a_swatch_refuses_what_it_cannot_draw() {
  refuses FILE_MISSING none.fabric.exr selvedge swatch none.fabric.exr -o a.png
  refuses STITCH_UNKNOWN papier selvedge swatch --truth papier -o a.png
  refuses OPTION_OUT_OF_RANGE samples selvedge swatch --truth plain-knit --samples 1 -o a.png
  refuses FILE_UNWRITABLE nowhere selvedge swatch --truth plain-knit -o nowhere/a.png
  exits 2 selvedge swatch --truth plain-knit -o a.jpg
  exits 2 selvedge swatch --truth plain-knit -o a.png --place far-away
  exits 2 selvedge swatch --truth plain-knit -o a.png --size 500x100
  exits 2 selvedge-view render a.glb -o a.png --place near
}

grid='{"centre": {"texels": 8, "directions": 16, "samples": 2}, "vary": {"lobes": [1], "texels": [4]}}'
sweep() {
  selvedge trade plain-knit --set yarn=tube -o sweep --grid grid.json --repeats 1 --size 32x24 --truth-samples 4 \
    --held-out-pairs 4 --held-out-samples 4 "$@"
}
# edited STATEMENT: of JavaScript, over `r`, the record of the sweep.
edited() {
  node -e 'const fs = require("fs"), r = JSON.parse(fs.readFileSync("sweep/trade.json", "utf8"));
    eval(process.argv[1]);
    fs.writeFileSync("sweep/trade.json", JSON.stringify(r, null, 2));' "$1"
}

test_a_sweep_measures_every_point_and_the_viewer_adds_to_it() {
  echo "$grid" >grid.json
  exits 0 sweep --json
  holds 'r.points === 3 && r.measured === 3'
  exits 0 selvedge-view trade sweep --repeats 1 --size 32x24 --json
  holds 'r.measured >= 26'
  # The figures are those that `compare` tells of the same frames, but for PNG's 8 bits.
  local point
  point=$(ls sweep/fabrics | sed 's/.fabric.exr$//' | head -1)
  selvedge-view render "sweep/fabrics/$point.fabric.exr" --place near --size 32x24 -o near.png
  exits 0 selvedge-view compare sweep/truth/near.png near.png --json
  cp "$scratch/out" compared.json
  holds "Math.abs(r.points.find(p => p.name === '$point').pictures.near.psnr -
    JSON.parse(require('fs').readFileSync('compared.json')).psnr) < 0.05" sweep/trade.json
  holds 'r.identity.machine.cores > 0 && r.points.length === 3 && r.points.every(p => p.bytes > 0 && p.seconds.make > 0 &&
    p.loadMs > 0 && p.frameMs > 0 && p.heldOut.length === 4 && p.pictures.near.ssim > 0 && p.pictures.all.psnr > 10)' \
    sweep/trade.json
  holds 'r.points[0].heldOut[0].texels[0] === 8 && r.points[2].heldOut[0].texels[0] === 8' sweep/trade.json
  # The viewer shows what the reference evaluation shows: half a hundredth of a decibel is a pixel or two.
  holds 'r.frames.filter(f => f.usual).every(f =>
    Math.abs(f.pictures.all.psnr - r.points.find(p => p.name === f.fabric).pictures.all.psnr) < 0.05)' sweep/trade.json
  [ "$(grep -c '<svg xmlns' sweep/index.html)" = 6 ]
  # Nothing is measured twice, and nothing stands there twice.
  cp sweep/trade.json before.json
  exits 0 selvedge-view trade sweep --repeats 1 --size 32x24 --json
  holds 'r.measured === 0'
  same sweep/trade.json before.json
  # Beside each picture the truth, which is in the page once.
  [ "$(grep -c '<use href="#truth"/>' sweep/index.html)" = "$(grep -c '<img alt=' sweep/index.html)" ]
  holds 'r.frames.length === 24 && require("fs").readFileSync("sweep/trade.csv", "utf8").split("\n").length === 1 + 3 + 24 + 1' \
    sweep/trade.json
}

test_both_programs_tell_a_terminal_how_far_a_sweep_is_and_what_is_left() {
  echo '{"centre": {"texels": 8, "directions": 16, "samples": 2}}' >grid.json
  # util-linux's script is a terminal; a machine without pseudo-terminals has none to try.
  script -qec true /dev/null >/dev/null 2>&1 </dev/null || exit 77
  script -qec "selvedge trade plain-knit --set yarn=tube -o sweep --grid grid.json --repeats 1 --size 64x48 \
    --held-out-samples 4" /dev/null >terminal.txt </dev/null
  grep -qE $'\r\033\\[Ktrade +[0-9]+ %  [0-9]+ s, [0-9]+ s left  .' terminal.txt || fail "no progress: $(cat terminal.txt)"
  script -qec "selvedge-view trade sweep --repeats 1 --size 160x120" /dev/null >terminal.txt </dev/null
  # The settings by name, as they are measured.
  grep -qE $'\r\033\\[Ktrade +[0-9]+ %  [0-9]+ s, [0-9]+ s left  t8-.*--' terminal.txt ||
    fail "no progress of frames: $(cat terminal.txt)"
}

test_the_viewer_adds_to_a_sweep_of_its_own_machine_and_program_alone() {
  echo '{"centre": {"texels": 8, "directions": 16, "samples": 2, "budget": 20000, "layers": "products"}}' >grid.json
  sweep --quiet
  view() { selvedge-view trade sweep --repeats 1 --size 32x24 "$@"; }
  # What the paper's path refuses is left out, with a line each.
  exits 0 view
  [ "$(grep -c -- '--paper-.* is left out: ' "$scratch/err")" = 2 ] || fail "$(cat "$scratch/err")"
  holds 'r.frames.length >= 20 && r.frames.every(f => f.madeBy.machine.cores > 0 && f.madeBy.software.startsWith("selvedge ")) &&
    !r.frames.some(f => f.knobs.path === "paper") && r.frames.some(f => f.knobs.power === "fast") &&
    Object.values(r.framePresets).every(name => r.frames.some(f => f.name === name))' sweep/trade.json
  # A record of another program is measured anew; one that nothing asks for is not shown.
  edited 'const frame = r.frames.find(f => f.name.endsWith("--hybrid-level0-x1"));
    frame.madeBy.software = "selvedge 0.0";
    r.frames.push({...frame, name: frame.name.replace("level0", "level9")});'
  exits 0 view --json
  holds 'r.measured === 1'
  holds '!r.frames.some(f => f.name.includes("level9"))' sweep/trade.json
  cp sweep/trade.json kept.json
  edited 'r.identity.machine.processor = "Another"'
  refuses OPTION_OUT_OF_RANGE /identity/machine/processor view --quiet
  cp kept.json sweep/trade.json
  edited 'r.identity.software = "selvedge 0.0"'
  refuses OPTION_OUT_OF_RANGE /identity/software view --quiet
}

test_a_beaten_preset_of_frames_is_told_by_the_setting_that_beats_it() {
  mkdir one two
  # sweep_of MS_OF_OTHER DB_OF_OTHER: beside a preset of 100 ms and 20 dB.
  sweep_of() {
    node -p 'const frame = (name, frameMs, psnr) => ({name: `t8--${name}`, frameMs, pictures: {all: {psnr, ssim: 0.5}},
        command: `selvedge-view render t8.fabric.exr --place near --size 32x24 --level ${psnr} -o near.png`});
      JSON.stringify({identity: {stitch: "s"}, framePresets: {draft: "t8--usual"},
        frames: [frame("usual", 100, 20), frame("other", ...process.argv.slice(1).map(Number)), frame("far", 900, 15)]})' "$@"
  }
  presets() { node "$root/tests/bench/frame_presets.mjs" one two; }
  sweep_of 95 20.004 >one/trade.json
  cp one/trade.json two
  exits 0 presets
  sweep_of 105 20.2 >two/trade.json
  exits 1 presets
  grep -q '^| draft | .* | 20.000 | 0.5000 | 100.0 | `--level 20.004` |$' "$scratch/out" || fail "$(cat "$scratch/out")"
  # Dearer in the mean of both.
  sweep_of 140 20.2 >two/trade.json
  exits 0 presets
  sweep_of 80 19.996 >one/trade.json
  cp one/trade.json two
  exits 1 presets
  sed -i 's/"framePresets"/"others"/' one/trade.json
  exits 2 presets
}

test_the_command_of_a_point_makes_its_fabric() {
  echo "$grid" >grid.json
  sweep --quiet
  node -e 'for (const p of JSON.parse(require("fs").readFileSync("sweep/trade.json", "utf8")).points)
    console.log(p.command + " --quiet")' >commands
  [ "$(wc -l <commands)" = 3 ]
  # shellcheck disable=SC1091
  source ./commands
  for made in *.fabric.exr; do
    selvedge evaluate "$made" --texel 1,2 --light 0,0.6,0.8 >a.json
    selvedge evaluate "sweep/fabrics/$made" --texel 1,2 --light 0,0.6,0.8 >b.json
    same a.json b.json
  done
}

test_an_interrupted_sweep_goes_on_where_it_was() {
  echo "$grid" >grid.json
  sweep --quiet
  cp sweep/trade.json before.json
  edited 'r.points = r.points.filter(p => p.name.includes("-2lobes-"))'
  rm sweep/index.html
  exits 0 sweep --json
  holds 'r.points === 3 && r.measured === 1'
  [ -f sweep/index.html ]
  holds 'const before = JSON.parse(require("fs").readFileSync("before.json")).points;
    r.points.every((p, i) => p.name === before[i].name && (p.name.includes("-1lobes-") || p.seconds.make === before[i].seconds.make))' \
    sweep/trade.json
  exits 0 sweep --json
  holds 'r.measured === 0'
  # Points of another grid in the same folder are still known.
  echo '{"centre": {"texels": 8, "directions": 16, "samples": 2}}' >grid.json
  exits 0 sweep --json
  holds 'r.points === 1 && r.measured === 0'
  holds 'r.points.length === 1' sweep/trade.json
  echo "$grid" >grid.json
  exits 0 sweep --json
  holds 'r.points === 3 && r.measured === 0'
}

test_a_folder_keeps_to_one_sweep() {
  echo "$grid" >grid.json
  sweep --quiet
  refuses OPTION_OUT_OF_RANGE seed sweep --seed 7
  refuses OPTION_OUT_OF_RANGE repeats selvedge trade plain-knit --set yarn=tube -o sweep --grid grid.json
  echo '{"centre": {"texels": 7.5}}' >grid.json
  refuses OPTION_OUT_OF_RANGE /centre/texels sweep
  printf '{\n  "centre":' >grid.json
  refuses JSON_MALFORMED 'grid.json: line 2, column 12: the JSON is cut short' sweep
  echo '{"centre": {"texels": 8, "texels": 4}}' >grid.json
  refuses JSON_MALFORMED '/centre/texels: stands there twice' sweep
  echo '{"centre": {"layers": "products"}}' >grid.json
  refuses OPTION_OUT_OF_RANGE 'has no budget to choose its layers within' sweep
  refuses FILE_MISSING none.json selvedge trade plain-knit -o sweep --grid none.json
  refuses FILE_MISSING nowhere selvedge-view trade nowhere
}

test_a_folder_belongs_to_the_sweep_that_began_in_it() {
  mkdir sweep
  printf '{"identity":3}' >sweep/trade.json
  printf '{"centre":{"texels":8,"directions":16,"samples":2,"layers":"paper"}}' >grid.json
  refuses FILE_DAMAGED sweep/trade.json selvedge trade plain-knit -o sweep --grid grid.json --quiet
  # Whatever is there when it is broken off, the folder says whose it is.
  rm sweep/trade.json
  (timeout -s KILL 2 selvedge trade plain-knit --set yarn=tube -o sweep --grid grid.json --truth-samples 4000 \
    --quiet || true) 2>"$scratch/err"
  refuses OPTION_OUT_OF_RANGE sweep/trade.json selvedge trade plain-weave -o sweep --grid grid.json --quiet
}

test_what_is_damaged_in_a_sweep_is_measured_again() {
  echo "$grid" >grid.json
  sweep --quiet
  cp -r sweep before
  edited 'r.points = r.points.map(p => p.name.includes("-1lobes-") ? {name: p.name} : p);
    r.truth.near = [1];
    r.bakes = 3;
    r.framePresets = "x";
    r.truth.middle.noisePsnr = "loud";'
  rm sweep/truth/middle.png
  cp sweep/pictures/truth.png sweep/truth/far.exr
  # Another size is another picture.
  selvedge swatch --truth plain-knit --set yarn=tube --place grazing --size 24x24 --samples 2 \
    -o sweep/truth/grazing.exr --quiet
  cut_short sweep/truth/held-out.samples.exr short && cp short sweep/truth/held-out.samples.exr
  rm sweep/fabrics/t4-*
  exits 0 sweep --json
  holds 'r.points === 3 && r.measured === 2'
  for file in near.exr middle.exr middle.png far.exr grazing.exr held-out.samples.exr; do
    same "sweep/truth/$file" "before/truth/$file"
  done
  holds 'const before = JSON.parse(require("fs").readFileSync("before/trade.json"));
    ["near", "middle", "far", "grazing"].every(view => r.truth[view].noisePsnr === before.truth[view].noisePsnr)' sweep/trade.json
  exits 0 sweep --json
  holds 'r.measured === 0'
}

test_a_fabric_cut_short_is_made_again() {
  echo "$grid" >grid.json
  sweep --quiet
  cp -r sweep before
  fabric=$(ls sweep/fabrics/t4-*)
  other=$(ls sweep/fabrics/*-1lobes-*)
  head -c 3000 "before/${fabric#*/}" >"$fabric"
  : >"$other"
  exits 0 sweep --json
  holds 'r.points === 3 && r.measured === 2'
  same "$fabric" "before/${fabric#*/}"
  same "$other" "before/${other#*/}"
  # Of its size, but not what was written.
  size=$(stat -c %s "$fabric")
  head -c "$size" /dev/zero >"$fabric"
  exits 0 sweep --json
  holds 'r.measured === 1'
  same "$fabric" "before/${fabric#*/}"
}

test_a_point_whose_budget_cannot_be_met_is_left_out() {
  echo '{"centre": {"texels": 8, "directions": 16, "samples": 2}, "vary": {"lobes": [1]},
    "points": [{"layers": "products", "budget": 1}]}' >grid.json
  exits 0 sweep --json
  holds 'r.points === 2 && r.measured === 2'
  grep -qE '^selvedge: plain-knit: t8-.* is left out: 1 bytes; the smallest fabric found has ' "$scratch/err" ||
    fail "$(cat "$scratch/err")"
  holds 'r.points.length === 2' sweep/trade.json
  [ -z "$(find sweep/bakes -name '*.exr')" ]
  # It is known from then on.
  exits 0 sweep --json
  holds 'r.points === 2 && r.measured === 0'
  grep -q 'is left out: 1 bytes' "$scratch/err" || fail "$(cat "$scratch/err")"
  exits 0 selvedge-view trade sweep --repeats 1 --size 32x24 --quiet
  holds 'r.points.length === 2' sweep/trade.json
  echo '{"centre": {"texels": 8, "directions": 16, "samples": 2, "layers": "products", "budget": 1}}' >grid.json
  exits 1 sweep --quiet
  grep -q -- '--grid: has no point that can be made \[OPTION_OUT_OF_RANGE\]' "$scratch/err" || fail "$(cat "$scratch/err")"
}

test_damaged_records_of_points_are_measured_anew_and_refused_by_the_viewer() {
  echo '{"centre": {"texels": 8, "directions": 16, "samples": 2}}' >grid.json
  sweep --quiet
  for change in 'r.points[0].bytes = null' 'r.points[0].pictures.far.psnr = "x"' 'delete r.points[0].command'; do
    edited "$change"
    refuses FILE_DAMAGED /points/0 selvedge-view trade sweep --repeats 1 --size 32x24
    exits 0 sweep --json
    holds 'r.measured === 1'
  done
  cp sweep/trade.json kept.json
  for change in 'r.trade = 2' 'delete r.truth.far.noisePsnr'; do
    edited "$change"
    refuses FILE_DAMAGED sweep/trade.json selvedge-view trade sweep --repeats 1 --size 32x24
    cp kept.json sweep/trade.json
  done
  refuses FILE_MISSING none/trade.json selvedge-view trade none
}

test_damaged_records_of_frames_are_measured_anew_and_stop_no_sweep() {
  echo '{"centre": {"texels": 8, "directions": 16, "samples": 2}}' >grid.json
  sweep --quiet
  view() { selvedge-view trade sweep --repeats 1 --size 32x24 "$@"; }
  view --quiet
  cp sweep/trade.json kept.json
  for damaged in '[]' '"x"' '{"frames": 1}'; do
    edited "r.frames = $damaged"
    exits 0 sweep --quiet
    holds 'r.points.length === 1 && r.frames.length === 0' sweep/trade.json
  done
  cp kept.json sweep/trade.json
  edited 'const frame = name => r.frames.find(f => f.name.endsWith(name));
    frame("--hybrid-level0-x1").swept = "yes";
    frame("--hybrid-level0-x2").usual = [1];
    delete frame("--hybrid-level0-x3").pictures;'
  exits 0 view --json
  holds 'r.measured === 3'
  holds 'const names = all => JSON.stringify(all.map(f => f.name));
    r.frames.length >= 20 && names(r.frames) === names(JSON.parse(require("fs").readFileSync("kept.json")).frames)' sweep/trade.json
}

test_the_viewer_refuses_a_sweep_whose_points_are_not_there() {
  echo '{"centre": {"texels": 8, "directions": 16, "samples": 2}}' >grid.json
  sweep --quiet
  view() { selvedge-view trade sweep --repeats 1 --size 32x24 "$@"; }
  cp sweep/trade.json kept.json
  for name in another "$(printf 'x%.0s' $(seq 200))"; do
    edited "r.points[0].name = '$name'"
    refuses FILE_MISSING trade.json view
  done
  for name in ../../outside /tmp/outside .. ''; do
    edited "r.points[0].name = '$name'"
    refuses FILE_DAMAGED sweep/trade.json view
  done
  for points in '{}' '[1]'; do
    edited "r.points = $points"
    refuses FILE_DAMAGED sweep/trade.json view
  done
  edited 'r.points = []'
  refuses FILE_MISSING trade.json view
  cp kept.json sweep/trade.json
  rm sweep/fabrics/*
  refuses FILE_MISSING trade.json view
}

test_pictures_from_other_places_are_another_sweep() {
  echo '{"centre": {"texels": 8, "directions": 16, "samples": 2}}' >grid.json
  sweep --quiet
  edited 'r.identity.places = "0123"'
  refuses OPTION_OUT_OF_RANGE places sweep --quiet
  refuses OPTION_OUT_OF_RANGE /identity/places selvedge-view trade sweep --quiet
  edited 'delete r.identity.places'
  refuses OPTION_OUT_OF_RANGE places sweep --quiet
  refuses FILE_DAMAGED /identity/places selvedge-view trade sweep --quiet
}

test_the_table_of_a_sweep_without_noise_says_so() {
  mkdir sweep
  node -p 'const view = {psnr: 20, ssim: 0.5}, noise = {noisePsnr: 40};
    JSON.stringify({identity: {stitch: "s", repeats: 1, machine: {processor: "p", cores: 1}},
      truth: {near: {noisePsnr: null}, middle: noise, far: noise, grazing: noise},
      points: [{command: "selvedge make s -o s.fabric.exr", bytes: 1, processorSeconds: 1, loadMs: 1,
        heldOut: [{psnr: 20, relativeL2: 0.1}], front: {bytes: true},
        pictures: {near: view, middle: view, far: view, grazing: view, all: view}}]})' >sweep/trade.json
  exits 0 node "$root/tests/bench/trade_table.mjs" sweep
  grep -qF 'in dB: near none, middle 40.0, far 40.0, grazing 40.0.' "$scratch/out" || fail "$(cat "$scratch/out")"
}

test_a_sweep_leaves_nothing_of_one_that_was_killed() {
  printf '{"centre":{"texels":8,"directions":64,"samples":200}}' >grid.json
  local begin=(selvedge trade plain-knit --set yarn=tube -o sweep --grid grid.json --repeats 1 --size 22x22
    --truth-samples 4 --held-out-pairs 1 --held-out-samples 2 --quiet)
  # Killed as soon as its bake has begun. No function here: $! would be the shell around the program.
  "${begin[@]}" &
  for _ in $(seq 1200); do
    if [ -n "$(find sweep/bakes -name '*.journal*' 2>/dev/null)" ]; then break; fi
    sleep 0.05
  done
  kill -KILL $!
  wait $! 2>/dev/null || true
  [ -n "$(ls sweep/bakes)" ] || fail "was killed too early or too late"
  exits 0 "${begin[@]}"
  [ -z "$(ls sweep/bakes)" ] || fail "left behind: $(ls sweep/bakes)"
  # Samples that were still needed when it was killed, and no longer are.
  touch sweep/bakes/t8-v64-l64-s200-b2.samples.exr
  exits 0 "${begin[@]}"
  [ -z "$(ls sweep/bakes)" ] || fail "left behind: $(ls sweep/bakes)"
}

test_a_sweep_refuses_halves_that_are_not_alike() {
  exits 2 selvedge trade plain-knit -o sweep --truth-samples 5
  exits 2 selvedge trade plain-knit -o sweep --held-out-samples 3
  [ ! -e sweep ]
}

"$2"
