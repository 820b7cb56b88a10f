#!/usr/bin/env bash
# The options of `selvedge-view render`: series, comparisons, tone curves, reports.
# shellcheck source=tests/cli/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

# png_size FILE: prints WIDTHxHEIGHT.
png_size() {
  node -e 'const b = require("fs").readFileSync(process.argv[1]);
    console.log(`${b.readUInt32BE(16)}x${b.readUInt32BE(20)}`)' "$1"
}

test_render_turntable_draws_every_frame_once_around() {
  make_scene
  selvedge-view render quad.glb -o turn.png -o turn.exr --size 60x40 --turntable 4 --elevation 20 --json >turn.json
  [ "$(echo turn*)" = 'turn-0001.exr turn-0001.png turn-0002.exr turn-0002.png turn-0003.exr turn-0003.png turn-0004.exr turn-0004.png turn.json' ] || fail "$(echo turn*)"
  holds 'r.frames === 4 && r.outputs.length === 8 && r.outputs[0] === "turn-0001.png" && r.width === 60 && r.height === 40 && r.seconds.evaluation > 0' turn.json
  [ "$(png_size turn-0003.png)" = 60x40 ] || fail "$(png_size turn-0003.png)"
  differ turn-0001.png turn-0002.png
  mkdir again
  selvedge-view render quad.glb -o again/turn.png -o again/turn.exr --size 60x40 --turntable 4 --elevation 20 --threads 1
  local frame
  for frame in 1 2 3 4; do
    same "turn-000$frame.png" "again/turn-000$frame.png"
    same "turn-000$frame.exr" "again/turn-000$frame.exr"
  done
}

test_render_turntable_leaves_all_frames_or_none() {
  make_scene
  mkdir turn-0003.png
  refuses FILE_UNWRITABLE turn-0003.png selvedge-view render quad.glb -o turn.png --size 20x20 --turntable 4
}

test_a_picture_of_a_spin_is_that_of_one_render() {
  make_scene
  selvedge dress quad.gltf k.fabric.exr -o dyed.glb --all --quiet --variant 'navy/blue=#101830' --variant sand='#b09060'
  selvedge-view render dyed.glb --turntable 3 --top --variants all -o 'spin/{variant}/{frame}.png' --size 60x40 --json >spin.json
  holds 'r.pictures.length === 8 && r.pictures.every((p) => require("fs").existsSync(p.file))' spin.json
  local variant frame words
  for variant in 0 1; do
    for frame in 1 3; do
      words=$(node -e 'const r = JSON.parse(require("fs").readFileSync("spin.json"));
        const p = r.pictures.filter((p) => p.variant === r.pictures[process.argv[1]].variant)[process.argv[2]];
        const c = p.camera;
        console.log(`${p.file} --variant=${p.variant} --azimuth=${c.azimuth} --elevation=${c.elevation} --look-at=${c.lookAt} --distance=${c.distance}`)' $variant $frame)
      # shellcheck disable=SC2086
      selvedge-view render dyed.glb -o one.png --size 60x40 ${words#* }
      same "${words%% *}" one.png
    done
  done
  [ -e spin/navy-blue/top.png ] || fail "$(find spin)"
  selvedge-view render quad.glb --turntable 2 --fabric k.fabric.exr -o '{variant}-{frame}.png' --size 60x40
  selvedge-view render quad.glb --turntable 2 -o q.png --size 60x40
  same k-0002.png q-0002.png
}

test_a_picture_of_a_sequence_is_that_of_one_time() {
  write_slide
  selvedge-view render slide.gltf --animation slide --frames 2..4 --fps 4 -o 's-%03d.png' --size 60x40
  selvedge-view render slide.gltf --animation slide --time 0.75 -o one.png --size 60x40
  same s-003.png one.png
  differ s-002.png one.png
  selvedge-view render slide.gltf --animation slide --frames 2..4 --fps 4 -o - --size 60x40 >stream
  cat s-00[234].png >all
  same stream all
}

test_render_tone_curves_change_pictures_of_bytes_alone() {
  make_plane_fabric
  local options=(--light 0,0,1 --exposure 12.566370614 --repeats 1x1 --view 0,0,1)
  for curve in none neutral agx; do
    selvedge-view render plane.fabric.exr -o "$curve.png" -o "$curve.exr" "${options[@]}" --tone-map "$curve"
    same "$curve.exr" none.exr
  done
  differ none.png neutral.png
  differ agx.png neutral.png
}

test_standard_output_that_cannot_be_written_is_an_error() {
  [ -c /dev/full ] || exit 77
  make_scene
  local status verb
  for verb in "selvedge-view --help" "selvedge-view render k.fabric.exr -o b.png --json" \
    "selvedge info k.fabric.exr --json" "selvedge stitch --list"; do
    status=0
    $verb >/dev/full 2>"$scratch/err" || status=$?
    [ "$status" = 1 ] || fail "status $status of $verb"
    [ "$(wc -l <"$scratch/err")" = 1 ] || fail "not one line of $verb: $(cat "$scratch/err")"
    grep -q 'standard output: .* \[FILE_UNWRITABLE\]$' "$scratch/err" || fail "$verb: $(cat "$scratch/err")"
  done
}

test_render_shadows_are_an_option() {
  make_scene
  local view=(quad.glb --size 60x40 --quiet --environment none)
  selvedge-view render "${view[@]}" -o plain.exr --shadows 0
  # A flat square shadows nothing: the same picture, made another way.
  selvedge-view render "${view[@]}" -o shadows.exr --json >shadows.json
  exits 0 compare-pictures plain.exr shadows.exr --max 1e-3
  holds 'r.seconds.shadows > 0' shadows.json
  # A second square before it, on the way of the light.
  node -e 'const fs = require("fs"), g = JSON.parse(fs.readFileSync("quad.gltf", "utf8"));
    g.nodes.push({mesh: 0, translation: [0.05, 0, 0.05]});
    g.scenes[0].nodes.push(1);
    fs.writeFileSync("two.gltf", JSON.stringify(g));'
  selvedge dress two.gltf k.fabric.exr -o two.glb --all --quiet
  view=(two.glb --size 60x40 --quiet --light 1,0,1)
  selvedge-view render "${view[@]}" -o open.exr --shadows 0
  selvedge-view render "${view[@]}" -o shaded.exr --shadows 512
  exits 1 compare-pictures open.exr shaded.exr --max 0.02
  # Scenes have them without a word.
  selvedge-view render "${view[@]}" -o default.exr
  differ open.exr default.exr
}

test_render_in_an_environment_has_a_light_backdrop_and_a_tone_curve() {
  make_scene
  local view=(quad.glb --size 60x40 --quiet)
  selvedge-view render "${view[@]}" -o default.png
  selvedge-view render "${view[@]}" -o given.png --exposure 1 --tone-map neutral --background 0.8,0.8,0.8
  same default.png given.png
  selvedge-view render "${view[@]}" -o plain.png --tone-map none
  differ default.png plain.png
}

test_render_paper_draws_as_published_and_points_to_hybrid_beyond() {
  make_scene
  selvedge-view render quad.glb -o paper.png --size 60x40 --tone-map none --path paper --json >paper.json
  holds 'r.path === "paper" && r.coveredPixels > 0 && r.seconds.geometry > 0 && r.seconds.evaluation > 0' paper.json
  selvedge-view render quad.glb -o hybrid.png --size 60x40 --tone-map none
  differ paper.png hybrid.png
  exits 0 compare-pictures paper.png hybrid.png --max 0.1  # nearest texels beside their mean
  selvedge make plain-knit --set yarn=tube -o products.fabric.exr --quiet "${small[@]}" >/dev/null
  refuses OPTION_OUT_OF_RANGE 'paper: the fabric has products' selvedge-view render products.fabric.exr -o x.png --path paper
}

"$2"
