#include "fitter/training_pairs.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "format/base/random.h"

namespace selvedge {
namespace {

std::vector<std::size_t> cells_drawn(std::size_t count) {
  constexpr auto wanted = static_cast<std::size_t>(TrainingPairs::most);
  if (count <= wanted) {
    std::vector<std::size_t> all(count);
    std::iota(all.begin(), all.end(), std::size_t{0});
    return all;
  }
  std::set<std::size_t> drawn;
  Random random(count);
  while (drawn.size() < wanted) {
    drawn.insert(static_cast<std::size_t>(random.uniform() * static_cast<double>(count)));
  }
  return {drawn.begin(), drawn.end()};
}

}  // namespace

TrainingPairs::TrainingPairs(const SamplesHeader& header) {
  const std::size_t lights = header.lights.count();
  cells_ = cells_drawn(static_cast<std::size_t>(header.views.count()) * lights);
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
  const std::size_t values = cells_.size() * static_cast<std::size_t>(header.texels());
  pairs_.alpha.resize(values);
  pairs_.alpha_noise.resize(values);
  // Vectors are not zero by themselves.
  pairs_.radiance.resize(values, V3f(0));
  pairs_.noise.resize(values, V3f(0));
}

void TrainingPairs::add(const SampleLevel& rows) {
  const auto texels = static_cast<std::size_t>(pairs_.width) * static_cast<std::size_t>(pairs_.height);
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
  const int count = rows_within(header, std::size_t{96} << 20);
  for (int first = 0; first < header.height; first += count) {
    const auto rows = reader.read_rows(first, std::min(count, header.height - first));
    if (!rows) return tl::unexpected(rows.error());
    training.add(*rows);
  }
  return training.finish();
}

}  // namespace selvedge
