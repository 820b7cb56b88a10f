// Written by tests/bench/quality: means over plain-knit, plain-weave, measured on
// AMD EPYC, 2 cores.
#include "converter/quality.h"

namespace selvedge {

std::span<const ExpectedPoint> expected_points() {
  static const std::array<ExpectedPoint, 23> rows{{
      {{32, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 525617, 9.36, 18.49, 23.91},
      {{32, 64, 64, 8, 2, 2, LayerChoice::no_table, 0, Storage::mixed}, 174622, 7.86, 17.04, 21.74},
      {{32, 64, 64, 8, 2, 1, LayerChoice::paper, 0, Storage::mixed}, 465678, 7.39, 18.17, 23.68},
      {{32, 64, 64, 2, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 527787, 8.53, 18.44, 23.87},
      {{32, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::half}, 448795, 9.38, 18.49, 23.91},
      {{8, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 49425, 2.00, 16.84, 21.91},
      {{16, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 147870, 3.74, 17.99, 23.30},
      {{8, 64, 64, 2, 2, 1, LayerChoice::paper, 0, Storage::half}, 42869, 1.47, 16.50, 21.50},
      {{8, 36, 36, 2, 2, 1, LayerChoice::paper, 0, Storage::half}, 28551, 1.21, 16.39, 20.75},
      {{16, 64, 64, 1, 2, 1, LayerChoice::paper, 0, Storage::half}, 123340, 2.53, 17.36, 22.41},
      {{16, 64, 64, 2, 2, 1, LayerChoice::paper, 0, Storage::half}, 121960, 2.71, 17.63, 22.98},
      {{16, 64, 64, 2, 2, 2, LayerChoice::products, 32768, Storage::mixed}, 32407, 4.64, 19.11, 23.00},
      {{16, 64, 64, 4, 2, 2, LayerChoice::products, 131072, Storage::mixed}, 81975, 4.87, 19.78, 23.29},
      {{16, 64, 64, 2, 2, 2, LayerChoice::slabs, 32768, Storage::mixed}, 31458, 6.57, 19.36, 22.89},
      {{16, 64, 64, 4, 2, 2, LayerChoice::slabs, 131072, Storage::mixed}, 125079, 6.83, 20.85, 24.57},
      {{32, 64, 64, 2, 2, 1, LayerChoice::paper, 0, Storage::half}, 421222, 6.50, 18.12, 23.64},
      {{32, 64, 64, 2, 2, 2, LayerChoice::products, 65536, Storage::mixed}, 64581, 12.80, 19.83, 23.41},
      {{32, 64, 64, 2, 2, 2, LayerChoice::products, 262144, Storage::mixed}, 239714, 13.09, 20.54, 23.82},
      {{32, 64, 64, 2, 2, 2, LayerChoice::slabs, 65536, Storage::mixed}, 64928, 21.15, 21.47, 25.37},
      {{32, 64, 64, 2, 2, 2, LayerChoice::slabs, 262144, Storage::mixed}, 250262, 22.46, 22.88, 26.19},
      {{32, 64, 64, 8, 2, 2, LayerChoice::products, 262144, Storage::mixed}, 231457, 13.83, 20.61, 23.88},
      {{32, 64, 64, 8, 2, 2, LayerChoice::slabs, 262144, Storage::mixed}, 245661, 22.78, 22.98, 26.25},
      {{64, 64, 64, 2, 2, 2, LayerChoice::products, 524288, Storage::mixed}, 509215, 45.26, 20.87, 24.02},
  }};
  return rows;
}

}  // namespace selvedge
