#!/usr/bin/env bash
# What a garment of somebody else can do: read no file that it does not bring, end no program, take no more than its
# share. The hostile files are made here.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

# edited IN.gltf OUT.gltf STATEMENT: with the JSON as `g`.
edited() {
  node -e 'const fs = require("fs"), g = JSON.parse(fs.readFileSync(process.argv[1]));
    eval(process.argv[3]);
    fs.writeFileSync(process.argv[2], JSON.stringify(g));' "$@"
}

# A base colour texture from a URI.
picture_from() {
  echo "g.images = [{uri: '$1'}]; g.textures = [{source: 0}];
    g.materials[0].pbrMetallicRoughness = {baseColorTexture: {index: 0}};"
}

test_no_verb_opens_a_file_outside_of_the_garments_folder() {
  make_plane_fabric
  write_quad quad.gltf
  mkdir in out
  echo 'the secret of the server' >secret
  ln -s ../secret in/link.png
  for uri in ../secret ..%2Fsecret "$PWD/secret" link.png ../no-such-file; do
    edited quad.gltf in/a.gltf "$(picture_from "$uri")"
    refuses GLTF_REFERENCE --allow-outside selvedge dress in/a.gltf plane.fabric.exr -o out/a.glb --all
    refuses GLTF_REFERENCE --allow-outside selvedge reattach in/a.gltf -o out/a.glb
    refuses GLTF_REFERENCE --allow-outside selvedge info in/a.gltf
    refuses GLTF_REFERENCE --allow-outside selvedge plan in/a.gltf
    refuses GLTF_REFERENCE --allow-outside selvedge-view render in/a.gltf -o out/a.png
    refuses GLTF_REFERENCE --allow-outside selvedge-view show in/a.gltf
    exits 1 selvedge check in/a.gltf quad.gltf
    grep -qE 'error: in/a.gltf: .*--allow-outside.* \[GLTF_REFERENCE\]$' "$scratch/err"
    grep -qF 'quad.gltf: gltf, good' "$scratch/out"
  done
}

test_what_is_no_picture_goes_into_no_garment_even_if_it_is_allowed() {
  make_plane_fabric
  write_quad quad.gltf
  mkdir in out
  echo 'the secret of the server' >secret
  edited quad.gltf in/a.gltf "$(picture_from ../secret)"
  exits 0 selvedge dress in/a.gltf plane.fabric.exr -o out/a.glb --all --allow-outside --usda out/a.usda
  exits 1 selvedge check in/a.gltf --allow-outside
  cat "$scratch/out" "$scratch/err" out/* >all
  [ "$(grep -c 'the secret' all)" = 0 ] || fail "bytes of a file that is no picture came out"
}

test_check_goes_on_after_a_file_that_ends_it() {
  write_quad quad.gltf
  # A document of 1.5 GB, more than there is memory for.
  printf '{' >large.gltf
  truncate -s 1500M large.gltf
  exits 1 bash -c 'ulimit -v 1200000; selvedge check large.gltf quad.gltf --threads 1'
  grep -qE '^selvedge: error: large.gltf: .*memory.* \[FILE_TOO_LARGE\]$' "$scratch/err"
  grep -qF 'quad.gltf: gltf, good' "$scratch/out"
  exits 1 bash -c 'ulimit -v 1200000; selvedge info large.gltf --threads 1'
  grep -qE '^selvedge: large.gltf: .*memory.* \[FILE_TOO_LARGE\]$' "$scratch/err"
  exits 1 bash -c 'ulimit -v 1200000; selvedge info large.gltf --threads 1 --json'
  holds "r.error.code === 'FILE_TOO_LARGE' && r.error.file === 'large.gltf'"
}

test_pictures_that_are_cut_short_or_have_no_name_end_no_verb() {
  make_plane_fabric
  write_quad quad.gltf
  printf 'RIFF\4\0\0\0' >short.webp
  : >empty.png
  for uri in short.webp empty.png '' . ./ 'a/..' '%00' '%' '#' 'data:' 'data:,' 'data:image/webp;base64,UklGRg=='; do
    edited quad.gltf a.gltf "$(picture_from "$uri")"
    exits 1 selvedge check a.gltf quad.gltf
    grep -qE 'error: a.gltf: /images/0.* \[IMAGE_UNREADABLE\]$' "$scratch/err"
    grep -qF 'quad.gltf: gltf, good' "$scratch/out"
    exits 0 selvedge dress a.gltf plane.fabric.exr -o d.glb --all --usda d.usda
    exits 0 selvedge dress a.gltf plane.fabric.exr -o d.gltf --all --no-fallback --usda d.usda
    exits 0 selvedge info a.gltf
    exits 0 selvedge-view render d.gltf -o d.png --size 16x16
  done
}
