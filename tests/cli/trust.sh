#!/usr/bin/env bash
# What a garment of somebody else can do: read no file that it does not bring, end no program, take no more than its
# share. The hostile files are made here.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

test_no_verb_opens_a_file_outside_of_the_garments_folder() {
  make_plane_fabric
  mkdir in out
  echo 'the secret of the server' >secret
  ln -s ../secret in/link.png
  for uri in ../secret ..%2Fsecret "$PWD/secret" link.png ../no-such-file; do
    edited quad.gltf in/a.gltf "$(picture_from "$uri")"
    refuses GLTF_REFERENCE --allow-outside selvedge dress in/a.gltf plane.fabric.exr -o out/a.glb --all
    refuses GLTF_REFERENCE --allow-outside selvedge info in/a.gltf
    refuses GLTF_REFERENCE --allow-outside selvedge plan in/a.gltf
    refuses GLTF_REFERENCE --allow-outside selvedge-view render in/a.gltf -o out/a.png
    refuses GLTF_REFERENCE --allow-outside selvedge-view show in/a.gltf
    exits 1 selvedge check in/a.gltf quad.gltf
    grep -qE 'error: in/a.gltf: .*--allow-outside.* \[GLTF_REFERENCE\]$' "$scratch/err"
    grep -qF 'quad.gltf: gltf, good' "$scratch/out"
  done
}

test_check_goes_on_after_a_file_that_ends_it() {
  write_quad quad.gltf
  # A document of 1.5 GB, more than there is memory for.
  if sanitized; then exit 77; fi
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
  printf 'RIFF\4\0\0\0' >short.webp
  : >empty.png
  for uri in short.webp empty.png '' . '%00' '#' 'data:,'; do
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

test_faults_within_pictures_and_scenes_are_told_with_their_place() {
  make_plane_fabric
  edited quad.gltf long.gltf "$png_writer"'
    const rows = chunk("IDAT", zlib.deflateSync(Buffer.alloc(1.5e8)));
    fs.writeFileSync("long.png", png(head(8, 8), rows, end));
    fs.writeFileSync("header.png", png(head(8, 8), zeros(8, 8), end).subarray(0, 33));
    g.images = [{uri: "long.png"}, {uri: "header.png"}], g.textures = [{source: 0}, {source: 1}];
    const own = g.meshes[0].primitives[0];
    for (const index of [0, 1]) g.materials[index] = {pbrMetallicRoughness: {baseColorTexture: {index}}};
    g.meshes[0].primitives.push({...own, material: 1});'
  exits 1 selvedge check long.gltf
  grep -qF '/images/0: holds more than its pixels [IMAGE_UNREADABLE]' "$scratch/err"
  grep -qE '/images/1: .*\[IMAGE_UNREADABLE\]$' "$scratch/err"
  exits 0 selvedge-view render long.gltf -o d.png --size 8x8
  grep -qF 'long.gltf: image 1 "header.png": ' "$scratch/err"

  edited quad.gltf many.gltf 'for (let i = 1; i < 40; ++i) g.materials.push({name: `m${i}`});'
  exits 0 selvedge dress many.gltf plane.fabric.exr -o d.glb --all
  [ "$(wc -l <"$scratch/err")" = 11 ] && grep -qF 'and 30 more like: material #1 "spare"' "$scratch/err" || fail "$(cat "$scratch/err")"

  # The length of the first attribute is the fifth byte after its name and type.
  selvedge-view render quad.gltf -o sky.exr --size 8x8
  node -e 'const fs = require("fs"), b = fs.readFileSync("sky.exr"), at = b.indexOf("chlist") + 7;
    b.writeUInt32LE(2e9, at), fs.writeFileSync("sky.exr", b)'
  refuses IMAGE_UNREADABLE 'sky.exr: ends within its header' \
    selvedge-view render quad.gltf -o d.png --size 8x8 --environment sky.exr
}

test_closed_streams_take_no_file_and_end_no_verb() {
  make_plane_fabric
  for closed in '>&- 2>&-' '2>&-' '<&- >&- 2>&-' '>/dev/full 2>/dev/full'; do
    rm -f d.glb
    status=0
    eval "selvedge dress quad.gltf plane.fabric.exr -o d.glb --all $closed" >"$scratch/out" || status=$?
    [ "$status" -le 1 ] || fail "status $status with $closed"
    exits 0 selvedge check d.glb
  done
}

# Files of some megabytes at most that declare far more than a machine has.
write_greedy() {
  write_quad quad.gltf
  edited quad.gltf pictures.gltf "$png_writer"'
    const text = chunk("zTXt", Buffer.concat([Buffer.from("t\0\0"), zlib.deflateSync(Buffer.alloc(7.9e6), {level: 9})]));
    fs.writeFileSync("texts.png", png(head(8, 8), ...Array(300).fill(text), zeros(8, 8), end));
    fs.writeFileSync("zeros.png", png(head(8000, 8000), zeros(8000, 8000), end));
    g.images = [], g.textures = [], g.materials = [], g.scenes[0].nodes = [], g.nodes = [], g.meshes = [];
    for (let i = 0; i < 64; ++i) {
      fs.copyFileSync("zeros.png", `zeros${i}.png`);
      g.images.push({uri: `zeros${i}.png`}), g.textures.push({source: i}), g.scenes[0].nodes.push(i);
      g.materials.push({pbrMetallicRoughness: {baseColorTexture: {index: i}}}), g.nodes.push({mesh: i});
      g.meshes.push({primitives: [{attributes: {POSITION: 0, NORMAL: 1, TEXCOORD_0: 2}, indices: 3, material: i}]});
    }'
  # Triangles over the four vertices of the quad, 1e5 times.
  local many='const data = Buffer.alloc(3e5);
    for (let i = 0; i < 1e5; ++i) data[3 * i + 1] = 1, data[3 * i + 2] = 2;
    fs.writeFileSync("indices.bin", data);
    g.buffers.push({byteLength: 3e5, uri: "indices.bin"});
    g.bufferViews.push({buffer: 1, byteLength: 3e5});
    g.accessors[3] = {bufferView: 4, componentType: 5121, count: 3e5, type: "SCALAR"};'
  edited quad.gltf instances.gltf "$many
    const places = Buffer.alloc(12 * 1e5);
    fs.writeFileSync('places.bin', places);
    g.buffers.push({byteLength: places.length, uri: 'places.bin'});
    g.bufferViews.push({buffer: 2, byteLength: places.length});
    g.accessors.push({bufferView: 5, componentType: 5126, count: 1e5, type: 'VEC3'});
    g.extensionsUsed = ['EXT_mesh_gpu_instancing'];
    g.nodes[0].extensions = {EXT_mesh_gpu_instancing: {attributes: {TRANSLATION: 4}}};"
}

test_garments_that_declare_more_than_the_memory_are_refused_before_they_take_it() {
  if sanitized; then exit 77; fi
  make_plane_fabric
  write_greedy
  # In 5 s of the processor, and what programs and libraries take beside the limit (addresses, of which the memory
  # is a part).
  within() { bash -c 'ulimit -t 5 -v "$0"; exec "$@"' "$@" --threads 1; }
  greedy() { within 2000000 "$@" --max-memory 1G; }
  for file in instances pictures; do
    exits 1 greedy selvedge check $file.gltf quad.gltf
    grep -qE "^selvedge: error: $file.gltf: .*(--max-memory|32 a byte).* \[FILE_TOO_LARGE\]$" "$scratch/err"
    grep -qF 'quad.gltf: gltf, good' "$scratch/out"
    [ $file != pictures ] || continue
    refuses FILE_TOO_LARGE --max-memory greedy selvedge-view render $file.gltf -o o.png
    refuses FILE_TOO_LARGE --max-memory greedy selvedge info $file.gltf
    refuses FILE_TOO_LARGE --max-memory greedy selvedge plan $file.gltf
    refuses FILE_TOO_LARGE --max-memory greedy selvedge dress $file.gltf plane.fabric.exr -o o.glb --all
  done
  refuses FILE_TOO_LARGE 'million pixels more than 32 a byte' greedy selvedge-view render pictures.gltf -o o.png
  edited quad.gltf deep.gltf 'for (let i = 1; i < 1700; ++i) g.nodes.push({mesh: 0}), g.scenes[0].nodes.push(i);'
  refuses FILE_TOO_LARGE 'surfaces lie behind each other at a pixel' selvedge-view render deep.gltf -o o.png --size 8x8
  # By default as well.
  exits 1 within 5300000 selvedge check instances.gltf pictures.gltf --quiet
  [ "$(grep -oE 'error: [a-z]+\.gltf: .*FILE_TOO_LARGE' "$scratch/err" | cut -d: -f2 | sort -u | wc -l)" = 2 ]
  # The option raises it. A small frame shows little of pictures that take 4.5 GB in full size.
  edited pictures.gltf few.gltf \
    'for (const all of [g.scenes[0].nodes, g.nodes, g.meshes, g.materials, g.textures, g.images]) all.length = 4'
  exits 1 selvedge check few.gltf
  exits 0 selvedge check few.gltf --max-memory 100G --quiet
  exits 0 bash -c 'ulimit -v 2000000; selvedge-view render few.gltf -o o.png --size 64x64 --max-memory 1G --threads 1'
  # 2.4 GB of text in a picture of 2.3 MB.
  edited quad.gltf texts.gltf "$(picture_from texts.png)"
  exits 0 greedy selvedge-view render texts.gltf -o o.png --size 8x8
}

test_pictures_that_show_nothing_have_a_remark() {
  make_plane_fabric
  exits 0 selvedge dress quad.gltf plane.fabric.exr -o d.glb --all --quiet
  notes() { exits 0 selvedge-view render "$2" -o o.png --size 16x16 "${@:3}"; grep -qF "note: $1" "$scratch/err" || fail "$(cat "$scratch/err")"; }
  notes 'no pixel shows the scene' d.glb --look-at 100,0,0 --distance 1
  notes 'the picture is black' d.glb --exposure 0
  notes 'the picture is black' quad.gltf --exposure 0
  exits 0 selvedge-view render d.glb -o o.png --size 16x16
  [ ! -s "$scratch/err" ] || fail "$(cat "$scratch/err")"
}

test_fabrics_whose_levels_do_not_fit_into_the_memory_are_refused() {
  write_plane plane.obj
  selvedge make --quality paper plane.obj --period 2x2 -o k.fabric.exr --quiet --texels 32 --views 64 --lights 16 \
    --samples 4 --pairs 8 --truth-samples 8
  write_quad quad.gltf
  selvedge dress quad.gltf k.fabric.exr -o d.gltf --all --no-fallback --quiet
  for input in d.gltf k.fabric.exr; do
    refuses FILE_TOO_LARGE --max-memory selvedge-view render $input -o o.png --level 0 --max-memory 500K
    exits 1 selvedge check $input --max-memory 500K
    grep -qE 'the values of the fabric take more .*--max-memory.* \[FILE_TOO_LARGE\]$' "$scratch/err"
    exits 0 selvedge check $input --max-memory 20M
  done
  refuses FILE_TOO_LARGE --max-memory selvedge dress quad.gltf k.fabric.exr -o o.glb --all --max-memory 500K
}

test_samples_take_no_more_than_their_parts() {
  if sanitized; then exit 77; fi
  make_plane_fabric
  # In the place of the provenance a header of as many bytes.
  node -e 'const fs = require("fs"), bytes = fs.readFileSync("plane.samples.exr"), begin = bytes.indexOf("selvedge.samples\0string\0") + 24;
    const size = bytes.readInt32LE(begin), h = JSON.parse(bytes.toString("utf8", begin + 4, begin + 4 + size));
    h.texels = [4096, 4096], h.provenance = {};
    bytes.write(JSON.stringify(h).padEnd(size), begin + 4);
    fs.writeFileSync("large.exr", bytes);'
  for verb in 'fit large.exr -o o.exr' 'fit large.exr -o o.exr --bytes 1M' 'compare plane.fabric.exr large.exr' 'check large.exr --quiet'; do
    # shellcheck disable=SC2086
    refuses SAMPLES_MALFORMED 'large.exr: radiance: is not a scanline part of 65536x65536 pixels' \
      bash -c 'ulimit -t 5 -v 1000000; exec selvedge "$@"' selvedge $verb
  done
}

test_all_files_of_a_dressed_garment_are_written_or_none() {
  make_plane_fabric
  exits 0 selvedge dress quad.gltf plane.fabric.exr -o o.gltf --all
  # The buffer fits onto the disk, the text does not; the fallback's pictures do, the layer does not.
  short() { (ulimit -f 2 && "$@"); }
  [ "$(stat -c %s o.bin)" -lt 2048 ] && [ "$(stat -c %s o.gltf)" -gt 2048 ] || fail "other sizes"
  refuses FILE_UNWRITABLE o.gltf short selvedge dress quad.gltf plane.fabric.exr -o o.gltf --all --backing '#ffffff'
  refuses FILE_UNWRITABLE new.gltf short selvedge dress quad.gltf plane.fabric.exr -o new.gltf --all
}

"$2"
