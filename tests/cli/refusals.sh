#!/usr/bin/env bash
# Bad input and wrong usage: every row of refusals.tsv is one line that names file, place and reason, and writes nothing.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

# The files that the rows name.
make_inputs() {
  make_plane_fabric
  selvedge bake plain-knit --set yarn=tube --texels 4 -o other.samples.exr --quiet "${small[@]:2}"
  write_quad bare.gltf 'POSITION NORMAL'
  selvedge dress quad.gltf plane.fabric.exr -o quad.glb --all --quiet
  selvedge dress quad.gltf plane.fabric.exr -o beside.gltf --all --quiet
  cut_short plane.samples.exr short.samples.exr
  cut_short plane.fabric.exr short.exr
  cut_short quad.glb short.glb
  cut_short quad.gltf short.gltf
  head -c 100 plane.samples.exr >start.samples.exr
  echo words | tee words.txt >words.exr
  for file in empty.{obj,exr,wif,txt,json,ply}; do : >$file; done
  mkdir folder
  # Files of other kinds.
  printf 'version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 9\n' | tee lfs.glb lfs.wif lfs.exr >lfs.hdr
  gzip -c quad.gltf >gzip.glb
  base64 quad.glb >base64.glb
  printf '\n<!DOCTYPE HTML>\n<html>' | tee page.glb >page.txt
  printf 'PK\3\4' >model.usdz
  printf 'd\206\6\0v 0 0 0\n' >coff.obj
  printf '{"width": 2, "grid": [0, 1]}' | tee foreign.json >foreign.gltf
  edited quad.gltf scenes.gltf 'g.nodes.push({mesh: 0}); g.meshes.push({primitives: [{...g.meshes[0].primitives[0], material: 2}]});
    g.materials.push({name: "veil"}); g.nodes[1].mesh = 1; g.scenes.push({name: "party", nodes: [1]})'
  # Meshes.
  selvedge stitch plain-weave --set yarn=tube -o whole.ply --quiet
  selvedge stitch plain-weave --set yarn=tube -o whole.obj --quiet
  cut_short whole.ply short.ply
  head -c 50 whole.ply >start.ply
  sed -n '1,/^v /p' whole.obj | head -c -4 | sed '$s/ [^ ]*$//' >short.obj
  sed 's/^v 2 2 0$/v 2 nan 0/' plane.obj >nan.obj
  sed 's/^v 2 2 0$/v 2 inf 0/' plane.obj >inf.obj
  printf 'v 0 0 0\nv 2 0 0\nv 2 2 0\n' >points.obj
  local head=(ply 'format ascii 1.0' 'element vertex 3' 'property float x' 'property float y' 'property float z')
  printf '%s\n' "${head[@]}" 'element face 1' 'property list uchar int vertex_indices' end_header '0 0 0' '2 0 nan' '0 2 0' \
    '3 0 1 2' >nan.ply
  sed 's/ascii/binary_little_endian/; /end_header/q' nan.ply >binary.ply
  node -e 'const f = new Float32Array([0, 0, 0, 2, 0, NaN, 0, 2, 0]), i = new Int32Array([0, 1, 2]);
    require("fs").appendFileSync("binary.ply", Buffer.concat([Buffer.from(f.buffer), Buffer.from([3]), Buffer.from(i.buffer)]))'
  # Stitches.
  printf '[WIF]\n[WEAVING]\nShafts=2\n[WARP]\nThreads=2\n[WEFT]\nThreads=2\n[THREADING]\n1=1\n2=3\n[LIFTPLAN]\n' >bad.wif
  printf '1: k2\n2: k2 m\n' >unknown.txt
  printf '1: k2\n2: k3\n' >uneven.txt
  printf '1: k2 [A B]\n' >yarn.txt
  printf 'name: caf\xe9\n1: k\n' >latin.txt
  printf 'yarn A: radius_mm=0.001\n1: k\n' >thin.txt
  printf '1: k\n' >k.txt
  { printf 'yarn A:\nyarn B:\n' && for row in {1..124}; do echo "$row: k128 [A$row B A$((127 - row))]"; done; } >big.txt
  echo '{"selvedge_stitch": 1, "name": "nothing", "period_mm": [2, 2], "yarns": []}' >bare.json
  selvedge stitch plain-knit --set yarn=tube -o knit.json --quiet
  cut_short knit.json short.json
  sed 's/"radius_mm"/"radius"/' knit.json >renamed.json
  # Files that are read and not written.
  ln -s plane.samples.exr link.exr
  ln plane.samples.exr hard.exr
  ln -s "$PWD" folder/up
  ln -s nothing.glb link.glb
  cp plane.fabric.exr v.glb
  cp plane.fabric.exr k.png
  cp quad.gltf g.usda
  # Pipes, and garments that refer to them.
  mkfifo pipe.{obj,ply,json,wif,txt,exr,glb,gltf,png,bin}
  edited beside.gltf buffer.gltf 'g.buffers[0].uri = "pipe.bin"'
  edited beside.gltf picture.gltf 'g.images[0] = {uri: "pipe.png"}'
  edited beside.gltf fabric.gltf 'g.extensions.SELVEDGE_materials_fabric.fabrics[0].uri = "pipe.exr"'
  edited quad.gltf mesh.gltf 'g.nodes.push({mesh: 1})'
}

# A full disk, as far as a test can make one: files of at most 4 KiB.
limited() { (ulimit -f 4 && "$@"); }

# A command that waits for a pipe is stopped, with a status of its own.
soon() { timeout 60 "$@"; }

# row CODE WORDS COMMAND: status 2 for the code usage, else 1; prints what is wrong.
row() {
  local wanted=1 status=0
  [ "$1" != usage ] || wanted=2
  eval "$3" >"$scratch/out" 2>"$scratch/err" </dev/null || status=$?
  [ "$status" = $wanted ] || echo "status $status"
  [ "$(wc -l <"$scratch/err")" = 1 ] || echo "not one line"
  grep -qF -- "$2" "$scratch/err" || echo "no \"$2\""
  [ "$1" = usage ] || grep -qE "^selvedge(-view)?: .+ \[$1\]$" "$scratch/err" || echo "no [$1]"
  [ ! -s "$scratch/out" ] || echo "something on standard output"
  [ "$before" = "$(snapshot)" ] || echo "something changed: $(diff <(echo "$before") <(snapshot))"
}

test_every_row_of_the_table_is_refused_in_one_line() {
  make_inputs
  local before code words command wrong bad=0 count=0
  before=$(snapshot)
  while IFS=$'\t' read -r code words command; do
    case $code in '' | '#'*) continue ;; esac
    case $command in *selvedge-view\ page*) [ -f "$bin/../share/selvedge/page.html" ] || continue ;; esac
    count=$((count + 1))
    wrong=$(row "$code" "$words" "$command")
    [ -z "$wrong" ] || { bad=$((bad + 1)) && echo "$command: ${wrong//$'\n'/; }: $(cat "$scratch/err")" >&2; }
  done <"$root/tests/cli/refusals.tsv"
  [ $bad = 0 ] && [ $count -gt 150 ] || fail "$bad of $count rows"
}

test_pictures_and_materials_that_are_pipes_are_left_out() {
  make_inputs
  exits 0 soon selvedge-view render picture.gltf -o o.png --size 16x16
  { echo 'mtllib pipe.mtl' && cat plane.obj; } >coloured.obj
  mkfifo pipe.mtl
  exits 0 soon selvedge stitch coloured.obj -o o.ply --quiet
}

"$2"
