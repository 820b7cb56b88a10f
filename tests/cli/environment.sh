#!/usr/bin/env bash
# Light from all around: --environment of the verbs that draw.
# shellcheck source=tests/cli/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

test_render_draws_light_from_all_around() {
  make_scene
  # White all around: 32 x 16 pixels of 1, as Radiance has them.
  node -e 'process.stdout.write("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16 +X 32\n");
    process.stdout.write(Buffer.concat(Array(512).fill(Buffer.from([128, 128, 128, 129]))))' >white.hdr
  selvedge-view render quad.glb -o lamps.exr --size 40x30 --environment none
  selvedge-view render quad.glb -o white.exr --size 40x30 --environment white.hdr
  selvedge-view render quad.glb -o strong.exr --size 40x30 --environment white.hdr --environment-strength 2 --environment-turn 90
  selvedge-view render quad.glb -o backdrop.exr --size 40x30 --environment white.hdr --backdrop
  selvedge-view render quad.glb -o blurred.exr --size 40x30 --environment white.hdr --backdrop --backdrop-blur 0.5
  differ lamps.exr white.exr
  differ white.exr strong.exr
  differ white.exr backdrop.exr
  selvedge-view render k.fabric.exr -o place.png --place near --size 40x30 --environment white.hdr
  differ white.exr blurred.exr
  # Without a word scenes stand in the studio, unless they have lights, and nothing else does.
  selvedge-view render quad.glb -o studio.exr --size 40x30 --environment studio
  selvedge-view render quad.glb -o default.exr --size 40x30
  same studio.exr default.exr
  selvedge-view render quad.glb -o turned.exr --size 40x30 --environment-turn 40
  differ studio.exr turned.exr
  selvedge-view render quad.glb -o none.exr --size 40x30 --environment none
  differ studio.exr none.exr
  selvedge-view render quad.glb -o ambient.exr --size 40x30 --environment none --ambient 0.2
  differ none.exr ambient.exr
}

"$2"
