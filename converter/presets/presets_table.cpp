// Written by tests/bench/trade: means over plain-knit, purl, rib, garter, two-colour, lace, plain-weave,
// twill, satin, basket, measured on AMD EPYC, 2 cores.
#include "converter/presets/presets.h"

namespace selvedge {

std::span<const MeasuredSetting> measured_settings() {
  static constexpr std::array<MeasuredSetting, 13> rows{{
      {R"({})", 528395, 11.82, 17.66, 23.37},
      {R"({"texels": 8, "views": 36, "lights": 36, "samples": 2, "lobes": 1, "storage": "half"})", 28154,
       1.86, 15.50, 20.78},
      {R"({"texels": 8, "views": 36, "lights": 36, "samples": 2, "lobes": 1, "storage": "half", "yarns": true})",
       43747, 3.24, 15.50, 29.33},
      {R"({"texels": 16, "samples": 2, "lobes": 1, "storage": "half"})", 120929, 3.77, 16.71, 22.39},
      {R"({"texels": 8, "samples": 4, "layers": "products", "budget": 16384})", 16072, 3.17, 16.41, 21.59},
      {R"({"texels": 8, "samples": 4, "layers": "products", "budget": 16384, "yarns": true})", 31665, 4.39,
       16.41, 30.42},
      {R"({"texels": 8, "layers": "products", "budget": 22528, "yarns": true})", 37664, 4.56, 16.75, 30.63},
      {R"({"texels": 16, "samples": 2, "layers": "products", "budget": 32768})", 32266, 5.78, 18.07, 23.55},
      {R"({"texels": 16, "layers": "products", "budget": 57344, "yarns": true})", 69041, 7.61, 18.48, 30.61},
      {R"({"samples": 2, "layers": "products", "budget": 65536})", 64811, 15.27, 18.90, 24.23},
      {R"({"samples": 2, "layers": "products", "budget": 262144})", 223911, 15.73, 19.41, 24.76},
      {R"({"texels": 16, "samples": 16, "layers": "products", "budget": 131072, "yarns": true})", 96685, 8.00,
       18.56, 30.62},
      {R"({"texels": 64, "views": 36, "lights": 36, "samples": 2, "lobes": 1, "storage": "half"})", 977191,
       16.35, 17.21, 22.63},
  }};
  return rows;
}

}  // namespace selvedge
