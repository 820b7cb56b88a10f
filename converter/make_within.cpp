#include "converter/make_within.h"

#include <algorithm>
#include <cmath>

namespace selvedge {
namespace {

/// What the stitch and the machine at hand change of the table's figures.
struct Correction {
  double bytes = 1;     // factor; a budget is kept whatever the stitch
  double seconds = 1;   // factor
  double held_out = 0;  // dB more
};

MakeFigures expected_of(const ExpectedPoint& row, const Correction& c, int threads) {
  const bool has_budget = row.point.budget > 0;
  return {
      has_budget ? std::min(row.bytes * c.bytes, static_cast<double>(row.point.budget)) : row.bytes * c.bytes,
      row.seconds * c.seconds / threads, row.held_out + c.held_out};
}

Correction correction_by(const ExpectedPoint& row, const MakeFigures& made, int threads) {
  Correction c;
  c.bytes = made.bytes / row.bytes;
  c.seconds = made.seconds * threads / row.seconds;
  c.held_out = std::isfinite(made.held_out) ? made.held_out - row.held_out : 0;
  return c;
}

}  // namespace

bool meets(const MakeLimits& limits, const MakeFigures& f) {
  return (!limits.bytes || f.bytes <= static_cast<double>(*limits.bytes)) &&
         (!limits.held_out || f.held_out >= *limits.held_out) &&
         (!limits.seconds || f.seconds <= *limits.seconds);
}

double distance_from(const MakeLimits& limits, const MakeFigures& f) {
  double distance = 0;
  if (limits.bytes) distance = std::max(distance, std::log2(f.bytes / static_cast<double>(*limits.bytes)));
  if (limits.seconds) distance = std::max(distance, std::log2(f.seconds / *limits.seconds));
  if (limits.held_out) distance = std::max(distance, *limits.held_out - f.held_out);
  return distance;
}

Result<Chosen> choose_within(std::span<const ExpectedPoint> table, const MakeLimits& limits, int threads,
                             const std::function<Result<MakeFigures>(const TradePoint&)>& make) {
  Chosen chosen;
  Correction correction;
  std::vector<bool> tried(table.size(), false);
  const auto cheaper = [](const ExpectedPoint& a, const ExpectedPoint& b) {
    return a.seconds != b.seconds ? a.seconds < b.seconds : a.bytes < b.bytes;
  };
  const auto better = [&](const ExpectedPoint& a, const ExpectedPoint& b) {
    if (limits.held_out) return cheaper(a, b);
    return a.held_out != b.held_out ? a.held_out > b.held_out : cheaper(a, b);
  };
  const auto try_point = [&](std::size_t i) -> Result<void> {
    tried[i] = true;
    MadePoint made{table[i].point, expected_of(table[i], correction, threads), {}};
    const auto figures = make(made.point);
    if (!figures) return tl::unexpected(figures.error());
    made.made = *figures;
    correction = correction_by(table[i], *figures, threads);
    chosen.tried.push_back(made);
    return {};
  };
  // The best yet of those made that meet the limits; only without a least quality can there be better ones.
  const auto keep = [&] {
    for (std::size_t i = 0; i < chosen.tried.size(); ++i) {
      if (meets(limits, chosen.tried[i].made)) chosen.kept = i;
    }
  };
  if (limits.held_out || limits.seconds) {
    const auto first = std::min_element(table.begin(), table.end(), cheaper);
    if (auto ok = try_point(static_cast<std::size_t>(first - table.begin())); !ok)
      return tl::unexpected(ok.error());
    keep();
    if (limits.held_out && chosen.kept) return chosen;
  }
  for (;;) {
    std::optional<std::size_t> next;
    for (std::size_t i = 0; i < table.size(); ++i) {
      if (tried[i] || !meets(limits, expected_of(table[i], correction, threads))) continue;
      if (!next || better(table[i], table[*next])) next = i;
    }
    if (!next) break;
    const std::size_t before = chosen.tried.size();
    if (auto ok = try_point(*next); !ok) return tl::unexpected(ok.error());
    if (meets(limits, chosen.tried[before].made)) {
      chosen.kept = before;
      return chosen;
    }
  }
  keep();
  if (chosen.kept) return chosen;
  double least = HUGE_VAL;
  const auto look_at = [&](const TradePoint& point, const MakeFigures& figures) {
    const double distance = distance_from(limits, figures);
    if (!(distance < least)) return;
    least = distance;
    chosen.nearest = point;
    chosen.nearest_figures = figures;
  };
  for (const MadePoint& made : chosen.tried) look_at(made.point, made.made);
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (!tried[i]) look_at(table[i].point, expected_of(table[i], correction, threads));
  }
  return chosen;
}

}  // namespace selvedge
