// Presets: named settings of a make, which are rows of a table of measured settings (docs/trade.md).
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>

#include "converter/presets/make_options.h"

namespace selvedge {

struct Preset {
  std::string_view name;   ///< of --quality
  std::string_view knobs;  ///< JSON
};

/// No row of the measured table is better in bytes, seconds and pictures together (tests/bench/quality).
inline constexpr std::array<Preset, 4> presets{
    {{"draft",
      R"({"texels": 8, "directions": 36, "samples": 2, "lobes": 1, "storage": "half", "yarns": true})"},
     {"standard", R"({"texels": 8, "samples": 8, "layers": "products", "budget": 22528, "yarns": true})"},
     {"high", R"({"texels": 16, "samples": 8, "layers": "products", "budget": 57344, "yarns": true})"},
     {"reference",
      R"({"texels": 16, "samples": 16, "layers": "products", "budget": 131072, "yarns": true})"}}};
inline constexpr std::string_view default_preset = "standard";

/// The options of a preset, or of "paper": the paper's model and scale. A budget grows with more texels than
/// the preset's own.
std::optional<MakeOptions> preset_named(std::string_view name);

/// A setting that was measured: means over the stitches of presets_table.cpp.
struct MeasuredSetting {
  std::string_view knobs;  ///< JSON
  double bytes = 0;
  double seconds = 0;   ///< processor time of bake and fit, summed over cores
  double held_out = 0;  ///< PSNR of held-out pairs at 64 x 64 texels by compare_with_finer(), dB
  double pictures = 0;  ///< PSNR of four swatches against the truth, dB
};

/// The table presets_table.cpp, which tests/bench/trade writes.
std::span<const MeasuredSetting> measured_settings();

}  // namespace selvedge
