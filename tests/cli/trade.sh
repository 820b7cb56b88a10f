#!/usr/bin/env bash
# The plot of what pictures cost and are worth (selvedge-view trade).
# shellcheck source=tests/cli/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

test_a_trade_plots_four_fabrics_from_four_distances() {
  exits 0 selvedge-view trade plain-knit --set yarn=tube --size 80x60 -o trade --json
  holds '[120, 30, 15, 8].every((pixels) => r.rows.filter((row) => row.pixels === pixels).length === 12)'
  holds 'r.rows.every((row) => row.ms > 0 && row.db > 10)'
  holds "r.rows[0].fabric === 'yarn' && r.rows[0].bytes === $(stat -c %s trade/plain-knit-yarn.fabric.exr)"
  # Close by, yarn is nearer to the stitch than the paper's texels.
  holds '["yarn", "paper"].map((fabric) => r.rows.find((row) => row.fabric === fabric).db).reduce((a, b) => a - b) > 5'
  [ "$(grep -o 'data:image/png' trade/index.html | wc -l)" = 52 ] && [ "$(grep -c '<td>' trade/index.html)" = 48 ]
}

"$2"
