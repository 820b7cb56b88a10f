#!/usr/bin/env bash
# The whole road in small, from the stitch to the picture, against closed forms and against itself.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

# shows FILE.exr COSINE: every pixel that is covered is albedo / pi times the cosine within 1 %.
shows() {
  oiiotool --dumpdata "$1" >"$scratch/pixels"
  node -e 'const cosine = Number(process.argv[2]);
    const pixels = require("fs").readFileSync(process.argv[1], "utf8").split("\n").filter(l => l.includes("Pixel"))
      .map(l => l.split(":")[1].trim().split(/\s+/).map(Number)).filter(p => p[3] === 1);
    const good = p => [0.8, 0.4, 0.2].every((a, c) => Math.abs(p[c] / (a / Math.PI * cosine) - 1) < 0.01);
    const bad = pixels.find(p => !good(p));
    if (pixels.length < 100 || bad) { console.error(pixels.length, bad); process.exit(1); }' \
    "$scratch/pixels" "$2" || fail "$1 is not albedo / pi x $2"
}

test_dressed_square_shows_albedo_over_pi_times_cosine() {
  make_plane_fabric
  exits 0 selvedge dress quad.gltf plane.fabric.exr -o dressed.glb --material cloth --json
  # 100 mm of square, 2 mm of fabric, one unit of texture coordinates.
  holds "r.embedded && r.materials[0].repeats.every(n => Math.abs(n - 50) < 0.001) && r.materials[0].metresPerUv.every(m => Math.abs(m - 0.1) < 1e-6)"
  exits 0 selvedge check dressed.glb
  selvedge-view render dressed.glb -o front.exr --size 64x64 --light 0,0.6,0.8 --quiet
  shows front.exr 0.8
  selvedge-view render dressed.glb -o slanted.exr --size 64x64 --light 0,0.6,0.8 --azimuth 40 --elevation 30 --quiet
  shows slanted.exr 0.8
  # From behind: the cloth is double-sided, and the light is on that side too.
  selvedge-view render dressed.glb -o behind.exr --size 64x64 --light 0,0,-1 --azimuth 180 --quiet
  shows behind.exr 1
}

test_a_colourway_shows_its_colour_and_another_fabric_its_own() {
  make_plane_fabric
  selvedge make --quality paper plane.obj --period 2x2 --albedo 0.1,0.2,0.3 -o dark.fabric.exr --quiet "${small[@]}"
  exits 0 selvedge dress quad.gltf dark.fabric.exr -o dressed.glb --all --json --variant orange=#e7aa7c \
    --variant plane=plane.fabric.exr
  holds "r.variants.length === 2 && r.variants[0].of === 0 && r.variants[1].index === 3 &&
    Math.abs(r.variants[0].tint[0] - 8) < 0.08"
  exits 0 selvedge check dressed.glb
  # 0.8, 0.4, 0.2 is #e7aa7c: both variants have the same colour, by a factor and by a fabric.
  for variant in orange plane; do
    exits 0 selvedge-view render dressed.glb -o v.exr --size 64x64 --light 0,0.6,0.8 --variant $variant --json
    holds 'r.fabrics === 1 && r.fabricMemory > 0'
    shows v.exr 0.8
  done
  refuses OPTION_OUT_OF_RANGE 'the garment has a "plane" already' selvedge dress dressed.glb dark.fabric.exr -o e.glb --all \
    --variant plane=#ffffff
  exits 0 selvedge dress quad.gltf dark.fabric.exr -o e.glb --all --json --variant $'r\xe9d=#ff0000'
  holds "r.variants[0].name.endsWith('xE9d')"
}

test_info_measures_the_set_that_it_is_told_and_names_what_a_garment_brings() {
  make_plane_fabric
  # Set 1 is half of set 0, so that a unit of it is twice as long.
  node -e 'const file = process.argv[1], json = JSON.parse(require("fs").readFileSync(file));
    const uvs = Buffer.from(new Float32Array([0, 0.5, 0.5, 0.5, 0.5, 0, 0, 0]).buffer);
    json.buffers.push({byteLength: 32, uri: "data:application/octet-stream;base64," + uvs.toString("base64")});
    json.bufferViews.push({buffer: 1, byteLength: 32, target: 34962});
    json.accessors.push({bufferView: 4, componentType: 5126, count: 4, type: "VEC2"});
    json.meshes[0].primitives[0].attributes.TEXCOORD_1 = 4;
    require("fs").writeFileSync(file, JSON.stringify(json));' quad.gltf
  exits 0 selvedge dress quad.gltf plane.fabric.exr -o d.glb --all --texcoord 1 --colour '#e70000' --json
  holds "r.materials[0].repeats.every(n => Math.abs(n - 100) < 0.001)"
  exits 0 selvedge info d.glb --json
  holds "r.content.materials[0].texCoord === 1 && Math.abs(r.content.materials[0].brings.tint[0] - 1) < 0.02"
}

test_a_garment_of_ply_is_dressed_with_its_coordinates_and_unwrapped_without() {
  make_plane_fabric
  local head=(ply 'format ascii 1.0' 'element vertex 4' 'property float x' 'property float y' 'property float z')
  local faces=('element face 1' 'property list uchar int vertex_indices' end_header)
  printf '%s\n' "${head[@]}" 'property float s' 'property float t' "${faces[@]}" '0 0 0 0 0' '0.1 0 0 1 0' '0.1 0.1 0 1 1' \
    '0 0.1 0 0 1' '4 0 1 2 3' >uv.ply
  printf '%s\n' "${head[@]}" "${faces[@]}" '0 0 0' '0.1 0 0' '0.1 0.1 0' '0 0.1 0' '4 0 1 2 3' >plain.ply
  exits 0 selvedge info uv.ply --json
  holds "r.kind === 'gltf' && r.content.triangles === 2"
  exits 0 selvedge dress uv.ply plane.fabric.exr -o uv.glb --all --json
  holds "r.materials[0].repeats.every(n => Math.abs(n - 50) < 0.001)"
  refuses GARMENT_NO_UVS plain.ply selvedge dress plain.ply plane.fabric.exr -o o.glb --all --unwrap never
  exits 0 selvedge dress plain.ply plane.fabric.exr -o plain.glb --all --json
  holds "r.unwrapped[0].charts === 1 && Math.abs(r.unwrapped[0].stretch - 1) < 1e-4 && Math.abs(r.materials[0].repeats[0] - 500) < 0.05"
  for name in uv plain; do
    exits 0 selvedge check $name.glb
    selvedge-view render $name.glb -o $name.exr --size 64x64 --light 0,0.6,0.8 --quiet
    shows $name.exr 0.8
  done
}

# lets_through FILE.exr: how many pixels of its middle show the background.
lets_through() {
  oiiotool --dumpdata "$1" | awk -F '[(,) ]+' '/Pixel/ && $3 >= 16 && $3 < 48 && $4 >= 16 && $4 < 48 && $NF < 0.9 { ++n }
    END { print n + 0 }'
}

test_a_backing_hides_what_lies_behind_the_holes() {
  write_quad quad.gltf
  selvedge make --quality paper lace --set yarn=tube -o lace.fabric.exr --quiet "${small[@]}" >/dev/null
  local view=(--size 64x64 --light 0,0,1 --quiet) cloth=(quad.gltf lace.fabric.exr --all)
  exits 0 selvedge dress "${cloth[@]}" -o plain.glb
  exits 0 selvedge dress "${cloth[@]}" -o backed.glb --backing '#00ff00' --json
  holds "r.backed === 1"
  exits 0 selvedge check backed.glb
  for name in plain backed; do selvedge-view render $name.glb -o $name.exr "${view[@]}"; done
  [ "$(lets_through plain.exr)" -gt 50 ] || fail "$(lets_through plain.exr) pixels show the background of lace"
  [ "$(lets_through backed.exr)" = 0 ] || fail "$(lets_through backed.exr) do with a backing"
}

# with_choices FILE.gltf: a second scene without nodes, two variants, a camera that looks from behind, a point light.
with_choices() {
  node -e 'const file = process.argv[1], json = JSON.parse(require("fs").readFileSync(file));
    json.nodes.push({camera: 0, name: "behind", translation: [0.05, 0.05, -0.2], rotation: [0, 1, 0, 0]},
      {translation: [0.05, 0.05, 2], extensions: {KHR_lights_punctual: {light: 0}}});
    json.cameras = [{type: "perspective", perspective: {yfov: 0.2, znear: 0.01}}];
    json.scenes = [{nodes: [0, 1, 2]}, {name: "nothing", nodes: [1]}];
    json.extensionsUsed = [...(json.extensionsUsed ?? []), "KHR_materials_variants", "KHR_lights_punctual"];
    json.extensions = {...json.extensions, KHR_materials_variants: {variants: [{name: "day"}, {name: "night"}]},
      KHR_lights_punctual: {lights: [{type: "point", intensity: 2}]}};
    json.materials[1].pbrMetallicRoughness = {baseColorFactor: [0, 0, 0, 1]};
    json.meshes[0].primitives[0].extensions = {KHR_materials_variants: {mappings: [{material: 1, variants: [1]}]}};
    require("fs").writeFileSync(file, JSON.stringify(json));' "$1"
}

test_scenes_variants_and_cameras_of_a_file_are_chosen_by_name_or_number() {
  write_quad quad.gltf
  with_choices quad.gltf
  exits 0 selvedge check quad.gltf
  local view=(--size 32x32 --quiet)
  exits 0 selvedge-view render quad.gltf -o day.png "${view[@]}" --variant day
  exits 0 selvedge-view render quad.gltf -o plain.png "${view[@]}"
  exits 0 compare-pictures day.png plain.png --max 0
  # Beside the file's own lamp the studio is weak.
  exits 0 selvedge-view render quad.gltf -o alone.png "${view[@]}" --environment none
  exits 1 compare-pictures alone.png plain.png --max 0.05
  exits 0 compare-pictures alone.png plain.png --max 0.35
  exits 0 selvedge-view render quad.gltf -o night.png "${view[@]}" --variant 1 --light 0,0,1
  exits 1 compare-pictures day.png night.png --max 0.3
  exits 0 selvedge-view render quad.gltf -o front.png "${view[@]}" --light 0,0,-1
  exits 0 selvedge-view render quad.gltf -o behind.png "${view[@]}" --light 0,0,-1 --camera behind
  # Rough metal, by glTF's defaults: dim.
  exits 1 compare-pictures front.png behind.png --max 0.1
  refuses GARMENT_EMPTY quad.gltf selvedge-view render quad.gltf -o o.png --scene nothing
  refuses OPTION_OUT_OF_RANGE '--camera: there is no "top"; the scene has 0 "behind"' selvedge-view render quad.gltf -o o.png --camera top
  refuses OPTION_OUT_OF_RANGE '--scene: there is no "2"' selvedge-view render quad.gltf -o o.png --scene 2
  refuses OPTION_OUT_OF_RANGE '--variant: there is no "dusk"' selvedge-view render quad.gltf -o o.png --variant dusk
}

test_a_missing_fabric_file_leaves_the_fallback() {
  make_plane_fabric
  exits 0 selvedge dress quad.gltf plane.fabric.exr -o dressed.gltf --all --quiet
  exits 0 selvedge-view render dressed.gltf -o fabric.exr --size 32x32 --light 0,0,1 --quiet
  rm plane.fabric.exr
  exits 0 selvedge-view render dressed.gltf -o fallback.exr --size 32x32 --light 0,0,1
  grep -q 'note: .*plane.fabric.exr: .*\[FILE_MISSING\]; the fallback is drawn' "$scratch/err" || fail "$(cat "$scratch/err")"
  exits 0 compare-pictures fabric.exr fallback.exr --max 0.02
}

test_dress_embeds_the_fabric_in_glb_and_refers_to_it_from_gltf() {
  make_plane_fabric
  mkdir out
  for form in glb gltf; do
    local output=out/o.$form
    exits 0 selvedge dress quad.gltf plane.fabric.exr -o $output --all --json
    holds "r.embedded === ('$form' === 'glb')"
    # A fabric in the folder above is outside of the garment's.
    exits 0 selvedge check --allow-outside $output
    exits 0 selvedge info --allow-outside $output --json
    holds "(r.content.fabrics[0].embeddedBytes === $(stat -c %s plane.fabric.exr)) === ('$form' === 'glb')"
    selvedge-view render --allow-outside $output -o $form.exr --size 48x48 --quiet
    same glb.exr $form.exr
    # Also in the folder where one works.
    exits 0 selvedge dress quad.gltf plane.fabric.exr -o here.$form --all --json
    exits 0 selvedge check here.$form
    # And once more over it.
    exits 0 selvedge dress here.$form plane.fabric.exr -o here.$form --all
    exits 0 selvedge check here.$form
  done
}

test_dress_writes_usd_with_its_files_beside() {
  make_plane_fabric
  mkdir out
  exits 0 selvedge dress quad.gltf plane.fabric.exr -o out/d.glb --all --usda out/u.usda --json
  holds "r.usd.join() === 'out/u-image0.png,out/u-fabric0.exr,out/u.usda'"
  same out/u-fabric0.exr plane.fabric.exr
  grep -qF 'selvedge:fabric:file = @./u-fabric0.exr@' out/u.usda
  cp -r out before
  exits 0 selvedge dress quad.gltf plane.fabric.exr -o out/d.glb --all --usda out/u.usda
  diff -r before out
  exits 0 selvedge dress quad.gltf plane.fabric.exr -o out/e.gltf --all --usda out/e.usda
  [ ! -e out/e-fabric0.exr ] || fail "a fabric that is a file already was written again"
  grep -qF 'selvedge:fabric:file = @../plane.fabric.exr@' out/e.usda
}

test_compare_prints_a_table_for_each_fabric() {
  make_plane_fabric
  selvedge fit plane.samples.exr -o second.fabric.exr --lobes 0 --no-table --quiet
  exits 0 selvedge compare plane.fabric.exr second.fabric.exr plane.samples.exr
  for fabric in plane second; do grep -q "^$fabric.fabric.exr ([0-9]* bytes)$" "$scratch/out"; done
  for kind in held-out validation; do [ "$(grep -c "^  $kind: " "$scratch/out")" = 2 ]; done
  # Four levels of two sets of two fabrics.
  [ "$(grep -cE '^ +[0-3] +[0-9]+x[0-9]+ +[0-9.]+' "$scratch/out")" = 16 ] || fail "$(cat "$scratch/out")"
  exits 0 selvedge compare plane.fabric.exr second.fabric.exr plane.samples.exr --json
  holds "r.fabrics.length === 2 && r.fabrics.every(f => ['held-out', 'validation'].every(
    k => f[k].levels.length === 4 && f[k].levels.every(l => l.relativeL2 < 0.01)))"
  holds "r.fabrics[0]['held-out'].pairs === 8 && r.fabrics[0].validation.pairs === 8"
}

# What the model is for: each part of it brings the fabric closer to directions it has never seen.
test_lobes_beat_a_diffuse_colour_and_the_table_beats_lobes() {
  selvedge bake plain-knit --set yarn=tube --yarns off -o k.samples.exr --texels 16 --samples 8 --truth-samples 16 \
    --pairs 48 --quiet
  selvedge fit k.samples.exr -o diffuse.exr --no-table --lobes 0 --quiet
  selvedge fit k.samples.exr -o lobes.exr --no-table --quiet
  selvedge fit k.samples.exr --quality paper -o table.exr --quiet
  exits 0 selvedge compare diffuse.exr lobes.exr table.exr k.samples.exr --json
  holds "(() => { const [diffuse, lobes, table] = r.fabrics.map(f => f['held-out'].levels[0]);
    return diffuse.psnr < lobes.psnr && lobes.psnr < table.psnr && table.relativeL2 < lobes.relativeL2; })()"
}

"$2"
