// Written by tests/bench/trade: means over plain-knit, purl, rib, garter, two-colour, lace, plain-weave,
// twill, satin, basket, measured on AMD EPYC, 2 cores.
#include "converter/presets/presets.h"

namespace selvedge {

std::span<const MeasuredSetting> measured_settings() {
  static constexpr std::array<MeasuredSetting, 24> rows{{
      {R"({})", 528429, 9.29, 17.66, 23.31},
      {R"({"bounces": 0})", 458846, 8.77, 17.55, 23.50},
      {R"({"directions": 36})", 373742, 6.17, 17.35, 22.70},
      {R"({"layers": "no-table"})", 177023, 7.89, 16.48, 21.82},
      {R"({"layers": "light-table"})", 862320, 14.95, 18.03, 23.33},
      {R"({"lobes": 1})", 467814, 7.46, 17.36, 23.03},
      {R"({"lobes": 3})", 592117, 15.93, 17.74, 23.37},
      {R"({"samples": 2})", 528709, 8.39, 17.59, 23.25},
      {R"({"storage": "half"})", 451471, 9.26, 17.66, 23.31},
      {R"({"storage": "float"})", 1195354, 9.28, 17.66, 23.31},
      {R"({"texels": 8})", 48806, 2.15, 15.94, 21.21},
      {R"({"texels": 16})", 147325, 3.79, 17.06, 22.62},
      {R"({"texels": 8, "samples": 2, "lobes": 1, "storage": "half"})", 42221, 1.66, 15.60, 20.88},
      {R"({"texels": 8, "directions": 36, "samples": 2, "lobes": 1, "storage": "half"})", 28188, 1.42, 15.50,
       20.63},
      {R"({"texels": 8, "samples": 4, "layers": "products", "budget": 16384})", 16044, 2.53, 16.37, 21.47},
      {R"({"texels": 16, "samples": 1, "lobes": 1, "storage": "half"})", 122480, 2.71, 16.41, 21.89},
      {R"({"texels": 16, "samples": 2, "lobes": 1, "storage": "half"})", 120963, 2.81, 16.71, 22.25},
      {R"({"texels": 16, "samples": 2, "layers": "products", "budget": 32768})", 32188, 4.61, 18.06, 23.24},
      {R"({"texels": 16, "samples": 4, "layers": "products", "budget": 65536})", 63376, 4.84, 18.50, 23.55},
      {R"({"texels": 16, "samples": 4, "layers": "products", "budget": 131072})", 83422, 4.84, 18.53, 23.57},
      {R"({"samples": 2, "lobes": 1, "storage": "half"})", 421779, 6.57, 17.31, 22.97},
      {R"({"samples": 2, "layers": "products", "budget": 65536})", 64655, 12.34, 18.92, 23.98},
      {R"({"samples": 2, "layers": "products", "budget": 262144})", 236484, 12.62, 19.45, 24.40},
      {R"({"texels": 64, "directions": 36, "samples": 2, "lobes": 1, "storage": "half"})", 977225, 13.23,
       17.21, 22.55},
  }};
  return rows;
}

}  // namespace selvedge
