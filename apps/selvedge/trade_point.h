// One point of a sweep: made, measured and drawn.
#pragma once

#include <string>
#include <vector>

#include "apps/common/report.h"
#include "apps/selvedge/command_line.h"
#include "format/picture/frame.h"
#include "format/samples/samples.h"

namespace selvedge {

/// The true pictures and held-out pairs that all points are compared with.
struct TradeTruth {
  V2d period_mm{1, 1};
  std::vector<Frame> pictures;  ///< of all_swatch_views
  PairSamples held_out;
  double peak = 0;  ///< 1/sr, of the held-out pairs
};

/// Where a sweep keeps the files of a point.
struct TradeFolder {
  std::string path;
  std::string samples(const MakeOptions& point) const;
  std::string bake_record(const MakeOptions& point) const;
  std::string fabric(const MakeOptions& point) const;
  std::string record(const MakeOptions& point) const;
  std::string picture(const std::string& name) const;
};

/// Bakes the samples if they are not there yet, fits them, measures the fabric and writes its record
/// (docs/trade.md). Bake and fit are repeated for the medians of their times.
Result<Json> measure_point(const TradeCommand& command, const MakeOptions& point, const TradeFolder& folder,
                           const TradeTruth& truth);

}  // namespace selvedge
