#include "converter/make/stitch_bake.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "converter/stitch/fibres.h"
#include "converter/stitch/textile.h"
#include "format/fabric/json_parts.h"

namespace selvedge {

Result<void> set_texels(const V2i& min_texels, int repeats, bool given, const std::string& name,
                        const BakeOptions& asked, BakeOptions& options) {
  constexpr int max_texels = 4096;
  if (!given) {
    options.width = std::max(asked.width * repeats, min_texels.x);
    options.height = std::max(asked.height * repeats, min_texels.y);
  }
  const bool possible = std::max(min_texels.x, min_texels.y) <= max_texels;
  if (possible && options.width >= min_texels.x && options.height >= min_texels.y) return {};
  return fail(Code::option_out_of_range, name, "--texels",
              fmt::format("its yarns need {}x{} texels; {}", min_texels.x, min_texels.y,
                          possible ? fmt::format("{}x{} were asked for", options.width, options.height)
                                   : fmt::format("at most {} a side are made", max_texels)));
}

void share_rays(BakeOptions& options) {
  constexpr int rays_of_pair = 1 << 13;
  const int of_texel = rays_of_pair / (options.width * options.height) / 2 * 2;
  options.truth_samples = std::clamp(of_texel, 2, options.truth_samples);
}

Result<nlohmann::ordered_json> sheet_of(const FoundStitch& stitch, const YarnData& yarns, const V2d& period) {
  const auto numbers = textile_numbers(stitch.pattern, stitch.stitches);
  if (!numbers) return tl::unexpected(numbers.error());
  auto tex = nlohmann::ordered_json::array();
  for (const double of_yarn : numbers->tex) {
    if (const nlohmann::ordered_json number = short_number(of_yarn);
        std::ranges::find(tex, number) == tex.end())
      tex.push_back(number);
  }
  std::string fibres;
  for (const Yarn& yarn : stitch.pattern.yarns) {
    const std::string name = yarn_kinds()[yarn.fibre].name;
    if (fibres.find(name) == std::string::npos) fibres += (fibres.empty() ? "" : ", ") + name;
  }
  nlohmann::ordered_json sheet = {{"composition", fibres},
                                  {"gramsPerSquareMetre", short_number(numbers->weight)},
                                  {"tex", tex},
                                  {"thicknessMm", short_number(numbers->thickness_mm)},
                                  {"cover", short_number(numbers->cover)},
                                  {"coverWithHairs", short_number(numbers->cover_hairs)}};
  const std::array<YarnRuns, 2> runs = Yarns(yarns, V2f(period)).variation().runs;
  if (runs[0].rows > 0 && runs[1].rows > 0) {
    sheet["construction"] = "weave";
    sheet["endsPerCentimetre"] = short_number(runs[1].rows * 10 / period.x);
    sheet["picksPerCentimetre"] = short_number(runs[0].rows * 10 / period.y);
  } else if (stitch.stitches > 0) {
    sheet["construction"] = "knit";
    sheet["tightness"] = short_number(numbers->tightness);
    sheet["stitchesPerSquareCentimetre"] = short_number(stitch.stitches * 100 / (period.x * period.y));
  }
  return sheet;
}

}  // namespace selvedge
