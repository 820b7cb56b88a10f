#!/usr/bin/env bash
# What frames of three qualities cost and are worth (selvedge-view trade).
# shellcheck source=tests/cli/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

test_a_trade_measures_three_qualities_from_four_distances() {
  exits 0 selvedge-view trade plain-knit --set yarn=tube --size 80x60 -o trade --json
  holds 'r.rows.map((row) => row.pixels).join() === "120,120,120,30,30,30,15,15,15,8,8,8"'
  holds 'r.rows.every((row) => row.movingMs > 0 && row.movingDb > 10 && row.restDb > 10)'
  holds "r.rows[1].quality === 'standard' && r.rows[1].bytes === $(stat -c %s trade/standard.fabric.exr)"
  # Close by, the standard quality shows the same yarn as draft in fewer bytes; paper has none.
  holds 'r.rows.every((row) => row.front || row.quality !== "standard")'
  [ "$(grep -o 'data:image/png' trade/index.html | wc -l)" = 28 ] && [ "$(grep -c '<td>' trade/index.html)" = 12 ]
}

"$2"
