// How far every way to store a level is from the truth, and how many bytes it takes: baselines beside
// fabrics.
//
//   selvedge-bench-layers SAMPLES [FABRIC...]
//
// For every level: PSNR and relative L2 against the held-out pairs (format/quality/compare.h has the
// definitions; the peak is one for all levels), relative L2 over the stored views and lights beside it, so
// that over-fitting shows, bytes of a texel in half precision before compression, and seconds. One component
// over texels has as many bytes as a coarse level of the paper's model has altogether: there is always one.
// Nothing here is chosen by the held-out pairs.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "fitter/budget/level_error.h"
#include "fitter/fit.h"
#include "fitter/solve/principal.h"
#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "format/quality/compare.h"
#include "format/samples/pool.h"

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

/// Mean squared error of tables that are interpolated in view and light, without the cosine of the light.
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
          const double cosine = static_cast<double>(direction_of(header.lights, lights.cell[l]).z);
          for (int c = 0; c < 3; ++c) colour[c] += weight * static_cast<double>(at[c]) / cosine;
        }
      }
      for (int c = 0; c < 3; ++c)
        colour[c] = static_cast<double>(pairs[p].light.z) * std::max(colour[c], 0.0);
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

/// The best linear space of `rank` dimensions for a level's tables, all texels together, and the tables in
/// it.
std::vector<Table> in_principal_components(const std::vector<Table>& tables, std::size_t rank) {
  const std::size_t count = tables.size();
  const std::size_t values = tables.front().size();
  std::vector<double> gram(count * count, 0);
  parallel_for(0, static_cast<int>(count), [&](int row) {
    const auto a = static_cast<std::size_t>(row);
    for (std::size_t b = 0; b <= a; ++b) {
      double sum = 0;
      for (std::size_t i = 0; i < values; ++i) sum += static_cast<double>(tables[a][i] * tables[b][i]);
      gram[a * count + b] = sum;
    }
  });
  const Principal components = principal_components(gram, count, rank);
  std::vector<Table> result(count, Table(values, 0));
  for (const auto& vector : components.vectors) {
    std::vector<double> component(values, 0);
    for (std::size_t t = 0; t < count; ++t) {
      for (std::size_t i = 0; i < values; ++i) component[i] += vector[t] * static_cast<double>(tables[t][i]);
    }
    for (std::size_t t = 0; t < count; ++t) {
      for (std::size_t i = 0; i < values; ++i) result[t][i] += static_cast<float>(vector[t] * component[i]);
    }
  }
  return result;
}

/// One line of a level's table.
struct Row {
  std::string name;
  std::string bytes;  ///< of a texel
  double psnr = 0;
  double relative_l2 = 0;
  double training = 0;  ///< relative L2 over the stored views and lights
  std::string seconds;
};

double relative(double error, double energy) { return energy > 0 ? std::sqrt(error / energy) : 0; }

class Bench {
 public:
  Bench(const SamplesHeader& header, PairSamples held_out, SampleLevel base)
      : header_(header), held_out_(std::move(held_out)), truths_(level_truths(held_out_)) {
    levels_.push_back(std::move(base));
    while (levels_.size() < truths_.size()) levels_.push_back(pool(levels_.back()));
    rows_.resize(levels_.size());
    tables_.resize(levels_.size());
    for (std::size_t k = 0; k < levels_.size(); ++k) {
      tables_[k].resize(levels_[k].texels());
      parallel_for(0, levels_[k].texels(), [&](int texel) {
        const auto t = static_cast<std::size_t>(texel);
        tables_[k][t] = table_of(levels_[k], t);
      });
    }
    std::vector<float> shown;
    for (std::size_t i = 0; i < held_out_.alpha.size(); ++i) {
      const V3f colour = held_out_.radiance[i] * held_out_.alpha[i];
      shown.insert(shown.end(), {colour.x, colour.y, colour.z});
    }
    const auto at = static_cast<std::ptrdiff_t>(0.999 * static_cast<double>(shown.size() - 1));
    std::nth_element(shown.begin(), shown.begin() + at, shown.end());
    peak_ = static_cast<double>(shown[at]);
  }

  const SamplesHeader& header() const { return header_; }
  const SampleLevel& base() const { return levels_.front(); }

  /// Tables made of each level's tables; `bytes`: of a texel of a level with so many.
  void add(const std::string& name, const std::function<double(double texels)>& bytes,
           const std::function<std::vector<Table>(const std::vector<Table>&)>& model) {
    for (std::size_t k = 0; k < levels_.size(); ++k) {
      const auto start = std::chrono::steady_clock::now();
      const std::vector<Table> made = model(tables_[k]);
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      double error = 0;
      double energy = 0;
      for (std::size_t t = 0; t < made.size(); ++t) {
        for (std::size_t i = 0; i < made[t].size(); ++i) {
          const auto truth = static_cast<double>(tables_[k][t][i]);
          error += std::pow(static_cast<double>(made[t][i]) - truth, 2);
          energy += truth * truth;
        }
      }
      const double held_out = error_of(made, truths_[k], held_out_.pairs, header_);
      double square = 0;
      double count = 0;
      for (const auto& pair : truths_[k].pairs) {
        for (const V3d& colour : pair) square += colour.length2();
        count += 3 * static_cast<double>(pair.size());
      }
      rows_[k].push_back({name, fmt::format("{:.0f}", bytes(static_cast<double>(levels_[k].texels()))),
                          10 * std::log10(peak_ * peak_ / std::max(held_out, 1e-30)),
                          relative(held_out, square / count), relative(error, energy),
                          fmt::format("{:.2f}", seconds)});
    }
  }

  /// A fabric; `bytes` and `seconds` of its levels, where they are known.
  Result<void> add(const std::string& name, const Fabric& fabric, const std::vector<std::string>& bytes,
                   const std::vector<LevelReport>& reports) {
    const auto comparison = compare(fabric, held_out_, PairKind::held_out, peak_);
    if (!comparison) return tl::unexpected(comparison.error());
    for (std::size_t k = 0; k < levels_.size(); ++k) {
      const LevelComparison& c = comparison->levels[k];
      rows_[k].push_back({name, k < bytes.size() ? bytes[k] : "", c.psnr, c.relative_l2,
                          training_error(fabric, k),
                          k < reports.size() ? fmt::format("{:.2f}", reports[k].seconds) : ""});
    }
    return {};
  }

  void print() const {
    for (std::size_t k = 0; k < levels_.size(); ++k) {
      fmt::print(
          "| {}x{} | bytes/texel | held-out dB | relative L2 | training L2 | seconds |\n"
          "|---|---|---|---|---|---|\n",
          levels_[k].width, levels_[k].height);
      for (const Row& row : rows_[k]) {
        fmt::print("| {} | {} | {:.2f} | {:.3f} | {:.3f} | {} |\n", row.name, row.bytes, row.psnr,
                   row.relative_l2, row.training, row.seconds);
      }
      fmt::print("\n");
    }
  }

 private:
  double training_error(const Fabric& fabric, std::size_t k) const {
    const std::vector<V3f> views = directions_of(header_.views);
    const std::vector<V3f> lights = directions_of(header_.lights);
    const auto texels = static_cast<std::size_t>(levels_[k].texels());
    std::vector<V2d> sums(texels, V2d(0, 0));
    parallel_for(0, levels_[k].texels(), [&](int texel) {
      const auto t = static_cast<std::size_t>(texel);
      const int width = levels_[k].width;
      for (std::size_t v = 0; v < views.size(); ++v) {
        for (std::size_t l = 0; l < lights.size(); ++l) {
          const Shading s =
              evaluate(fabric, static_cast<int>(k), texel % width, texel / width, lights[l], views[v]);
          const float* truth = &tables_[k][t][3 * (v * lights.size() + l)];
          const V3d difference = V3d(s.radiance * s.alpha) - V3d(V3f(truth[0], truth[1], truth[2]));
          sums[t] += V2d(difference.length2(), V3d(V3f(truth[0], truth[1], truth[2])).length2());
        }
      }
    });
    V2d sum(0, 0);
    for (const V2d& s : sums) sum += s;
    return relative(sum.x, sum.y);
  }

  SamplesHeader header_;
  PairSamples held_out_;
  std::vector<LevelTruth> truths_;
  std::vector<SampleLevel> levels_;
  std::vector<std::vector<Table>> tables_;  ///< alpha f, by level and texel
  std::vector<std::vector<Row>> rows_;
  double peak_ = 0;
};

/// Each texel's table by itself.
std::vector<Table> each(const std::vector<Table>& tables, const std::function<Table(const Table&)>& model) {
  std::vector<Table> result(tables.size());
  parallel_for(0, static_cast<int>(tables.size()), [&](int texel) {
    const auto t = static_cast<std::size_t>(texel);
    result[t] = model(tables[t]);
  });
  return result;
}

/// Ways of the lobes; bytes of a texel in half precision.
Result<void> add_lobes(Bench& bench) {
  const int views = bench.header().views.count();
  struct Way {
    const char* name;
    int lobes;
    bool table;
  };
  constexpr std::array ways{Way{"1 lobe", 1, false}, Way{"2 lobes", 2, false}, Way{"4 lobes", 4, false},
                            Way{"2 lobes x T(v): the paper's model", 2, true}};
  for (const Way& way : ways) {
    FitOptions options;
    options.lobes = way.lobes;
    options.view_table = way.table;
    const auto result = fit(bench.base(), bench.header(), options);
    if (!result) return tl::unexpected(result.error());
    const int values = 3 * parameter_count(way.lobes) + 6 + views + (way.table ? 3 * views : 0);
    const std::vector<std::string> bytes(result->levels.size(), std::to_string(2 * values));
    if (auto ok = bench.add(way.name, result->fabric, bytes, result->levels); !ok) return ok;
  }
  return {};
}

int run(const std::vector<std::string>& arguments) {
  const auto failed = [](const Error& error) {
    fmt::print(stderr, "selvedge-bench-layers: {}\n", to_line(error));
    return 1;
  };
  auto reader = SamplesReader::open(arguments.front());
  if (!reader) return failed(reader.error());
  auto held_out = reader->read_pairs(PairKind::held_out);
  if (!held_out) return failed(held_out.error());
  auto base = reader->read_level();
  if (!base) return failed(base.error());
  Bench bench(reader->header(), std::move(*held_out), std::move(*base));

  const auto views = static_cast<std::size_t>(bench.header().views.count());
  const auto lights = static_cast<std::size_t>(bench.header().lights.count());
  const auto same = [](double bytes) { return [bytes](double) { return bytes; }; };
  bench.add("one diffuse colour", same(6), [&](const std::vector<Table>& tables) {
    return each(tables, [&](const Table& table) { return diffuse(table, bench.header()); });
  });
  if (auto ok = add_lobes(bench); !ok) return failed(ok.error());
  for (const std::size_t rank : {1, 2, 4, 8}) {
    const double bytes = 2 * static_cast<double>(rank * (views + 3 * lights));
    bench.add(fmt::format("singular vectors, rank {}", rank), same(bytes),
              [&](const std::vector<Table>& tables) {
                return each(tables, [&](const Table& table) { return of_rank(table, views, rank); });
              });
  }
  // As many as the paper's model has bytes, or a quarter of them; each component is stored once.
  const double paper =
      2.0 * static_cast<double>(3 * parameter_count(2) + 6) + 8.0 * static_cast<double>(views);
  for (const double part : {0.25, 1.0}) {
    const double component = 6.0 * static_cast<double>(views * lights);
    const auto rank_of = [=](double texels) {
      return std::clamp(std::floor(part * paper * texels / (component + 2 * texels)), 1.0, texels);
    };
    bench.add(
        fmt::format("principal components over texels, {} bytes",
                    part < 1 ? "a quarter of the paper's" : "the paper's"),
        [&](double texels) { return rank_of(texels) * (component + 2 * texels) / texels; },
        [&](const std::vector<Table>& tables) {
          const double rank = rank_of(static_cast<double>(tables.size()));
          return in_principal_components(tables, static_cast<std::size_t>(rank));
        });
  }
  bench.add("all samples, bilinear", same(2.0 * static_cast<double>(views * (3 * lights + 1))),
            [](const std::vector<Table>& tables) { return tables; });
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    const auto fabric = read_fabric(arguments[i]);
    if (!fabric) return failed(fabric.error());
    if (auto ok = bench.add(arguments[i], *fabric, {}, {}); !ok) return failed(ok.error());
  }
  bench.print();
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
