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
    const own = read('info.json').content.accuracy;
    return r.verb === 'fit' && r.levels.length === 4 && own.pairs === 8 && r.levels.every((l, k) =>
      Math.abs(l.heldOutPsnr - truth[k].psnr) < 1e-9 && Math.abs(own.front[k] - truth[k].psnr) < 0.006 &&
      l.layers === '2 lobes x table' &&
      l.bytes === Object.values(l.layerBytes).reduce((a, b) => a + b)) &&
      r.levels.reduce((sum, l) => sum + l.bytes, 0) < r.bytes; })()"
  exits 0 selvedge check k.fabric.exr --strict
}

test_a_fit_without_pairs_has_no_errors_to_tell() {
  selvedge bake plain-knit --set yarn=tube -o bare.samples.exr --quiet "${small[@]:0:8}" --pairs 0
  refuses SAMPLES_MALFORMED 'no pairs to choose layers by' selvedge fit bare.samples.exr -o bare.exr
  exits 0 selvedge fit bare.samples.exr --quality paper -o bare.exr --json
  holds "r.levels.every(l => l.heldOutPsnr === null)"
}

test_a_swatch_of_a_lambert_plane_is_the_same_traced_and_fitted() {
  make_plane_fabric
  # A plane's held-out directions are met to half precision; so are these pictures, in steps of 8 bits.
  for view in near grazing; do
    exits 0 selvedge truth plane.obj --period 2x2 --albedo 0.8,0.4,0.2 --place "$view" --size 40x30 --samples 4 \
      -o truth.png --json
    holds 'r.verb === "truth" && r.samples === 4 && r.noise < 1e-6 && r.alphaNoise === 0'
    exits 0 selvedge-view render plane.fabric.exr --place "$view" --size 40x30 -o fabric.png
    exits 0 compare-pictures truth.png fabric.png --json
    holds '(r.psnr === null || r.psnr > 40)'
  done
}

test_a_traced_swatch_has_the_same_bytes_for_any_threads_and_others_for_another_seed() {
  truth() { selvedge truth plain-knit --set yarn=tube --size 32x24 --samples 4 --quiet "$@"; }
  truth -o a.exr --threads 1
  truth -o b.exr --threads 3
  same a.exr b.exr
  truth -o c.exr --seed 2
  differ a.exr c.exr
}

"$2"
