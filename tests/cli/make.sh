#!/usr/bin/env bash
# bake, fit and make: qualities, sizes, lists of many fabrics.
# shellcheck source=tests/cli/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

# The same numbers, however they were asked for.
same_cloth() {
  for file; do selvedge info "$file" --json | sed -n '/"digests": {/,/^    },/p' >"$file.digests"; done
  [ -s "$1.digests" ] && same "$1.digests" "$2.digests"
}

test_a_quality_is_the_settings_it_stands_for_and_options_beside_it_stay() {
  exits 0 selvedge make plain-knit --set yarn=tube --quality draft -o a.fabric.exr --json
  holds 'r.bake.samples === 36 && r.fit.levels[0].texels[0] === 8 && r.fit.levels[0].layers === "1 lobe x table"'
  selvedge make plain-knit --set yarn=tube --quality draft --texels 8 --views 36 --lights 36 --samples 2 --lobes 1 \
    --yarns on -o b.fabric.exr --quiet
  same_cloth a.fabric.exr b.fabric.exr
  exits 0 selvedge make plain-knit --set yarn=tube --quality standard --texels 8 --bytes 24000 --views 16 \
    --lights 16 -o c.fabric.exr --json
  holds 'r.bake.samples === 36 && r.fit.levels[0].texels[0] === 8 && r.fit.bytes <= 24000 && r.fit.yarn !== null'
  local few=(--texels 8 --views 16 --lights 16)
  selvedge make plain-knit --set yarn=tube --quality standard --bytes 30000 "${few[@]}" -o d.fabric.exr --quiet
  selvedge make plain-knit --set yarn=tube --quality paper --samples 8 --bytes 30000 --yarns on "${few[@]}" \
    -o e.fabric.exr --quiet
  same_cloth d.fabric.exr e.fabric.exr
  # More texels have more bytes; a given size is kept.
  few=(--views 16 --lights 16 --quality standard --texels 32)
  exits 0 selvedge make plain-knit --set yarn=tube "${few[@]}" -o h.fabric.exr --json
  holds 'r.fit.bytes > 40000 && r.fit.bytes <= 400000'
  exits 0 selvedge make plain-knit --set yarn=tube "${few[@]}" --bytes 32K -o h.fabric.exr --json
  holds 'r.fit.bytes <= 32768'
}

# Yarn is rounded first, then left out, unless it was asked for.
test_a_file_has_at_most_the_bytes_that_are_asked_for() {
  for bytes in 12K 24K 33K; do
    exits 0 selvedge make plain-knit --bytes $bytes -o $bytes.fabric.exr --json
    holds "r.fit.bytes <= parseInt('$bytes') * 1024 && r.fit.bytes >= parseInt('$bytes') * 900 && (r.fit.yarn === null) === ('$bytes' === '12K')"
    holds "(r.fit.remarks.length === 1) === ('$bytes' === '12K')"
    exits 0 selvedge check $bytes.fabric.exr
  done
  exits 0 selvedge make plain-knit --bytes 64K --sides both -o both.fabric.exr --json
  holds 'r.fit.bytes <= 65536 && r.fit.sides.back.length === 4'
  refuses OPTION_OUT_OF_RANGE '11264 bytes; the smallest file has' selvedge make plain-knit --yarns on --bytes 11K -o n.exr --quiet
}

test_a_fabric_is_recoloured_by_the_stitch_in_other_colours() {
  selvedge make plain-knit --set colour=#808080 --quality draft -o grey.fabric.exr --quiet
  exits 0 selvedge make plain-knit --set colour=#1b2a49 --recolour grey.fabric.exr -o navy.fabric.exr --json
  holds 'r.bake === undefined && r.fit.levels[0].heldOutPsnr === null'
  exits 0 selvedge info navy.fabric.exr --json
  holds 'r.content.recipe.set.colour === "#1b2a49" && r.content.recipe.quality === "draft"'
  exits 0 selvedge check navy.fabric.exr
  refuses OPTION_OUT_OF_RANGE 'grey.fabric.exr: --recolour' selvedge make purl --recolour grey.fabric.exr -o purl.fabric.exr
  # A map stays, and yarn and its light are what a make has.
  local map=(--kinds 36 --quality draft --quiet)
  for row in {1..12}; do echo "$row: k12 [A$((row % 4 + 1)) B$((row % 3 + 3)) A$((8 - row % 4 - row % 3))]"; done >rows.txt
  { printf 'yarn A: albedo=#e6dcc4 yarn=tube\nyarn B: albedo=#1f3c6e yarn=tube\n' && cat rows.txt; } >blue.txt
  sed 's/#1f3c6e/#8a2020/' blue.txt >red.txt
  sed 's/\[A4 B3/[A3 B4/' blue.txt >moved.txt
  selvedge make blue.txt "${map[@]}" -o blue.fabric.exr
  selvedge make red.txt "${map[@]}" -o red.fabric.exr
  selvedge make red.txt "${map[@]}" --recolour blue.fabric.exr -o dyed.fabric.exr
  exits 0 selvedge check dyed.fabric.exr
  exits 0 selvedge info red.fabric.exr --json
  local digests
  digests=$(sed -n '/"digests": {/,/^    },/p' "$scratch/out" | tr -d ' \n')
  exits 0 selvedge info dyed.fabric.exr --json
  for layer in map yarns indirect; do holds "'$digests'.includes(r.content.digests.$layer[0])"; done
  # Its yarn is exported stitch by stitch: 12 x 12 in the square.
  write_quad quad.gltf
  selvedge dress quad.gltf blue.fabric.exr -o quad.glb --all --quiet
  exits 0 selvedge export quad.glb -o yarn.glb --triangles 60000 --json
  holds 'r.triangles <= 60000 && r.triangles > 15000'
  holds '(({copies, bent, cut}) => bent + copies >= 80 && copies + bent + cut >= 144)(r.yarns[0])'
  exits 0 selvedge check yarn.glb
  refuses OPTION_OUT_OF_RANGE 'blue.fabric.exr: --recolour' selvedge make moved.txt "${map[@]}" --recolour blue.fabric.exr -o o.exr
}

test_a_make_without_a_quality_is_the_standard_one() {
  exits 0 selvedge make plain-knit --set yarn=tube -o a.fabric.exr --json
  holds 'r.bake.samples === 36 && r.fit.levels[0].texels[0] === 8 && r.fit.bytes <= 32768 && r.fit.yarn.curves === 1'
  selvedge make plain-knit --set yarn=tube --quality standard -o b.fabric.exr --quiet
  same_cloth a.fabric.exr b.fabric.exr
  for quality in standard paper; do
    exits 0 selvedge make plain-knit --set yarn=tube "${small[@]}" --quality $quality --no-table --lobes 1 \
      -o l.fabric.exr --json
    holds 'r.fit.levels[0].layers === "1 lobe"'
  done
  # Bake and fit by themselves make the same, by way of a file.
  for quality in "" "--quality paper"; do
    # shellcheck disable=SC2086
    {
      selvedge bake plain-knit --set yarn=tube $quality "${small[@]}" -o s.samples.exr --quiet
      selvedge fit s.samples.exr $quality -o c.fabric.exr --quiet
      selvedge make plain-knit --set yarn=tube $quality "${small[@]}" --keep-samples t.samples.exr -o d.fabric.exr \
        --quiet
    }
    same s.samples.exr t.samples.exr
    same c.fabric.exr d.fabric.exr
  done
}

# Lace and satin repeat after many yarns; of a weaving draft with twice as many, eight texels are too few.
test_a_draft_is_to_be_had_for_stitches_of_many_yarns() {
  for stitch in lace satin; do
    exits 0 selvedge make $stitch --set yarn=tube --quality draft -o $stitch.fabric.exr --quiet
    exits 0 selvedge check $stitch.fabric.exr
  done
  write_twill twill.wif 8
  exits 0 selvedge make twill.wif --set yarn=tube --quality draft -o draft.fabric.exr --json
  holds 'r.fit.levels[0].texels[0] === 16'
  refuses OPTION_OUT_OF_RANGE 'its yarns need 16x16 texels' \
    selvedge make twill.wif --quality draft --texels 8 -o none.fabric.exr --quiet
}

list() {
  cat >list <<'END'
# Small fabrics.
plain-knit --set yarn=tube --set albedo=#a02030 --quality draft --texels 4 --views 16 --lights 16 -o red.fabric.exr

'own stitch.json' --quality draft --texels 4 --views 16 --lights 16 -o own.fabric.exr  # woven
END
  selvedge stitch plain-weave --set yarn=tube -o "own stitch.json"
}

test_a_list_makes_what_its_lines_make_and_a_line_of_it_is_one_job_of_a_job_array() {
  list
  exits 0 selvedge make --list list --json
  holds 'r.made === 2 && r.failed === 0 && r.fabrics[1].line === 4 && r.fabrics[1].output === "own.fabric.exr"'
  mkdir whole
  mv ./*.fabric.exr whole
  # As "#SBATCH --array=1-4" and "selvedge make --list list --line $SLURM_ARRAY_TASK_ID" do; lines 1 and 3 are no work.
  for task in 1 2 3 4; do exits 0 selvedge make --list list --line $task --quiet; done
  same red.fabric.exr whole/red.fabric.exr
  same own.fabric.exr whole/own.fabric.exr
  selvedge make plain-knit --set yarn=tube --set albedo=#a02030 --quality draft --texels 4 --views 16 --lights 16 \
    -o red.fabric.exr --quiet
  same red.fabric.exr whole/red.fabric.exr
  refuses OPTION_OUT_OF_RANGE 'list: line 5: the list has 4 lines' selvedge make --list list --line 5
}

test_a_list_is_read_whole_before_any_work_and_goes_on_after_a_fabric_that_fails() {
  list
  bad() {
    sed "$2" list >bad
    refuses OPTION_OUT_OF_RANGE "bad: line $1" selvedge make --list bad
  }
  bad '4: unknown option --vews' '4s/--views/--vews/'
  bad '4: a quote is not closed' "4s/json'/json/"
  bad '4: writes own.fabric.exr, as line 2 does' '2s/red.fabric/own.fabric/'
  bad '2: writes over own stitch.json, an input' "2s/red.fabric.exr/'own stitch.json'/"
  bad '4: writes over bad, an input' '4s/own.fabric.exr/bad/'
  bad '4: --list ' '4s/.*/--list list/'
  bad '4: has a control character' '4s/own/\x1b[31m/'
  sed 's/plain-knit/no-stitch/' list >bad
  refuses STITCH_UNKNOWN 'bad: line 2' selvedge make --list bad
  sed -i '2s/$/ --bytes 100/' list
  exits 1 selvedge make --list list --json
  holds 'r.failed === 1 && r.made === 1 && r.fabrics[0].error.code === "OPTION_OUT_OF_RANGE"'
}

test_what_has_not_changed_is_kept() {
  list
  exits 0 selvedge make --list list --if-changed --json
  holds 'r.made === 2 && r.kept === 0'
  echo >>'own stitch.json'
  exits 0 selvedge make --list list --if-changed --json
  holds 'r.made === 1 && r.kept === 1 && r.fabrics[0].kept'
  write_quad quad.gltf
  local run
  for run in false true; do
    exits 0 selvedge dress quad.gltf red.fabric.exr -o quad.glb --all --if-changed --json
    holds "(r.kept === true) === $run"
    exits 0 selvedge-view render quad.glb -o 'q-{frame}.png' --turntable 2 --size 40x30 --if-changed --json
    holds "(r.kept === true) === $run"
  done
  exits 0 selvedge-view render quad.glb -o 'q-{frame}.png' --turntable 2 --size 40x31 --if-changed --json
  holds 'r.kept === undefined'
}

test_a_fabric_is_made_again_by_its_recipe() {
  printf 'name: own\nyarn A: radius_mm=0.5\n2: k2 p2\n1: k2 p2\n' >own.txt
  selvedge make own.txt --set yarn=cotton --set 'colour=#aa3322' --quality draft --no-table --seed 3 -o a.fabric.exr --quiet
  exits 0 selvedge info a.fabric.exr --json
  mkdir again
  node -pe 'JSON.parse(fs.readFileSync(0, "utf8")).content.recipe.text.trimEnd()' <"$scratch/out" >again/own.txt
  exits 0 selvedge info a.fabric.exr
  (cd again && eval "$(sed -e ':a' -e '/\\$/N; s/\\\n//; ta' "$scratch/out" | sed -n 's/^recipe *//p') -o a.fabric.exr --quiet")
  same a.fabric.exr again/a.fabric.exr
}

test_make_leaves_no_half_file_after_a_signal() {
  # With job control a background process has Ctrl-C as it comes, instead of ignoring it.
  set -m
  echo old >k.fabric.exr
  local status pid before
  before=$(snapshot)
  for signal in INT TERM; do
    # Minutes of work for any machine: the signal ends it.
    selvedge make plain-knit --set yarn=tube -o k.fabric.exr --keep-samples k.samples.exr --texels 128 --views 256 \
      --lights 256 --samples 64 >"$scratch/out" 2>&1 &
    pid=$! status=0
    sleep 1
    kill -$signal $pid
    wait $pid || status=$?
    [ "$status" = $((128 + $(kill -l $signal))) ] || fail "status $status after $signal: $(cat "$scratch/out")"
    [ "$before" = "$(snapshot)" ] || fail "left something behind: $(diff <(echo "$before") <(snapshot))"
  done
}

"$2"
