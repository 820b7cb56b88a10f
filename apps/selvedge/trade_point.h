// One point of a sweep: made, judged and drawn.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "apps/common/report.h"
#include "apps/selvedge/command_line.h"
#include "converter/presets/settings.h"
#include "format/quality/compare.h"
#include "format/quality/picture_error.h"

namespace selvedge {

/// What all points are judged by.
struct TradeTruth {
  V2d period_mm{1, 1};
  std::vector<Frame> pictures;  ///< of all_swatch_views
  PairSamples held_out;
  double peak = 0;  ///< 1/sr, of the held-out pairs
};

/// Where a sweep keeps what it makes.
struct TradeFolder {
  std::string path;
  std::string samples(const TradePoint& point) const;
  std::string bake_record(const TradePoint& point) const;
  std::string fabric(const TradePoint& point) const;
  std::string record(const TradePoint& point) const;
  std::string picture(const std::string& name) const;
};

/// `selvedge make ...` as a line for a shell that would make this fabric.
std::string make_line(const TradeCommand& command, const TradePoint& point);

/// How long something took: by the clock, and the work of all cores, which other programs' work does not
/// change.
struct MakeSeconds {
  double wall = 0;
  double processor = 0;
};

/// The samples of the point in their file, baked if they are not there yet; gives the median of the seconds
/// that it took (when they were baked). The bake is repeated for its time alone.
Result<MakeSeconds> ensure_samples(const TradeCommand& command, const TradePoint& point,
                                   const TradeFolder& folder);

/// Fits the samples, judges the fabric and writes its record (docs/trade.md). `bake`: for the record.
Result<Json> measure_point(const TradeCommand& command, const TradePoint& point, const TradeFolder& folder,
                           const TradeTruth& truth, const MakeSeconds& bake);

}  // namespace selvedge
