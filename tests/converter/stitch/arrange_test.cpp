#include "converter/stitch/arrange.h"

#include <doctest/doctest.h>

#include <cstdlib>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "converter/mesh/map_joints.h"
#include "converter/stitch/chart.h"
#include "converter/stitch/find_cell.h"
#include "converter/stitch/text_cells.h"
#include "converter/stitch/wif.h"
#include "format/base/atomic_file.h"
#include "format/base/random.h"
#include "tests/format/files.h"
#include "tests/require.h"
#include "tests/shared_data.h"

using namespace selvedge;

namespace {

constexpr KindLimit by_size{KindLimit::By::size};
constexpr KindLimit exact{KindLimit::By::exact};
constexpr KindLimit none{KindLimit::By::none};
constexpr KindLimit by_accuracy(double decibels) { return {KindLimit::By::accuracy, 0, decibels}; }
constexpr KindLimit at_most(int stitches) { return {KindLimit::By::stitches, stitches}; }

struct CopiedCase {
  const char* chart;  ///< in shared/data/charts
  KindLimit limit;
  int kinds = 0;           ///< 0: it is made whole
  int max_stitches = 0;    ///< of the sampler
  int others = 0;          ///< stitches that are not shown by 8 neighbours, at most
  double decibels = 0;     ///< at least
  bool is_damask = false;  ///< its second colour becomes purl
};

StitchGrid grid_in(const std::string& path, bool is_damask) {
  const std::string text = stitch_text_in(path);
  if (kind_of_text(text, path) == StitchText::draft)
    return test::need(grid_of(test::need(read_wif(text, path)).weave));
  KnitChart chart = test::need(read_chart(text, path)).knit;
  for (auto& row : chart.rows)
    for (ChartStitch& stitch : row)
      if (is_damask) stitch.purl = std::exchange(stitch.yarn, 0) != 0;
  return test::need(grid_of(chart));
}

/// The stitch at (x, y), and those beside, above and below it: 0 to 2; its yarns.
std::vector<int> neighbourhood(const StitchGrid& grid, int x, int y, int reach) {
  const auto at = [](int i, int n) { return (i + n) % n; };
  std::vector<int> all{grid.rows[y], grid.columns[x]};
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      if (reach == 2 || (reach == 1 && dx * dy == 0) || dy == 0)
        all.push_back(grid.cells[at(y + dy, grid.size.y) * grid.size.x + at(x + dx, grid.size.x)]);
      if (reach == 2 && grid.is_woven) {
        all.push_back(grid.rows[at(y + dy, grid.size.y)]);
        all.push_back(grid.columns[at(x + dx, grid.size.x)]);
      }
    }
  return all;
}

/// Gives it light that differs from station to station.
YarnData& lit_at_random(YarnData& yarns) {
  for (int i = 0; i < counts_of(yarns).stations * light_values_per_station; ++i)
    yarns.station_light.push_back(static_cast<float>(hash64(i) % 1000) / 1000);
  return yarns;
}

}  // namespace

TEST_CASE("Samplers have the stitches of large charts and drafts, and yarns run on wherever they are shown") {
  for (const auto& [chart, limit, kinds, max_stitches, others, decibels, is_damask] :
       {CopiedCase{"blobs-24x24.txt", exact, 73, 144, 0, max_decibels},
        {"blobs-24x24.txt", by_accuracy(36), 73, 64, 120, 36},
        {"blobs-24x24.txt", by_accuracy(50), 73, 144, 60, 50},
        {"draft-100-8-shafts.wif", by_accuracy(45), 450, 900, 1400, 45},
        {"blobs-24x24.txt", by_size},
        {"blobs-24x24.txt", at_most(100), 73, 100, 40},
        {"blobs-24x24.txt", none},
        {"blobs-60x93.txt", by_size, 74, 784, 0},
        {"blobs-60x80-3.txt", by_size, 237, 784, 20},
        {"blobs-24x24.txt", exact, 62, 144, 0, max_decibels, true},
        {"blobs-60x93.txt", by_size, 74, 784, 0, max_decibels, true},
        {"013.png", by_size},
        {"043.png", exact, 209, 610, 0},
        {"cactus-medium.png", exact, 86, 220, 0},
        {"draft-32.wif", exact, 32, 64, 0},
        {"draft-100-8-shafts.wif", by_size, 450, 1600, 400}}) {
    CAPTURE(std::string(chart));
    const std::string path = test::shared_data(std::string("charts/") + chart);
    if (path.empty()) return;
    const StitchGrid cloth = grid_in(path, is_damask);
    const auto found = arrange(cloth, limit);
    CHECK(found.has_value() == (kinds > 0));
    if (!found) continue;
    const V2i n = found->sampler.size;
    std::set<std::vector<int>> all;
    std::set<std::vector<int>> kept;
    int alike = 0;
    int runs_on = 0;
    for (int y = 0; y < n.y; ++y)
      for (int x = 0; x < n.x; ++x) kept.insert(neighbourhood(found->sampler, x, y, 2));
    for (int y = 0; y < cloth.size.y; ++y)
      for (int x = 0; x < cloth.size.x; ++x) {
        const int shown = found->map.shown[(cloth.size.y - 1 - y) * cloth.size.x + x];
        const auto same = [&](int reach) {
          return neighbourhood(cloth, x, y, reach) ==
                 neighbourhood(found->sampler, shown % n.x, n.y - 1 - shown / n.x, reach);
        };
        all.insert(neighbourhood(cloth, x, y, 2));
        alike += same(2) ? 1 : 0;
        runs_on += same(cloth.is_woven ? 1 : 0) ? 1 : 0;
      }
    CHECK(runs_on == static_cast<int>(cloth.count()));
    CHECK(alike == found->stitches[0]);
    CHECK(found->stitches[0] + found->stitches[1] + found->stitches[2] == static_cast<int>(cloth.count()));
    CHECK(static_cast<int>(cloth.count()) - alike <= others);
    CHECK(n.x * n.y <= max_stitches);
    CHECK(found->decibels >= decibels);
    CHECK(static_cast<int>(all.size()) == kinds);
    CHECK(found->kind_count == kinds);
    int missing = 0;
    for (const auto& kind : all) missing += kept.contains(kind) ? 0 : 1;
    CHECK(found->missing_kinds == missing);
    CHECK(found->map.kinds == n);
    CHECK(found->map.size == cloth.size);
  }
}

TEST_CASE(
    "Stitches end as those begin that a map shows behind them, in place, direction, section and light") {
  const test::Folder folder;
  const std::string diamond = folder / "diamond.txt";
  std::string rows;
  for (int y = 12; y > 0; --y) {
    rows += std::to_string(y) + ":";
    for (int x = 0; x < 12; ++x) rows += std::abs(2 * x - 11) + std::abs(2 * y - 13) < 11 ? " p" : " k";
    rows += '\n';
  }
  test::need(write_file(diamond, rows));
  for (const std::string& path :
       {test::shared_data("charts/blobs-24x24.txt"), test::shared_data("charts/draft-32.wif"), diamond}) {
    CAPTURE(path);
    if (path.empty()) return;
    CellOptions options;
    options.form = StitchForm::yarn;
    options.kinds = exact;
    YarnCell cell = *test::need(find_cell(path, options)).yarn;
    const V2f period(cell.period);
    CHECK(validate(lit_at_random(cell.yarns), period).has_value());
    const JointGaps gaps = joint_gaps(cell.yarns, period);
    CHECK(gaps.place_radii < 0.001);
    CHECK(gaps.degrees < 3);
    CHECK(gaps.squeeze < 0.001);
    CHECK(gaps.light > 0.2);
    join_light(cell.yarns, period);
    CHECK(joint_gaps(cell.yarns, period).light < 0.03);
  }
}

TEST_CASE("Cloth of other stitches than knit and purl ones, and of uneven yarns, has no sampler") {
  KnitChart chart;
  chart.yarns.emplace_back();
  chart.rows.assign(8, std::vector(8, ChartStitch{}));
  CHECK(grid_of(chart));
  chart.rows[3][2].purl = true;
  CHECK(grid_of(chart));
  chart.rows[3][2].twist = 1;
  CHECK(!grid_of(chart));
  Weave weave{
      std::vector(4, Yarn{}), std::vector(4, Yarn{}), {1, 1, 1, 1}, {1, 1, 1, 1}, std::vector(16, true)};
  CHECK(grid_of(weave));
  weave.weft_spacing_mm[1] = 2;
  CHECK(!grid_of(weave));
}
