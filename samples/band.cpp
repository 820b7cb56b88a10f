#include "samples/band.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace selvedge::samples {
namespace {

/// A closed curve through points (Catmull-Rom), by its arc length.
class ClosedCurve {
 public:
  ClosedCurve(const std::vector<V3d>& points, const std::vector<int>& ring) : starts_{0} {
    for (const int p : ring) points_.push_back(points[p]);
    for (std::size_t j = 0; j < points_.size(); ++j) {
      starts_.push_back(starts_.back() + (points_[(j + 1) % points_.size()] - points_[j]).length());
    }
  }

  double length() const { return starts_.back(); }
  /// Where point j lies, in [0, 1].
  double around(std::size_t j) const { return starts_[j] / length(); }

  V3d at(double around) const {
    const std::size_t count = points_.size();
    const double s = (around - std::floor(around)) * length();
    const auto after = std::ranges::upper_bound(starts_, s);
    const std::size_t j = std::min(static_cast<std::size_t>(after - starts_.begin()) - 1, count - 1);
    const double t = (s - starts_[j]) / (starts_[j + 1] - starts_[j]);
    const V3d& a = points_[(j + count - 1) % count];
    const V3d& b = points_[j];
    const V3d& c = points_[(j + 1) % count];
    const V3d& d = points_[(j + 2) % count];
    return (b * 2 + (c - a) * t + (a * 2 - b * 5 + c * 4 - d) * (t * t) +
            (b * 3 - a - c * 3 + d) * (t * t * t)) *
           0.5;
  }

 private:
  std::vector<V3d> points_;
  std::vector<double> starts_;
};

/// A strip as a ruled surface from the seam, both of its edges by their own arc length, so that stitches keep
/// their width; leaning towards right angles with the seam, so that they keep their shape. `around` in [0,
/// 1), `down` in metres from the seam, the same height all around.
class Strip {
 public:
  Strip(const std::vector<V3d>& points, const Rings& rings) : seam_(points, rings.front()) {
    aim_at(ClosedCurve(points, rings.back()));
  }

  double height() const { return height_; }
  double around(std::size_t j) const { return seam_.around(j); }

  V3d at(double around, double down) const { return seam_.at(around) + direction(around) * down; }

  /// Outwards, by central differences over some millimetres.
  V3d normal(double around, double down) const {
    const double h = 0.004 / seam_.length();
    const V3d across = at(around + h, down) - at(around - h, down);
    return direction(around).cross(across).normalized();
  }

  /// The way around at a height, so far inside of the strip; metres.
  double length_at(double down, double inside) const {
    constexpr int steps = 256;
    double sum = 0;
    V3d last = at(0, down) - normal(0, down) * inside;
    for (int i = 1; i <= steps; ++i) {
      const double s = static_cast<double>(i) / steps;
      const V3d p = at(s, down) - normal(s, down) * inside;
      sum += (p - last).length();
      last = p;
    }
    return sum;
  }

 private:
  static constexpr int steps_around = 64;

  /// Directions, evenly spaced; smoothed, because a fan of directions stretches the stitches at the edge.
  void aim_at(const ClosedCurve& edge) {
    for (int i = 0; i < steps_around; ++i) {
      const double s = static_cast<double>(i) / steps_around;
      const V3d down = edge.at(s) - seam_.at(s);
      height_ += down.length() / steps_around;
      const V3d tangent = (seam_.at(s + 0.01) - seam_.at(s - 0.01)).normalized();
      directions_.push_back((down - tangent * tangent.dot(down)).normalized());
    }
    constexpr int smoothing = 48;
    for (int round = 0; round < smoothing; ++round) {
      const std::vector<V3d> rough = directions_;
      for (std::size_t i = 0; i < rough.size(); ++i) {
        const V3d& before = rough[(i + rough.size() - 1) % rough.size()];
        directions_[i] = (before + rough[i] * 2 + rough[(i + 1) % rough.size()]).normalized();
      }
    }
  }

  V3d direction(double around) const {
    const double s = (around - std::floor(around)) * steps_around;
    const std::size_t i = static_cast<std::size_t>(s) % steps_around;
    const double t = s - std::floor(s);
    return (directions_[i] * (1 - t) + directions_[(i + 1) % steps_around] * t).normalized();
  }

  ClosedCurve seam_;
  std::vector<V3d> directions_;  ///< unit, from the seam to the edge
  double height_ = 0;
};

/// One row of the band's cross-section: where it lies on the strip and how far inside of it.
struct Station {
  double down;    ///< metres from the seam along the strip
  double inside;  ///< metres
  double depth;   ///< of the ribs, metres
  double length;  ///< metres along the section from the seam: the texture's v
};

std::vector<Station> section_of(double height, const BandOptions& o) {
  std::vector<Station> stations;
  const double straight = height - o.roll;
  constexpr double first_row = 0.003;
  const int rows = std::max(1, static_cast<int>(std::lround((straight - first_row) / o.row)));
  for (int i = 0; i <= rows; ++i) {
    const double down = first_row + (straight - first_row) * i / rows;
    stations.push_back({down, 0, i == 0 ? 0.6 * o.depth : o.depth, down});
  }
  constexpr int bends = 4;
  for (int i = 1; i <= bends; ++i) {
    const double angle = std::numbers::pi * i / bends;
    stations.push_back({straight + o.roll * std::sin(angle), o.roll * (1 - std::cos(angle)),
                        o.depth * std::abs(std::cos(angle)), straight + o.roll * angle});
  }
  const double back = o.turned_back * straight;
  const int back_rows = std::max(1, static_cast<int>(std::lround(back / o.row)));
  const double bent = stations.back().length;
  for (int i = 1; i <= back_rows; ++i) {
    const double up = back * i / back_rows;
    stations.push_back({straight - up, 2 * o.roll, o.depth, bent + up});
  }
  return stations;
}

/// A rib as a polyline of `samples` pieces: its pitch is what is left of the yarn's length, and columns get
/// their texture coordinates by the length of the yarn up to them.
struct RibShape {
  double pitch = 0;
  std::vector<double> yarn{0};  ///< per column, the part of the rib's yarn before it

  explicit RibShape(const BandOptions& o) {
    // The pitch by bisection: the polyline's length grows with it.
    double low = 0.2 * o.rib;
    double high = o.rib;
    for (int round = 0; round < 50; ++round) {
      pitch = (low + high) / 2;
      (lengthen(o) < o.rib ? low : high) = pitch;
    }
    const double whole = yarn.back();
    for (double& y : yarn) y /= whole;
  }
  double yarn_at(int column) const { return yarn[column]; }

 private:
  double lengthen(const BandOptions& o) {
    yarn.assign(1, 0);
    const double turn = 2 * std::numbers::pi / o.samples;
    for (int j = 0; j < o.samples; ++j) {
      const double rise = o.depth * (std::cos(turn * (j + 1)) - std::cos(turn * j));
      yarn.push_back(yarn.back() + std::hypot(pitch / o.samples, rise));
    }
    return yarn.back();
  }
};

/// Two rings of different numbers of points, joined by triangles; both carry one point more than they have
/// columns, the last one on the first.
void join(Patch& patch, int upper_first, const std::vector<double>& upper, int lower_first,
          const std::vector<double>& lower) {
  std::size_t i = 0;
  std::size_t j = 0;
  while (i + 1 < upper.size() || j + 1 < lower.size()) {
    const int a = upper_first + static_cast<int>(i);
    const int b = lower_first + static_cast<int>(j);
    const bool step_lower = i + 1 == upper.size() || (j + 1 < lower.size() && lower[j + 1] <= upper[i + 1]);
    if (step_lower) {
      patch.triangles.emplace_back(a, b, b + 1);
      ++j;
    } else {
      patch.triangles.emplace_back(a, b, a + 1);
      ++i;
    }
  }
}

}  // namespace

Rings peel(const QuadSurface& surface, int label, const V3d& first) {
  std::map<std::pair<int, int>, int> quad_of;  // directed edge -> quad of the strip
  std::map<std::pair<int, int>, int> any_quad_of;
  for (std::size_t q = 0; q < surface.quads.size(); ++q) {
    for (std::size_t k = 0; k < 4; ++k) {
      const std::pair edge(surface.quads[q][k], surface.quads[q][(k + 1) % 4]);
      any_quad_of[edge] = static_cast<int>(q);
      if (surface.labels[q] == label) quad_of[edge] = static_cast<int>(q);
    }
  }
  std::map<int, int> next;
  for (const auto& [edge, quad] : quad_of) {
    if (!any_quad_of.contains({edge.second, edge.first})) next[edge.first] = edge.second;
  }
  Rings rings{{next.begin()->first}};
  for (int p = next.begin()->second; p != rings[0].front(); p = next.at(p)) rings[0].push_back(p);
  for (;;) {
    const std::vector<int>& ring = rings.back();
    std::vector<int> inner;
    for (std::size_t j = 0; j < ring.size(); ++j) {
      const auto found = quad_of.find({ring[j], ring[(j + 1) % ring.size()]});
      if (found == quad_of.end()) break;
      const Quad& quad = surface.quads[found->second];
      const std::size_t k = static_cast<std::size_t>(std::ranges::find(quad, ring[j]) - quad.begin());
      inner.push_back(quad[(k + 3) % 4]);
    }
    if (inner.empty()) break;
    rings.push_back(inner);
  }

  std::ranges::reverse(rings);
  const std::vector<int>& seam = rings.front();
  const auto start = std::ranges::max_element(
      seam, [&](int a, int b) { return first.dot(surface.positions[a]) < first.dot(surface.positions[b]); });
  const auto shift = start - seam.begin();
  for (std::vector<int>& ring : rings) std::rotate(ring.begin(), ring.begin() + shift, ring.end());
  return rings;
}

void add_band(Assembly& assembly, const Rings& rings, const std::string& material,
              const BandOptions& options) {
  const Strip strip(assembly.points, rings);
  const std::vector<Station> section = section_of(strip.height(), options);
  // The mean way around, weighted by the height of the rows; the inner side's is shorter.
  double around_mean = 0;
  for (std::size_t i = 0; i < section.size(); ++i) {
    const double above = i == 0 ? 0 : section[i - 1].length;
    around_mean += (section[i].length - above) * strip.length_at(section[i].down, section[i].inside);
  }
  around_mean /= section.back().length;
  const RibShape shape(options);
  const int ribs = std::max(8, static_cast<int>(std::lround(around_mean / shape.pitch)));
  const int columns = ribs * options.samples;
  const double width = ribs * options.rib;

  Patch patch;
  patch.material = material;
  const auto add_vertex = [&](int point, double yarn, double length) {
    patch.points.push_back(point);
    patch.tex_coords.emplace_back(options.middle_u + (yarn - 0.5) * width, length);
  };

  std::vector<double> upper;
  const std::vector<int>& seam = rings.front();
  for (std::size_t j = 0; j <= seam.size(); ++j) {
    upper.push_back(strip.around(j));
    add_vertex(seam[j % seam.size()], upper.back(), 0);
  }
  std::vector<double> lower;
  for (int j = 0; j <= columns; ++j) lower.push_back(static_cast<double>(j) / columns);

  int above = 0;
  bool first = true;
  for (const Station& station : section) {
    const int here = static_cast<int>(patch.points.size());
    const int first_point = static_cast<int>(assembly.points.size());
    for (int j = 0; j < columns; ++j) {
      const double around = lower[j];
      const double crest = station.depth * std::cos(2 * std::numbers::pi * j / options.samples);
      // Inside of the turned edge, crests look to the inside as well.
      const double offset = station.inside > options.roll ? -station.inside - crest : crest - station.inside;
      assembly.points.push_back(strip.at(around, station.down) + strip.normal(around, station.down) * offset);
    }
    for (int j = 0; j <= columns; ++j) {
      const int rib = j / options.samples;
      add_vertex(first_point + j % columns, (rib + shape.yarn_at(j % options.samples)) / ribs,
                 station.length);
    }
    if (first) {
      join(patch, above, upper, here, lower);
    } else {
      for (int j = 0; j < columns; ++j) {
        patch.triangles.emplace_back(above + j, here + j, here + j + 1);
        patch.triangles.emplace_back(above + j, here + j + 1, above + j + 1);
      }
    }
    above = here;
    first = false;
  }
  assembly.patches.push_back(std::move(patch));
}

}  // namespace selvedge::samples
