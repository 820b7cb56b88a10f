#!/usr/bin/env bash
# How good a fabric is: reports of fits as files, what the fabric says of itself, and pictures of comparisons.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

make_samples() { selvedge bake plain-knit --set yarn=tube -o k.samples.exr --quiet --yarns off "${small[@]}"; }

test_a_fit_reports_what_compare_finds_and_the_fabric_says() {
  make_samples
  exits 0 selvedge fit k.samples.exr --quality paper -o k.fabric.exr --json
  selvedge compare k.fabric.exr k.samples.exr --json >compare.json
  selvedge info k.fabric.exr --json >info.json
  holds "(() => { const read = f => JSON.parse(require('fs').readFileSync(f, 'utf8'));
    const truth = read('compare.json').fabrics[0]['held-out'].levels;
    const own = read('info.json').content.provenance.fit.heldOut;
    return r.verb === 'fit' && r.levels.length === 4 && r.warnings.length === 0 && own.pairs === 8 && r.levels.every((l, k) =>
      Math.abs(l.heldOutPsnr - truth[k].psnr) < 1e-9 && Math.abs(own.front[k] - truth[k].psnr) < 0.006 &&
      l.atLimit <= l.texels[0] * l.texels[1] && l.iterations >= 1 && l.layers === '2 lobes x table' &&
      l.bytes === Object.values(l.layerBytes).reduce((a, b) => a + b)) &&
      r.levels.reduce((sum, l) => sum + l.bytes, 0) < r.bytes; })()"
  exits 0 selvedge check k.fabric.exr --warnings-as-errors
}

test_the_fabric_has_the_same_bytes_on_any_number_of_threads() {
  make_samples
  selvedge fit k.samples.exr -o a.exr --quiet --threads 1
  selvedge fit k.samples.exr -o b.exr --quiet --threads 3
  same a.exr b.exr
}

test_repack_keeps_the_record_while_it_is_true() {
  make_samples
  selvedge fit k.samples.exr --quality paper -o k.fabric.exr --quiet
  selvedge repack k.fabric.exr -o same.exr --codec none --quiet
  exits 0 selvedge info same.exr --json
  holds 'r.content.provenance.fit.heldOut.front.length === 4'
  # Other values have other errors.
  for options in --half-lobes '--layers lobes,frame,opacity'; do
    # shellcheck disable=SC2086
    exits 0 selvedge repack k.fabric.exr -o other.exr $options
    exits 0 selvedge info other.exr --json
    holds 'r.content.provenance.fit.heldOut === undefined && r.content.provenance.fit.lobes === 2'
  done
}

test_no_output_is_written_over_another_file_of_the_command() {
  make_samples
  cp k.samples.exr before.exr
  ln -s k.samples.exr link.exr
  ln k.samples.exr hard.exr
  mkdir folder
  ln -s "$PWD" folder/up
  selvedge fit k.samples.exr -o k.fabric.exr --quiet
  write_quad quad.gltf
  write_plane plane.obj
  for file in k.fabric.exr:v.glb quad.gltf:g.usda k.fabric.exr:f.svg k.fabric.exr:k.png; do cp ${file/:/ }; done
  local before
  before=$(snapshot)
  # OPTION OTHER COMMAND...
  over() {
    exits 2 "${@:3}"
    grep -qE -- "^selvedge(-view)?: $1: .* is the file of $2 as well; see " "$scratch/err" || fail "${*:3}: $(cat "$scratch/err")"
    [ "$(wc -l <"$scratch/err")" = 1 ] && [ ! -s "$scratch/out" ] || fail "${*:3}: $(cat "$scratch/err" "$scratch/out")"
    [ "$before" = "$(snapshot)" ] || fail "changed: ${*:3}: $(diff <(echo "$before") <(snapshot))"
  }
  # A built-in stitch is no file of that name.
  exits 0 selvedge bake plain-knit -o plain-knit --texels 1 --views 4 --lights 4 --samples 2 --quiet
  rm plain-knit
  over --output samples selvedge fit k.samples.exr -o ./k.samples.exr
  over --output samples selvedge fit link.exr -o k.samples.exr
  over --output samples selvedge fit k.samples.exr -o hard.exr
  over --output samples selvedge fit k.samples.exr -o folder/up/k.samples.exr
  over --output --keep-samples selvedge make plain-knit -o m.exr --keep-samples folder/up/m.exr
  over --depfile input selvedge make plane.obj -o m.exr --depfile plane.obj
  over --output --opacity selvedge import t.csv --width 4 --opacity k.png -o k.png
  over --output input selvedge bake plane.obj -o plane.obj
  over --output fabric selvedge dress quad.gltf v.glb -o v.glb --all
  over --output --variant selvedge dress quad.gltf k.fabric.exr -o v.glb --all --variant red=#aa0000 --variant other=v.glb
  over --usda garment selvedge dress g.usda k.fabric.exr -o o.glb --all --usda g.usda
  over --usda fabric selvedge dress quad.gltf g.usda -o o.glb --all --usda g.usda
  over --output --fabric selvedge reattach quad.gltf -o v.glb --fabric cloth=v.glb
  over --output --environment selvedge swatch k.fabric.exr -o k.samples.exr --environment k.samples.exr
  over --output --environment selvedge-view render quad.gltf -o k.samples.exr --environment link.exr
  over --output --compare selvedge-view render quad.gltf -o k.fabric.exr --compare k.fabric.exr
  over --stats input selvedge-view render quad.gltf -o o.png --stats quad.gltf
  over --stats --output selvedge-view render quad.gltf -o o.png --stats o.png
  over --output --output selvedge-view render quad.gltf -o o.png -o folder/up/o.png
  over --screenshot --environment selvedge-view show quad.gltf --environment k.png --screenshot k.png
  over --output input selvedge-view page quad.gltf x.html -o x.html
}

test_a_budget_that_no_fabric_meets_is_refused_with_the_smallest() {
  make_samples
  refuses OPTION_OUT_OF_RANGE 'the smallest fabric found has' selvedge fit k.samples.exr -o b.exr --budget 1K
  [ ! -e b.exr ]
  exits 0 selvedge fit k.samples.exr -o b.exr --budget 16K
  [ "$(stat -c %s b.exr)" -le 16384 ]
}

test_a_fit_without_pairs_has_no_errors_to_tell() {
  selvedge bake plain-knit --set yarn=tube -o bare.samples.exr --quiet "${small[@]}" --pairs 0
  refuses SAMPLES_MALFORMED 'no pairs to choose layers by' selvedge fit bare.samples.exr -o bare.exr
  exits 0 selvedge fit bare.samples.exr --quality paper -o bare.exr --json
  holds "r.levels.every(l => l.heldOutPsnr === null && l.trainingError > 0)"
}

test_a_truth_is_the_same_for_any_threads_and_bad_settings_are_refused() {
  swatch() { selvedge swatch --truth plain-knit --set yarn=tube --size 32x24 --samples 4 --quiet "$@"; }
  swatch -o a.exr --threads 1
  swatch -o b.exr --threads 3
  same a.exr b.exr
  refuses OPTION_OUT_OF_RANGE transmission selvedge swatch --truth plain-knit --set transmission=1.5 -o a.png
}

test_a_swatch_of_a_lambert_plane_is_the_same_traced_fitted_and_drawn() {
  make_plane_fabric
  # A plane's held-out directions are met to half precision; so are these pictures, in steps of 8 bits.
  for view in near grazing; do
    exits 0 selvedge swatch --truth plane.obj --period 2x2 --albedo 0.8,0.4,0.2 --place "$view" --size 40x30 --samples 4 \
      -o truth.png --json
    holds 'r.verb === "swatch" && r.truth === true && r.samples === 4 && r.noise < 1e-6 && r.alphaNoise === 0'
    exits 0 selvedge swatch plane.fabric.exr --place "$view" --size 40x30 -o fabric.png
    exits 0 selvedge-view render plane.fabric.exr --place "$view" --size 40x30 -o viewer.png
    exits 0 compare-pictures truth.png fabric.png --json
    holds '(r.psnr === null || r.psnr > 40) && r.ssim > 0.99'
    exits 0 compare-pictures fabric.png viewer.png --max 0.004
  done
}

test_a_traced_swatch_has_the_same_bytes_for_any_threads_and_others_for_another_seed() {
  swatch() { selvedge swatch --truth plain-knit --set yarn=tube --size 32x24 --samples 4 --quiet "$@"; }
  swatch -o a.exr --threads 1
  swatch -o b.exr --threads 3
  same a.exr b.exr
  swatch -o c.exr --seed 2
  differ a.exr c.exr
}

test_a_swatch_refuses_what_it_cannot_draw() {
  refuses FILE_MISSING none.fabric.exr selvedge swatch none.fabric.exr -o a.png
  refuses STITCH_UNKNOWN papier selvedge swatch --truth papier -o a.png
  refuses OPTION_OUT_OF_RANGE samples selvedge swatch --truth plain-knit --samples 1 -o a.png
  refuses FILE_UNWRITABLE nowhere selvedge swatch --truth plain-knit -o nowhere/a.png
  exits 2 selvedge swatch --truth plain-knit -o a.jpg
  exits 2 selvedge swatch --truth plain-knit -o a.png --place far-away
  exits 2 selvedge swatch --truth plain-knit -o a.png --size 500x100
  exits 2 selvedge-view render a.glb -o a.png --place near
}

"$2"
