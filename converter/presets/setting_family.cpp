#include "converter/presets/setting_family.h"

#include <algorithm>
#include <cmath>

namespace selvedge {
namespace {

constexpr double usual_slope = 0.75;  // dB per octave of bytes
constexpr double min_fall = 1.5;

constexpr int min_texels = 8;
constexpr int max_texels = 64;

double octaves(double from, double to) { return std::log2(to / from); }

double slope_between(const ExpectedPoint& a, const ExpectedPoint& b) {
  return (b.held_out - a.held_out) / octaves(a.bytes, b.bytes);
}

bool leaves_budget(const ExpectedPoint& row) {
  return row.bytes < 0.9 * static_cast<double>(row.point.budget);
}

TradePoint without_budget(TradePoint point) {
  point.budget = 0;
  return point;
}

SettingFamily* find(std::vector<SettingFamily>& families, const TradePoint& setting) {
  const auto at = std::find_if(families.begin(), families.end(),
                               [&](const SettingFamily& f) { return f.setting == setting; });
  return at == families.end() ? nullptr : &*at;
}

/// Mean over neighbouring rows of the families with these layers.
double slope_of(const std::vector<SettingFamily>& families, LayerChoice layers) {
  double sum = 0;
  int count = 0;
  for (const SettingFamily& family : families) {
    if (family.setting.layers != layers) continue;
    for (std::size_t i = 1; i < family.rows.size(); ++i, ++count)
      sum += slope_between(family.rows[i - 1], family.rows[i]);
  }
  return count > 0 ? std::max(sum / count, 0.0) : usual_slope;
}

void set_slopes(std::vector<SettingFamily>& families) {
  for (SettingFamily& family : families) {
    const std::size_t rows = family.rows.size();
    const double alone = rows > 1 ? 0 : slope_of(families, family.setting.layers);
    const double first = rows > 1 ? slope_between(family.rows[0], family.rows[1]) : alone;
    const double last = rows > 1 ? slope_between(family.rows[rows - 2], family.rows[rows - 1]) : alone;
    family.fall = std::max(2 * first, min_fall);
    family.rise = std::max(last, 0.0) / 2;
  }
}

/// The family beyond `from`, seen from the family `other` with half or twice as many texels.
SettingFamily beyond(const SettingFamily& from, const SettingFamily& other, bool finer) {
  const SettingFamily& coarse = finer ? other : from;
  const SettingFamily& fine = finer ? from : other;
  double gain = 0;
  for (const ExpectedPoint& row : coarse.rows) gain += held_out_at(fine, 2 * row.bytes) - row.held_out;
  gain /= static_cast<double>(coarse.rows.size());
  const double ratio = std::max(fine.rows.front().seconds / coarse.rows.front().seconds, 1.0);
  SettingFamily family = from;
  family.setting.texels = finer ? 2 * from.setting.texels : from.setting.texels / 2;
  for (ExpectedPoint& row : family.rows) {
    row.point.texels = family.setting.texels;
    row.point.budget = finer ? 2 * row.point.budget : row.point.budget / 2;
    row.bytes *= finer ? 2 : 0.5;
    row.seconds *= finer ? std::max(ratio, 4.0) : 1 / std::sqrt(ratio);
    row.held_out += finer ? gain / 2 : -gain;
    row.pictures = 0;
  }
  return family;
}

void add_other_texels(std::vector<SettingFamily>& families) {
  const std::vector<SettingFamily> measured = families;
  for (const SettingFamily& coarse : measured) {
    if (!has_budget(coarse.setting)) continue;
    TradePoint setting = coarse.setting;
    setting.texels = 2 * coarse.setting.texels;
    const auto fine = std::find_if(measured.begin(), measured.end(),
                                   [&](const SettingFamily& f) { return f.setting == setting; });
    if (fine == measured.end()) continue;
    for (const bool finer : {false, true}) {
      const SettingFamily further = finer ? beyond(*fine, coarse, true) : beyond(coarse, *fine, false);
      const int texels = further.setting.texels;
      if (texels >= min_texels && texels <= max_texels && find(families, further.setting) == nullptr)
        families.push_back(further);
    }
  }
}

}  // namespace

std::vector<SettingFamily> families_of(std::span<const ExpectedPoint> rows) {
  std::vector<SettingFamily> families;
  for (const ExpectedPoint& row : rows) {
    const TradePoint setting = without_budget(row.point);
    SettingFamily* family = find(families, setting);
    if (family == nullptr) family = &families.emplace_back(SettingFamily{setting, {}, 0, 0});
    family->rows.push_back(row);
  }
  for (SettingFamily& family : families) {
    // Of two rows with as many bytes the better one, so that all differ.
    std::sort(family.rows.begin(), family.rows.end(), [](const ExpectedPoint& a, const ExpectedPoint& b) {
      return a.bytes != b.bytes ? a.bytes < b.bytes : a.held_out > b.held_out;
    });
    family.rows.erase(
        std::unique(family.rows.begin(), family.rows.end(),
                    [](const ExpectedPoint& a, const ExpectedPoint& b) { return a.bytes == b.bytes; }),
        family.rows.end());
  }
  set_slopes(families);
  add_other_texels(families);
  return families;
}

double held_out_at(const SettingFamily& family, double bytes) {
  const std::vector<ExpectedPoint>& rows = family.rows;
  if (bytes <= rows.front().bytes) {
    const double below = octaves(bytes, rows.front().bytes);
    return rows.front().held_out - family.fall * below * (1 + below / 2);
  }
  for (std::size_t i = 1; i < rows.size(); ++i) {
    if (bytes <= rows[i].bytes)
      return rows[i - 1].held_out + slope_between(rows[i - 1], rows[i]) * octaves(rows[i - 1].bytes, bytes);
  }
  return rows.back().held_out + family.rise * octaves(rows.back().bytes, bytes);
}

ExpectedPoint expected_at(const SettingFamily& family, std::uint64_t budget) {
  if (!has_budget(family.setting)) return family.rows.front();
  for (const ExpectedPoint& row : family.rows) {
    if (row.point.budget == budget) return row;
  }
  ExpectedPoint expected = family.rows.front();
  expected.point.budget = budget;
  expected.bytes = static_cast<double>(budget);
  if (leaves_budget(family.rows.back())) expected.bytes = std::min(expected.bytes, family.rows.back().bytes);
  expected.held_out = held_out_at(family, expected.bytes);
  expected.pictures = 0;
  return expected;
}

std::vector<std::uint64_t> budgets_of(const SettingFamily& family) {
  if (!has_budget(family.setting)) return {0};
  const ExpectedPoint& dearest = family.rows.back();
  const double most = static_cast<double>(dearest.point.budget) * (leaves_budget(dearest) ? 1 : 4);
  std::vector<std::uint64_t> budgets;
  for (const ExpectedPoint& row : family.rows) budgets.push_back(row.point.budget);
  // Whole KiB: they stand on command lines.
  for (double bytes = family.rows.front().bytes / 4; bytes <= most; bytes *= std::exp2(1.0 / 8))
    budgets.push_back(static_cast<std::uint64_t>(std::ceil(bytes / 1024)) * 1024);
  std::sort(budgets.begin(), budgets.end());
  budgets.erase(std::unique(budgets.begin(), budgets.end()), budgets.end());
  return budgets;
}

}  // namespace selvedge
