// Written by tests/bench/trade: means over plain-knit, purl, rib, garter, two-colour, lace, plain-weave,
// twill, satin, basket, measured on AMD EPYC, 2 cores.
#include "converter/presets/presets.h"

namespace selvedge {

std::span<const MeasuredSetting> measured_settings() {
  static constexpr std::array<MeasuredSetting, 13> rows{{
      {R"({})", 528395, 10.37, 17.66, 23.38},
      {R"({"texels": 8, "views": 36, "lights": 36, "samples": 2, "lobes": 1, "storage": "half"})", 28154,
       1.63, 15.50, 20.78},
      {R"({"texels": 8, "views": 36, "lights": 36, "samples": 2, "lobes": 1, "storage": "half", "yarns": true})",
       43747, 2.72, 15.50, 30.08},
      {R"({"texels": 16, "samples": 2, "lobes": 1, "storage": "half"})", 120929, 3.18, 16.71, 22.39},
      {R"({"texels": 8, "samples": 4, "layers": "products", "budget": 16384})", 16066, 2.81, 16.39, 21.55},
      {R"({"texels": 8, "samples": 4, "layers": "products", "budget": 16384, "yarns": true})", 31660, 4.02,
       16.39, 30.16},
      {R"({"texels": 8, "layers": "products", "budget": 23552, "yarns": true})", 38578, 4.13, 16.76, 30.41},
      {R"({"texels": 16, "samples": 2, "layers": "products", "budget": 32768})", 32154, 5.19, 18.06, 23.53},
      {R"({"texels": 16, "layers": "products", "budget": 57344, "yarns": true})", 68979, 6.82, 18.51, 30.36},
      {R"({"samples": 2, "layers": "products", "budget": 65536})", 64621, 13.99, 18.92, 24.18},
      {R"({"samples": 2, "layers": "products", "budget": 262144})", 236450, 14.16, 19.45, 24.64},
      {R"({"texels": 16, "samples": 16, "layers": "products", "budget": 131072, "yarns": true})", 96301, 7.20,
       18.57, 30.37},
      {R"({"texels": 64, "views": 36, "lights": 36, "samples": 2, "lobes": 1, "storage": "half"})", 977191,
       14.51, 17.21, 22.63},
  }};
  return rows;
}

}  // namespace selvedge
