#!/usr/bin/env bash
# Bakes that are killed, cut into shards, and told what to aim at.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

test_a_killed_bake_goes_on_where_it_was() {
  # A second's work for any machine, in 25 pieces: the last is the yarn.
  local sizes=(--texels 12 --views 16 --lights 16 --samples 4096 --held-out-pairs 4 --validation-pairs 2
    --rim-pairs 2 --truth-samples 64) kills=0 pid
  selvedge bake plain-knit --set yarn=tube -o whole.exr "${sizes[@]}" --quiet
  while [ $kills -lt 3 ]; do
    selvedge bake plain-knit --set yarn=tube -o killed.exr "${sizes[@]}" --quiet &
    pid=$!
    for _ in $(seq 2000); do
      # Something new is in the journal.
      [ "$(stat -c %s killed.exr.journal 2>/dev/null || echo 0)" -le "${seen:-0}" ] || break
      kill -0 $pid 2>/dev/null || break
      sleep 0.005
    done
    seen=$(stat -c %s killed.exr.journal 2>/dev/null || echo 0)
    kill -KILL $pid 2>/dev/null || break
    wait $pid 2>/dev/null || true
    kills=$((kills + 1))
    [ ! -e killed.exr ] || break
  done
  [ $kills -gt 0 ] || fail "was never killed"
  exits 0 selvedge bake plain-knit --set yarn=tube -o killed.exr "${sizes[@]}" --json
  holds "r.resumed + r.units === 25 && (r.resumed > 0 || $kills === 0)"
  same whole.exr killed.exr
  [ "$(echo killed.exr*)" = killed.exr ] || fail "left behind: $(echo killed.exr*)"
}

test_what_a_bake_left_that_was_killed_before_its_first_view_is_gone_after_the_next() {
  selvedge bake plain-knit --set yarn=tube -o k.exr --texels 64 --views 16 --lights 16 --samples 16384 --quiet &
  local pid=$!
  for _ in $(seq 2000); do
    [ -z "$(find . -name 'k.exr.journal.part-*')" ] || break
    sleep 0.005
  done
  kill -KILL $pid
  wait $pid 2>/dev/null || true
  [ -n "$(find . -name 'k.exr.journal.part-*')" ] || fail "was not killed before its first view"
  exits 0 selvedge bake plain-knit --set yarn=tube -o k.exr "${small[@]}" --quiet
  [ "$(echo k.exr*)" = k.exr ] || fail "left behind: $(echo k.exr*)"
}

test_a_journal_survives_ctrl_c_and_sigterm() {
  set -m
  selvedge bake plain-knit --set yarn=tube -o k.exr --texels 12 --views 64 --lights 16 --samples 4096 --quiet &
  local pid=$!
  for _ in $(seq 2000); do
    [ ! -e k.exr.journal ] || break
    sleep 0.005
  done
  kill -TERM $pid
  wait $pid || true
  [ -s k.exr.journal ] || fail "no journal"
  [ ! -e k.exr ] || fail "a file before its time"
  [ "$(find . -name '*.part-*' | wc -l)" = 0 ] || fail "left something behind"
}

test_shards_merge_to_the_bytes_of_the_whole() {
  selvedge bake plain-weave --set yarn=tube -o whole.exr "${small[@]}" --quiet
  for i in 1 0; do
    exits 0 selvedge bake plain-weave --set yarn=tube -o "$i.shard" --shard "$i/2" "${small[@]}" --json
    holds "r.units === $((17 - i))"
  done
  exits 0 selvedge merge 0.shard 1.shard -o merged.exr --json
  holds "r.verb === 'merge' && r.shards === 2"
  same whole.exr merged.exr
  refuses SAMPLES_MALFORMED 'in none of the shards' selvedge merge 0.shard -o other.exr
  refuses SAMPLES_MALFORMED 'not a journal' selvedge merge whole.exr -o other.exr
  refuses FILE_MISSING 2.shard selvedge merge 2.shard -o other.exr
  exits 2 selvedge bake plain-weave -o 2.shard --shard 2/2 "${small[@]}"
}

test_bake_refuses_values_that_are_none() {
  exits 2 selvedge bake plain-knit -o t.exr --bounces -1
  exits 2 selvedge bake plain-knit -o t.exr --indirect none
  exits 2 selvedge bake plain-knit -o t.exr --reference-height high
}

test_bake_takes_light_ground_and_plane() {
  selvedge bake plain-knit --set yarn=tube -o black.exr "${small[@]}" --bounces unlimited --reference-height 50% \
    --quiet
  selvedge bake plain-knit --set yarn=tube -o white.exr "${small[@]}" --bounces unlimited --reference-height 50% \
    --ground 1 --quiet
  differ black.exr white.exr
  exits 0 selvedge info white.exr --json
  holds "r.content.provenance.bake.bounces === 'unlimited' && r.content.provenance.bake.ground === 1"
  holds "r.content.provenance.bake.referencePlane === 'share' && r.content.referenceHeight < r.content.thickness"
  exits 0 selvedge bake plain-knit --set yarn=tube -o traced.exr "${small[@]}" --indirect traced --json
  holds "r.rays > 0"
}

"$2"
