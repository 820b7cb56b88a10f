#!/usr/bin/env bash
# Bad input: one line that names file, place and reason, exit status 1, and nothing written.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

test_refuses_missing_files() {
  make_plane_fabric
  write_quad quad.gltf
  refuses FILE_MISSING none.obj selvedge bake none.obj --period 2x2 -o o.exr
  refuses FILE_MISSING none.ply selvedge make none.ply --period 2x2 -o o.exr
  refuses FILE_MISSING none.ply selvedge stitch none.ply --period 2x2 -o o.obj
  refuses '(FILE_MISSING|STITCH_UNKNOWN)' none.json selvedge bake none.json -o o.exr
  refuses STITCH_UNKNOWN no-such-knit selvedge make no-such-knit -o o.exr
  refuses FILE_MISSING none.exr selvedge fit none.exr -o o.exr
  refuses FILE_MISSING none.csv selvedge import none.csv --width 40 -o o.exr
  refuses FILE_MISSING none.glb selvedge dress none.glb plane.fabric.exr -o o.glb --all
  refuses FILE_MISSING none.exr selvedge dress quad.gltf none.exr -o o.glb --all
  refuses FILE_MISSING none.exr selvedge check none.exr --quiet
  refuses FILE_MISSING none.exr selvedge info none.exr
  refuses FILE_MISSING none.exr selvedge evaluate none.exr --uv 0,0
  refuses FILE_MISSING none.exr selvedge compare none.exr plane.samples.exr
  refuses FILE_MISSING none.exr selvedge compare plane.fabric.exr none.exr
  refuses FILE_MISSING none.glb selvedge-view render none.glb -o o.png
  refuses FILE_MISSING none.exr selvedge-view render none.exr -o o.png
  refuses FILE_MISSING none.png compare-pictures none.png none.png
}

# A full disk, as far as a test can make one: files of at most 4 KiB.
limited() { (ulimit -f 4 && "$@"); }

test_a_full_disk_is_an_error_and_leaves_nothing() {
  make_plane_fabric
  write_quad quad.gltf
  refuses FILE_UNWRITABLE o.exr limited selvedge bake plane.obj --period 2x2 -o o.exr --texels 16 --views 16 --lights 16
  refuses FILE_UNWRITABLE o.exr limited selvedge fit plane.samples.exr -o o.exr
  refuses FILE_UNWRITABLE o.glb limited selvedge dress quad.gltf plane.fabric.exr -o o.glb --all
  refuses '(FILE|IMAGE)_UNWRITABLE' o.exr limited selvedge-view render plane.fabric.exr -o o.exr --repeats 40x40
  refuses FILE_UNWRITABLE o.ply limited selvedge stitch plain-knit -o o.ply
}

test_refuses_samples_cut_short() {
  make_plane_fabric
  cut_short plane.samples.exr short.exr
  local code='(FILE_DAMAGED|EXR_MALFORMED)'
  refuses "$code" short.exr selvedge fit short.exr -o o.exr
  refuses "$code" short.exr selvedge compare plane.fabric.exr short.exr
  refuses "$code" short.exr selvedge check short.exr --quiet
  head -c 100 plane.samples.exr >short.exr
  refuses "$code" short.exr selvedge fit short.exr -o o.exr
  : >empty.exr
  refuses "$code" empty.exr selvedge fit empty.exr -o o.exr
}

test_refuses_a_fabric_cut_short() {
  make_plane_fabric
  write_quad quad.gltf
  cut_short plane.fabric.exr short.exr
  local code='(FILE_DAMAGED|EXR_MALFORMED)'
  refuses "$code" short.exr selvedge evaluate short.exr --uv 0,0
  refuses "$code" short.exr selvedge compare short.exr plane.samples.exr
  refuses "$code" short.exr selvedge check short.exr --quiet
  refuses "$code" short.exr selvedge dress quad.gltf short.exr -o o.glb --all
  refuses "$code" short.exr selvedge-view render short.exr -o o.png
}

test_refuses_files_of_the_wrong_kind() {
  make_plane_fabric
  write_quad quad.gltf
  refuses SAMPLES_MALFORMED plane.fabric.exr selvedge fit plane.fabric.exr -o o.exr
  refuses FABRIC_MALFORMED plane.samples.exr selvedge evaluate plane.samples.exr --uv 0,0
  refuses FABRIC_MALFORMED plane.samples.exr selvedge dress quad.gltf plane.samples.exr -o o.glb --all
  refuses '.*' quad.gltf selvedge fit quad.gltf -o o.exr
  echo words >words.txt
  refuses '.*' words.txt selvedge check words.txt --quiet
  refuses '.*' plane.fabric.exr selvedge dress plane.fabric.exr plane.fabric.exr -o o.glb --all
  refuses '.*' plane.fabric.exr selvedge bake plane.fabric.exr -o o.exr
}

test_refuses_a_fabric_of_another_cell_in_compare() {
  make_plane_fabric
  selvedge bake plain-knit --set yarn=tube -o knit.samples.exr --quiet "${small[@]:2}" --texels 4
  refuses FABRIC_MISMATCH plane.fabric.exr selvedge compare plane.fabric.exr knit.samples.exr
}

test_refuses_a_garment_cut_short() {
  make_plane_fabric
  write_quad quad.gltf
  selvedge dress quad.gltf plane.fabric.exr -o quad.glb --all --quiet
  cut_short quad.glb short.glb
  cut_short quad.gltf short.gltf
  for file in short.glb short.gltf; do
    local code='(FILE_DAMAGED|GLTF_MALFORMED|JSON_MALFORMED)'
    refuses "$code" $file selvedge dress $file plane.fabric.exr -o o.glb --all
    refuses "$code" $file selvedge check $file --quiet
    refuses "$code" $file selvedge info $file
    refuses "$code" $file selvedge-view render $file -o o.png -o o.exr
  done
}

test_refuses_a_mesh_cut_short() {
  selvedge stitch plain-weave --set yarn=tube --grid 8 -o whole.obj --quiet
  selvedge stitch plain-weave --set yarn=tube --grid 8 -o whole.ply --quiet
  # In the middle of a vertex and of a face: an OBJ that ends with a line is whole.
  sed -n '1,/^v /p' whole.obj | head -c -4 | sed '$s/ [^ ]*$//' >short.obj
  refuses FILE_DAMAGED short.obj selvedge bake short.obj --period 2x2 -o o.exr
  cut_short whole.ply short.ply
  refuses FILE_DAMAGED short.ply selvedge bake short.ply --period 2x2 -o o.exr
  refuses FILE_DAMAGED short.ply selvedge stitch short.ply --period 2x2 -o o.obj
  head -c 50 whole.ply >short.ply
  refuses FILE_DAMAGED short.ply selvedge make short.ply --period 2x2 -o o.exr
}

test_refuses_options_out_of_range() {
  make_plane_fabric
  refuses OPTION_OUT_OF_RANGE --view selvedge-view render plane.fabric.exr -o k.png --view 0,0,-1
  refuses OPTION_OUT_OF_RANGE --period selvedge bake plain-knit -o k.exr --period 2x2
  refuses OPTION_OUT_OF_RANGE --grid selvedge bake plain-knit -o k.exr --grid 2
  refuses OPTION_OUT_OF_RANGE texels selvedge bake plain-knit -o k.exr --texels -3
  refuses OPTION_OUT_OF_RANGE texels selvedge bake plain-knit -o k.exr --texels 1024 --lights 4096
  refuses OPTION_OUT_OF_RANGE reference-height selvedge bake plain-knit -o k.exr --reference-height 1e30
  refuses OPTION_OUT_OF_RANGE --level selvedge evaluate plane.fabric.exr --uv 0,0 --level 9
}

test_refuses_nan_in_a_mesh() {
  write_plane nan.obj
  sed -i 's/^v 2 2 0$/v 2 nan 0/' nan.obj
  refuses MESH_NOT_FINITE nan.obj selvedge bake nan.obj --period 2x2 -o o.exr
  grep -q 'line 3' "$scratch/err"
  sed -i 's/nan/inf/' nan.obj
  refuses MESH_NOT_FINITE nan.obj selvedge make nan.obj --period 2x2 -o o.exr
  printf '%s\n' ply 'format ascii 1.0' 'element vertex 3' 'property float x' 'property float y' 'property float z' \
    'element face 1' 'property list uchar int vertex_indices' end_header '0 0 0' '2 0 nan' '0 2 0' '3 0 1 2' >nan.ply
  refuses MESH_NOT_FINITE nan.ply selvedge bake nan.ply --period 2x2 -o o.exr
  sed 's/ascii/binary_little_endian/; /end_header/q' nan.ply >binary.ply
  node -e 'const f = new Float32Array([0, 0, 0, 2, 0, NaN, 0, 2, 0]), i = new Int32Array([0, 1, 2]);
    require("fs").appendFileSync("binary.ply",
      Buffer.concat([Buffer.from(f.buffer), Buffer.from([3]), Buffer.from(i.buffer)]))'
  refuses MESH_NOT_FINITE binary.ply selvedge bake binary.ply --period 2x2 -o o.exr
}

test_refuses_an_empty_mesh() {
  : >empty.obj
  refuses MESH_EMPTY empty.obj selvedge bake empty.obj --period 2x2 -o o.exr
  printf 'v 0 0 0\nv 2 0 0\nv 2 2 0\n' >points.obj
  refuses MESH_EMPTY points.obj selvedge make points.obj --period 2x2 -o o.exr
  printf '%s\n' ply 'format ascii 1.0' 'element vertex 0' 'property float x' 'property float y' 'property float z' \
    'element face 0' 'property list uchar int vertex_indices' end_header >empty.ply
  refuses MESH_EMPTY empty.ply selvedge bake empty.ply --period 2x2 -o o.exr
  : >nothing.ply
  refuses '(FILE_DAMAGED|MESH_EMPTY)' nothing.ply selvedge bake nothing.ply --period 2x2 -o o.exr
}

test_refuses_a_bad_period() {
  write_plane plane.obj
  refuses '(MESH_INVALID|OPTION_OUT_OF_RANGE)' period selvedge bake plane.obj --period 0x2 -o o.exr
}

test_refuses_a_material_that_is_not_there() {
  make_plane_fabric
  write_quad quad.gltf
  refuses MATERIAL_MISSING quad.gltf selvedge dress quad.gltf plane.fabric.exr -o o.glb --material Silk
  # What there is instead is said.
  grep -q '"Silk".*"cloth"' "$scratch/err"
  refuses MATERIAL_MISSING quad.gltf selvedge dress quad.gltf plane.fabric.exr -o o.glb --material '#2'
  refuses MATERIAL_MISSING quad.gltf \
    selvedge dress quad.gltf plane.fabric.exr -o o.gltf --material cloth --material Silk
}

test_refuses_to_reattach_where_nothing_is_lost_or_nothing_is_found() {
  make_plane_fabric
  write_quad quad.gltf
  refuses MATERIAL_MISSING quad.gltf selvedge reattach quad.gltf -o o.glb
  selvedge dress quad.gltf plane.fabric.exr -o quad.glb --all --quiet
  refuses MATERIAL_MISSING quad.glb selvedge reattach quad.glb -o o.glb
  make_packed quad.glb packed.glb
  refuses GLTF_REFERENCE 'packed.glb: /materials/0/extras/SELVEDGE_materials_fabric: ' selvedge reattach packed.glb -o o.glb
  refuses FILE_MISSING none.exr selvedge reattach packed.glb -o o.glb --fabric none.exr
  refuses GLTF_REFERENCE plane.fabric.exr selvedge reattach packed.glb -o o.glb --fabric silk=plane.fabric.exr
  refuses FABRIC_MALFORMED plane.samples.exr selvedge reattach packed.glb -o o.glb --fabric plane.samples.exr
  refuses FILE_UNWRITABLE none/o.glb selvedge reattach packed.glb -o none/o.glb --fabric plane.fabric.exr
  cp plane.fabric.exr fabric.glb
  exits 2 selvedge reattach packed.glb -o fabric.glb --fabric fabric.glb
  same plane.fabric.exr fabric.glb
}

test_refuses_a_usd_layer_that_cannot_be_written_and_leaves_no_gltf_either() {
  make_plane_fabric
  write_quad quad.gltf
  exits 2 selvedge dress quad.gltf plane.fabric.exr -o o.glb --all --usda o.usd
  refuses FILE_UNWRITABLE none/o selvedge dress quad.gltf plane.fabric.exr -o o.glb --all --usda none/o.usda
}

test_refuses_a_garment_without_texture_coordinates() {
  make_plane_fabric
  write_quad bare.gltf 'POSITION NORMAL'
  refuses GARMENT_NO_UVS "--unwrap makes some" selvedge dress bare.gltf plane.fabric.exr -o o.glb --material cloth
  write_quad quad.gltf
  refuses GARMENT_NO_UVS quad.gltf selvedge dress quad.gltf plane.fabric.exr -o o.glb --material cloth --texcoord 1
}

test_refuses_sizes_of_zero() {
  refuses OPTION_OUT_OF_RANGE texels selvedge bake plain-knit -o o.exr --texels 0
  refuses OPTION_OUT_OF_RANGE texels selvedge bake plain-knit -o o.exr --texels 8x0
  refuses OPTION_OUT_OF_RANGE texels selvedge make plain-knit -o o.exr --texels 0 --keep-samples s.exr
  refuses OPTION_OUT_OF_RANGE views selvedge bake plain-knit -o o.exr --texels 4 --views 0
  refuses OPTION_OUT_OF_RANGE lights selvedge bake plain-knit -o o.exr --texels 4 --lights 0
  refuses OPTION_OUT_OF_RANGE samples selvedge bake plain-knit -o o.exr --texels 4 --samples 0
}

test_refuses_parameters_and_broken_drafts() {
  refuses OPTION_OUT_OF_RANGE '--set gauge: no such parameter' selvedge bake plain-knit -o o.exr --set gauge=3
  refuses OPTION_OUT_OF_RANGE '--set radius_mm: the yarns are too thick' selvedge stitch purl -o o.ply --set radius_mm=0.9
  write_plane plane.obj
  refuses OPTION_OUT_OF_RANGE '--set' selvedge bake plane.obj -o o.exr --set slack=0
  refuses STITCH_UNKNOWN cable selvedge stitch cable --list
  printf '[WIF]\n[WEAVING]\nShafts=2\n[WARP]\nThreads=2\n[WEFT]\nThreads=2\n[THREADING]\n1=1\n2=3\n[LIFTPLAN]\n' >bad.wif
  refuses STITCH_INVALID 'bad.wif: [THREADING] 2: must lie in 0 to 2, is 3' selvedge make bad.wif -o o.exr
  : >empty.wif
  refuses STITCH_INVALID empty.wif selvedge stitch empty.wif -o o.json
  refuses STITCH_UNKNOWN none.wif selvedge stitch none.wif
}

test_refuses_broken_charts_with_their_line() {
  printf '1: k2\n2: k2 m\n' >bad.txt
  refuses STITCH_INVALID 'bad.txt: line 2: there is no stitch "m"' selvedge stitch bad.txt
  refuses STITCH_INVALID 'bad.txt: line 2' selvedge make bad.txt -o o.exr
  printf '1: k2\n2: k3\n' >bad.txt
  refuses STITCH_INVALID 'line 2: row 2 has 3 stitches, row 1 has 2' selvedge bake bad.txt -o o.exr
  printf '1: k2 [A B]\n' >bad.txt
  refuses STITCH_INVALID 'line 1: there is no yarn B' selvedge stitch bad.txt --show
  printf 'name: caf\xe9\n1: k\n' >bad.txt
  refuses STITCH_INVALID 'line 1: has a byte that is not UTF-8' selvedge stitch bad.txt
  : >empty.txt
  refuses STITCH_INVALID empty.txt selvedge stitch empty.txt -o o.json
  refuses STITCH_UNKNOWN none.txt selvedge stitch none.txt
  printf 'yarn A: radius_mm=0.001\n1: k\n' >thin.txt
  refuses OPTION_OUT_OF_RANGE 'to relax them would take too long' selvedge stitch thin.txt
  printf '1: k\n' >k.txt
  refuses OPTION_OUT_OF_RANGE 'k.txt: --set radius_mm: the yarns are too thick' selvedge stitch k.txt --set radius_mm=0.9
  refuses OPTION_OUT_OF_RANGE '--period' selvedge stitch k.txt --period 5x4
}

test_refuses_a_pattern_without_yarn() {
  echo '{"selvedge_stitch": 1, "name": "nothing", "period_mm": [2, 2], "yarns": []}' >bare.json
  refuses STITCH_INVALID bare.json selvedge bake bare.json -o o.exr
  grep -q '/yarns' "$scratch/err"
  refuses STITCH_INVALID bare.json selvedge stitch bare.json -o o.obj
  refuses STITCH_INVALID bare.json selvedge make bare.json -o o.exr
}

test_refuses_a_stitch_description_cut_short() {
  selvedge stitch plain-knit --set yarn=tube -o knit.json --quiet
  cut_short knit.json short.json
  refuses JSON_MALFORMED short.json selvedge bake short.json -o o.exr
  grep -q 'line [0-9]*, column' "$scratch/err"
  ! grep -qF 'json.exception' "$scratch/err" || fail "$(cat "$scratch/err")"
  : >empty.json
  refuses JSON_MALFORMED empty.json selvedge stitch empty.json -o o.obj
  sed 's/"radius_mm"/"radius"/' knit.json >renamed.json
  refuses STITCH_INVALID renamed.json selvedge make renamed.json -o o.exr
  grep -q '/yarns/0/radius_mm' "$scratch/err"
}

test_refuses_outputs_that_cannot_be_written() {
  make_plane_fabric
  write_quad quad.gltf
  mkdir folder
  refuses FILE_UNWRITABLE none/o.ply selvedge stitch plain-knit -o none/o.ply
  refuses FILE_UNWRITABLE none/o.exr selvedge bake plain-knit -o none/o.exr
  refuses FILE_UNWRITABLE none/o.exr selvedge fit plane.samples.exr -o none/o.exr
  refuses FILE_UNWRITABLE none/o.exr: selvedge make plain-knit -o none/o.exr
  refuses FILE_UNWRITABLE none/s.exr selvedge make plain-knit -o o.exr --keep-samples none/s.exr
  refuses FILE_UNWRITABLE none/o.glb selvedge dress quad.gltf plane.fabric.exr -o none/o.glb --all
  refuses FILE_UNWRITABLE folder: selvedge bake plain-knit -o folder
  refuses FILE_UNWRITABLE folder: selvedge make plain-knit -o folder
  # Of two pictures neither.
  refuses '(FILE|IMAGE)_UNWRITABLE' none/o.exr selvedge-view render plane.fabric.exr -o o.png -o none/o.exr
  exits 1 selvedge-samples sweater -o none/o.glb
}

# A pipe stands for all that is no plain file: renaming a finished file onto a device would replace the device.
test_refuses_to_replace_what_is_no_plain_file() {
  make_plane_fabric
  write_quad quad.gltf
  mkfifo pipe.exr pipe.glb pipe.ply
  refuses FILE_UNWRITABLE pipe.ply selvedge stitch plain-knit -o pipe.ply
  refuses FILE_UNWRITABLE pipe.exr selvedge bake plain-knit -o pipe.exr "${small[@]}"
  refuses FILE_UNWRITABLE pipe.exr selvedge fit plane.samples.exr -o pipe.exr
  refuses FILE_UNWRITABLE pipe.glb selvedge dress quad.gltf plane.fabric.exr -o pipe.glb --all
  refuses '(FILE|IMAGE)_UNWRITABLE' pipe.exr selvedge-view render plane.fabric.exr -o pipe.exr
}

# What waits for a pipe that nobody writes to is stopped, with a status of its own.
soon() { timeout 60 "$@"; }

test_a_pipe_is_no_input_and_is_not_waited_for() {
  make_plane_fabric
  write_quad quad.gltf
  selvedge dress quad.gltf plane.fabric.exr -o quad.glb --all --quiet
  make_packed quad.glb packed.glb
  mkfifo pipe.obj pipe.ply pipe.json pipe.wif pipe.txt pipe.exr pipe.glb pipe.gltf pipe.png pipe.mtl pipe.bin
  for file in pipe.obj pipe.ply pipe.json pipe.wif pipe.txt; do
    refuses FILE_UNREADABLE "$file" soon selvedge bake $file -o o.exr
    refuses FILE_UNREADABLE "$file" soon selvedge make $file -o o.exr
    refuses FILE_UNREADABLE "$file" soon selvedge stitch $file -o o.ply
  done
  { echo 'mtllib pipe.mtl' && cat plane.obj; } >coloured.obj
  exits 0 soon selvedge stitch coloured.obj -o o.ply --quiet
  rm o.ply
  refuses FILE_UNREADABLE pipe.exr soon selvedge merge pipe.exr -o o.exr
  refuses FILE_UNREADABLE pipe.exr soon selvedge fit pipe.exr -o o.exr
  refuses FILE_UNREADABLE pipe.exr soon selvedge repack pipe.exr -o o.exr
  refuses FILE_UNREADABLE pipe.exr soon selvedge evaluate pipe.exr --uv 0,0
  refuses FILE_UNREADABLE pipe.exr soon selvedge compare pipe.exr plane.samples.exr
  refuses FILE_UNREADABLE pipe.exr soon selvedge compare plane.fabric.exr pipe.exr
  for file in pipe.glb pipe.gltf; do
    refuses FILE_UNREADABLE $file soon selvedge dress $file plane.fabric.exr -o o.glb --all
    refuses FILE_UNREADABLE $file soon selvedge reattach $file -o o.glb --fabric plane.fabric.exr
    refuses FILE_UNREADABLE $file soon selvedge-view render $file -o o.png
  done
  refuses FILE_UNREADABLE pipe.exr soon selvedge dress quad.gltf pipe.exr -o o.glb --all
  refuses FILE_UNREADABLE pipe.exr soon selvedge dress quad.gltf pipe.exr -o o.gltf --all --external
  refuses FILE_UNREADABLE pipe.exr soon selvedge reattach packed.glb -o o.glb --fabric pipe.exr
  for file in pipe.exr pipe.glb; do
    refuses FILE_UNREADABLE $file soon selvedge check $file --quiet
    refuses FILE_UNREADABLE $file soon selvedge info $file
  done
  refuses FILE_UNREADABLE pipe.exr soon selvedge-view render pipe.exr -o o.png
  refuses FILE_UNREADABLE pipe.png soon compare-pictures pipe.png pipe.png
  echo '{"op":"evaluate","file":"pipe.exr","uv":[0,0],"level":0,"light":[0,0,1],"view":[0,0,1]}' >queries.jsonl
  exits 0 soon selvedge answer <queries.jsonl
  holds "r.error === 'FILE_UNREADABLE'"
}

test_pipes_that_a_file_refers_to_are_not_waited_for() {
  make_plane_fabric
  write_quad quad.gltf
  selvedge dress quad.gltf plane.fabric.exr -o beside.gltf --all --external --quiet
  mkfifo pipe.bin pipe.png pipe.exr
  edit() {
    node -e 'const fs = require("fs"), json = JSON.parse(fs.readFileSync("beside.gltf", "utf8"));
      eval(process.argv[2]);
      fs.writeFileSync(process.argv[1], JSON.stringify(json));' "$1" "$2"
  }
  edit buffer.gltf 'json.buffers[0].uri = "pipe.bin"'
  refuses FILE_UNREADABLE pipe.bin soon selvedge check buffer.gltf --quiet
  refuses FILE_UNREADABLE pipe.bin soon selvedge dress buffer.gltf plane.fabric.exr -o o.glb --all
  edit picture.gltf 'json.images[0] = {uri: "pipe.png"}'
  refuses IMAGE_UNREADABLE pipe.png soon selvedge check picture.gltf --quiet
  exits 0 soon selvedge-view render picture.gltf -o o.png --size 16x16
  edit fabric.gltf 'json.extensions.SELVEDGE_materials_fabric.fabrics[0].uri = "pipe.exr"'
  refuses GLTF_REFERENCE pipe.exr soon selvedge check fabric.gltf --quiet
  refuses FILE_UNREADABLE pipe.exr soon selvedge-view render fabric.gltf -o o.png --size 16x16
  # What a bake goes on from lies beside its output.
  mkfifo o.exr.journal
  refuses FILE_UNWRITABLE o.exr.journal soon selvedge bake plane.obj --period 2x2 -o o.exr "${small[@]}"
}

# is_text FILE: UTF-8 without control characters but line ends.
is_text() {
  node -e 'const text = new TextDecoder("utf-8", {fatal: true}).decode(require("fs").readFileSync(process.argv[1]));
    if (/[\x00-\x09\x0b-\x1f\x7f-\x9f]/.test(text)) throw new Error("control characters");' "$1"
}

test_bytes_that_are_no_text_are_escaped_in_messages_and_reports() {
  make_plane_fabric
  write_quad quad.gltf
  local odd=$'n\xffme\e[31m'
  # In the file's name, in JSON, in the names of an EXR file's parts, in a material's name.
  printf '{"asset":{"version":"2.0","generator":"\xff\x1b[2J"}}' >bad.gltf
  cp bad.gltf "$odd.gltf"
  sed 's/frame.nx/fr\xffme.nx/' plane.fabric.exr >bad.exr
  differ plane.fabric.exr bad.exr
  sed 's/"cloth"/"clo\\u001b[31mth"/' quad.gltf >named.gltf
  for file in bad.gltf "$odd.gltf" bad.exr; do
    exits 1 selvedge check "$file"
    is_text "$scratch/err"
    cp "$scratch/err" said
    exits 1 selvedge check "$file" --json
    is_text "$scratch/err"
    is_text "$scratch/out"
    holds "r.good === false"
    # Names that are no text are not taken from an EXR file at all, and nothing is quoted of what is no JSON.
    [ "$file" = "$odd.gltf" ] || continue
    grep -qE '\\x(FF|1B)' said || fail "no escape: $(cat said)"
    holds "/\\\\x(FF|1B)/.test(JSON.stringify(r.files[0].issues))"
  done
  exits 0 selvedge dress named.gltf plane.fabric.exr -o named.glb --all
  is_text "$scratch/out"
  cp plane.fabric.exr "$odd.exr"
  exits 0 selvedge dress quad.gltf "$odd.exr" -o "$odd.glb" --all
  is_text "$scratch/out"
  exits 0 selvedge check "$odd.glb" "$odd.exr" --json
  is_text "$scratch/out"
  exits 0 selvedge info "$odd.exr" --json
  is_text "$scratch/out"
  exits 0 selvedge bake plane.obj --period 2x2 -o "$odd.samples.exr" "${small[@]}"
  is_text "$scratch/out"
}

"$2"
