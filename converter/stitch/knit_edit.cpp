#include <algorithm>
#include <cmath>

#include "converter/stitch/knit_cloth.h"
#include "converter/stitch/yarn_relax.h"

namespace selvedge {
namespace {

/// Stitches from a changed one up to which yarn begins as it is drawn, and from which on it stays at rest.
/// Between, it begins between both: yarns that are drawn through each other are so all along that way.
constexpr double drawn_distance = 1.2;
constexpr double rest_distance = 3;
/// More of the cloth comes to rest as a whole.
constexpr double max_active_fraction = 0.75;

/// The parts of one knit, drawn.
struct DrawnParts {
  DrawnParts(const StitchPattern& drawn, const std::vector<std::vector<KnitPart>>& all)
      : pattern(drawn), parts(all) {
    for (const auto& chain : parts) {
      first.emplace_back(1, 0);
      for (const KnitPart& part : chain) first.back().push_back(first.back().back() + part.segments);
    }
  }
  bool are_equal(std::size_t chain, std::size_t part, const DrawnParts& other,
                 std::size_t other_chain) const {
    const KnitPart& a = parts[chain][part];
    const KnitPart& b = other.parts[other_chain][part];
    const auto at = [part](const DrawnParts& drawn, std::size_t c) {
      return drawn.pattern.yarns[c].segments.begin() + static_cast<std::ptrdiff_t>(drawn.first[c][part]);
    };
    return a.is_loop == b.is_loop && a.length_mm == b.length_mm && a.segments == b.segments &&
           std::equal(at(*this, chain), at(*this, chain) + static_cast<std::ptrdiff_t>(a.segments),
                      at(other, other_chain));
  }
  const StitchPattern& pattern;
  const std::vector<std::vector<KnitPart>>& parts;
  std::vector<std::vector<std::size_t>> first;  ///< segments of each part, and the end
};

/// The chain of `last` that this one has most parts of, -1: none. Rows gain and lose yarns.
int match(const DrawnParts& now, std::size_t chain, const DrawnParts& last, std::vector<char>& equal) {
  constexpr int away = 24;
  int best = -1;
  std::ptrdiff_t best_count = 0;
  const auto count = static_cast<int>(last.parts.size());
  const int begin = std::max(0, static_cast<int>(chain) - away);
  for (int k = begin; k < std::min(count, static_cast<int>(chain) + away); ++k) {
    if (last.parts[k].size() != now.parts[chain].size()) continue;
    std::vector<char> here;
    for (std::size_t p = 0; p < now.parts[chain].size(); ++p)
      here.push_back(now.are_equal(chain, p, last, k) ? 1 : 0);
    const auto same = std::ranges::count(here, 1);
    if (same <= best_count) continue;
    best_count = same;
    best = k;
    equal = here;
  }
  return best;
}

/// The points whose means with their neighbours a knit's curve passes (KnitCloth::give()).
std::vector<V3d> points_of(const std::vector<BezierSegment>& segments, const V3d& way) {
  std::vector<V3d> means;
  for (std::size_t k = 0; k < segments.size(); k += 2) means.push_back(segments[k][0]);
  const std::size_t count = means.size();
  std::vector<V3d> points = means;
  for (int round = 0; round < 12; ++round) {
    const std::vector<V3d> before = points;
    for (std::size_t i = 0; i < count; ++i) {
      const V3d last = i > 0 ? before[i - 1] : before[count - 1] - way;
      const V3d next = i + 1 < count ? before[i + 1] : before[0] + way;
      points[i] = means[i] + before[i] * 0.125 - (last + next) * 0.0625;
    }
  }
  return points;
}

}  // namespace

/// Points and parts of both knits, as edit() needs them.
struct KnitCloth::Kept {
  std::vector<V3d> drawn, rest;            ///< points
  std::vector<char> known;                 ///< of points: whether they have a rest
  std::vector<std::pair<V3d, V3d>> moves;  ///< of parts at rest: their middles, drawn, and their way to rest
  std::vector<V3d> changed;                ///< the middles of the others
};

/// Takes the period and what rests; false: the yarn is other yarn.
bool KnitCloth::adopt_rest(const DrawnKnit& knit, const RestedKnit& last, Kept& kept) {
  const V2d drawn_period = period_;
  const StitchPattern& rested = last.relaxed.pattern;
  if (last.drawn.period_mm != drawn_period || last.relaxed.lean_repeats > 1) return false;
  const DrawnParts now(knit.pattern, knit.parts);
  const DrawnParts then(last.drawn, last.parts);
  move_to(rested.period_mm);
  min_period_ = 0.25 * period_;
  thin_ = rested.yarns.front().radius_mm / knit.pattern.yarns.front().radius_mm;
  std::vector<V3d>& drawn = kept.drawn;
  std::vector<V3d>& rest = kept.rest;
  drawn = rest = points_;
  kept.known.assign(points_.size(), 0);
  for (std::size_t c = 0; c < chains_.size(); ++c) {
    Chain& chain = chains_[c];
    std::vector<char> equal(chain.parts.size(), 0);
    const int found = match(now, c, then, equal);
    // Else its pieces are others.
    if (found >= 0 && (std::abs(rested.yarns[found].radius_mm / (thin_ * chain.radius) - 1) > 1e-9 ||
                       last.drawn.yarns[found].flattening != knit.pattern.yarns[c].flattening ||
                       rested.yarns[found].squeezes.empty() == chain.soft))
      return false;
    std::vector<V3d> old;
    std::vector<std::size_t> first{0};
    if (found >= 0) {
      old = points_of(rested.yarns[found].segments, way(chain));
      for (const KnitPart& part : last.relaxed.parts[found])
        first.push_back(first.back() + part.segments / 2);
    }
    for (std::size_t p = 0; p < chain.parts.size(); ++p) {
      Part& part = chain.parts[p];
      V3d middle(0);
      V3d moved(0);
      const double each = 1.0 / (part.end - part.begin);
      for (std::uint32_t i = part.begin; i < part.end; ++i) {
        middle += drawn[i] * each;
        if (equal[p] == 0) continue;
        const std::size_t k = first[p] + i - part.begin;
        rest[i] = old[k];
        kept.known[i] = 1;
        moved += (rest[i] - drawn[i]) * each;
        if (!chain.soft) continue;
        const V3d& squeeze = rested.yarns[found].squeezes[2 * k + 1];
        const double wide2 = 1 / (1 - squeeze.length2());
        const V3d widest = squeeze.normalized();
        const V3d thinnest = (rest[i] - old[k > 0 ? k - 1 : k + 1]).normalized().cross(widest).normalized();
        squeezes_[i] = squeeze;
        for (int x = 0; x < 3; ++x)
          for (int y = 0; y < 3; ++y)
            strains_[i][x][y] = 0.5 * std::log(wide2) * (widest[x] * widest[y] - thinnest[x] * thinnest[y]);
      }
      if (equal[p] != 0)
        kept.moves.emplace_back(middle, moved);
      else
        kept.changed.push_back(middle);
    }
  }
  return !kept.changed.empty() && !kept.moves.empty();
}

bool KnitCloth::edit(const DrawnKnit& knit, const RestedKnit& last, const V2d& gauge) {
  Kept kept;
  if (!adopt_rest(knit, last, kept)) return false;
  const auto& [drawn, rest, known, moves, changed] = kept;
  const std::size_t count = points_.size();
  // In stitches, to the nearest copy.
  const V2d stitch = gauge * period_ / knit.pattern.period_mm;
  const auto distance2 = [&](const V3d& a, const V3d& b) {
    double sum = 0;
    for (int k = 0; k < 2; ++k) {
      const double turns = (a[k] - b[k]) / period_[k];
      sum += std::pow((turns - std::round(turns)) * period_[k] / stitch[k], 2);
    }
    return sum;
  };
  std::vector<double> away(count, rest_distance);
  for (std::uint32_t i = 0; i < count; ++i)
    for (const V3d& place : changed) away[i] = std::min(away[i], std::sqrt(distance2(drawn[i], place)));
  active_.assign(count, 0);
  std::size_t active = 0;
  for (const Chain& chain : chains_)
    for (const Part& part : chain.parts) {
      if (*std::min_element(away.begin() + part.begin, away.begin() + part.end) >= rest_distance) continue;
      std::fill(active_.begin() + part.begin, active_.begin() + part.end, 1);
      active += part.end - part.begin;
    }
  if (static_cast<double>(active) > max_active_fraction * static_cast<double>(count)) {
    active_.clear();
    return false;
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const double still =
        known[i] != 0 ? std::clamp((away[i] - drawn_distance) / (rest_distance - drawn_distance), 0.0, 1.0)
                      : 0;
    points_[i] = rest[i];
    if (still == 1) continue;
    V3d sum(0);
    double weights = 0;
    for (const auto& [middle, move] : moves) {
      const double weight = std::exp(-std::min(distance2(drawn[i], middle), 100.0));
      sum += move * weight;
      weights += weight;
    }
    points_[i] = rest[i] * still + (drawn[i] + sum / weights) * (1 - still);
  }
  hold(knit, rest, known);
  return true;
}

/// Keeps the lengths of yarn at rest, and all of what is not active.
void KnitCloth::hold(const DrawnKnit& knit, const std::vector<V3d>& rest, const std::vector<char>& known) {
  images_.clear();
  has_kinds_ = false;
  for (std::size_t c = 0; c < chains_.size(); ++c) {
    Chain& chain = chains_[c];
    for (Part& part : chain.parts) {
      const auto length = [&](const std::vector<V3d>& points) {
        double sum = 0;
        for (std::uint32_t i = part.begin; i < part.end; ++i) {
          const V3d d = points[next_[i]] - points[i];
          sum += (next_[i] > i ? d : d + way(chain)).length();
        }
        return sum;
      };
      part.drawn = length(points_);
      if (known[part.begin] != 0)
        part.length = length(rest);
      else if (!part.is_loop)
        part.length *= period_.x / knit.pattern.period_mm.x;
    }
    for (std::uint32_t i = chain.begin; i < chain.end; ++i) {
      if (active_[i] != 0) {
        squeezes_[i] = V3d(0);
        continue;
      }
      radii_[i] = thin_ * chain.radius;
      reaches_[i] = radii_[i] / std::sqrt(1 - squeezes_[i].length2());
    }
  }
  // A last tile, which is empty, of what stays.
  const auto still = static_cast<std::uint32_t>(tiles_.size());
  for (auto& tile : tiles_) {
    std::erase_if(tile, [&](std::uint32_t i) { return active_[i] == 0; });
    for (std::uint32_t k = 0; k < tile.size(); ++k) place_of_[tile[k]] = k;
  }
  for (std::uint32_t i = 0; i < points_.size(); ++i)
    if (active_[i] == 0) tile_of_[i] = still;
  tiles_.emplace_back();
  factors_.resize(tiles_.size());
  set_lengths();
}

}  // namespace selvedge
