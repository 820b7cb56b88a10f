// Written by tests/bench/trade: means over plain-knit, purl, rib, garter, two-colour, lace, plain-weave,
// twill, satin, basket, measured on AMD EPYC, 2 cores.
#include "converter/quality.h"

namespace selvedge {

std::span<const ExpectedPoint> expected_points() {
  static const std::array<ExpectedPoint, 32> rows{{
      {{32, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 528429, 10.36, 17.66, 23.31},
      {{32, 64, 64, 8, 0, 2, LayerChoice::paper, 0, Storage::mixed}, 458846, 9.94, 17.55, 23.50},
      {{32, 36, 36, 8, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 373742, 6.93, 17.35, 22.70},
      {{32, 64, 64, 8, 2, 2, LayerChoice::no_table, 0, Storage::mixed}, 177023, 8.79, 16.48, 21.82},
      {{32, 64, 64, 8, 2, 2, LayerChoice::light_table, 0, Storage::mixed}, 862320, 16.70, 18.03, 23.33},
      {{32, 64, 64, 8, 2, 1, LayerChoice::paper, 0, Storage::mixed}, 467814, 8.37, 17.36, 23.03},
      {{32, 64, 64, 8, 2, 3, LayerChoice::paper, 0, Storage::mixed}, 592117, 17.81, 17.74, 23.37},
      {{32, 64, 64, 2, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 528709, 9.57, 17.59, 23.25},
      {{32, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::half}, 451471, 10.35, 17.66, 23.31},
      {{32, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::whole}, 1195354, 10.39, 17.66, 23.31},
      {{8, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 48806, 2.46, 15.94, 21.21},
      {{16, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 147325, 4.32, 17.06, 22.62},
      {{8, 64, 64, 2, 2, 1, LayerChoice::paper, 0, Storage::half}, 42221, 1.89, 15.60, 20.88},
      {{8, 36, 36, 2, 2, 1, LayerChoice::paper, 0, Storage::half}, 28188, 1.62, 15.50, 20.63},
      {{8, 64, 64, 4, 2, 2, LayerChoice::products, 16384, Storage::mixed}, 16044, 2.89, 16.37, 21.47},
      {{8, 64, 64, 4, 2, 2, LayerChoice::slabs, 16384, Storage::mixed}, 16044, 4.22, 16.37, 21.47},
      {{8, 64, 64, 4, 2, 2, LayerChoice::slabs, 65536, Storage::mixed}, 55608, 4.46, 17.03, 21.98},
      {{16, 64, 64, 1, 2, 1, LayerChoice::paper, 0, Storage::half}, 122480, 3.08, 16.41, 21.89},
      {{16, 64, 64, 2, 2, 1, LayerChoice::paper, 0, Storage::half}, 120963, 3.18, 16.71, 22.25},
      {{16, 64, 64, 2, 2, 2, LayerChoice::products, 32768, Storage::mixed}, 32188, 5.19, 18.06, 23.24},
      {{16, 64, 64, 4, 2, 2, LayerChoice::products, 131072, Storage::mixed}, 83422, 5.48, 18.53, 23.57},
      {{16, 64, 64, 2, 2, 2, LayerChoice::slabs, 32768, Storage::mixed}, 32080, 8.70, 18.18, 23.27},
      {{16, 64, 64, 4, 2, 2, LayerChoice::slabs, 65536, Storage::mixed}, 64801, 9.69, 19.16, 24.11},
      {{16, 64, 64, 4, 2, 2, LayerChoice::slabs, 131072, Storage::mixed}, 123887, 9.89, 19.46, 24.34},
      {{16, 36, 36, 4, 2, 2, LayerChoice::slabs, 65536, Storage::mixed}, 64231, 6.53, 18.87, 23.81},
      {{32, 64, 64, 2, 2, 1, LayerChoice::paper, 0, Storage::half}, 421779, 7.48, 17.31, 22.97},
      {{32, 64, 64, 2, 2, 2, LayerChoice::products, 65536, Storage::mixed}, 64655, 14.07, 18.92, 23.98},
      {{32, 64, 64, 2, 2, 2, LayerChoice::products, 262144, Storage::mixed}, 236484, 14.37, 19.45, 24.40},
      {{32, 64, 64, 2, 2, 2, LayerChoice::slabs, 65536, Storage::mixed}, 64881, 26.39, 20.02, 24.82},
      {{32, 64, 64, 2, 2, 2, LayerChoice::slabs, 262144, Storage::mixed}, 254148, 27.53, 21.56, 25.97},
      {{32, 64, 64, 8, 2, 2, LayerChoice::slabs, 262144, Storage::mixed}, 255694, 29.58, 21.72, 26.08},
      {{64, 36, 36, 2, 2, 1, LayerChoice::paper, 0, Storage::half}, 977225, 14.69, 17.21, 22.55},
  }};
  return rows;
}

}  // namespace selvedge
