// Garments that are drawn, and what their frames take.
#pragma once

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tests/bench/rows.h"
#include "viewer/load.h"
#include "viewer/renderer.h"

namespace selvedge::bench {

struct Sample {
  double wall = 0;
  double processor = 0;
  RenderStats stats;
};

/// Medians over frames, ms.
class Samples {
 public:
  void add(const Sample& sample) { samples_.push_back(sample); }
  double frame() const { return median(&Sample::wall); }
  double processor() const { return median(&Sample::processor); }
  /// Of a stage.
  double stage(double RenderStats::*seconds) const {
    return median([seconds](const Sample& s) { return s.stats.*seconds; });
  }
  const RenderStats& last() const { return samples_.back().stats; }

 private:
  template <class Seconds>
  double median(const Seconds& seconds) const {
    std::vector<double> values;
    for (const Sample& s : samples_) values.push_back(std::invoke(seconds, s) * 1e3);
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  }
  std::vector<Sample> samples_;
};

struct Subject {
  std::string name;
  Scene scene;
  std::vector<Fabric> fabrics;
  std::vector<V3d> points;
};

inline Subject load(const std::string& path) {
  OpenScene open = need(open_scene(path));
  Subject subject{std::filesystem::path(path).stem().string(), {}, need(read_fabrics(open)), {}};
  subject.scene = std::move(open.scene);
  subject.points = need(world_points(subject.scene));
  return subject;
}

}  // namespace selvedge::bench
