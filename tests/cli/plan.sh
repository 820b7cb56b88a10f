#!/usr/bin/env bash
# The levels, the yarn and the sides of its fabrics that a scene's cameras see (plan).
# shellcheck source=tests/cli/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

# A square of 0.1 m in a knit of 16 x 16 texels, a repeat every 5 x 3.8 mm: texels of 0.31 x 0.24 mm.
make_cloth() {
  selvedge make --quality paper plain-knit --set yarn=tube -o k.fabric.exr --quiet "${small[@]:2}" --texels 16 "$@"
  write_quad quad.gltf
  selvedge dress quad.gltf k.fabric.exr -o quad.glb --all --quiet
}

# A pixel spans 2 tan(fov / 2) distance / height: 0.8284 * 1.5 / 400 = 3.107 mm, straight on. That is 9.94 texels along u
# and 13.1 along v: a square of the same area is 11.4 texels wide, and between the levels 2 and 3 (log2(11.4) - 1 = 2.51).
far_view=(--distance 1.5 --fov 45 --size 400x400)

test_a_plan_tells_what_pixels_ask_for() {
  make_cloth
  exits 0 selvedge plan quad.glb "${far_view[@]}" --json
  holds 'r.verb === "plan" && r.materials.length === 1 && r.materials[0].name === "cloth"'
  holds 'r.materials[0].levels.join() === "2,3" && r.materials[0].levelsOfFabric === 5'
  holds 'r.materials[0].pixelTexels.every((t) => Math.abs(t - 11.4) < 0.05)'
  holds 'r.materials[0].seen && r.materials[0].sides === "front" && !r.materials[0].yarn'
  # Light comes through a sheet.
  holds 'r.materials[0].through && r.materials[0].make === "--texels 4x4 --sides both --yarns off"'
  exits 0 selvedge plan quad.glb "${far_view[@]}"
  grep -q 'make STITCH --texels 4x4 --sides both --yarns off$' "$scratch/out"
  # Half as far, pixels are half as wide and levels one finer; a larger frame does the same.
  exits 0 selvedge plan quad.glb --distance 0.75 --fov 45 --size 400x400 --json
  holds 'r.materials[0].levels.join() === "1,2"'
  exits 0 selvedge plan quad.glb --distance 1.5 --fov 45 --size 800x800 --json
  holds 'r.materials[0].levels.join() === "1,2"'
}

test_a_plan_knows_backs_yarn_and_what_no_camera_sees() {
  make_cloth --yarns on
  exits 0 selvedge plan quad.glb --distance 0.01 --azimuth 180 --json
  holds 'r.materials[0].sides === "back" && r.materials[0].yarn && r.materials[0].levels[0] === 0'
  holds 'r.materials[0].make === "--texels 16x16 --sides both --yarns on"'
  exits 0 selvedge plan quad.glb "${far_view[@]}" --look-at 0,9,0 --json
  holds '!r.materials[0].seen && r.materials[0].sides === "none" && r.materials[0].levels.join() === "4,4"'
  # A quad that reaches behind the camera: from the finest level to a coarse one near the horizon.
  exits 0 selvedge plan quad.glb --distance 0.02 --elevation 80 --fov 90 --json
  holds 'r.materials[0].levels[0] === 0 && r.materials[0].levels[1] >= 1'
}

test_a_plan_leaves_out_what_other_surfaces_hide() {
  make_cloth
  edited quad.gltf wall.gltf 'g.materials[1].doubleSided = true; g.nodes.push({mesh: 1, translation: [0, 0, -0.001]});
    g.meshes.push({primitives: [{...g.meshes[0].primitives[0], material: 1}]}); g.scenes[0].nodes.push(1)'
  selvedge dress wall.gltf k.fabric.exr -o wall.glb --material cloth --quiet
  exits 0 selvedge plan wall.glb "${far_view[@]}" --json
  holds 'r.materials[0].sides === "front" && !r.materials[0].through && / --sides front /.test(r.materials[0].make)'
  exits 0 selvedge plan wall.glb "${far_view[@]}" --azimuth 180 --json
  holds '!r.materials[0].seen && r.materials[0].sides === "none"'
}

test_a_plan_covers_the_cameras_of_the_file() {
  make_cloth
  edited quad.gltf cameras.gltf 'g.cameras = [1, 0.3].map((yfov) => ({type: "perspective", perspective: {yfov, znear: 0.01}}));
    g.nodes.push({camera: 0, name: "far", translation: [0.05, 0.05, 2]}, {camera: 1, name: "near", translation: [0.05, 0.05, 0.2]});
    g.scenes[0].nodes.push(1, 2)'
  selvedge dress cameras.gltf k.fabric.exr -o cameras.glb --all --quiet
  levels() { exits 0 selvedge plan cameras.glb --size 400x400 --json "$@"; node -p 'JSON.parse(require("fs").readFileSync(process.argv[1])).materials[0].levels.join()' "$scratch/out"; }
  [ "$(levels)" = 0,4 ] && [ "$(levels --camera far --camera near)" = 0,4 ] || fail "$(levels)"
  [ "$(levels --camera near)" = 0,0 ] || fail "$(levels --camera near)"
  [ "$(levels --camera 0)" = 3,4 ] || fail "$(levels --camera 0)"
}

"$2"
