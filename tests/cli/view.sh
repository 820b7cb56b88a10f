#!/usr/bin/env bash
# The options of `selvedge-view render`: series, comparisons, tone curves, reports.
# shellcheck source=tests/cli/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

make_scene() {
  selvedge make plain-knit -o k.fabric.exr --quiet "${small[@]}" >/dev/null
  write_quad quad.gltf
  selvedge dress quad.gltf k.fabric.exr -o quad.glb --all --quiet
}

# png_size FILE: prints WIDTHxHEIGHT.
png_size() {
  node -e 'const b = require("fs").readFileSync(process.argv[1]);
    console.log(`${b.readUInt32BE(16)}x${b.readUInt32BE(20)}`)' "$1"
}

test_render_turntable_draws_every_frame_once_around() {
  make_scene
  selvedge-view render quad.glb -o turn.png -o turn.exr --size 60x40 --turntable 4 --elevation 20 --stats turn.json
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

test_render_compare_puts_two_scenes_beside_each_other() {
  make_scene
  make_plane_fabric
  selvedge-view render quad.glb -o one.exr --size 50x40 --quiet
  selvedge-view render quad.glb -o both.exr -o both.png --size 50x40 --compare quad.glb --stats both.json --quiet
  [ "$(png_size both.png)" = 104x40 ] || fail "$(png_size both.png)"
  holds 'r.compare.input === "quad.glb" && r.compare.coveredPixels === r.coveredPixels' both.json
  selvedge-view render quad.glb -o fabric.png --size 50x40 --compare plane.fabric.exr --quiet
  selvedge-view render quad.glb -o scene.png --size 50x40 --compare quad.glb --quiet
  differ fabric.png scene.png
  same scene.png both.png
  # The other fabric by itself: dressed in it, the quad looks the same but for the rounding of its repeats.
  selvedge dress quad.gltf plane.fabric.exr -o plane.glb --all --quiet
  selvedge-view render quad.glb -o dressed.png --size 50x40 --compare plane.glb --quiet
  exits 0 selvedge-view compare fabric.png dressed.png --max 0.01
  refuses FILE_MISSING nothing.glb selvedge-view render quad.glb -o x.png --compare nothing.glb
  cut_short plane.fabric.exr short.fabric.exr
  refuses FILE_DAMAGED short.fabric.exr selvedge-view render quad.glb -o x.png --compare short.fabric.exr
  exits 2 selvedge-view render k.fabric.exr -o x.png --compare quad.glb
}

test_render_tone_curves_are_those_of_the_help() {
  make_plane_fabric
  # f of a Lambertian of albedo 0.8, 0.4, 0.2 seen and lit from above, times pi * 4.
  local options=(--light 0,0,1 --exposure 12.566370614 --repeats 1x1 --view 0,0,1)
  local curve
  for curve in none reinhard aces; do
    selvedge-view render plane.fabric.exr -o "$curve.png" "${options[@]}" --tone-map "$curve"
  done
  selvedge-view render plane.fabric.exr -o light.exr "${options[@]}" --tone-map aces
  selvedge-view render plane.fabric.exr -o plain.exr "${options[@]}"
  same light.exr plain.exr
  # The first pixel of a PNG is stored as it is, whatever the filter of its row.
  node -e 'const fs = require("fs"), zlib = require("zlib");
    const c = [3.2, 1.6, 0.8], y = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    const curves = {none: v => v, reinhard: v => v / (1 + y),
      aces: v => v * (2.51 * v + 0.03) / (v * (2.43 * v + 0.59) + 0.14)};
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

test_render_reads_only_the_levels_that_it_shows() {
  make_scene
  selvedge-view render quad.glb -o near.png --size 400x400 --zoom 40 --stats near.json
  selvedge-view render quad.glb -o far.png --size 40x40 --distance-factor 4 --stats far.json
  holds 'r.fabricBytes.inFiles === require("fs").statSync("k.fabric.exr").size' near.json
  # Level 0 is most of it, the only one that is seen. Headers are read in steps, some bytes twice.
  holds 'r.fabricBytes.read > 0.6 * r.fabricBytes.inFiles && r.fabricBytes.read < 1.1 * r.fabricBytes.inFiles' near.json
  holds 'r.fabricBytes.read < 0.6 * r.fabricBytes.inFiles' far.json
}

test_render_stats_are_a_file_or_standard_output() {
  make_scene
  exits 0 selvedge-view render quad.glb -o a.png --size 20x20 --stats -
  holds '["prepare", "project", "geometry", "readBack", "evaluation", "filter", "read", "write", "total"].every(s => r.seconds[s] >= 0)'
  exits 0 selvedge-view render quad.glb -o a.png --size 20x20 --stats a.json
  [ ! -s "$scratch/out" ] || fail "both: $(cat "$scratch/out")"
  holds 'r.verb === "render" && r.triangles === 2 && r.layers === 1' a.json
  refuses FILE_UNWRITABLE missing selvedge-view render quad.glb -o b.png --stats missing/a.json
}

"$2"
