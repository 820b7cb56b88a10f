// How far every way to store a level is from the truth, and how many bytes it takes: baselines beside
// fabrics.
//
//   selvedge-bench-layers SAMPLES [FABRIC...]
//
// For every level: PSNR against the held-out pairs, dB (format/compare.h has the definition; the peak is one
// for all levels), and bytes per texel in half precision. Nothing here is chosen by the held-out pairs.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "fitter/level_judge.h"
#include "fitter/principal.h"
#include "format/compare.h"
#include "format/fabric_exr.h"
#include "format/parallel.h"
#include "format/pool.h"

namespace selvedge {
namespace {

/// alpha f of a texel for the stored views and lights: [view][3 * light + channel].
using Table = std::vector<float>;

Table table_of(const SampleLevel& level, std::size_t texel) {
  const auto views = static_cast<std::size_t>(level.views);
  const auto lights = static_cast<std::size_t>(level.lights);
  Table table;
  for (std::size_t v = 0; v < views; ++v) {
    const float alpha = level.alpha[texel * views + v];
    for (std::size_t l = 0; l < lights; ++l) {
      const V3f& radiance = level.radiance[(texel * views + v) * lights + l];
      for (int c = 0; c < 3; ++c) table.push_back(alpha * radiance[c]);
    }
  }
  return table;
}

/// Mean squared error of tables that are interpolated in view and light.
double error_of(const std::vector<Table>& tables, const LevelTruth& truth,
                const std::vector<DirectionPair>& pairs, const SamplesHeader& header) {
  const auto values = 3 * static_cast<std::size_t>(header.lights.count());
  double sum = 0;
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const DirectionTaps views = interpolate(header.views, pairs[p].view);
    const DirectionTaps lights = interpolate(header.lights, pairs[p].light);
    for (std::size_t t = 0; t < tables.size(); ++t) {
      V3d colour(0, 0, 0);
      for (std::size_t v = 0; v < 4; ++v) {
        for (std::size_t l = 0; l < 4; ++l) {
          const auto weight = static_cast<double>(views.weight[v] * lights.weight[l]);
          const float* at = &tables[t][static_cast<std::size_t>(views.cell[v]) * values +
                                       3 * static_cast<std::size_t>(lights.cell[l])];
          for (int c = 0; c < 3; ++c) colour[c] += weight * static_cast<double>(at[c]);
        }
      }
      for (int c = 0; c < 3; ++c) colour[c] = std::max(colour[c], 0.0);
      sum += (colour - truth.pairs[p][t]).length2();
    }
  }
  return sum / (3 * static_cast<double>(tables.size()) * static_cast<double>(pairs.size()));
}

/// The best sum of `rank` products T_k(v) S_k(l) of a texel: its singular vectors, all channels in S.
Table of_rank(const Table& table, std::size_t views, std::size_t rank) {
  const std::size_t values = table.size() / views;
  std::vector<double> gram(views * views, 0);
  for (std::size_t a = 0; a < views; ++a) {
    for (std::size_t b = 0; b <= a; ++b) {
      for (std::size_t i = 0; i < values; ++i) {
        gram[a * views + b] += static_cast<double>(table[a * values + i] * table[b * values + i]);
      }
    }
  }
  const Principal components = principal_components(gram, views, rank);
  Table result(table.size(), 0);
  for (const auto& vector : components.vectors) {
    std::vector<double> row(values, 0);
    for (std::size_t v = 0; v < views; ++v) {
      for (std::size_t i = 0; i < values; ++i)
        row[i] += vector[v] * static_cast<double>(table[v * values + i]);
    }
    for (std::size_t v = 0; v < views; ++v) {
      for (std::size_t i = 0; i < values; ++i)
        result[v * values + i] += static_cast<float>(vector[v] * row[i]);
    }
  }
  return result;
}

/// A Lambert texel of the colour and opacity that fit best.
Table diffuse(const Table& table, const SamplesHeader& header) {
  const std::vector<V3f> lights = directions_of(header.lights);
  const std::size_t values = 3 * lights.size();
  V3d cross(0, 0, 0);
  double square = 0;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const auto cosine = static_cast<double>(lights[i % values / 3].z);
    cross[static_cast<int>(i % 3)] += cosine * static_cast<double>(table[i]);
    square += cosine * cosine / 3;
  }
  Table result(table.size());
  for (std::size_t i = 0; i < table.size(); ++i) {
    const auto cosine = static_cast<double>(lights[i % values / 3].z);
    result[i] = static_cast<float>(cosine * cross[static_cast<int>(i % 3)] / square);
  }
  return result;
}

void print_row(const std::string& name, double bytes, const std::vector<double>& errors, double peak) {
  fmt::print("{:34}  {:>10}", name, bytes > 0 ? fmt::format("{:.0f}", bytes) : "");
  for (const double error : errors)
    fmt::print("  {:6.2f}", 10 * std::log10(peak * peak / std::max(error, 1e-30)));
  fmt::print("\n");
}

int run(const std::vector<std::string>& arguments) {
  const auto failed = [](const Error& error) {
    fmt::print(stderr, "selvedge-bench-layers: {}\n", to_line(error));
    return 1;
  };
  auto reader = SamplesReader::open(arguments.front());
  if (!reader) return failed(reader.error());
  const SamplesHeader& header = reader->header();
  const auto held_out = reader->read_pairs(PairKind::held_out);
  if (!held_out) return failed(held_out.error());
  auto base = reader->read_level();
  if (!base) return failed(base.error());
  const std::vector<LevelTruth> truths = level_truths(*held_out);
  std::vector<SampleLevel> levels{std::move(*base)};
  while (levels.size() < truths.size()) levels.push_back(pool(levels.back()));

  std::vector<float> shown;
  for (std::size_t i = 0; i < held_out->alpha.size(); ++i) {
    const V3f colour = held_out->radiance[i] * held_out->alpha[i];
    shown.insert(shown.end(), {colour.x, colour.y, colour.z});
  }
  const auto at = static_cast<std::ptrdiff_t>(0.999 * static_cast<double>(shown.size() - 1));
  std::nth_element(shown.begin(), shown.begin() + at, shown.end());
  const auto peak = static_cast<double>(shown[static_cast<std::size_t>(at)]);

  fmt::print("{}: held-out PSNR, dB\n{:34}  {:>10}", arguments.front(), "", "bytes/texel");
  for (const SampleLevel& level : levels)
    fmt::print("  {:>6}", fmt::format("{}x{}", level.width, level.height));
  fmt::print("\n");
  const auto views = static_cast<std::size_t>(header.views.count());
  const double directions = 2.0 * (header.views.count() + 3.0 * header.lights.count());
  const auto row = [&](const std::string& name, double bytes,
                       const std::function<Table(const Table&)>& model) {
    std::vector<double> errors;
    for (std::size_t k = 0; k < levels.size(); ++k) {
      std::vector<Table> tables(static_cast<std::size_t>(levels[k].texels()));
      parallel_for(0, levels[k].texels(), [&](int texel) {
        const auto t = static_cast<std::size_t>(texel);
        tables[t] = model(table_of(levels[k], t));
      });
      errors.push_back(error_of(tables, truths[k], held_out->pairs, header));
    }
    print_row(name, bytes, errors, peak);
  };
  row("one diffuse colour", 6, [&](const Table& table) { return diffuse(table, header); });
  for (const std::size_t rank : {1, 2, 4, 8}) {
    row(fmt::format("singular vectors, rank {}", rank), static_cast<double>(rank) * directions,
        [&](const Table& table) { return of_rank(table, views, rank); });
  }
  row("all samples, bilinear", 2.0 * header.views.count() * (3.0 * header.lights.count() + 1),
      [](const Table& table) { return table; });
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    const auto fabric = read_fabric(arguments[i]);
    if (!fabric) return failed(fabric.error());
    const auto comparison = compare(*fabric, *held_out, PairKind::held_out, peak);
    if (!comparison) return failed(comparison.error());
    std::vector<double> errors;
    for (const LevelComparison& level : comparison->levels) {
      errors.push_back(peak * peak / std::pow(10, level.psnr / 10));
    }
    print_row(arguments[i], 0, errors, peak);
  }
  return 0;
}

}  // namespace
}  // namespace selvedge

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("usage: selvedge-bench-layers SAMPLES [FABRIC...]\n", stderr);
    return 2;
  }
  return selvedge::run({argv + 1, argv + argc});
}
