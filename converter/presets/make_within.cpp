#include "converter/presets/make_within.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "converter/presets/setting_family.h"

namespace selvedge {
namespace {

constexpr int max_tries_of_family = 3;
constexpr int max_tries_of_the_nearest = 2;
constexpr double seconds_for_the_nearest = 60;

/// A setting that could be made.
struct Candidate {
  std::size_t family = 0;
  TradePoint point;
  MakeFigures expected;
};

class Search {
 public:
  Search(std::span<const ExpectedPoint> table, const MakeLimits& limits, int min_texels, int threads,
         const std::function<Result<MakeFigures>(const TradePoint&)>& make)
      : table_(table),
        limits_(limits),
        min_texels_(min_texels),
        threads_(threads),
        make_(make),
        families_(families_of(table)) {}

  Result<Chosen> run() {
    if (limits_.held_out || limits_.seconds) {
      if (auto ok = probe(); !ok) return tl::unexpected(ok.error());
      if (limits_.held_out && chosen_.kept) return chosen_;
    }
    // The probe may be the best within the limits; what is expected to be better comes before it.
    const std::optional<std::size_t> probed = std::exchange(chosen_.kept, std::nullopt);
    while (chosen_.tried.size() < max_tries) {
      const auto next = best();
      if (!next || (probed && !better(next->expected, expected_again(*probed)))) break;
      if (auto ok = make(*next); !ok) return tl::unexpected(ok.error());
      if (chosen_.kept) return chosen_;
    }
    chosen_.kept = probed;
    if (!chosen_.kept) return nearest();
    return chosen_;
  }

 private:
  static bool cheaper(const MakeFigures& a, const MakeFigures& b) {
    return a.seconds != b.seconds ? a.seconds < b.seconds : a.bytes < b.bytes;
  }
  bool better(const MakeFigures& a, const MakeFigures& b) const {
    if (limits_.held_out || a.held_out == b.held_out) return cheaper(a, b);
    return a.held_out > b.held_out;
  }

  /// The cheapest row.
  Result<void> probe() {
    const ExpectedPoint* cheapest = nullptr;
    for (const ExpectedPoint& row : table_) {
      if (row.point.texels < min_texels_) continue;
      if (cheapest == nullptr ||
          cheaper({row.bytes, row.seconds, 0}, {cheapest->bytes, cheapest->seconds, 0}))
        cheapest = &row;
    }
    if (cheapest == nullptr) return {};
    TradePoint setting = cheapest->point;
    setting.budget = 0;
    for (std::size_t i = 0; i < families_.size(); ++i) {
      if (families_[i].setting == setting)
        return make({i, cheapest->point, expected(i, cheapest->point.budget)});
    }
    return {};
  }

  /// What was made last of the same family, else of the same kind of layers, else at all; of those that
  /// `counts` holds for.
  template <class Counts>
  std::optional<std::size_t> closest_made(std::size_t family, Counts counts) const {
    std::optional<std::size_t> closest;
    int closeness = 0;
    for (std::size_t i = chosen_.tried.size(); i-- > 0;) {
      if (!counts(chosen_.tried[i])) continue;
      const bool same_layers = families_[family_of_[i]].setting.layers == families_[family].setting.layers;
      const int close = family_of_[i] == family ? 3 : same_layers ? 2 : 1;
      if (close <= closeness) continue;
      closest = i;
      closeness = close;
    }
    return closest;
  }

  MakeFigures expected(std::size_t family, std::uint64_t budget) const {
    const ExpectedPoint raw = expected_at(families_[family], budget);
    MakeFigures figures{raw.bytes, raw.seconds / threads_, raw.held_out};
    if (const auto i = closest_made(family, [](const MadePoint&) { return true; })) {
      const MakeFigures& made = chosen_.tried[*i].made;
      figures.seconds *= made.seconds * threads_ / families_[family_of_[*i]].rows.front().seconds;
      figures.held_out += made.held_out - raw_held_out(*i);
    }
    if (budget > 0) return figures;
    if (const auto i = closest_made(family, [](const MadePoint& m) { return !has_budget(m.point); }))
      figures.bytes *= chosen_.tried[*i].made.bytes / families_[family_of_[*i]].rows.front().bytes;
    return figures;
  }

  MakeFigures expected_again(std::size_t i) const {
    return expected(family_of_[i], chosen_.tried[i].point.budget);
  }

  /// What the table has for the size that came out.
  double raw_held_out(std::size_t i) const {
    const SettingFamily& family = families_[family_of_[i]];
    const MadePoint& made = chosen_.tried[i];
    return has_budget(made.point) ? held_out_at(family, made.made.bytes) : family.rows.front().held_out;
  }

  /// The smallest that a fabric of so many texels can be, as far as it is known: finer ones are no smaller.
  double floor_of(int texels) const {
    double least = 0;
    for (const MadePoint& made : chosen_.tried) {
      if (made.too_large() && made.point.texels <= texels) least = std::max(least, made.made.bytes);
    }
    return least;
  }

  /// Whether making this could tell more than what was made of the family.
  bool is_new(std::size_t family, std::uint64_t budget) const {
    int tries = 0;
    for (std::size_t i = 0; i < chosen_.tried.size(); ++i) {
      if (family_of_[i] != family) continue;
      const MadePoint& made = chosen_.tried[i];
      if (made.point.budget == budget || ++tries >= max_tries_of_family) return false;
      const bool not_enough = limits_.held_out && made.made.held_out < *limits_.held_out;
      if (not_enough && budget < made.point.budget) return false;
      const bool used_all = made.made.bytes >= 0.9 * static_cast<double>(made.point.budget);
      if (!used_all && budget > made.point.budget) return false;
    }
    return true;
  }

  /// All that could be made, with what is expected of it now.
  std::vector<Candidate> candidates() const {
    std::vector<Candidate> all;
    const bool other_budgets = limits_.held_out || limits_.bytes;
    for (std::size_t i = 0; i < families_.size(); ++i) {
      const SettingFamily& family = families_[i];
      if (family.setting.texels < min_texels_) continue;
      const double floor = floor_of(family.setting.texels);
      std::vector<std::uint64_t> budgets;
      if (other_budgets || !has_budget(family.setting)) {
        budgets = budgets_of(family);
      } else {
        for (const ExpectedPoint& row : family.rows) budgets.push_back(row.point.budget);
      }
      if (has_budget(family.setting)) {
        if (limits_.bytes && *limits_.bytes >= budgets.front() && *limits_.bytes <= budgets.back())
          budgets.push_back(*limits_.bytes);
        // A little more: which fabric is the smallest depends on the budget that it was looked for with.
        if (floor > 0) budgets.push_back(static_cast<std::uint64_t>(std::ceil(1.01 * floor / 64)) * 64);
      }
      for (const std::uint64_t budget : budgets) {
        if (budget > 0 && static_cast<double>(budget) < floor) continue;
        if (!is_new(i, budget)) continue;
        TradePoint point = family.setting;
        point.budget = budget;
        all.push_back({i, point, expected(i, budget)});
      }
    }
    return all;
  }

  std::optional<Candidate> best() const {
    std::optional<Candidate> found;
    for (const Candidate& candidate : candidates()) {
      if (!meets(limits_, candidate.expected)) continue;
      if (!found || better(candidate.expected, found->expected)) found = candidate;
    }
    return found;
  }

  /// `kept` is set where it meets the limits.
  Result<void> make(const Candidate& candidate) {
    const auto figures = make_(candidate.point);
    if (!figures) return tl::unexpected(figures.error());
    chosen_.tried.push_back({candidate.point, candidate.expected, *figures});
    family_of_.push_back(candidate.family);
    const MadePoint& made = chosen_.tried.back();
    if (!made.too_large() && meets(limits_, made.made)) chosen_.kept = chosen_.tried.size() - 1;
    return {};
  }

  Result<Chosen> nearest() {
    for (int tries = 0;; ++tries) {
      Shortfall least{HUGE_VAL, HUGE_VAL};
      for (const MadePoint& made : chosen_.tried) {
        // No budget is known that makes one that was too large.
        const Shortfall lacks = shortfall_of(limits_, made.made);
        if (made.too_large() || !(lacks < least)) continue;
        least = lacks;
        chosen_.nearest = made.point;
        chosen_.nearest_figures = made.made;
        chosen_.nearest_made = true;
      }
      std::optional<Candidate> nearer;
      for (const Candidate& candidate : candidates()) {
        const Shortfall lacks = shortfall_of(limits_, candidate.expected);
        const bool is_nearer =
            lacks < least || (nearer && lacks == least && better(candidate.expected, nearer->expected));
        if (!is_nearer) continue;
        least = lacks;
        nearer = candidate;
      }
      if (!nearer) return chosen_;
      if (tries == max_tries_of_the_nearest || chosen_.tried.size() >= max_tries ||
          nearer->expected.seconds > seconds_for_the_nearest) {
        chosen_.nearest = nearer->point;
        chosen_.nearest_figures = nearer->expected;
        chosen_.nearest_made = false;
        return chosen_;
      }
      if (auto ok = make(*nearer); !ok) return tl::unexpected(ok.error());
      if (chosen_.kept) return chosen_;
    }
  }

  std::span<const ExpectedPoint> table_;
  const MakeLimits& limits_;
  int min_texels_;
  int threads_;
  const std::function<Result<MakeFigures>(const TradePoint&)>& make_;
  std::vector<SettingFamily> families_;
  Chosen chosen_;
  std::vector<std::size_t> family_of_;  // of chosen_.tried
};

}  // namespace

bool MadePoint::too_large() const {
  return has_budget(point) && made.bytes > static_cast<double>(point.budget);
}

bool meets(const MakeLimits& limits, const MakeFigures& f) {
  return (!limits.bytes || f.bytes <= static_cast<double>(*limits.bytes)) &&
         (!limits.held_out || f.held_out >= *limits.held_out) &&
         (!limits.seconds || f.seconds <= *limits.seconds);
}

Shortfall shortfall_of(const MakeLimits& limits, const MakeFigures& f) {
  Shortfall lacks;
  if (limits.bytes)
    lacks.octaves = std::max(lacks.octaves, std::log2(f.bytes / static_cast<double>(*limits.bytes)));
  if (limits.seconds) lacks.octaves = std::max(lacks.octaves, std::log2(f.seconds / *limits.seconds));
  if (limits.held_out) lacks.decibels = std::max(0.0, *limits.held_out - f.held_out);
  return lacks;
}

Result<Chosen> choose_within(std::span<const ExpectedPoint> table, const MakeLimits& limits, int min_texels,
                             int threads, const std::function<Result<MakeFigures>(const TradePoint&)>& make) {
  return Search(table, limits, min_texels, threads, make).run();
}

}  // namespace selvedge
