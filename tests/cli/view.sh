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
  holds 'r.frames === 4 && r.width === 60 && r.height === 40 && r.seconds.evaluation > 0' turn.json
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
  refuses OPTION_OUT_OF_RANGE --turntable selvedge-view render quad.glb -o many.png --size 20x20 --turntable 721
  exits 2 selvedge-view render quad.glb -o turn.png --turntable 0
  exits 2 selvedge-view render k.fabric.exr -o turn.png --turntable 4
}

test_render_tone_curves_are_those_of_the_help() {
  make_plane_fabric
  # f of a Lambertian of albedo 0.8, 0.4, 0.2 seen and lit from above, times pi * 4.
  local options=(--light 0,0,1 --exposure 12.566370614 --repeats 1x1 --view 0,0,1)
  local curve
  for curve in none neutral; do
    selvedge-view render plane.fabric.exr -o "$curve.png" "${options[@]}" --tone-map "$curve"
  done
  selvedge-view render plane.fabric.exr -o light.exr "${options[@]}" --tone-map agx
  selvedge-view render plane.fabric.exr -o plain.exr "${options[@]}"
  same light.exr plain.exr
  # The first pixel of a PNG is stored as it is, whatever the filter of its row.
  node -e 'const fs = require("fs"), zlib = require("zlib");
    const c = [3.2, 1.6, 0.8], peak = 3.2 - 0.04, shown = 1 - 0.24 ** 2 / (peak + 0.24 - 0.76);
    const grey = 1 - 1 / (0.15 * (peak - shown) + 1);
    const curves = {none: v => v, neutral: v => (v - 0.04) * shown / peak * (1 - grey) + shown * grey};
    const srgb = v => v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055;
    for (const [name, curve] of Object.entries(curves)) {
      const bytes = fs.readFileSync(`${name}.png`), parts = [];
      for (let at = 8; at < bytes.length; at += 12 + bytes.readUInt32BE(at))
        if (bytes.toString("latin1", at + 4, at + 8) === "IDAT") parts.push(bytes.subarray(at + 8, at + 8 + bytes.readUInt32BE(at)));
      const pixel = [...zlib.inflateSync(Buffer.concat(parts)).subarray(1, 4)];
      c.forEach((v, i) => {
        const wanted = 255 * srgb(Math.min(1, curve(v)));
        // Two steps: one of rounding, one for the noise of the bake.
        if (!(Math.abs(pixel[i] - wanted) <= 2)) { console.error(name, i, pixel, wanted); process.exit(1); }
      });
    }'
  exits 2 selvedge-view render plane.fabric.exr -o x.png --tone-map filmic
}

test_render_refuses_options_that_would_have_no_effect() {
  make_scene
  exits 2 selvedge-view render k.fabric.exr -o s.png --azimuth 20
  exits 2 selvedge-view render k.fabric.exr -o s.png --variant red
  exits 2 selvedge-view render quad.glb -o s.png --repeats 2x2
  idle() {
    exits 2 selvedge-view render "${@:2}" -o s.png
    grep -q -- "^selvedge-view: $1: .*--help$" "$scratch/err" || fail "$*: $(cat "$scratch/err")"
  }
  local option
  for option in '--turntable 2' '--zoom 2' '--focus 0,0' '--layers 2' '--ambient 1' '--size 20x20' '--shadows 512'; do
    # shellcheck disable=SC2086
    idle "${option% *}" k.fabric.exr $option
  done
  for option in '--repeats 2x2' '--view 0,0,1' '--pixels-per-texel 2'; do
    # shellcheck disable=SC2086
    idle "${option% *}" k.fabric.exr --place near $option
  done
  idle --points quad.glb --level 1 --points 3
  idle --place quad.glb --place near
  idle --image-memory quad.glb --path paper --image-memory 64
  for option in '--azimuth 20' '--elevation 3' '--fov 20' --orthographic '--distance 20' '--distance-factor 3' '--look-at 1,1,1'; do
    # shellcheck disable=SC2086
    idle "${option% *}" quad.glb --camera 0 $option
  done
  idle --distance-factor quad.glb --distance 5 --distance-factor 2
  idle --fov quad.glb --orthographic --fov 20
  idle --light-frame quad.glb --light-frame camera
  idle --light-frame quad.glb --point-light 0,0,1 --light-frame camera
  idle --points quad.glb --path paper --points 3
  [ ! -e s.png ] || fail "wrote s.png"
}

# What lights of 1e-6 and 1e12 make is what a light of 1 makes, times that.
test_lights_of_any_intensity_make_numbers() {
  make_scene
  local size=(--place near --size 32x24 --supersample 1 --quiet) of
  for of in '1' '1e-3' '1e-6' '1e9' '1e12'; do
    selvedge-view render k.fabric.exr -o "view$of.exr" "${size[@]}" --light "0.3,0.2,1,$of" --exposure "$(node -p "3/$of")" -o "view$of.png"
    exits 0 compare-pictures view1.png "view$of.png" --max 0.005
  done
  exits 2 selvedge-view render k.fabric.exr -o x.png --light 0,0,1,1e13
  exits 2 selvedge truth plain-knit -o x.png --light 0,0,1,1e13
  # As near to the cloth as numbers go.
  selvedge-view render quad.glb -o point.exr --size 20x20 --quiet --point-light 0.05,0.05,1e-9,1e12
  # A single number that is none would make the difference one that JSON does not have.
  selvedge-view render quad.glb -o usual.exr --size 20x20 --quiet
  exits 0 compare-pictures point.exr usual.exr --json
  holds 'Number.isFinite(r.maxAbsolute) && r.maxAbsolute > 0'
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

test_render_point_lights_fall_off_with_the_square_of_their_distance() {
  make_scene
  local view=(--size 60x40 --quiet --look-at 0.05,0.05,0)
  # Over the middle, four times as strong at twice the distance: the same there but for the slant.
  selvedge-view render quad.glb -o near.exr "${view[@]}" --point-light 0.05,0.05,10,100
  selvedge-view render quad.glb -o far.exr "${view[@]}" --point-light 0.05,0.05,20,400
  selvedge-view render quad.glb -o sun.exr "${view[@]}" --light 0,0,1
  exits 0 compare-pictures near.exr far.exr --max 1e-3
  exits 0 compare-pictures near.exr sun.exr --max 2e-3
  # Beside lights that are far away, in any order; light adds up.
  selvedge-view render quad.glb -o both.exr "${view[@]}" --light 0,0,1,0.5 --point-light 0.05,0.05,10,50
  selvedge-view render quad.glb -o also.exr "${view[@]}" --point-light 0.05,0.05,10,50 --light 0,0,1,0.5
  exits 0 compare-pictures both.exr sun.exr --max 2e-3
  exits 0 compare-pictures both.exr also.exr --max 1e-6
  # It stands in the scene, whatever the axes of --light.
  selvedge-view render quad.glb -o turned.exr "${view[@]}" --azimuth 30 --point-light 0.05,0.05,10,100
  selvedge-view render quad.glb -o again.exr "${view[@]}" --azimuth 30 --point-light 0.05,0.05,10,100 --light 0,0,1,0 --light-frame camera
  same turned.exr again.exr
  exits 2 selvedge-view render quad.glb -o x.png --point-light 1,2
  exits 2 selvedge-view render quad.glb -o x.png --point-light 1,2,3,-1
}

test_render_draws_materials_without_fabric_by_their_core_parameters() {
  write_quad quad.gltf
  # White metal, rough: all light from around comes back, and nothing else without a light that hits it.
  local view=(--size 40x40 --quiet --orthographic --light 0,0,-1 --background 0,0,0)
  selvedge-view render quad.gltf -o metal.png "${view[@]}" --ambient 0.5
  selvedge-view render quad.gltf -o dark.png "${view[@]}" --ambient 0
  node -e 'const fs = require("fs"), g = JSON.parse(fs.readFileSync("quad.gltf", "utf8"));
    g.extensionsUsed = ["KHR_materials_unlit"];
    g.materials[0].extensions = {KHR_materials_unlit: {}};
    g.materials[0].pbrMetallicRoughness = {baseColorFactor: [0.5, 0.5, 0.5, 1]};
    fs.writeFileSync("unlit.gltf", JSON.stringify(g));'
  selvedge-view render unlit.gltf -o unlit.png "${view[@]}" --ambient 0
  exits 0 compare-pictures metal.png unlit.png --max 0.005
  exits 1 compare-pictures dark.png unlit.png --max 0.5
  exits 2 selvedge-view render quad.gltf -o x.png --ambient -1
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
  selvedge-view render "${view[@]}" -o again.exr
  selvedge-view render "${view[@]}" -o default.exr
  same again.exr default.exr
  exits 2 selvedge-view render quad.glb -o x.png --shadows 8
  exits 2 selvedge-view render quad.glb -o x.png --shadows many
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
