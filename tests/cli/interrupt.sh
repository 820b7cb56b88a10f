#!/usr/bin/env bash
# An interrupted program leaves nothing behind and dies of the signal.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
# With job control a background process has Ctrl-C as it comes, instead of ignoring it.
set -m

# Minutes of work for any machine: what ends it is the signal.
large=(--texels 128 --views 256 --lights 256 --samples 64)

# leaves_nothing SIGNAL STATUS COMMAND...: sends the signal once the command has begun its file.
leaves_nothing() {
  local signal=$1 wanted=$2 status=0 pid before began=
  shift 2
  before=$(snapshot)
  "$@" >"$scratch/out" 2>"$scratch/err" &
  pid=$!
  for _ in $(seq 600); do
    began=$(find . -name '*.part-*' -print -quit)
    [ -z "$began" ] || break
    kill -0 $pid 2>/dev/null || fail "ended by itself: $*: $(cat "$scratch/err")"
    sleep 0.05
  done
  [ -n "$began" ] || fail "began no file: $*"
  sleep 0.2
  kill "-$signal" $pid
  wait $pid || status=$?
  [ "$status" = "$wanted" ] || fail "status $status, not $wanted, after $signal of: $*"
  [ "$before" = "$(snapshot)" ] || fail "left something behind: $(diff <(echo "$before") <(snapshot))"
}

test_bake_leaves_no_half_file_after_ctrl_c() {
  leaves_nothing INT 130 selvedge bake plain-knit --set yarn=tube -o k.samples.exr "${large[@]}"
}

test_bake_leaves_no_half_file_after_sigterm() {
  leaves_nothing TERM 143 selvedge bake plain-knit --set yarn=tube -o k.samples.exr "${large[@]}"
}

test_make_leaves_no_half_file_after_ctrl_c() {
  leaves_nothing INT 130 selvedge make --quality paper plain-knit --set yarn=tube -o k.fabric.exr "${large[@]}"
  leaves_nothing TERM 143 selvedge make --quality paper plain-knit --set yarn=tube -o k.fabric.exr \
    --keep-samples k.samples.exr "${large[@]}"
}

test_bake_leaves_the_old_file_after_ctrl_c() {
  echo old >k.samples.exr
  leaves_nothing INT 130 selvedge bake plain-knit --set yarn=tube -o k.samples.exr "${large[@]}"
  [ "$(cat k.samples.exr)" = old ]
}

"$2"
