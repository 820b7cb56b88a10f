#!/usr/bin/env bash
# The whole road at the edge of what can be asked (docs/extremes.md).
# shellcheck source=tests/cli/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

test_cloth_of_a_hundredth_of_a_millimetre_and_of_ten_metres_is_made_worn_and_drawn() {
  local yarns=(plain-weave --set yarn=tube --quality draft --views 16 --lights 16 --pairs 8 --quiet)
  write_quad quad.gltf
  local held=()
  # Spacing of the yarns, and repeats in the cell: 0.01 mm, 2 mm, 10 m.
  for size in 0.005:1 1:1 1000:5; do
    selvedge make "${yarns[@]}" --set warp_spacing_mm=${size%:*} --set weft_spacing_mm=${size%:*} \
      --set repeats=${size#*:} -o cloth.fabric.exr
    exits 0 selvedge check cloth.fabric.exr
    exits 0 selvedge info cloth.fabric.exr --json
    [ ${size#*:} = 5 ] || held+=("$(node -p 'JSON.parse(require("fs").readFileSync(process.argv[1])).content.accuracy.front[0]' "$scratch/out")")
    selvedge dress quad.gltf cloth.fabric.exr -o quad.glb --all --quiet
    exits 0 selvedge plan quad.glb
    exits 0 selvedge-view render quad.glb -o frame.exr --size 32x32 --supersample 1 --environment none --quiet
  done
  node -e 'const [a, b] = process.argv.slice(1).map(Number); process.exit(Math.abs(a - b) < 0.5 ? 0 : 1)' "${held[@]}" ||
    fail "held out, dB: ${held[*]}"
}

test_one_texel_one_direction_and_one_sample_make_a_valid_fabric() {
  write_plane plane.obj
  exits 0 selvedge make --quality paper plane.obj --period 2x2 --albedo 0.999,0.4,0 --texels 1 --views 1 --lights 1 --samples 1 \
    --pairs 1 --truth-samples 2 -o one.fabric.exr
  exits 0 selvedge check one.fabric.exr
  exits 0 selvedge evaluate one.fabric.exr --level 0 --texel 0,0 --light 0,0,1 --view 0,0,1 --json
  # Lambert: albedo / pi.
  holds 'r.rgb.every((x, c) => Math.abs(x * Math.PI - [0.999, 0.4, 0][c]) < 1e-3)'
}

test_garments_without_anything_to_dress_are_refused_in_a_line() {
  make_plane_fabric
  # What is missing | code | what dress says.
  while IFS='|' read -r statement code text; do
    edited quad.gltf empty.gltf "$statement"
    refuses "$code" "$text" selvedge dress empty.gltf plane.fabric.exr -o o.glb --all
    refuses GARMENT_EMPTY 'there is nothing to draw' selvedge-view render empty.gltf -o o.png --size 16x16
    exits 0 selvedge info empty.gltf
  done <<'CASES'
g.meshes[0].primitives = []|GARMENT_EMPTY|the materials are on no triangles
g.meshes[0].primitives[0].mode = 0|GARMENT_EMPTY|the materials are on no triangles
delete g.meshes, delete g.nodes[0].mesh|GARMENT_EMPTY|the materials are on no triangles
g.nodes = [], g.scenes = [{}]|GARMENT_EMPTY|is on no triangle in the scene
g.scenes[0].nodes = []|GARMENT_EMPTY|is on no triangle in the scene
delete g.scene, delete g.scenes, delete g.nodes|GARMENT_EMPTY|is on no triangle in the scene
for (const name in g) if (name !== "asset") delete g[name]|MATERIAL_MISSING|there are no triangles to dress
g.nodes[0].scale = [0, 0, 0]|GARMENT_NO_UVS|cover no area in the scene
CASES
}

"$2"
