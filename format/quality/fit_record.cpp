#include "format/quality/fit_record.h"

#include <fmt/format.h>

#include "format/fabric/json_io.h"

namespace selvedge {
namespace {

using nlohmann::json;

}  // namespace

Result<void> add_side_accuracy(const Fabric& side, const PairSamples& held_out, FitRecord& record) {
  if (held_out.pairs.empty()) return {};
  const auto comparison = compare(side, held_out, PairKind::held_out, record.peak);
  if (!comparison) return tl::unexpected(comparison.error());
  record.pair_count += comparison->pair_count;
  record.peak = comparison->peak;
  for (const LevelComparison& level : comparison->levels)
    record.psnr[index_of(side.side)].push_back(level.psnr);
  return {};
}

std::string accuracy_json(const FitRecord& record) {
  json text = json::object();
  if (record.pair_count > 0)
    text = {{"pairs", record.pair_count}, {"peak", short_number(record.peak, "{:.6g}")}};
  for (const Side side : all_sides)
    for (const double psnr : record.psnr[index_of(side)])
      text[name_of(side)].push_back(short_number(psnr, "{:.2f}"));
  return text.dump();
}

std::string layers_text(const FabricLevel& level) {
  std::string text;
  const auto join = [&](const char* between, const std::string& more) {
    text += (text.empty() ? "" : between) + more;
  };
  if (level.has(LayerKind::lobes)) {
    const int lobes = level.lobe_count();
    text = lobes == 0 ? "diffuse" : fmt::format("{} lobe{}", lobes, lobes == 1 ? "" : "s");
  }
  if (level.has(LayerKind::table)) join(" x ", "table");
  if (level.has(LayerKind::light)) join(" x ", "light table");
  if (level.has(LayerKind::products)) join(", ", fmt::format("{} products", level.pairs.size()));
  return text.empty() ? "constant" : text;
}

}  // namespace selvedge
