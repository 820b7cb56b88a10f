#include "converter/stitch/arrange.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "format/base/random.h"

namespace selvedge {
namespace {

using Keys = std::array<std::uint64_t, kind_match_count>;

int wrapped(int index, int count) { return ((index % count) + count) % count; }

std::size_t index_at(const StitchGrid& grid, int x, int y) {
  return std::size_t{1} * wrapped(y, grid.size.y) * grid.size.x + wrapped(x, grid.size.x);
}

/// Numbers of all that must be the same, by KindMatch.
Keys keys_at(const StitchGrid& grid, int x, int y) {
  constexpr unsigned bits = 4;  // knit and purl stitches of max_chart_yarns
  const auto cell = [&](int dx, int dy) -> std::uint64_t {
    return grid.cells[index_at(grid, x + dx, y + dy)];
  };
  const auto row = [&](int dy) -> std::uint64_t { return grid.rows[wrapped(y + dy, grid.size.y)]; };
  const auto column = [&](int dx) -> std::uint64_t { return grid.columns[wrapped(x + dx, grid.size.x)]; };
  const std::uint64_t beside = (cell(-1, 0) << bits | cell(0, 0)) << bits | cell(1, 0);
  const std::uint64_t upright = cell(0, -1) << bits | cell(0, 1);
  const std::uint64_t corners =
      ((cell(-1, -1) << bits | cell(1, -1)) << bits | cell(-1, 1)) << bits | cell(1, 1);
  if (!grid.is_woven) {
    const std::uint64_t own = row(0) << 3 * bits | beside;
    const std::uint64_t four = own << 2 * bits | upright;
    return {four << 4 * bits | corners, four, own};
  }
  // Sides are single bits here: 9 of them leave room for six kinds of yarn.
  const auto sides = [](std::uint64_t some) {
    return (some & 1) | (some >> (bits - 1) & 2) | (some >> 2 * (bits - 1) & 4) |
           (some >> 3 * (bits - 1) & 8);
  };
  const std::uint64_t own = ((row(0) << 8 | column(0)) << 3 | sides(beside)) << 2 | sides(upright);
  const std::uint64_t four = (((own << 8 | row(-1)) << 8 | row(1)) << 8 | column(-1)) << 8 | column(1);
  return {four << 4 | sides(corners), four, own};
}

/// Sets them in a knit; returns whether they change.
bool set_row_yarns(StitchGrid& grid, int y) {
  if (grid.is_woven) return false;
  std::uint8_t yarns = 0;
  for (int x = 0; x < grid.size.x; ++x)
    yarns |= static_cast<std::uint8_t>(1U << grid.stitches[grid.cells[index_at(grid, x, y)]].yarn);
  return std::exchange(grid.rows[y], yarns) != yarns;
}

/// The kinds of a cloth, and what their presence is worth.
struct Kinds {
  struct Level {
    std::unordered_map<std::uint64_t, int> ids;
    std::vector<int> counts;         ///< stitches of each
    std::vector<std::size_t> where;  ///< one of them
    std::vector<double> worth;
  };
  std::array<Level, kind_match_count> levels;

  explicit Kinds(const StitchGrid& cloth) {
    for (int y = 0; y < cloth.size.y; ++y)
      for (int x = 0; x < cloth.size.x; ++x) {
        const Keys keys = keys_at(cloth, x, y);
        for (std::size_t l = 0; l < keys.size(); ++l) {
          Level& level = levels[l];
          const auto [found, is_new] = level.ids.try_emplace(keys[l], static_cast<int>(level.counts.size()));
          if (is_new) level.counts.push_back(0), level.where.push_back(index_at(cloth, x, y));
          ++level.counts[found->second];
        }
      }
    for (std::size_t l = 0; l < levels.size(); ++l)
      for (const int count : levels[l].counts)
        // Yarns cannot run on without the least of these.
        levels[l].worth.push_back(std::sqrt(count) +
                                  (l == 2 ? 2 * std::sqrt(static_cast<double>(cloth.count())) : 0));
  }
};

/// A sequence of so many yarns, round, with as many triples of neighbours of `given` as it can have.
std::vector<std::uint8_t> with_triples(const std::vector<std::uint8_t>& given, int count, Random& random) {
  const auto triple = [](const std::vector<std::uint8_t>& yarns, int i) {
    const int n = static_cast<int>(yarns.size());
    return yarns[wrapped(i - 1, n)] << 16 | yarns[wrapped(i, n)] << 8 | yarns[wrapped(i + 1, n)];
  };
  const int whole = static_cast<int>(given.size());
  std::map<int, double> worth;
  for (int i = 0; i < whole; ++i) ++worth[triple(given, i)];
  for (auto& [own, count_of] : worth) count_of = 1 + std::sqrt(count_of);
  const auto score = [&](const std::vector<std::uint8_t>& yarns) {
    std::map<int, double> left = worth;
    double sum = 0;
    for (int i = 0; i < count; ++i)
      if (const auto found = left.find(triple(yarns, i)); found != left.end()) {
        sum += found->second;
        found->second = 0.01;
      }
    return sum;
  };
  std::vector<std::uint8_t> best(given.begin(), given.begin() + count);
  double best_score = score(best);
  for (int i = 0; i < 4000 && worth.size() > 1; ++i) {
    std::vector<std::uint8_t> tried = best;
    const int length = 3 + static_cast<int>(random.uniform() * 6);
    const int from = static_cast<int>(random.uniform() * whole);
    const int to = static_cast<int>(random.uniform() * count);
    for (int k = 0; k < length; ++k) tried[(to + k) % count] = given[(from + k) % whole];
    if (const double own = score(tried); own >= best_score) best = std::move(tried), best_score = own;
  }
  return best;
}

/// Annealing: pieces of the cloth are laid into a sampler of a size.
class Search {
 public:
  /// `worth_of_more`: of further stitches of a kind, of its first one's.
  Search(const StitchGrid& cloth, const Kinds& kinds, const V2i& size, double worth_of_more)
      : cloth_(cloth),
        kinds_(kinds),
        worth_of_more_(worth_of_more),
        random_(hash64(1), hash64(size.x * 4096 + size.y)) {
    grid_.is_woven = cloth.is_woven;
    grid_.stitches = cloth.stitches;
    grid_.size = size;
    grid_.cells.resize(std::size_t{1} * size.x * size.y);
    grid_.rows.resize(size.y);
    grid_.columns.resize(size.x);
    if (cloth.is_woven) {
      grid_.rows = with_triples(cloth.rows, size.y, random_);
      grid_.columns = with_triples(cloth.columns, size.x, random_);
    }
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x)
        grid_.cells[index_at(grid_, x, y)] = cloth.cells[index_at(cloth, x, y)];
      set_row_yarns(grid_, y);
    }
    for (std::size_t l = 0; l < present_.size(); ++l) present_[l].resize(kinds.levels[l].counts.size());
    ids_.assign(grid_.count(), {-1, -1, -1});
    is_changed_.resize(grid_.count());
    for (std::size_t at = 0; at < grid_.count(); ++at) update(at);
  }

  void run(int rounds) {
    constexpr double hot = 4;
    constexpr double cold = 0.05;
    for (int i = 0; i < rounds; ++i) {
      heat_ = hot * std::pow(cold / hot, static_cast<double>(i) / rounds);
      lay_piece();
    }
  }

  int missing(KindMatch match) const {
    return static_cast<int>(std::ranges::count(present_[static_cast<std::size_t>(match)], 0));
  }
  const StitchGrid& grid() const { return grid_; }

 private:
  int below(int count) { return std::min(count - 1, static_cast<int>(random_.uniform() * count)); }

  /// Lays a missing kind, or a row of the cloth, where the sampler has to change least.
  void lay_piece() {
    const Kinds::Level& level = kinds_.levels[random_.uniform() < 0.2 ? 2 : 0];
    const std::vector<int>& present = present_[&level - kinds_.levels.data()];
    std::size_t from = level.where[below(static_cast<int>(level.where.size()))];
    for (int tries = 0; tries < 40; ++tries) {
      const int id = below(static_cast<int>(present.size()));
      if (present[id] == 0) {
        from = level.where[id];
        break;
      }
    }
    const V2i source(static_cast<int>(from % cloth_.size.x), static_cast<int>(from / cloth_.size.x));
    const bool is_row = !grid_.is_woven && random_.uniform() < 0.03;
    const int reach = random_.uniform() < 0.2 ? 2 + below(4) : 1;
    const V2i first(is_row ? -below(grid_.size.x) : -reach, is_row ? -below(2) : -reach);
    const V2i piece(is_row ? grid_.size.x : std::min(grid_.size.x, 1 + 2 * reach),
                    is_row ? 1 - first.y : std::min(grid_.size.y, 1 + 2 * reach));
    V2i best(0, 0);
    int least = -1;
    for (int tries = 0; tries < 12; ++tries) {
      const V2i to(below(grid_.size.x), below(grid_.size.y));
      int differs = 0;
      for (int dy = first.y; dy < first.y + piece.y; ++dy)
        for (int dx = first.x; dx < first.x + piece.x; ++dx)
          differs += cell_of(cloth_, source + V2i(dx, dy)) != cell_of(grid_, to + V2i(dx, dy)) ? 1 : 0;
      for (int d = -1; d <= 1 && grid_.is_woven; ++d) {
        const auto other = [&](const auto& own, int a, int n, const auto& all, int b, int m) {
          return own[wrapped(a, n)] != all[wrapped(b, m)] ? 100 : 0;
        };
        differs += other(grid_.rows, to.y + d, grid_.size.y, cloth_.rows, source.y + d, cloth_.size.y);
        differs += other(grid_.columns, to.x + d, grid_.size.x, cloth_.columns, source.x + d, cloth_.size.x);
      }
      if (least >= 0 && differs >= least) continue;
      least = differs;
      best = to;
    }
    std::vector<std::pair<std::size_t, std::uint8_t>> before;
    for (int dy = first.y; dy < first.y + piece.y; ++dy)
      for (int dx = first.x; dx < first.x + piece.x; ++dx) {
        const std::size_t at = index_at(grid_, best.x + dx, best.y + dy);
        const std::uint8_t cell = cell_of(cloth_, source + V2i(dx, dy));
        if (grid_.cells[at] == cell) continue;
        before.emplace_back(at, grid_.cells[at]);
        grid_.cells[at] = cell;
      }
    change(before);
  }

  std::uint8_t cell_of(const StitchGrid& grid, const V2i& at) const {
    return grid.cells[index_at(grid, at.x, at.y)];
  }

  /// Keeps the changed cells, or takes them back.
  void change(const std::vector<std::pair<std::size_t, std::uint8_t>>& before) {
    std::vector<std::size_t> touched;
    const auto touch = [&](int x, int y) {
      const std::size_t at = index_at(grid_, x, y);
      if (std::exchange(is_changed_[at], 1) == 0) touched.push_back(at);
    };
    for (const auto& [at, cell] : before) {
      const int x = static_cast<int>(at % grid_.size.x);
      const int y = static_cast<int>(at / grid_.size.x);
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) touch(x + dx, y + dy);
      if (set_row_yarns(grid_, y))
        for (int i = 0; i < grid_.size.x; ++i) touch(i, y);
    }
    gain_ = 0;
    for (const std::size_t at : touched) update(at);
    const bool is_kept = gain_ >= 0 || random_.uniform() < std::exp(gain_ / heat_);
    for (const auto& [at, cell] : before) {
      if (is_kept) break;
      grid_.cells[at] = cell;
      set_row_yarns(grid_, static_cast<int>(at / grid_.size.x));
    }
    for (const std::size_t at : touched) {
      is_changed_[at] = 0;
      if (!is_kept) update(at);
    }
  }

  /// Counts a cell as the kinds that it is of now.
  void update(std::size_t at) {
    const Keys keys =
        keys_at(grid_, static_cast<int>(at % grid_.size.x), static_cast<int>(at / grid_.size.x));
    for (std::size_t l = 0; l < keys.size(); ++l) {
      const Kinds::Level& level = kinds_.levels[l];
      const auto add = [&](int id, int sense) {
        if (id < 0) return;
        int& count = present_[l][id];
        const int more = std::max(count, count + sense);
        // As many of each kind as in the cloth, in proportion, are worth most.
        const double known = l == 0 ? worth_of_more_ * (std::sqrt(more) - std::sqrt(more - 1)) : 0;
        gain_ += sense * level.worth[id] * (more == 1 ? 1 : known);
        count += sense;
      };
      const auto found = level.ids.find(keys[l]);
      const int id = found == level.ids.end() ? -1 : found->second;
      if (id == ids_[at][l]) continue;
      add(std::exchange(ids_[at][l], id), -1);
      add(id, 1);
    }
  }

  const StitchGrid& cloth_;
  const Kinds& kinds_;
  double worth_of_more_;
  Random random_;
  StitchGrid grid_;
  std::vector<std::array<int, kind_match_count>> ids_;      ///< of cells
  std::array<std::vector<int>, kind_match_count> present_;  ///< cells of each kind
  std::vector<char> is_changed_;
  double gain_ = 0;
  double heat_ = 1;
};

/// The colour that a stitch of a cloth or its sampler shows.
const V3f& colour_at(const StitchGrid& cloth, const StitchGrid& grid, int x, int y) {
  const std::uint8_t cell = grid.cells[index_at(grid, x, y)];
  if (!grid.is_woven) return cloth.colours[0][cell];
  return cell != 0 ? cloth.colours[1][grid.columns[wrapped(x, grid.size.x)]]
                   : cloth.colours[0][grid.rows[wrapped(y, grid.size.y)]];
}

/// Square of the difference that neighbours of other colours make to a stitch's mean colour, mean of the
/// channels. The fractions of it that are their yarn are fitted to pairs of maps of charts and of drafts.
double square_error(const StitchGrid& cloth, const V2i& at, const StitchGrid& sampler, const V2i& own) {
  double sum = 0;
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      const float nearest = cloth.is_woven ? (dy == 0 ? 0.06F : 0) : (dy > 0 ? 0.2F : 0);
      const float fraction = dx * dy != 0 ? 0.035F : nearest;
      const V3f& wanted = colour_at(cloth, cloth, at.x + dx, at.y + dy);
      const V3f& shown = colour_at(cloth, sampler, own.x + dx, own.y + dy);
      sum += static_cast<double>(((shown - wanted) * fraction).length2()) / 3;
    }
  return sum;
}

/// Sets the map: of the stitches that match best, one whose farther neighbours do, too, and beside which the
/// cloth goes on as the sampler does.
void show_kinds(const StitchGrid& cloth, Arrangement& arranged) {
  constexpr std::size_t max_tried = 24;
  constexpr int sweeps = 4;
  constexpr int worth_of_side = 4;  // of cells around that are alike
  const StitchGrid& sampler = arranged.sampler;
  std::array<std::unordered_map<std::uint64_t, std::vector<int>>, kind_match_count> found;
  for (int y = 0; y < sampler.size.y; ++y)
    for (int x = 0; x < sampler.size.x; ++x) {
      const Keys keys = keys_at(sampler, x, y);
      for (std::size_t l = 0; l < keys.size(); ++l)
        found[l][keys[l]].push_back(static_cast<int>(index_at(sampler, x, y)));
    }
  const V2i n = sampler.size;
  constexpr std::array<std::array<int, 2>, 4> sides{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
  const auto beside = [&](int one, int dx, int dy) {
    return static_cast<int>(index_at(sampler, one % n.x + dx, one / n.x + dy));
  };
  std::vector<int> shown(cloth.count(), -1);
  for (std::size_t i = 0; i < sweeps * cloth.count(); ++i) {
    const std::size_t at = i % cloth.count();
    const bool is_first = i == at;
    const int x = static_cast<int>(at % cloth.size.x);
    const int y = static_cast<int>(at / cloth.size.x);
    const Keys keys = keys_at(cloth, x, y);
    std::size_t l = 0;
    while (!found[l].contains(keys[l])) ++l;
    arranged.stitches[l] += is_first ? 1 : 0;
    const std::vector<int>& some = found[l][keys[l]];
    int most = -1;
    const auto try_one = [&](int one) {
      int alike = 0;
      for (const auto& [dx, dy] : sides)
        alike += shown[index_at(cloth, x + dx, y + dy)] == beside(one, dx, dy) ? worth_of_side : 0;
      for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -2; dx <= 2; ++dx)
          alike += cloth.cells[index_at(cloth, x + dx, y + dy)] == sampler.cells[beside(one, dx, dy)] ? 1 : 0;
      if (alike <= most) return;
      most = alike;
      shown[at] = one;
    };
    if (!is_first) try_one(shown[at]);
    for (const auto& [dx, dy] : sides) {
      const int next = shown[index_at(cloth, x + dx, y + dy)];
      if (next >= 0 && std::ranges::binary_search(some, beside(next, -dx, -dy)))
        try_one(beside(next, -dx, -dy));
    }
    const std::size_t step = std::max<std::size_t>(1, some.size() / max_tried);
    for (std::size_t k = hash64(at) % step; k < some.size() && is_first; k += step) try_one(some[k]);
  }
  double error = 0;
  for (std::size_t at = 0; at < shown.size(); ++at)
    error +=
        square_error(cloth, V2i(static_cast<int>(at % cloth.size.x), static_cast<int>(at / cloth.size.x)),
                     sampler, {shown[at] % n.x, shown[at] / n.x});
  error /= static_cast<double>(cloth.count());
  arranged.decibels = std::min(max_decibels, -10 * std::log10(std::max(error, 1e-12)));
  arranged.map.kinds = n;
  arranged.map.size = cloth.size;
  // The map's first row is the topmost.
  for (int y = cloth.size.y - 1; y >= 0; --y)
    for (int x = 0; x < cloth.size.x; ++x) {
      const int own = shown[index_at(cloth, x, y)];
      arranged.map.shown.push_back(static_cast<std::uint16_t>((n.y - 1 - own / n.x) * n.x + own % n.x));
    }
}

}  // namespace

std::optional<StitchGrid> grid_of(const KnitChart& chart) {
  constexpr float other_side = 0.7F;  // of the albedo: between knit and purl pictures differ, too
  StitchGrid grid;
  grid.size = {static_cast<int>(chart.rows.front().size()), static_cast<int>(chart.rows.size())};
  for (const auto& row : chart.rows)
    for (const ChartStitch& stitch : row) {
      ChartStitch plain;
      plain.purl = stitch.purl;
      plain.yarn = stitch.yarn;
      if (stitch != plain) return std::nullopt;
      const auto found = std::ranges::find(grid.stitches, stitch);
      grid.cells.push_back(static_cast<std::uint8_t>(found - grid.stitches.begin()));
      if (found != grid.stitches.end()) continue;
      grid.stitches.push_back(stitch);
      const bool is_as_first = stitch.purl == grid.stitches.front().purl;
      grid.colours[0].push_back(chart.yarns[stitch.yarn].albedo * (is_as_first ? 1 : other_side));
    }
  grid.rows.resize(grid.size.y);
  grid.columns.resize(grid.size.x);
  for (int y = 0; y < grid.size.y; ++y) set_row_yarns(grid, y);
  return grid;
}

std::optional<StitchGrid> grid_of(const Weave& weave) {
  StitchGrid grid;
  grid.size = {static_cast<int>(weave.warp.size()), static_cast<int>(weave.weft.size())};
  grid.is_woven = true;
  grid.cells.assign(weave.warp_is_over.begin(), weave.warp_is_over.end());
  for (const auto& [yarns, widths, kinds] : {std::tuple(&weave.warp, &weave.warp_spacing_mm, &grid.columns),
                                             std::tuple(&weave.weft, &weave.weft_spacing_mm, &grid.rows)}) {
    std::vector<const Yarn*> known;
    for (const Yarn& yarn : *yarns) {
      const auto same = std::ranges::find_if(known, [&](const Yarn* other) {
        return other->albedo == yarn.albedo && other->radius_mm == yarn.radius_mm;
      });
      kinds->push_back(static_cast<std::uint8_t>(same - known.begin()));
      if (same == known.end()) known.push_back(&yarn);
    }
    for (const Yarn* yarn : known) grid.colours[yarns == &weave.warp ? 1 : 0].push_back(yarn->albedo);
    if (known.size() > 255 || std::ranges::count(*widths, widths->front()) != std::ssize(*widths))
      return std::nullopt;
  }
  return grid;
}

std::optional<Arrangement> arrange(const StitchGrid& cloth, const KindLimit& limit) {
  using By = KindLimit::By;
  constexpr int few = 64;                // stitches of the smallest sampler
  constexpr int whole_stitches = 800;    // that are made whole
  constexpr int usual_stitches = 784;    // made for others: as in the cloth, most have like ones around them
  constexpr int usual_crossings = 1600;  // of less yarn
  constexpr int rounds = 100'000;
  constexpr double worth_of_more = 0.3;
  constexpr double worth_if_few = 0.05;
  const int count = static_cast<int>(cloth.count());
  const bool is_usual = limit.by == By::size;
  const int few_usual = limit.stitches * (cloth.is_woven ? 2 : 1);
  if (is_usual && count <= (few_usual > 0 ? few_usual : whole_stitches)) return std::nullopt;
  if (limit.by == By::none || std::min(cloth.size.x, cloth.size.y) < 3 || count > max_map_stitches)
    return std::nullopt;
  const Kinds kinds(cloth);
  const int kind_count = static_cast<int>(kinds.levels[0].counts.size());
  const int usual = few_usual > 0 ? few_usual : cloth.is_woven ? usual_crossings : usual_stitches;
  const int max_stitches = limit.by == By::stitches ? limit.stitches
                           : is_usual               ? std::min(count / 2, usual)
                                                    : std::min(count - 1, max_stitch_kinds);
  std::optional<Arrangement> best;
  for (double area = limit.by == By::accuracy ? few
                     : limit.by == By::exact  ? std::max<double>(few, 1.5 * kind_count)
                                              : max_stitches;
       ; area *= 1.3) {
    area = std::min<double>(area, max_stitches);
    V2i size(std::clamp(static_cast<int>(std::sqrt(area)), 3, cloth.size.x), 3);
    size.y = std::clamp(static_cast<int>(area / size.x), 3, cloth.size.y);
    if (size.x * size.y > max_stitches || size.x * size.y >= count) break;
    Search search(cloth, kinds, size, limit.by == By::exact ? worth_if_few : worth_of_more);
    search.run(rounds);
    const int missing = search.missing(KindMatch::eight);
    if (search.missing(KindMatch::row) == 0)
      best.emplace(Arrangement{search.grid(), {}, kind_count, missing, {}});
    if (best && best->map.empty() && limit.by == By::accuracy) show_kinds(cloth, *best);
    if (area >= max_stitches || missing == 0 ||
        (best && limit.by == By::accuracy && best->decibels >= limit.decibels))
      break;
  }
  if (best && best->map.empty()) show_kinds(cloth, *best);
  return best;
}

double stitch_changes(const StitchGrid& grid) {
  const auto stitch = [&](int x, int y) -> const ChartStitch& {
    return grid.stitches[grid.cells[index_at(grid, x, y)]];
  };
  double changes = 0;
  for (int y = 0; y < grid.size.y; ++y)
    for (int x = 0; x < grid.size.x; ++x)
      changes +=
          (stitch(x, y) != stitch(x + 1, y) ? 1 : 0) + (stitch(x, y).purl != stitch(x, y + 1).purl ? 1 : 0);
  return changes / static_cast<double>(grid.count());
}

std::vector<int> yarns_of_rows(const StitchGrid& grid) {
  std::vector<int> counts;
  if (grid.is_woven) return counts;
  for (const std::uint8_t row : grid.rows) counts.push_back(std::popcount(row));
  return counts;
}

void take_sampler(const StitchGrid& sampler, KnitChart& chart) {
  chart.max_float = 0;  // what catches them depends on more than neighbours
  chart.rows.assign(sampler.size.y, {});
  for (std::size_t i = 0; i < sampler.count(); ++i)
    chart.rows[i / sampler.size.x].push_back(sampler.stitches[sampler.cells[i]]);
}

void take_sampler(const StitchGrid& cloth, const StitchGrid& sampler, Weave& weave) {
  for (auto [yarns, widths, kinds, own] :
       {std::tuple(&weave.warp, &weave.warp_spacing_mm, &cloth.columns, &sampler.columns),
        std::tuple(&weave.weft, &weave.weft_spacing_mm, &cloth.rows, &sampler.rows)}) {
    std::vector<Yarn> taken;
    for (const std::uint8_t kind : *own)
      taken.push_back((*yarns)[std::ranges::find(*kinds, kind) - kinds->begin()]);
    *yarns = std::move(taken);
    widths->resize(own->size());
  }
  weave.warp_is_over.assign(sampler.cells.begin(), sampler.cells.end());
}

}  // namespace selvedge
