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
    const own = read('info.json').content.provenance.fit;
    return r.verb === 'fit' && r.levels.length === 4 && r.warnings.length === 0 && r.levels.every((l, k) =>
      Math.abs(l.heldOut.psnr - truth[k].psnr) < 0.006 && Math.abs(l.heldOut.relativeL2 - truth[k].relativeL2) < 6e-5 &&
      l.heldOut.pairs === 8 && l.training.pairs === 128 && l.training.psnr > 0 &&
      l.converged + l.atLimit === l.texels[0] * l.texels[1] && l.iterations >= 1 && l.layers === '2 lobes x table' &&
      l.bytes === Object.values(l.layerBytes).reduce((a, b) => a + b) && own.levels[k].bytes === l.bytes &&
      own.levels[k].training.psnr === l.training.psnr && own.levels[k].converged === l.converged) &&
      r.levels.reduce((sum, l) => sum + l.bytes, 0) < r.bytes; })()"
  exits 0 selvedge check k.fabric.exr --warnings-as-errors
}

test_warnings_of_a_fit_are_in_its_fabric() {
  exits 0 selvedge make --quality paper plain-knit --set yarn=tube -o m.fabric.exr --quiet --texels 8 \
    --views 1 --lights 16 --samples 4
  exits 0 selvedge info m.fabric.exr --json
  holds "r.content.provenance.fit.warnings[0].code === 'SAMPLES_SPARSE'"
}

test_the_fabric_has_the_same_bytes_on_any_number_of_threads() {
  make_samples
  selvedge fit k.samples.exr -o a.exr --quiet --threads 1
  selvedge fit k.samples.exr -o b.exr --quiet --threads 3
  same a.exr b.exr
}

test_repack_keeps_of_the_record_what_stays_true() {
  make_samples
  selvedge fit k.samples.exr --quality paper -o k.fabric.exr --quiet
  exits 0 selvedge repack k.fabric.exr -o upper.exr --levels 1-3 --codec piz
  # All that is said of it is that it is a part.
  exits 0 selvedge check upper.exr
  [ "$(grep -c warning: "$scratch/err")" = 1 ] || fail "$(cat "$scratch/err")"
  grep -q FABRIC_LEVELS "$scratch/err" || fail "$(cat "$scratch/err")"
  exits 0 selvedge info k.fabric.exr --json
  mv "$scratch/out" whole.json
  exits 0 selvedge info upper.exr --json
  holds "(() => { const whole = JSON.parse(require('fs').readFileSync('whole.json', 'utf8')).content.provenance.fit;
    const own = r.content.provenance.fit;
    return own.levels.length === 3 && own.levels.every((l, k) => l.heldOut.psnr === whole.levels[k + 1].heldOut.psnr &&
      l.converged === whole.levels[k + 1].converged); })()"
  # Other values have other errors; only the fit's own course is still true.
  for options in --half-lobes '--layers lobes,frame,opacity'; do
    # shellcheck disable=SC2086
    exits 0 selvedge repack k.fabric.exr -o other.exr $options
    exits 0 selvedge check other.exr --warnings-as-errors
    exits 0 selvedge info other.exr --json
    holds "r.content.provenance.fit.levels.every(l => !l.heldOut && !l.training && l.converged >= 1 && l.bytes > 0)"
  done
  holds "r.content.provenance.fit.levels[0].layers === '2 lobes'"
}

test_a_plot_has_the_same_bytes_whatever_the_threads() {
  make_samples
  selvedge fit k.samples.exr -o k.fabric.exr --quiet
  exits 0 selvedge compare k.fabric.exr k.samples.exr --plot 1.svg --threads 1 --quiet
  exits 0 selvedge compare k.fabric.exr k.samples.exr --plot 2.svg --threads 3 --quiet
  same 1.svg 2.svg
  exits 0 selvedge compare k.fabric.exr k.samples.exr
  psnr=$(awk '/held-out:/ { on = 1 } on && $1 == "0" { print $3; exit }' "$scratch/out")
  grep -qF ">$psnr dB, relative L2 " 1.svg || fail "no $psnr dB in the plot"
  [ "$(grep -c '<image ' 1.svg)" = 19 ]
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
  over --output --list selvedge make --list l.json -o l.json
  over --output --for selvedge make plain-knit --for p.json -o p.json
  over --output shards selvedge merge a.part b.part -o b.part
  over --output --opacity selvedge import t.csv --width 4 --opacity k.png -o k.png
  over --output input selvedge bake plane.obj -o plane.obj
  over --output scene selvedge plan p.json -o p.json
  over --plot files selvedge compare f.svg k.samples.exr --plot f.svg
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

test_plots_are_refused_before_the_work() {
  make_samples
  selvedge fit k.samples.exr -o k.fabric.exr --quiet
  exits 2 selvedge compare k.fabric.exr k.samples.exr --plot k.png
  exits 2 selvedge compare k.fabric.exr k.fabric.exr k.samples.exr --plot k.svg
  refuses FILE_UNWRITABLE absent/k.svg selvedge compare k.fabric.exr k.samples.exr --plot absent/k.svg
  selvedge bake plain-knit --set yarn=tube -o bare.samples.exr --quiet --texels 8 --views 16 --lights 16 --samples 4 \
    --held-out-pairs 0
  refuses SAMPLES_MALFORMED held-out selvedge compare k.fabric.exr bare.samples.exr --plot k.svg
  # Without held-out pairs the fit still says how it did on its own samples.
  exits 0 selvedge fit bare.samples.exr -o bare.exr --json
  holds "r.levels.every(l => l.heldOut === null && l.training.psnr > 0)"
}

test_explicit_fibres_are_traced_the_same_for_any_threads_and_refused_where_there_are_none() {
  swatch() { selvedge swatch --truth plain-knit --set yarn=tube --size 32x24 --samples 4 --quiet "$@"; }
  swatch -o plies.exr
  swatch --fibres=12 -o a.exr --threads 1
  swatch --fibres=12 -o b.exr --threads 3
  same a.exr b.exr
  differ plies.exr a.exr
  refuses OPTION_OUT_OF_RANGE transmission selvedge swatch --truth plain-knit --set transmission=1.5 -o a.png
  selvedge stitch plain-knit --set yarn=tube -o k.ply --quiet
  refuses OPTION_OUT_OF_RANGE fibres selvedge swatch --truth k.ply --fibres -o a.png
  exits 2 selvedge swatch any.fabric.exr --fibres -o a.png
  exits 2 selvedge swatch --truth plain-knit --fibres=many -o a.png
  exits 2 selvedge swatch --truth plain-knit --fibres --ground 0.5 -o a.png
}

test_a_model_is_judged_as_a_fabric_is() {
  make_samples
  selvedge fit k.samples.exr -o k.fabric.exr --quiet --quality paper
  exits 0 selvedge compare k.fabric.exr k.samples.exr --model 'selvedge answer' --plot k.svg --json
  # Its answers are exact to the digits of their JSON.
  holds "['held-out', 'rim', 'validation'].every(kind => { const own = r.fabrics[0][kind], model = r.model[kind];
    return model.pairs === own.pairs && model.peak === own.peak && model.levels.length === 4 && model.levels.every((l, k) =>
      Math.abs(l.psnr - own.levels[k].psnr) < 1e-4 && Math.abs(l.meanError - own.levels[k].meanError) < 1e-6); })"
  [ "$(grep -o '<title>model' k.svg | wc -l)" = 12 ] || fail "pictures of the model: $(grep -o '<title>[a-z]*' k.svg)"
  # White paper is several times as bright as this knit; no fabric is needed.
  cat >lambert.mjs <<'END'
import { createInterface } from 'node:readline';
for await (const line of createInterface({ input: process.stdin })) {
  const f = Math.max(0, JSON.parse(line).light[2]) / Math.PI;
  console.log(JSON.stringify({ rgb: [f, f, f], alpha: 1 }));
}
END
  exits 0 selvedge compare k.samples.exr --model 'node lambert.mjs' --json
  holds "r.fabrics.length === 0 && r.model['held-out'].levels.every(l => l.relativeL2 > 1 && l.meanError > 1)"
}

test_a_model_that_does_not_answer_is_refused() {
  make_samples
  exits 2 selvedge compare k.samples.exr
  model() { refuses JSON_MALFORMED "$1" selvedge compare k.samples.exr --model "$2"; }
  model 'answer 1: is missing' true
  model 'answer 1: is missing' false
  model 'answer 1: is not a JSON object' 'yes nonsense'
  model 'answer 1, rgb: is not three numbers' 'yes "{}"'
  model 'answer 1, alpha: is not a number from 0 to 1' "yes '{\"rgb\":[0,0,0],\"alpha\":2}'"
  model 'answer 1: {"error"' "sed 's/.*/{\"error\":\"no\"}/'"
  model 'answer 2: is missing' 'echo "{\"rgb\":[0,0,0],\"alpha\":1}"; cat >/dev/null'
  model 'answer 1: is too long' 'cat /dev/zero'
  model 'answer 2: is too long' 'echo "{\"rgb\":[0,0,0],\"alpha\":1}"; yes | tr -d "\n"'
  model 'answer 1361: is one too many' "yes '{\"rgb\":[0,0,0],\"alpha\":1}'"
  model 'the command failed' "sed 's/.*/{\"rgb\":[0,0,0],\"alpha\":1}/'; false"
}

"$2"
