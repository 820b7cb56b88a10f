#!/usr/bin/env bash
# selvedge check: issues, severities, exit statuses.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

test_check_tells_good_files_from_bad_ones() {
  make_plane_fabric
  selvedge dress quad.gltf plane.fabric.exr -o quad.glb --all --quiet
  exits 0 selvedge check plane.fabric.exr plane.samples.exr quad.gltf quad.glb --json
  holds "r.good && r.files.map(f => f.kind).join() === 'fabric,samples,gltf,gltf' && r.files.every(f => f.good)"
  cut_short plane.fabric.exr short.fabric.exr
  exits 1 selvedge check plane.fabric.exr short.fabric.exr quad.glb missing.glb --json
  holds "!r.good && r.files.map(f => f.good).join() === 'true,false,true,false' && r.files[3].issues[0].code === 'FILE_MISSING'"
  [ "$(wc -l <"$scratch/err")" = 2 ] || fail "not a line for each bad file: $(cat "$scratch/err")"
  exits 1 selvedge check short.fabric.exr plane.fabric.exr
  grep -q '^plane.fabric.exr: fabric, good$' "$scratch/out"
}

test_check_lists_every_issue_with_its_severity() {
  make_plane_fabric
  write_quad quad.gltf 'POSITION NORMAL'
  # Not dressed by us: no fallback, no mirror, no texture coordinates.
  node -e 'const fs = require("fs"), g = JSON.parse(fs.readFileSync("quad.gltf", "utf8"));
    const name = "SELVEDGE_materials_fabric";
    g.extensionsUsed = [name];
    g.extensions = {[name]: {fabrics: [{mimeType: "image/x-exr", uri: "plane.fabric.exr"}]}};
    g.materials[0].extensions = {[name]: {fabric: {index: 0}}};
    g.accessors[3].count = 60;
    fs.writeFileSync("bad.gltf", JSON.stringify(g));'
  exits 1 selvedge check bad.gltf
  local code
  for code in GLTF_ACCESSOR GARMENT_NO_UVS; do
    grep -qE "^selvedge: error: bad.gltf: /.*: .* \[$code\]$" "$scratch/err" || fail "no $code: $(cat "$scratch/err")"
  done
  grep -qE '^selvedge: warning: bad.gltf: /.*: .* \[GLTF_FALLBACK\]$' "$scratch/err" || fail "no fallback: $(cat "$scratch/err")"
  [ ! -s "$scratch/out" ] || fail "praise for a bad file: $(cat "$scratch/out")"
  exits 1 selvedge check bad.gltf "$root/samples/sweater.glb" --json
  holds "r.files[0].issues.filter(i => i.severity === 'error').map(i => i.code).sort().join() === 'GARMENT_NO_UVS,GLTF_ACCESSOR'"
  holds "r.files[0].issues.every(i => i.file === 'bad.gltf' && i.place.startsWith('/') && i.message && i.code)"
  holds "!r.files[0].good && r.files[1].good && r.files[1].issues.length === 0"
}

test_check_counts_warnings_and_can_take_them_for_errors() {
  make_plane_fabric
  selvedge dress quad.gltf plane.fabric.exr -o dressed.glb --material cloth --quiet
  exits 0 selvedge check dressed.glb --strict
  selvedge dress quad.gltf plane.fabric.exr -o bare.glb --material cloth --no-fallback --quiet
  exits 0 selvedge check bare.glb
  grep -q '^bare.glb: gltf, good, 2 warnings$' "$scratch/out" || fail "$(cat "$scratch/out" "$scratch/err")"
  [ "$(grep -c '^selvedge: warning: bare.glb: .*\[GLTF_FALLBACK\]$' "$scratch/err")" = 2 ] || fail "$(cat "$scratch/err")"
  exits 0 selvedge check bare.glb --quiet
  [ ! -s "$scratch/err" ] || fail "not quiet: $(cat "$scratch/err")"
  exits 1 selvedge check bare.glb --strict --quiet
  [ "$(wc -l <"$scratch/err")" = 2 ] || fail "$(cat "$scratch/err")"
}

"$2"
