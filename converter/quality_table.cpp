// Written by tests/bench/quality: means over plain-knit, measured on
// AMD EPYC, 2 cores.
#include "converter/quality.h"

namespace selvedge {

std::span<const ExpectedPoint> expected_points() {
  static const std::array<ExpectedPoint, 12> rows{{
      {{32, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 520847, 9.07, 18.88, 24.73},
      {{32, 64, 64, 8, 2, 2, LayerChoice::no_table, 0, Storage::mixed}, 178520, 7.66, 17.91, 23.46},
      {{32, 64, 64, 8, 2, 1, LayerChoice::paper, 0, Storage::mixed}, 462922, 7.07, 18.61, 24.62},
      {{32, 64, 64, 2, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 518985, 8.36, 18.85, 24.66},
      {{32, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::half}, 444790, 9.13, 18.88, 24.73},
      {{8, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 48727, 1.73, 17.43, 22.83},
      {{16, 64, 64, 8, 2, 2, LayerChoice::paper, 0, Storage::mixed}, 146095, 3.45, 18.46, 24.21},
      {{8, 64, 64, 2, 2, 1, LayerChoice::paper, 0, Storage::half}, 41813, 1.25, 17.12, 22.32},
      {{32, 64, 64, 2, 2, 1, LayerChoice::paper, 0, Storage::half}, 414246, 6.30, 18.58, 24.54},
      {{32, 64, 64, 2, 2, 2, LayerChoice::products, 65536, Storage::mixed}, 64005, 12.50, 20.61, 24.95},
      {{32, 64, 64, 2, 2, 2, LayerChoice::products, 262144, Storage::mixed}, 231252, 12.67, 21.38, 25.33},
      {{32, 64, 64, 8, 2, 2, LayerChoice::products, 262144, Storage::mixed}, 228506, 13.62, 21.45, 25.44},
  }};
  return rows;
}

}  // namespace selvedge
