#!/usr/bin/env bash
# Sweeps over speed and accuracy, and the choice of a setting within limits (selvedge-view trade).
# shellcheck source=tests/cli/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

sweep() {
  selvedge-view trade plain-knit --sweep set=yarn=tube --sweep views=16 --sweep lights=16 --sweep samples=2 \
    --sweep quality=paper --sweep texels=4,8 --sweep supersample=1,2 --size 32x24 --truth-samples 4 -o sweep "$@"
}

test_a_sweep_measures_every_combination_and_limits_choose_from_its_table() {
  exits 0 sweep --json
  holds 'r.rows.length === 4 && new Set(r.rows.map((row) => row.setting)).size === 4'
  holds 'r.rows.every((row) => row.bytes > 1000 && row.seconds > 0 && row.frameMs > 0 && row.pictureDb > 5 && row.heldOutDb > 5)'
  holds 'r.rows[0].bytes === r.rows[1].bytes && r.rows[0].bytes < r.rows[2].bytes && r.rows[0].heldOutDb < r.rows[2].heldOutDb'
  cp "$scratch/out" report.json
  [ "$(wc -l <sweep/trade.csv)" = 5 ] && [ "$(ls sweep/*.fabric.exr | wc -l)" = 2 ]
  [ "$(grep -o 'data:image/png' sweep/index.html | wc -l)" = 5 ] && [ "$(grep -c '<svg' sweep/index.html)" = 4 ]
  # The command lines of a row make the same bytes and picture.
  local fabric
  fabric=$(node -p 'JSON.parse(require("fs").readFileSync("report.json")).rows[3].make.match(/-o (.*)/)[1]')
  mv "$fabric" before.exr
  bash -c "$(node -p 'JSON.parse(require("fs").readFileSync("report.json")).rows[3].make') --quiet"
  same before.exr "$fabric"
  bash -c "$(node -p 'JSON.parse(require("fs").readFileSync("report.json")).rows[3].render') --quiet"
  [ -s picture.png ]
  # Limits choose from the table: the best picture within the bytes, or the fastest of the quality.
  exits 0 selvedge-view trade sweep/trade.csv --max-bytes "$(stat -c %s "${fabric/texels=8/texels=4}")" --json
  holds 'r.chosen.setting.includes("texels=4") && r.chosen.pictureDb === Math.max(r.rows[0].pictureDb, r.rows[1].pictureDb)'
  exits 0 selvedge-view trade sweep/trade.csv --min-db 1
  grep -q '^selvedge make plain-knit --set=yarn=tube' "$scratch/out"
  refuses OPTION_OUT_OF_RANGE 'none of 4 settings' selvedge-view trade sweep/trade.csv --max-bytes 1
  echo 'a,b' >other.csv
  refuses OPTION_OUT_OF_RANGE other.csv selvedge-view trade other.csv --max-bytes 1
}

test_a_sweep_goes_on_without_settings_that_cannot_be_made() {
  exits 1 selvedge-view trade plain-knit --sweep set=yarn=tube --sweep views=16 --sweep lights=16 --sweep samples=2 \
    --sweep budget=10,20K --size 32x24 --truth-samples 4 -o sweep --json
  holds 'r.rows.length === 1 && r.rows[0].setting.includes("budget=20K")'
  [ "$(wc -l <"$scratch/err")" = 1 ] && [ "$(wc -l <sweep/trade.csv)" = 2 ]
}

test_a_sweep_refuses_wrong_values_before_the_work() {
  exits 2 sweep --sweep colour=1
  exits 2 sweep --sweep texels
  exits 2 selvedge-view trade plain-knit
  exits 2 selvedge-view trade any.csv
  exits 2 selvedge-view trade any.csv --max-bytes 1K --sweep texels=4
  exits 1 selvedge-view trade plain-knit --sweep texels=many -o sweep
  grep -q 'plain-knit: --sweep: .*texels' "$scratch/err"
  exits 1 selvedge-view trade paper -o sweep
  grep -q 'STITCH_UNKNOWN' "$scratch/err"
  [ -z "$(ls sweep 2>/dev/null)" ]
}

"$2"
