#!/usr/bin/env bash
# What a scene requires of its fabrics (plan), and fabrics that are made for it alone (make --for).
# shellcheck source=tests/cli/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

knit=(--texels 16 --views 16 --lights 16 --samples 4 --held-out-pairs 8 --validation-pairs 4 --rim-pairs 4 --truth-samples 8)

# A square of 0.1 m in a knit of 16 x 16 texels, a repeat every 5 x 3.8 mm: texels of 0.31 x 0.24 mm.
make_cloth() {
  selvedge make --quality paper plain-knit --set yarn=tube -o k.fabric.exr --quiet "${knit[@]}"
  write_quad quad.gltf
  selvedge dress quad.gltf k.fabric.exr -o quad.glb --all --quiet
}

# A pixel spans 2 tan(fov / 2) distance / height: 0.8284 * 1.5 / 400 = 3.107 mm. Straight on and to the middle of the frame
# that is 9.94 texels along u and 13.1 along v: between the levels log2(9.94) - 1 = 2.31 and log2(13.1) - 1 = 2.71.
far_view=(--distance 1.5 --fov 45 --size 400x400)

test_a_plan_tells_what_pixels_ask_for() {
  make_cloth
  exits 0 selvedge plan quad.glb "${far_view[@]}" -o plan.json --json
  holds 'r.verb === "plan" && r.materials.length === 1 && r.materials[0].name === "cloth"'
  holds 'r.materials[0].levels[0] === 2 && r.materials[0].levelsOfFabric === 5 && r.materials[0].lacking.join() === "0,0"'
  # A little less: of the square, the corners are farthest from the axis.
  holds 'r.materials[0].pixelMm[0] < 3.107 && r.materials[0].pixelMm[0] > 3.1'
  holds 'Math.abs(r.materials[0].texelMm - r.materials[0].pixelMm[0] / 2) < 1e-9'
  # Flat and straight on: pixels are alike to a few thousandths, and no coarser level is asked for.
  holds 'r.materials[0].pixelMm[1] < 3.12 && r.materials[0].levels[1] === 3'
  holds 'r.materials[0].fronts && !r.materials[0].backs'
  same "$scratch/out" plan.json
  # From behind, and from everywhere.
  exits 0 selvedge plan quad.glb "${far_view[@]}" --azimuth 180 --json
  holds '!r.materials[0].fronts && r.materials[0].backs'
  exits 0 selvedge plan quad.glb --distance 1.5 3 --fov 45 --size 400x400 --json
  holds 'r.materials[0].fronts && r.materials[0].backs && r.materials[0].levels[0] === 2'
  holds 'r.materials[0].pixelMm[1] === null && r.materials[0].levels[1] === 4'
  # Nearer, and finer frames.
  exits 0 selvedge plan quad.glb --distance 0.3 --fov 45 --size 400x400 --json
  holds 'r.materials[0].levels[0] === 0'
  exits 0 selvedge plan quad.glb "${far_view[@]}" --supersample 8 --json
  holds 'r.materials[0].levels[0] === 0'
  # Elsewhere.
  exits 0 selvedge plan quad.glb "${far_view[@]}" --look-at 0,9,0 --json
  holds '!r.materials[0].seen && r.materials[0].levels[0] === 4 && r.materials[0].pixelMm[0] === null'
}

# again: the options of `plan` that the sight and the frame of plan.json tell of, a line each.
again() {
  node -e 'const {sight: s, size, supersample} = JSON.parse(require("fs").readFileSync("plan.json"));
    const words = ["--size", size.join("x"), "--supersample", supersample];
    const given = (name, value) => value === undefined || words.push(name, ...[value].flat());
    for (const camera of s.cameras ?? []) given("--camera", camera);
    given("--distance", s.distances ?? s.distance);
    given("--azimuth", s.azimuth);
    given("--elevation", s.elevation);
    given("--look-at", s.lookAt?.join());
    given("--distance-factor", s.distanceFactor);
    given("--fov", s.fov);
    if (s.projection === "parallel") words.push("--orthographic");
    given("--zoom", s.zoom);
    given("--focus", s.focus.join());
    given("--scene", s.scene);
    given("--variant", s.variant);
    console.log(words.join("\n"));'
}

test_a_plan_is_made_again_from_what_it_tells() {
  make_cloth
  selvedge dress quad.gltf k.fabric.exr -o quad2.gltf --all --quiet
  # A second scene with a smaller square, a variant without a fabric, two cameras.
  node -e 'const fs = require("fs"), g = JSON.parse(fs.readFileSync("quad2.gltf"));
    g.cameras = [{type: "perspective", perspective: {yfov: 0.6, znear: 0.01}},
      {type: "orthographic", orthographic: {xmag: 0.2, ymag: 0.1, znear: 0, zfar: 9}}];
    g.nodes.push({camera: 0, name: "Front", translation: [0, 0, 2]}, {camera: 1, name: "Flat", translation: [0, 0, 4]},
      {mesh: 0, name: "Small", scale: [0.1, 0.1, 0.1]});
    g.scenes[0].nodes.push(1, 2);
    g.scenes.push({name: "Other", nodes: [3]});
    g.materials.push({...g.materials[0], name: "one side", doubleSided: false});
    g.extensions = {...g.extensions, KHR_materials_variants: {variants: [{name: "Cut"}]}};
    g.extensionsUsed.push("KHR_materials_variants");
    g.meshes[0].primitives[0].extensions = {KHR_materials_variants: {mappings: [{material: 2, variants: [0]}]}};
    fs.writeFileSync("quad2.gltf", JSON.stringify(g));'
  for options in "" "--azimuth 20 --elevation -7.25 --fov 12.5" "--orthographic --distance 0.31" \
    "--distance-factor 3.7 --zoom 2.5 --focus 0.25,0.7" "--look-at 0.01,0.02,0.3 --distance 1.1 --supersample 2" \
    "--distance 0.4 7 --zoom 1.5 --focus 0.1,0.2" "--distance 0.4 7 --orthographic --fov 50 --size 64x48" \
    "--camera Front --camera Flat --zoom 3" "--camera Front --distance 2 3 --fov 20" "--scene Other --distance 0.2" \
    "--orthographic --azimuth 10" "--variant Cut --azimuth 180"; do
    # shellcheck disable=SC2086 # several words
    exits 0 selvedge plan quad2.gltf $options -o plan.json --json
    mapfile -t words < <(again)
    exits 0 selvedge plan quad2.gltf "${words[@]}" -o second.json --quiet
    same plan.json second.json
    case $options in
    *--zoom*) holds 'r.sight.zoom > 1' plan.json ;;
    *) holds 'r.sight.zoom === 1' plan.json ;;
    esac
    cp plan.json "plan$((made = ${made:-0} + 1)).json"
  done
  # The last one looks at the back of what shows none.
  holds '!r.materials[0].seen && !r.materials[0].holes && r.materials[0].levels.join() === "4,4"' plan12.json
  # And no two of them are the same plan.
  [ "$(node -p 'new Set([...Array(11).keys()].map((i) =>
    JSON.stringify(JSON.parse(require("fs").readFileSync(`plan${i + 1}.json`)).materials))).size')" = 11 ]
}

test_holes_are_those_of_the_fabric() {
  write_plane plane.obj
  selvedge make --quality paper plane.obj --period 2x2 -o plane.fabric.exr --quiet "${small[@]}"
  write_quad quad.gltf
  selvedge dress quad.gltf plane.fabric.exr -o solid.glb --all --quiet
  exits 0 selvedge plan solid.glb "${far_view[@]}" --json
  holds '!r.materials[0].holes && r.materials[0].behind.length === 0'
  selvedge make --quality paper lace -o lace.fabric.exr --quiet "${knit[@]}"
  selvedge dress quad.gltf lace.fabric.exr -o open.glb --all --quiet
  exits 0 selvedge plan open.glb "${far_view[@]}" --json
  # "spare" is on nothing, but nobody has looked whether it is.
  holds 'r.materials[0].holes && r.materials[0].behind.includes(0)'
}

test_a_fabric_for_a_plan_is_a_small_one_and_shows_the_same() {
  make_cloth
  selvedge plan quad.glb "${far_view[@]}" -o plan.json --quiet
  exits 0 selvedge make --quality paper plain-knit --set yarn=tube -o part.fabric.exr --for plan.json "${knit[@]}" \
    --json
  holds 'r.fit.levels.length === 2 && r.fit.levels[0].texels[0] === 4'
  exits 0 selvedge info part.fabric.exr --json
  holds 'r.content.texels.join() === "4,4" && r.content.levels === 2'
  holds 'r.content.whole.level === 2 && r.content.whole.texels.join() === "16,16"'
  [ "$(stat -c %s part.fabric.exr)" -lt $(($(stat -c %s k.fabric.exr) / 2)) ]
  exits 0 selvedge check part.fabric.exr --json
  holds 'r.files[0].issues.length === 1 && r.files[0].issues[0].code === "FABRIC_LEVELS"'
  holds 'r.files[0].issues[0].place === "/whole"'
  holds 'r.files[0].issues[0].message.endsWith("levels 0-1 and 4 of 5 are missing")'
  # The levels of the whole fabric alone, in another way: what both show of a view they are for.
  selvedge repack k.fabric.exr -o packed.fabric.exr --levels 2-3 --quiet
  exits 0 selvedge info packed.fabric.exr --json
  holds 'r.content.whole.level === 2 && r.content.whole.texels.join() === "16,16"'
  for fabric in packed part; do
    selvedge dress quad.gltf $fabric.fabric.exr -o $fabric.glb --all --quiet
    exits 0 selvedge-view render $fabric.glb -o $fabric.png "${far_view[@]}" --json
    holds 'r.warnings.length === 0'
    [ ! -s "$scratch/err" ] || fail "a warning: $(cat "$scratch/err")"
  done
  selvedge-view render quad.glb -o whole.png "${far_view[@]}" --quiet
  same whole.png packed.png
  # Other rays, other noise: but for that the same.
  exits 0 selvedge-view compare whole.png part.png --max 0.1
}

test_repacking_a_part_counts_from_the_whole() {
  make_cloth
  selvedge repack k.fabric.exr -o a.exr --levels 1-4 --quiet
  selvedge repack a.exr -o b.exr --levels 2-3 --quiet
  selvedge repack k.fabric.exr -o c.exr --levels 3-4 --quiet
  same b.exr c.exr
}

# Of a twill hardly a texel is half open, and yet light comes through everywhere.
test_a_fabric_for_a_plan_is_as_open_as_the_whole() {
  write_quad quad.gltf
  local small=(--texels 16 --views 16 --lights 16 --held-out-pairs 8 --validation-pairs 4)
  selvedge make --quality paper twill --set yarn=tube -o whole.fabric.exr "${small[@]}" --quiet
  selvedge dress quad.gltf whole.fabric.exr -o whole.glb --all --quiet
  selvedge plan whole.glb --distance 1 --fov 45 --size 200x200 -o plan.json --quiet
  selvedge make --quality paper twill --set yarn=tube --for plan.json -o part.fabric.exr "${small[@]}" --quiet
  selvedge dress quad.gltf part.fabric.exr -o part.glb --all --quiet
  for glb in whole part; do
    selvedge-view render $glb.glb -o $glb.png --distance 1 --fov 45 --size 200x200 --background 1,1,1
    grep -aq '"alphaMode":"MASK"' $glb.glb || fail "$glb is opaque"
  done
  exits 0 selvedge-view compare whole.png part.png --max 0.012
}

test_a_level_is_one_of_the_whole() {
  make_cloth
  selvedge repack k.fabric.exr -o part.fabric.exr --levels 2-3 --quiet
  selvedge-view render k.fabric.exr --level 2 -o whole.exr
  selvedge-view render part.fabric.exr --level 2 -o part.exr
  same whole.exr part.exr
  refuses OPTION_OUT_OF_RANGE '--level: must lie between 2 and 3' selvedge-view render part.fabric.exr --level 0 -o none.exr
  # Where no size hangs on it the nearest takes its place, and a line says so.
  selvedge dress quad.gltf part.fabric.exr -o part.glb --all --quiet
  for level in 0 4; do
    for input in part.glb "part.fabric.exr --place near"; do
      # shellcheck disable=SC2086
      exits 0 selvedge-view render $input --level $level -o near.png --size 40x30
      [ "$(grep -c 'FABRIC_LEVELS\]$' "$scratch/err")" = 1 ] || fail "$input, level $level: $(cat "$scratch/err")"
    done
  done
  grep -q 'has levels 2-3 of the whole, and level 4 is asked for' "$scratch/err" || fail "$(cat "$scratch/err")"
  exits 0 selvedge-view render part.glb --level 3 -o near.png --size 40x30
  [ ! -s "$scratch/err" ] || fail "$(cat "$scratch/err")"
  # A whole fabric lacks none, however many are asked for.
  exits 0 selvedge-view render quad.glb --level 9 -o near.png --size 40x30
  [ ! -s "$scratch/err" ] || fail "$(cat "$scratch/err")"
}

test_asking_a_part_for_more_is_a_warning() {
  make_cloth
  selvedge repack k.fabric.exr -o part.fabric.exr --levels 2-4 --quiet
  selvedge dress quad.gltf part.fabric.exr -o part.glb --all --quiet
  exits 0 selvedge-view render part.glb -o near.png --distance 0.1 --fov 45 --size 200x200
  [ "$(wc -l <"$scratch/err")" = 1 ] || fail "not one line: $(cat "$scratch/err")"
  grep -q 'warning: part.fabric: /whole: .* \[FABRIC_LEVELS\]$' "$scratch/err" || fail "$(cat "$scratch/err")"
  [ -s near.png ]
  exits 0 selvedge-view render part.glb -o near.png --distance 0.1 --fov 45 --size 200x200 --quiet
  [ ! -s "$scratch/err" ]
  # The plan says it before.
  exits 0 selvedge plan part.glb --distance 0.1 --fov 45 --size 200x200 --json
  holds 'r.materials[0].lacking.join() === "2,0" && r.materials[0].levels[0] === 0'
}

test_a_part_without_coarser_levels_says_so() {
  make_cloth
  selvedge repack k.fabric.exr -o part.fabric.exr --levels 1-2 --quiet
  exits 0 selvedge info part.fabric.exr --json
  holds 'r.content.whole.level === 1 && r.content.whole.levels === 5 && r.content.levels === 2'
  exits 0 selvedge check part.fabric.exr --json
  holds 'r.files[0].issues.length === 1 && r.files[0].issues[0].place === "/whole"'
  holds 'r.files[0].issues[0].message.endsWith("levels 0 and 3-4 of 5 are missing")'
  # Of a part of the part the same is known.
  selvedge repack part.fabric.exr -o less.fabric.exr --levels 0 --quiet
  exits 0 selvedge info less.fabric.exr --json
  holds 'r.content.whole.level === 1 && r.content.whole.levels === 5 && r.content.levels === 1'
  # Dressed in it, a plan and a picture from afar miss the coarser ones.
  selvedge dress quad.gltf part.fabric.exr -o part.glb --all --quiet
  exits 0 selvedge plan part.glb "${far_view[@]}" --json
  holds 'r.materials[0].levelsOfFabric === 5 && r.materials[0].levels.join() === "2,3"'
  holds 'r.materials[0].lacking.join() === "0,1"'
  exits 0 selvedge-view render part.glb -o far.png "${far_view[@]}"
  [ "$(wc -l <"$scratch/err")" = 1 ] || fail "not one line: $(cat "$scratch/err")"
  grep -q 'has levels 1-2 of the whole, and levels 1-3 may be asked for.*\[FABRIC_LEVELS\]$' "$scratch/err" || fail "$(cat "$scratch/err")"
  # Swatches say the same line.
  exits 0 selvedge swatch part.fabric.exr -o far.png --place far --size 64x48
  grep -q 'has levels 1-2 of the whole.*\[FABRIC_LEVELS\]$' "$scratch/err" || fail "$(cat "$scratch/err")"
  exits 0 selvedge swatch part.fabric.exr -o far.png --place far --size 64x48 --json
  holds 'r.warnings.length === 1 && r.warnings[0].code === "FABRIC_LEVELS"'
  exits 0 selvedge-view render part.fabric.exr --place far -o far.png --size 64x48
  grep -q 'has levels 1-2 of the whole.*\[FABRIC_LEVELS\]$' "$scratch/err" || fail "$(cat "$scratch/err")"
}

test_what_is_seen_from_near_alone_needs_no_coarser_levels() {
  make_cloth
  # 0.3 mm a pixel of 0.31 x 0.24 mm texels, straight on: levels 0 and 1 of 5.
  selvedge plan quad.glb --distance 0.14 --fov 45 --size 400x400 -o plan.json --quiet
  exits 0 selvedge make --quality paper plain-knit --set yarn=tube -o near.fabric.exr --for plan.json "${knit[@]}" \
    --json
  holds 'r.fit.levels.length < 5 && r.fit.levels[0].texels[0] === 16'
  exits 0 selvedge info near.fabric.exr --json
  holds 'r.content.whole.level === 0 && r.content.whole.levels === 5 && r.content.whole.texels.join() === "16,16"'
  exits 0 selvedge check near.fabric.exr --json
  holds 'r.files[0].issues.length === 1 && r.files[0].issues[0].message.endsWith("-4 of 5 are missing")'
}

test_samples_of_a_part_make_a_part() {
  make_cloth
  selvedge plan quad.glb --distance 1.5 3 --fov 45 --size 400x400 -o plan.json --quiet
  selvedge make --quality paper plain-knit --set yarn=tube -o one.exr --for plan.json \
    --keep-samples s.exr "${knit[@]}" --quiet
  selvedge fit s.exr --quality paper -o two.exr --quiet
  same one.exr two.exr
}

test_materials_of_a_plan_are_chosen_by_name() {
  make_cloth
  selvedge plan quad.glb "${far_view[@]}" -o plan.json --quiet
  node -e 'const fs = require("fs"), r = JSON.parse(fs.readFileSync("plan.json"));
    r.materials.push({...r.materials[0], name: "close", index: 7, pixelMm: [0.1, null]});
    fs.writeFileSync("two.json", JSON.stringify(r));'
  for choice in '--material close' '--material #7' '--material cloth --material close' ''; do
    # shellcheck disable=SC2086 # several words
    selvedge make --quality paper plain-knit --set yarn=tube -o k.exr --for two.json $choice "${knit[@]}" --quiet
    exits 0 selvedge info k.exr --json
    holds 'r.content.texels.join() === "16,16" && r.content.whole === undefined'
  done
  selvedge make --quality paper plain-knit --set yarn=tube -o k.exr --for two.json --material cloth "${knit[@]}" --quiet
  exits 0 selvedge info k.exr --json
  holds 'r.content.texels.join() === "4,4"'
}

test_a_fabric_that_no_frame_sees_has_one_texel_and_a_line_says_so() {
  make_cloth
  selvedge plan quad.glb "${far_view[@]}" --look-at 0,9,0 -o plan.json --quiet
  holds '!r.materials[0].seen' plan.json
  exits 0 selvedge make --quality paper plain-knit --set yarn=tube -o k.exr --for plan.json "${knit[@]}"
  grep -qx 'selvedge: plain-knit: no frame of the plan sees its materials: the coarsest level alone is made' "$scratch/err" ||
    fail "$(cat "$scratch/err")"
  exits 0 selvedge make --quality paper plain-knit --set yarn=tube -o k.exr --for plan.json "${knit[@]}" --json
  holds 'r.bake.remarks.some((line) => line.startsWith("no frame of the plan sees")) && r.fit.levels.length === 1'
  exits 0 selvedge info k.exr --json
  holds 'r.content.texels.join() === "1,1" && r.content.whole.level === 4'
  # Beside one that is seen it does not count.
  node -e 'const fs = require("fs"), r = JSON.parse(fs.readFileSync("plan.json"));
    r.materials.push({...r.materials[0], name: "close", index: 7, seen: true, levels: [0, 4], pixelMm: [0.1, null]});
    fs.writeFileSync("two.json", JSON.stringify(r));'
  exits 0 selvedge make --quality paper plain-knit --set yarn=tube -o k.exr --for two.json "${knit[@]}" --json
  holds '!r.bake.remarks.some((line) => line.startsWith("no frame of the plan sees"))'
  exits 0 selvedge info k.exr --json
  holds 'r.content.texels.join() === "16,16"'
}

test_what_is_no_plan_is_refused() {
  make_cloth
  selvedge plan quad.glb "${far_view[@]}" -o plan.json --quiet
  make_for=(selvedge make --quality paper plain-knit --set yarn=tube -o out.exr "${knit[@]}" --for)
  refuses FILE_MISSING nowhere.json "${make_for[@]}" nowhere.json
  refuses MATERIAL_MISSING silk "${make_for[@]}" plan.json --material silk
  exits 2 selvedge make plain-knit -o out.exr --material cloth
  broken() {
    node -e 'const fs = require("fs"), r = JSON.parse(fs.readFileSync("plan.json")); eval(process.argv[1]);
      fs.writeFileSync("broken.json", JSON.stringify(r));' "$1"
    refuses JSON_MALFORMED "broken.json: $2" "${make_for[@]}" broken.json
  }
  broken 'r.verb = "make"' /verb
  broken 'delete r.look' /look/bias
  broken 'r.look.bias = 1e9' /look/bias
  broken 'r.materials = []' /materials
  broken 'r.materials[0] = 3' /materials/0
  broken 'delete r.materials[0].pixelMm' /materials/0/pixelMm
  broken 'r.materials[0].pixelMm = [-1, null]' /materials/0/pixelMm
  broken 'r.materials[0].pixelMm = ["1", null]' /materials/0/pixelMm
  # Of another program, or contradicting itself.
  broken 'r.program = "other"' /program
  broken 'r.report = 99' /report
  broken 'r.materials[0].pixelMm = [5, 1]' /materials/0/pixelMm
  broken 'r.materials[0].pixelMm = [null, 1]' /materials/0/pixelMm
  broken 'r.materials[0].seen = false' /materials/0/seen
  broken 'r.materials[0].pixelMm = [null, 0]' /materials/0/seen
  broken 'r.materials[0].levels = [3, 1]' /materials/0/levels
  broken 'r.materials[0].levels = [0.5, 1]' /materials/0/levels
  broken 'r.materials[0].levels = 3' /materials/0/levels
  broken 'r.materials[0].levelsOfFabric = 3' /materials/0/levelsOfFabric
  echo '[' >broken.json
  refuses JSON_MALFORMED broken.json "${make_for[@]}" broken.json
  cp plan.json out.exr
  exits 2 "${make_for[@]}" out.exr
  same out.exr plan.json
}

test_what_cannot_be_planned_is_refused() {
  make_cloth
  refuses FILE_MISSING nowhere.glb selvedge plan nowhere.glb -o plan.json
  refuses MATERIAL_MISSING quad.gltf selvedge plan quad.gltf -o plan.json
  refuses OPTION_OUT_OF_RANGE --camera selvedge plan quad.glb --camera Front -o plan.json
  refuses OPTION_OUT_OF_RANGE --distance selvedge plan quad.glb --distance 3 2 -o plan.json
  refuses OPTION_OUT_OF_RANGE --distance selvedge plan quad.glb --distance 0 2 -o plan.json
  refuses OPTION_OUT_OF_RANGE --fov selvedge plan quad.glb --distance 1 2 --fov 180 -o plan.json
  refuses OPTION_OUT_OF_RANGE --size selvedge plan quad.glb --size 0x10 -o plan.json
  refuses OPTION_OUT_OF_RANGE --supersample selvedge plan quad.glb --supersample 17 -o plan.json
  exits 2 selvedge plan quad.glb --distance 1 2 --azimuth 30
  exits 2 selvedge plan quad.glb --camera Front --distance 2
  exits 2 selvedge plan quad.glb --size 12
  # What is no glTF at all, and what is a damaged one, in words of ours.
  refuses JSON_MALFORMED 'k.fabric.exr: is neither glTF nor GLB' selvedge plan k.fabric.exr -o plan.json
  sed 's/"asset"/asset/' quad.gltf >broken.gltf
  refuses JSON_MALFORMED 'broken.gltf: byte 1: is not JSON' selvedge plan broken.gltf -o plan.json
  cut_short quad.gltf short.gltf
  refuses JSON_MALFORMED ': the JSON is cut short' selvedge plan short.gltf -o plan.json
  cut_short quad.glb short.glb
  exits 1 selvedge plan short.glb -o plan.json
  [ ! -e plan.json ]
}

# Frames of a turntable read every level that they ask for once.
test_many_frames_read_a_level_once() {
  make_cloth
  for frames in 12 24; do
    exits 0 selvedge-view render quad.glb -o turn.png --turntable $frames "${far_view[@]}" --json
    node -p 'JSON.parse(require("fs").readFileSync(process.argv[1])).fabricBytes.read' "$scratch/out" >bytes.$frames
  done
  same bytes.12 bytes.24
  holds 'r.fabricBytes.read < r.fabricBytes.inFiles / 2'
  exits 0 selvedge-view render quad.glb -o turn.png --turntable 12 --distance 0.3 --size 200x200 --json
  holds 'r.fabricBytes.read <= r.fabricBytes.inFiles'
}

"$2"
