#include "fitter/training_pairs.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "format/base/random.h"

namespace selvedge {
namespace {

/// Random cells of `count`, ascending; all of them if they are few.
std::vector<std::size_t> draw_cells(std::size_t count) {
  constexpr std::size_t max_pairs = TrainingPairs::max_pairs;
  if (count <= max_pairs) {
    std::vector<std::size_t> all(count);
    std::iota(all.begin(), all.end(), 0);
    return all;
  }
  std::set<std::size_t> drawn;
  Random random(count);
  while (drawn.size() < max_pairs) {
    drawn.insert(static_cast<std::size_t>(random.uniform() * static_cast<double>(count)));
  }
  return {drawn.begin(), drawn.end()};
}

}  // namespace

TrainingPairs::TrainingPairs(const SamplesHeader& header) {
  const std::size_t lights = header.lights.count();
  cells_ = draw_cells(header.views.count() * lights);
  const std::vector<V3f> view_directions = directions_of(header.views);
  const std::vector<V3f> light_directions = directions_of(header.lights);
  for (const std::size_t cell : cells_) {
    DirectionPair pair;
    pair.view = view_directions[cell / lights];
    pair.light = light_directions[cell % lights];
    pairs_.pairs.push_back(pair);
  }
  pairs_.width = header.width;
  pairs_.height = header.height;
  const std::size_t values = cells_.size() * header.texels();
  pairs_.alpha.resize(values);
  pairs_.alpha_noise.resize(values);
  // V3f has no default value.
  pairs_.radiance.resize(values, V3f(0));
  pairs_.noise.resize(values, V3f(0));
}

void TrainingPairs::add(const SampleLevel& rows) {
  const std::size_t texels = pairs_.width * pairs_.height;
  const std::size_t views = rows.views;
  const std::size_t lights = rows.lights;
  const std::size_t count = rows.texels();
  for (std::size_t p = 0; p < cells_.size(); ++p) {
    for (std::size_t t = 0; t < count; ++t) {
      const std::size_t to = p * texels + next_texel_ + t;
      pairs_.alpha[to] = rows.alpha[t * views + cells_[p] / lights];
      pairs_.radiance[to] = rows.radiance[t * views * lights + cells_[p]];
    }
  }
  next_texel_ += count;
}

Result<PairSamples> read_training_pairs(SamplesReader& reader) {
  const SamplesHeader& header = reader.header();
  TrainingPairs training(header);
  const int count = max_rows(header, std::size_t{96} << 20);
  for (int first = 0; first < header.height; first += count) {
    const auto rows = reader.read_rows(first, std::min(count, header.height - first));
    if (!rows) return tl::unexpected(rows.error());
    training.add(*rows);
  }
  return training.finish();
}

}  // namespace selvedge
