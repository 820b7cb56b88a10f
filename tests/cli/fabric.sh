#!/usr/bin/env bash
# Questions asked of fabric files.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

make_knit_fabric() { selvedge make --quality paper plain-knit --set yarn=tube -o k.fabric.exr --quiet "${small[@]}"; }

# says FILE EXPRESSION: prints a part of the attribute text, `t`.
says() {
  selvedge info "$1" --json |
    node -p 'const t = JSON.parse(require("fs").readFileSync(0)).content; JSON.stringify(eval(process.argv[1]))' "$2"
}

digests_of() { says "$1" t.digests; }

test_answers_to_the_conformance_kit_are_those_of_evaluate() {
  make_knit_fabric
  local n=0 where
  for at in '0 texel 3,5' '2 texel 1,0' '3 texel 0,0' '0.75 uv 0.3,-7.9' '2.5 uv 0.999,0.5' '3 uv 9,9'; do
    read -r level how where <<<"$at"
    selvedge evaluate k.fabric.exr --level "$level" --"$how" "$where" --light 0,0.6,0.8 --view 0.6,0,0.8 \
      >$n.json
    n=$((n + 1))
    echo "{\"op\":\"evaluate\",\"file\":\"k.fabric.exr\",\"level\":$level,\"$how\":[$where]," \
      '"light":[0,0.6,0.8],"view":[0.6,0,0.8]}'
  done >queries.jsonl
  answer_queries <queries.jsonl | sed '1s/^/[/; $!s/$/,/; $s/$/]/' >answers.json
  holds 'r.length === 6 && r.every((a, i) => {
    const e = JSON.parse(require("fs").readFileSync(i + ".json"));
    return a.alpha === e.alpha && a.rgb.join() === e.rgb.join(); })' answers.json
}

test_yarn_goes_from_the_stitch_into_the_fabric() {
  local few=(--texels 8 --views 4 --lights 4 --samples 1 --lobes 1 --pairs 8 --truth-samples 8 --quiet)
  exits 0 selvedge make plain-knit --set yarn=tube --yarns on "${few[@]}" -o y.fabric.exr
  exits 0 selvedge info y.fabric.exr
  grep -qE '^yarn +[0-9]+ curves, [0-9]+ nodes$' "$scratch/out" || fail "$(cat "$scratch/out")"
  exits 0 selvedge info y.fabric.exr --json
  holds "r.layers.find(l => l.layer === 'yarns').bytes[0] > 1000 && r.content.layers.yarns.curves > 0 &&
    r.content.accuracy.front.length === 4 && r.content.accuracy.yarn > 25"
  exits 0 selvedge check y.fabric.exr
  # Level -1 is a point: yarn or none.
  exits 0 selvedge evaluate y.fabric.exr --level -1 --uv 0.3,0.4 --json
  holds 'r.alpha === 1 && r.rgb[0] > 0'
  exits 1 selvedge evaluate y.fabric.exr --level -1 --texel 0,0
  exits 1 selvedge evaluate y.fabric.exr --level -1.5 --uv 0,0
  # In a mesh from a file they are found; a sheet has none.
  selvedge stitch plain-knit --set yarn=tube -o knit.obj --quiet
  exits 0 selvedge make knit.obj --period 5x3.8 --yarns on "${few[@]}" -o k.fabric.exr
  exits 0 selvedge evaluate k.fabric.exr --level -1 --uv 0.3,0.4 --json
  holds 'r.alpha === 1 && r.rgb[0] > 0'
  write_plane plane.obj
  exits 0 selvedge make plane.obj --period 2x2 --yarns on --texels 8 --views 4 --lights 4 --samples 1 --lobes 1 -o p.fabric.exr
  grep -q 'no yarns are stored' "$scratch/err" || fail "says nothing of the yarns"
}

test_both_sides_go_from_the_bake_into_the_fabric() {
  local few=(--texels 8 --views 16 --lights 16 --samples 2 --lobes 1 --yarns on --quiet)
  exits 0 selvedge make plain-knit --set yarn=tube "${few[@]}" --sides both --keep-samples b.samples.exr \
    -o b.fabric.exr --json
  holds 'const s = r.fit.sides; ["back", "through", "back.through"].every(side => s[side].length === 4 &&
    s[side].every(level => level.heldOutPsnr > 10 && level.bytes > 0))'
  exits 0 selvedge make plain-knit --set yarn=tube "${few[@]}" -o f.fabric.exr
  [ "$(digests_of f.fabric.exr)" = "$(digests_of b.fabric.exr)" ] || fail "the front is another"
  exits 0 selvedge check b.fabric.exr b.samples.exr
  exits 0 selvedge info b.fabric.exr
  for side in back through back.through; do grep -qE " $side\.(lobes|products) " "$scratch/out" || fail "$(cat "$scratch/out")"; done
  exits 0 selvedge info b.samples.exr --json
  holds 'r.content.sides === "both"'
  # Light behind the cloth: the front, and the back on its own side.
  for light in 0,0.6,0.8 0,0.6,-0.8; do
    for side in '' --behind; do
      # shellcheck disable=SC2086
      exits 0 selvedge evaluate b.fabric.exr --level 3 --texel 0,0 --light=$light $side --json
      holds 'r.rgb.every(x => x > 0)'
    done
  done
  exits 0 selvedge evaluate f.fabric.exr --level 3 --texel 0,0 --light=0,0.6,-0.8 --json
  holds 'r.rgb.every(x => x === 0)'
}

"$2"
