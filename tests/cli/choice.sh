#!/usr/bin/env bash
# Settings that are chosen: by a quality, and within limits.
# shellcheck source=tests/cli/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

test_a_quality_is_the_settings_it_stands_for_and_options_beside_it_stay() {
  exits 0 selvedge make plain-knit --set yarn=tube --quality draft -o a.fabric.exr --json
  holds 'r.bake.samples === 2 && r.fit.levels[0].texels[0] === 8 && r.fit.levels[0].layers === "1 lobe x table"'
  selvedge make plain-knit --set yarn=tube --quality paper --texels 8 --views 36 --lights 36 --samples 2 --lobes 1 \
    --half-lobes --yarns on -o b.fabric.exr --quiet
  same a.fabric.exr b.fabric.exr
  exits 0 selvedge make plain-knit --set yarn=tube --quality standard --texels 8 --budget 20000 --views 16 \
    --lights 16 -o c.fabric.exr --json
  holds 'r.bake.samples === 8 && r.fit.levels[0].texels[0] === 8 && r.fit.bytes - r.fit.yarn.bytes - 4000 <= 20000'
  local few=(--texels 8 --views 16 --lights 16)
  selvedge make plain-knit --set yarn=tube --quality standard --budget 30000 "${few[@]}" -o d.fabric.exr --quiet
  selvedge make plain-knit --set yarn=tube --quality paper --samples 8 --budget 30000 --yarns on "${few[@]}" \
    -o e.fabric.exr --quiet
  same d.fabric.exr e.fabric.exr
  # More texels have more bytes, a size that was given is kept.
  few=(--views 16 --lights 16 --quality standard --texels 32)
  exits 0 selvedge make plain-knit --set yarn=tube "${few[@]}" -o h.fabric.exr --json
  holds 'r.fit.bytes > 40000 && r.fit.bytes <= 400000'
  exits 0 selvedge make plain-knit --set yarn=tube "${few[@]}" --budget 32K -o h.fabric.exr --json
  holds 'r.fit.bytes <= 32768 + 8192'
  exits 2 selvedge make plain-knit --quality best -o d.fabric.exr
  exits 2 selvedge-view render a.fabric.exr --place near -o x.png --quality best
}

test_a_make_without_a_quality_is_the_standard_one() {
  exits 0 selvedge make plain-knit --set yarn=tube -o a.fabric.exr --json
  holds 'r.bake.samples === 8 && r.fit.levels[0].texels[0] === 8 && r.fit.bytes <= 32768 && r.fit.yarn.curves === 1'
  selvedge make plain-knit --set yarn=tube --quality standard -o b.fabric.exr --quiet
  same a.fabric.exr b.fabric.exr
  # Layers that are named are those that are made, of every preset.
  for quality in standard high paper; do
    exits 0 selvedge make plain-knit --set yarn=tube "${small[@]}" --quality $quality --no-table --lobes 1 \
      -o l.fabric.exr --json
    holds 'r.fit.levels[0].layers === "1 lobe"'
  done
  # Bake and fit by themselves make the same, of every quality.
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

test_make_within_limits_never_writes_over_its_input() {
  selvedge stitch plain-weave --set yarn=tube -o weave.ply --quiet
  cp weave.ply before.ply
  exits 2 selvedge make weave.ply --max-bytes 12K -o weave.ply --quiet
  same weave.ply before.ply
  # What is not in the measured table is not chosen by it.
  exits 2 selvedge make plain-weave --max-seconds nan -o a.exr
}

test_make_within_limits_keeps_them_or_names_the_nearest() {
  exits 0 selvedge make plain-knit --set yarn=tube --max-bytes 16K --max-seconds 600 -o k.fabric.exr --json
  holds 'r.made.bytes <= 16384 && r.made.seconds <= 600 && r.expected.bytes > 0 && r.options.startsWith("--quality paper --") &&
    r.tried.some(t => t.options === r.options)'
  [ "$(stat -c %s k.fabric.exr)" -le 16384 ]
  exits 0 selvedge check k.fabric.exr
  # All three figures are reported, whichever were limited.
  exits 0 selvedge make plain-weave --set yarn=tube --max-bytes 16K -o w.fabric.exr --json
  holds 'r.made.bytes <= 16384 && r.made.seconds > 0'
  node -p 'const made = JSON.parse(require("fs").readFileSync(process.argv[1], "utf8")); made.made.heldOut' "$scratch/out" >alone
  # By the same directions as where quality is limited.
  exits 0 selvedge make plain-weave --set yarn=tube --max-bytes 16K --min-db 1 -o v.fabric.exr --json
  if cmp -s v.fabric.exr w.fabric.exr; then holds "r.made.heldOut === $(cat alone)"; fi
  holds "Math.abs(r.made.heldOut - $(cat alone)) < 2"
  write_plane plane.obj
  exits 0 selvedge make plane.obj --period 2x2 --min-db 30 --max-bytes 1M -o p.fabric.exr --json
  holds 'r.tried.length === 1 && r.made.heldOut >= 30'
  # Nothing is as small as that.
  refuses OPTION_OUT_OF_RANGE 'the smallest fabric found has' \
    selvedge make plain-knit --set yarn=tube --max-bytes 100 -o none.fabric.exr --quiet
  exits 2 selvedge make plain-knit --max-bytes 60K --texels 8 -o x.fabric.exr
  exits 2 selvedge make plain-knit --min-db 20 --quality draft -o x.fabric.exr
}

test_limits_of_cost_are_met_where_quality_is_not_to_be_had() {
  refuses OPTION_OUT_OF_RANGE 'are met by none of 2 settings made; the nearest is --quality paper' \
    selvedge make plain-weave --set yarn=tube --min-db 100 --max-bytes 12K -o none.fabric.exr --quiet
  local made options
  made=$(sed -nE 's/.*: ([0-9]+) bytes.*/\1/p' "$scratch/err")
  [ "$made" -le 12288 ] || fail "$(cat "$scratch/err")"
  # What it names can be made, and is as small as it says.
  options=$(sed -E 's/.*nearest is (.*): [0-9]+ bytes.*/\1/' "$scratch/err")
  # shellcheck disable=SC2086 # several words
  selvedge make plain-weave --set yarn=tube $options -o nearest.fabric.exr --quiet
  [ "$(stat -c %s nearest.fabric.exr)" = "$made" ]
}

test_a_size_that_is_none_is_a_usage_error_of_one_line() {
  for size in 0 0K -5 -5K 99999999999999999999999 1e30 17179869184G 5X '' 1.5; do
    for verb in "make plain-knit --max-bytes" "make plain-knit --budget" "fit s.exr --budget"; do
      # shellcheck disable=SC2086 # several words
      exits 2 selvedge $verb "$size" -o x.fabric.exr
      [ "$(wc -l <"$scratch/err")" = 1 ] || fail "not one line: $(cat "$scratch/err")"
      [ "$(wc -c <"$scratch/err")" -lt 120 ] || fail "a long line: $(cat "$scratch/err")"
      grep -qF "\"$size\" is not a number of bytes" "$scratch/err" || fail "$(cat "$scratch/err")"
    done
  done
}

test_a_name_that_is_too_long_is_told_as_it_was_given() {
  write_plane plane.obj
  local name
  # There is room for one suffix of a temporary file and not for another, or for none.
  for length in 229 240 260; do
    name=$(printf 'a%.0s' $(seq "$length"))
    refuses FILE_UNWRITABLE "selvedge: $name: File name too long" \
      selvedge make plane.obj --period 2x2 "${small[@]}" -o "$name" --quiet
    refuses FILE_UNWRITABLE "selvedge: $name: File name too long" \
      selvedge make plane.obj --period 2x2 --min-db 30 -o "$name" --quiet
  done
}

test_make_within_limits_chooses_layers_within_a_size_that_nobody_measured() {
  exits 0 selvedge make plain-knit --set yarn=tube --max-bytes 20K -o k.fabric.exr --json
  holds 'r.made.bytes <= 20480 && r.made.bytes > 12000 && /--budget 20480/.test(r.options)'
  exits 0 selvedge check k.fabric.exr
}

test_the_options_of_a_choice_make_the_same_bytes_in_the_place_of_the_limits() {
  # remade ARGUMENT...: by the options that the last report names.
  remade() {
    # shellcheck disable=SC2046 # several words
    selvedge make "$@" $(node -p 'JSON.parse(require("fs").readFileSync(process.argv[1])).options' "$scratch/out") \
      -o remade.fabric.exr --quiet
    same kept.fabric.exr remade.fabric.exr
  }
  local others=(--set yarn=tube --set warp_albedo=0.3,0.2,0.1 --set weft_radius_mm=0.28 --seed 5 --grid 40 --held-out-pairs 4
    --validation-pairs 16 --reference-height 80%)
  exits 0 selvedge make plain-weave --max-bytes 12K "${others[@]}" --threads 1 -o kept.fabric.exr --json
  remade plain-weave "${others[@]}"
  write_plane "the plane's.obj"
  others=(--period 2x2 --albedo 0.8,0.4,0.2 --seed 9)
  exits 0 selvedge make "the plane's.obj" --min-db 30 "${others[@]}" -o kept.fabric.exr --json
  remade "the plane's.obj" "${others[@]}"
}

# Lace and satin repeat after many yarns; of a weaving draft with twice as many, eight texels are too few.
test_a_draft_and_a_size_are_to_be_had_for_stitches_of_many_yarns() {
  for stitch in lace satin; do
    exits 0 selvedge make $stitch --set yarn=tube --quality draft -o $stitch.fabric.exr --quiet
    exits 0 selvedge check $stitch.fabric.exr
  done
  {
    printf '[WIF]\n[WEAVING]\nShafts=4\n'
    printf '[%s]\nThreads=8\nUnits=Centimeters\nSpacing=0.1\nThickness=0.06\n' WARP WEFT
    echo '[THREADING]'
    for i in 1 2 3 4 5 6 7 8; do echo "$i=$(((i - 1) % 4 + 1))"; done
    echo '[LIFTPLAN]'
    for i in 1 2 3 4 5 6 7 8; do echo "$i=$(((i - 1) % 4 + 1)),$((i % 4 + 1))"; done
  } >twill.wif
  exits 0 selvedge make twill.wif --set yarn=tube --quality draft -o draft.fabric.exr --json
  holds 'r.fit.levels[0].texels[0] === 16'
  exits 0 selvedge make twill.wif --set yarn=tube --max-bytes 16K -o small.fabric.exr --json
  holds 'r.fit.levels[0].texels[0] === 16 && r.made.bytes <= 16384'
  refuses OPTION_OUT_OF_RANGE 'its yarns need 16x16 texels' \
    selvedge make twill.wif --quality draft --texels 8 -o none.fabric.exr --quiet
}

"$2"
