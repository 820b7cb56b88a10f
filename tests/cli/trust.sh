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
