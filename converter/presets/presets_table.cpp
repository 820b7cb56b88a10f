// Written by tests/bench/trade: means over plain-knit, purl, rib, garter, two-colour, lace, plain-weave,
// twill, satin, basket, measured on AMD EPYC, 2 cores.
#include "converter/presets/presets.h"

namespace selvedge {

std::span<const ExpectedPoint> expected_points() {
  static const std::array<ExpectedPoint, 35> rows{{
      {{32, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 528429, 9.29, 17.66, 23.31},
      {{32, 64, 64, 8, 0, 2, LayerChoice::paper, 0, Storage::mixed}, 458846, 8.77, 17.55, 23.50},
      {{32, 36, 36, 8, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 373742, 6.17, 17.35, 22.70},
      {{32, 64, 64, 8, 2, 2, LayerChoice::no_table, 0, Storage::mixed}, 177023, 7.89, 16.48, 21.82},
      {{32, 64, 64, 8, 2, 2, LayerChoice::light_table, 0, Storage::mixed}, 862320, 14.95, 18.03, 23.33},
      {{32, 64, 64, 8, 2, 1, LayerChoice::paper, 0, Storage::mixed}, 467814, 7.46, 17.36, 23.03},
      {{32, 64, 64, 8, 2, 3, LayerChoice::paper, 0, Storage::mixed}, 592117, 15.93, 17.74, 23.37},
      {{32, 64, 64, 2, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 528709, 8.39, 17.59, 23.25},
      {{32, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::half}, 451471, 9.26, 17.66, 23.31},
      {{32, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::whole}, 1195354, 9.28, 17.66, 23.31},
      {{8, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 48806, 2.15, 15.94, 21.21},
      {{16, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 147325, 3.79, 17.06, 22.62},
      {{8, 64, 64, 2, 2, 1, LayerChoice::paper, 0, Storage::half}, 42221, 1.66, 15.60, 20.88},
      {{8, 36, 36, 2, 2, 1, LayerChoice::paper, 0, Storage::half}, 28188, 1.42, 15.50, 20.63},
      {{8, 64, 64, 4, 2, 2, LayerChoice::products, 16384, Storage::mixed}, 16044, 2.53, 16.37, 21.47},
      {{8, 64, 64, 4, 2, 2, LayerChoice::slabs, 16384, Storage::mixed}, 16044, 3.71, 16.37, 21.47},
      {{8, 64, 64, 4, 2, 2, LayerChoice::slabs, 65536, Storage::mixed}, 55608, 3.91, 17.03, 21.98},
      {{16, 64, 64, 1, 2, 1, LayerChoice::paper, 0, Storage::half}, 122480, 2.71, 16.41, 21.89},
      {{16, 64, 64, 2, 2, 1, LayerChoice::paper, 0, Storage::half}, 120963, 2.81, 16.71, 22.25},
      {{16, 64, 64, 2, 2, 2, LayerChoice::products, 32768, Storage::mixed}, 32188, 4.61, 18.06, 23.24},
      {{16, 64, 64, 4, 2, 2, LayerChoice::products, 65536, Storage::mixed}, 63376, 4.84, 18.50, 23.55},
      {{16, 64, 64, 4, 2, 2, LayerChoice::products, 131072, Storage::mixed}, 83422, 4.84, 18.53, 23.57},
      {{16, 64, 64, 2, 2, 2, LayerChoice::slabs, 32768, Storage::mixed}, 32080, 7.68, 18.18, 23.27},
      {{16, 64, 64, 4, 2, 2, LayerChoice::slabs, 65536, Storage::mixed}, 64801, 8.49, 19.16, 24.11},
      {{16, 64, 64, 4, 2, 2, LayerChoice::slabs, 131072, Storage::mixed}, 123887, 8.75, 19.46, 24.34},
      {{16, 36, 36, 4, 2, 2, LayerChoice::slabs, 65536, Storage::mixed}, 64231, 5.80, 18.87, 23.81},
      {{32, 64, 64, 2, 2, 1, LayerChoice::paper, 0, Storage::half}, 421779, 6.57, 17.31, 22.97},
      {{32, 64, 64, 2, 2, 2, LayerChoice::products, 65536, Storage::mixed}, 64655, 12.34, 18.92, 23.98},
      {{32, 64, 64, 2, 2, 2, LayerChoice::products, 262144, Storage::mixed}, 236484, 12.62, 19.45, 24.40},
      {{32, 64, 64, 2, 2, 2, LayerChoice::slabs, 65536, Storage::mixed}, 64881, 23.20, 20.02, 24.82},
      {{32, 64, 64, 2, 2, 2, LayerChoice::slabs, 131072, Storage::mixed}, 128946, 23.60, 21.10, 25.58},
      {{32, 64, 64, 2, 2, 2, LayerChoice::slabs, 262144, Storage::mixed}, 254148, 24.28, 21.56, 25.97},
      {{32, 64, 64, 8, 2, 2, LayerChoice::slabs, 262144, Storage::mixed}, 255694, 25.77, 21.72, 26.08},
      {{32, 64, 64, 8, 2, 2, LayerChoice::slabs, 524288, Storage::mixed}, 480887, 25.98, 21.85, 26.23},
      {{64, 36, 36, 2, 2, 1, LayerChoice::paper, 0, Storage::half}, 977225, 13.23, 17.21, 22.55},
  }};
  return rows;
}

}  // namespace selvedge
