#include "fitter/budget/file_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>

#include "format/base/atomic_file.h"

namespace selvedge {
namespace {

/// Writes the fabric with a record that is as long as any can be, as its errors are not known yet. Returns
/// the size.
Result<double> written_size(const LayerFit& chosen, const Issues& warnings, const FabricWriteOptions& options,
                            const std::string& path) {
  constexpr FitError unknown{1'000'000, -1000, -1000};
  FitRecord record{-1.23456e-300, chosen.levels, {}, warnings};
  for (LevelReport& level : record.levels) level.held_out = level.training = unknown;
  if (auto ok = write_fabric(path, chosen.fabric, std::move(record), options); !ok)
    return tl::unexpected(ok.error());
  std::error_code error;
  return static_cast<double>(std::filesystem::file_size(path, error));
}

}  // namespace

Result<LayerFit> choose_for_file(const LayerFitter& fitter, double budget, const FabricWriteOptions& options,
                                 const std::shared_ptr<const Yarns>& yarns, const std::string& output) {
  constexpr int max_tries = 6;
  const auto beside = AtomicFile::create(output);
  if (!beside) return tl::unexpected(beside.error());
  double overhead = LayerFitter::typical_overhead;
  double smallest = std::numeric_limits<double>::infinity();
  LayerFit best;
  double best_size = 0;
  for (int i = 0; i < max_tries; ++i) {
    LayerFit chosen = fitter.choose(budget, overhead);
    chosen.fabric.levels.front().set_yarns(yarns);
    auto size = written_size(chosen, fitter.warnings(), options, beside->temporary());
    if (!size) {
      size.error().file = output;
      return tl::unexpected(size.error());
    }
    smallest = std::min(smallest, *size);
    // If the file is too large, the correction has a small margin.
    const double correction = *size - chosen.bytes + (*size > budget ? 0.002 * budget : 0);
    if (*size <= budget && *size > best_size) {
      best_size = *size;
      best = std::move(chosen);
    }
    if (best_size > 0.98 * budget || correction == 0) break;
    overhead += correction;
  }
  if (best_size > 0) return best;
  return fail(Code::option_out_of_range, output, "--budget",
              fmt::format("{:.0f} bytes; the smallest fabric found has {:.0f}", budget, smallest));
}

}  // namespace selvedge
