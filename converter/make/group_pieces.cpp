#include "converter/make/group_pieces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "format/fabric/directions.h"
#include "format/fabric/fabric.h"

namespace selvedge {
namespace {

/// A curve with the places where it is cut, as indices of nodes with fractions; the last is the first of the
/// next repeat.
class CutCurve {
 public:
  CutCurve(const YarnCurve& curve, std::span<const V3f> nodes, const V2f& period)
      : curve_(curve), nodes_(nodes), frames_(chain_frames(curve, nodes, period)) {
    turns_ = V3d(static_cast<double>(curve.repeat_offset.x) * static_cast<double>(period.x),
                 static_cast<double>(curve.repeat_offset.y) * static_cast<double>(period.y), 0);
  }

  /// Cuts where the chain passes the lines between threads: where it does so lowest, between two loops.
  /// Whether that is possible.
  bool cut(const V2i& threads) {
    const bool along_x = std::abs(turns_.x) >= std::abs(turns_.y);
    const double whole = along_x ? turns_.x : turns_.y;
    const int count =
        along_x ? threads.x * std::abs(curve_.repeat_offset.x) : threads.y * std::abs(curve_.repeat_offset.y);
    if (count == 0 || whole == 0) return false;
    const double pitch = whole / count;
    const auto place = [&](int i) {
      const V3d at = node(i);
      return (along_x ? at.x : at.y) / pitch;
    };
    const double first = std::ceil(place(0));
    for (int k = 0; k < count; ++k) {
      const double border = first + k;
      double lowest = std::numeric_limits<double>::infinity();
      double found = -1;
      const double after = k == 0 ? -curve_.nodes : cuts_.back() + 1e-3;
      const double before = k == 0 ? 2 * curve_.nodes : cuts_.front() + curve_.nodes - 1e-3;
      for (int i = -curve_.nodes; i < 2 * curve_.nodes; ++i) {
        const double from = place(i) - border;
        const double to = place(i + 1) - border;
        if ((from < 0) == (to < 0)) continue;
        const double at = i + from / (from - to);
        const V3d here = position(at);
        const double height = along_x ? here.y : here.z;
        if (at < after || at > before || height >= lowest) continue;
        lowest = height;
        found = at;
      }
      if (!std::isfinite(lowest)) return false;
      cuts_.push_back(found);
    }
    cuts_.push_back(cuts_.front() + curve_.nodes);
    return true;
  }

  const YarnCurve& curve() const { return curve_; }
  int pieces() const { return static_cast<int>(cuts_.size()) - 1; }
  V3d start(int piece) const { return position(cuts_[piece]); }
  /// YarnPlies::phase where the chain begins with the first piece.
  float phase() const {
    const YarnPlies& plies = curve_.plies;
    if (plies.count == 1) return plies.phase;
    const double turned =
        2 * std::numbers::pi * plies.shift * length_at(cuts_[0]) / (frames_.length.back() * plies.count);
    return static_cast<float>(
        std::remainder(static_cast<double>(plies.phase) + turned + angle_at(cuts_[0]), 2 * std::numbers::pi));
  }
  /// The place, in nodes, of a fraction of the piece's length.
  double place_in(int piece, double fraction) const {
    const double from = length_at(cuts_[piece]);
    return place_of_length(from + fraction * (length_at(cuts_[piece + 1]) - from));
  }
  V3d position(double place) const {
    const int i = static_cast<int>(std::floor(place));
    const double s = place - i;
    const double rest = 1 - s;
    const V3d from = node(i);
    const V3d along = node(i + 1) - from;
    const double length = along.length();
    const int within = (i % curve_.nodes + curve_.nodes) % curve_.nodes;
    return from + along * (s * s * (3 - 2 * s)) + frames_.tangent[within] * (length * s * rest * rest) -
           frames_.tangent[within + 1] * (length * s * s * rest);
  }
  V3f squeeze(double place) const {
    const int i = static_cast<int>(std::floor(place));
    const int within = (i % curve_.nodes + curve_.nodes) % curve_.nodes;
    return V3f(squeeze_between(V3d(curve_.squeezes[within]),
                               V3d(curve_.squeezes[(within + 1) % curve_.nodes]), place - i));
  }
  /// Adds the light at a place of the piece, from the stations `light` of the curve, in angles of the piece.
  void add_light(int piece, double place, std::span<const float> light, std::span<float> to) const {
    const double total = frames_.length.back();
    const double at = length_at(place) / total * curve_.stations;
    const double whole = std::floor(at);
    const double begin = length_at(cuts_[piece]) / total;
    for (int i = 0; i < 2; ++i) {
      const double station = whole + i;
      const int own = (static_cast<int>(station) % curve_.stations + curve_.stations) % curve_.stations;
      add_rotated_light(light.subspan(std::size_t{light_values_per_station} * own, light_values_per_station),
                        frames_.closing_angle * (station / curve_.stations - begin) - angle_at(cuts_[piece]),
                        i == 0 ? 1 - (at - whole) : at - whole, curve_.plies.sides != 0, to);
    }
  }

 private:
  V3d node(int i) const {
    const int repeat = static_cast<int>(std::floor(static_cast<double>(i) / curve_.nodes));
    return V3d(nodes_[i - repeat * curve_.nodes]) + turns_ * static_cast<double>(repeat);
  }
  double length_at(double place) const {
    const double repeat = std::floor(place / curve_.nodes);
    const double within = place - repeat * curve_.nodes;
    const int i = std::min(static_cast<int>(within), curve_.nodes - 1);
    const auto& length = frames_.length;
    return repeat * length.back() + length[i] + (within - i) * (length[i + 1] - length[i]);
  }
  double place_of_length(double wanted) const {
    const auto& length = frames_.length;
    const double repeat = std::floor(wanted / length.back());
    const double within = wanted - repeat * length.back();
    const auto next = std::upper_bound(length.begin(), length.end() - 1, within);
    return repeat * curve_.nodes + static_cast<double>(next - length.begin() - 1) +
           (within - *(next - 1)) / (*next - *(next - 1));
  }
  /// From the direction that a piece which begins there counts from to the chain's.
  double angle_at(double place) const {
    const int i = static_cast<int>(std::floor(place));
    const double s = place - i;
    const int within = (i % curve_.nodes + curve_.nodes) % curve_.nodes;
    const V3d tangent = (frames_.tangent[within] * (1 - s) + frames_.tangent[within + 1] * s).normalized();
    const V3d across = frames_.across[within] * (1 - s) + frames_.across[within + 1] * s;
    const V3d own = upward_across(tangent);
    return std::atan2(own.cross(across).dot(tangent), own.dot(across));
  }

  const YarnCurve& curve_;
  std::span<const V3f> nodes_;
  ChainFrames frames_;
  V3d turns_;
  std::vector<double> cuts_;
};

/// Pieces of equal numbers of values, value by value: loops over pieces are vectors.
struct PieceValues {
  int pieces = 0;
  std::vector<float> values;   ///< [value][piece]
  std::vector<float> weights;  ///< of each value's square in a distance
  int values_per_piece() const { return static_cast<int>(weights.size()); }
  float& at(int value, int piece) { return values[std::size_t{1} * value * pieces + piece]; }

  /// Squares of the distances of all pieces to a point.
  void distances(const std::vector<float>& point, std::vector<float>& to) const {
    to.assign(pieces, 0);
    const float* from = values.data();
    for (std::size_t i = 0; i < weights.size(); ++i, from += pieces) {
      const float weight = weights[i];
      const float middle = point[i];
      for (int p = 0; p < pieces; ++p) to[p] += weight * (from[p] - middle) * (from[p] - middle);
    }
  }
  std::vector<float> of(int piece) const {
    std::vector<float> point(weights.size());
    for (std::size_t i = 0; i < weights.size(); ++i) point[i] = values[i * pieces + piece];
    return point;
  }
};

struct Kinds {
  std::vector<int> kind_of;
  std::vector<std::vector<float>> means;
};

/// k-means from the pieces that are farthest from all before them.
Kinds grouped(const PieceValues& all, int max_kinds) {
  constexpr int rounds = 4;
  constexpr float same = 1e-4F;  ///< a square: pieces that differ by rounding
  Kinds kinds;
  std::vector<float> nearest(all.pieces, std::numeric_limits<float>::infinity());
  std::vector<float> distance;
  kinds.kind_of.assign(all.pieces, 0);
  const auto take = [&](int kind) {
    all.distances(kinds.means[kind], distance);
    for (int p = 0; p < all.pieces; ++p) {
      if (distance[p] >= nearest[p]) continue;
      nearest[p] = distance[p];
      kinds.kind_of[p] = kind;
    }
  };
  int farthest = 0;
  for (int k = 0; k < std::min(max_kinds, all.pieces) && nearest[farthest] > same; ++k) {
    kinds.means.push_back(all.of(farthest));
    take(k);
    farthest = static_cast<int>(std::ranges::max_element(nearest) - nearest.begin());
  }
  for (int round = 0; round < rounds; ++round) {
    std::vector<int> counts(kinds.means.size(), 0);
    for (auto& mean : kinds.means) std::ranges::fill(mean, 0.0F);
    for (int p = 0; p < all.pieces; ++p) ++counts[kinds.kind_of[p]];
    for (int i = 0; i < all.values_per_piece(); ++i)
      for (int p = 0; p < all.pieces; ++p)
        kinds.means[kinds.kind_of[p]][i] +=
            all.values[std::size_t{1} * i * all.pieces + p] / static_cast<float>(counts[kinds.kind_of[p]]);
    if (round + 1 == rounds) break;
    // A kind without pieces keeps its place far from all.
    nearest.assign(all.pieces, std::numeric_limits<float>::infinity());
    for (std::size_t k = 0; k < kinds.means.size(); ++k)
      if (counts[k] > 0) take(static_cast<int>(k));
  }
  return kinds;
}

/// To a multiple of the step: numbers that pack well.
V3f on_grid(const V3d& d, double step) {
  return V3f(static_cast<float>(step * std::round(d.x / step)),
             static_cast<float>(step * std::round(d.y / step)),
             static_cast<float>(step * std::round(d.z / step)));
}

/// Turns factors of the functions of the light into numbers whose squares add up to the mean square of the
/// light they make, and back: the functions themselves are far from perpendicular. Upper part of Cholesky's
/// factor.
class OrthonormalLight {
 public:
  OrthonormalLight() {
    const DirectionGrid lights{16, 16};
    for (int l = 0; l < lights.count(); ++l) {
      const auto basis = light_basis(cell_direction(lights, l));
      for (int i = 0; i < count; ++i)
        for (int k = i; k < count; ++k)
          upper_[i][k] += static_cast<double>(basis[i]) * static_cast<double>(basis[k]) / lights.count();
    }
    for (int i = 0; i < count; ++i) {
      for (int k = i; k < count; ++k)
        for (int above = 0; above < i; ++above) upper_[i][k] -= upper_[above][i] * upper_[above][k];
      const double root = std::sqrt(upper_[i][i]);
      for (int k = i; k < count; ++k) upper_[i][k] /= root;
    }
  }
  /// `station`: [angle][light][colour].
  void to_orthonormal(std::span<float> station) const {
    for_each_list(station, [&](float* factors) {
      for (int i = 0; i < count; ++i) factors[3 * i] = static_cast<float>(sum_from(i, i, factors));
    });
  }
  void from_orthonormal(std::span<float> station) const {
    for_each_list(station, [&](float* factors) {
      for (int i = count - 1; i >= 0; --i)
        factors[3 * i] = static_cast<float>(
            (static_cast<double>(factors[3 * i]) - sum_from(i, i + 1, factors)) / upper_[i][i]);
    });
  }

 private:
  static constexpr int count = yarn_light_function_count;
  static void for_each_list(std::span<float> station, const std::function<void(float*)>& visit) {
    for (int angle = 0; angle < angle_function_count; ++angle)
      for (int colour = 0; colour < 3; ++colour) visit(&station[3 * count * angle + colour]);
  }
  double sum_from(int row, int first, const float* factors) const {
    double sum = 0;
    for (int k = first; k < count; ++k) sum += upper_[row][k] * static_cast<double>(factors[3 * k]);
    return sum;
  }
  std::array<std::array<double, count>, count> upper_{};
};

/// Rounds the light of kinds to steps of 1/127 to 2/127 of the largest value of its colour, and moments to
/// 1/32: numbers that pack well.
void round_light(std::vector<float>& light) {
  std::array<float, 3> largest{};
  const auto is_moment = [](std::size_t i) {
    return i % light_values_per_station >= transfer_values_per_station;
  };
  const auto colour_of = [](std::size_t i) { return i % light_values_per_station % 3; };
  for (std::size_t i = 0; i < light.size(); ++i)
    if (!is_moment(i)) largest[colour_of(i)] = std::max(largest[colour_of(i)], std::abs(light[i]));
  for (std::size_t i = 0; i < light.size(); ++i) {
    const float wanted = largest[colour_of(i)] / 127;
    const float step = is_moment(i) ? 0x1p-5F : wanted > 0 ? std::exp2(std::ceil(std::log2(wanted))) : 1;
    light[i] = step * std::round(light[i] / step);
  }
}

/// Numbers of the values of pieces: shapes, squeezes if any, light from above and, if known, through.
struct Layout {
  int pieces = 0;
  int nodes = 0, stations = 0;  ///< of each piece
  bool squashed = false, through = false;
  double radius = std::numeric_limits<double>::infinity();  ///< mm, the least

  Layout(const std::vector<CutCurve>& curves, const YarnData& data) : through(!data.light_through.empty()) {
    int all_stations = 0;
    for (const CutCurve& c : curves) {
      pieces += c.pieces();
      all_stations += c.curve().stations;
      squashed = squashed || !c.curve().squeezes.empty();
      radius = std::min(radius, static_cast<double>(c.curve().radius));
    }
    nodes = (static_cast<int>(data.nodes.size()) + pieces - 1) / pieces;
    stations = (all_stations + pieces - 1) / pieces;
  }
  int sides() const { return through ? 2 : 1; }
  int shape_values() const { return 3 * nodes * (squashed ? 2 : 1); }
  int light_values() const { return light_values_per_station * stations; }
  int values() const { return shape_values() + sides() * light_values(); }
  bool is_moment(int value) const {
    return (value - shape_values()) % light_values_per_station >= transfer_values_per_station;
  }
  /// Positions on its multiples pack well, mm.
  double step() const { return std::exp2(std::floor(std::log2(radius / 256))); }
};

PieceValues values_of(const std::vector<CutCurve>& curves, const YarnData& data, const Layout& layout,
                      const OrthonormalLight& orthonormal) {
  PieceValues all{layout.pieces, {}, std::vector<float>(layout.values())};
  all.values.resize(all.weights.size() * layout.pieces);
  std::vector<float> light(light_values_per_station);
  std::size_t first_station = 0;
  int piece = 0;
  for (const CutCurve& c : curves) {
    for (int p = 0; p < c.pieces(); ++p, ++piece) {
      const V3d way = c.start(p + 1) - c.start(p);
      for (int i = 0; i < layout.nodes; ++i) {
        const double fraction = static_cast<double>(i) / layout.nodes;
        const double place = c.place_in(p, fraction);
        const V3d shape = c.position(place) - c.start(p) - way * fraction;
        V3f squeeze = c.curve().squeezes.empty() ? V3f(0, 0, 0) : c.squeeze(place);
        if (squeeze.x + squeeze.y < 0) squeeze = -squeeze;  // of either sign
        for (int axis = 0; axis < 3; ++axis) {
          all.at(3 * i + axis, piece) = static_cast<float>(shape[axis]);
          if (layout.squashed) all.at(3 * (layout.nodes + i) + axis, piece) = squeeze[axis];
        }
      }
      int value = layout.shape_values();
      for (int side = 0; side < layout.sides(); ++side) {
        const std::span of_curve =
            std::span(side == 0 ? data.station_light : data.light_through).subspan(first_station);
        for (int s = 0; s < layout.stations; ++s) {
          std::ranges::fill(light, 0.0F);
          c.add_light(p, c.place_in(p, static_cast<double>(s) / layout.stations), of_curve, light);
          orthonormal.to_orthonormal(light);
          for (const float number : light) all.at(value++, piece) = number;
        }
      }
    }
    first_station += std::size_t{light_values_per_station} * c.curve().stations;
  }
  return all;
}

/// Deviations of 0.035 radii, of a tenth in squeezes and of 15 % of the light are 1; moments do not count.
void weigh(const Layout& layout, PieceValues& all) {
  double light_square = 0;
  for (int i = layout.shape_values(); i < layout.values(); ++i)
    for (int p = 0; p < all.pieces && !layout.is_moment(i); ++p)
      light_square += static_cast<double>(all.at(i, p)) * static_cast<double>(all.at(i, p));
  const double of_light = std::max(light_square / all.pieces * 0.15 * 0.15, 1e-20);
  const double of_shape = layout.nodes * 0.035 * 0.035 * layout.radius * layout.radius;
  for (int i = 0; i < layout.values(); ++i)
    all.weights[i] = static_cast<float>(i >= layout.shape_values()
                                            ? (layout.is_moment(i) ? 0 : 1 / of_light)
                                            : 1 / (i >= 3 * layout.nodes ? layout.nodes * 0.01 : of_shape));
}

}  // namespace

YarnData find_copies(const YarnData& data, const V2f& period, const V2i& threads, int max_kinds) {
  std::vector<CutCurve> curves;
  bool possible = true;
  for_each_curve(data, [&](std::size_t, const YarnCurve& curve, std::span<const V3f> nodes) {
    possible = possible && curves.emplace_back(curve, nodes, period).cut(threads);
  });
  if (!possible) return data;
  const Layout layout(curves, data);
  const OrthonormalLight orthonormal;
  PieceValues all = values_of(curves, data, layout, orthonormal);
  weigh(layout, all);
  Kinds kinds = grouped(all, max_kinds);

  YarnData result = data;
  YarnCopies& copies = result.copies = {};
  copies.nodes = layout.nodes;
  copies.stations = layout.stations;
  copies.kind_of = std::move(kinds.kind_of);
  for (std::size_t c = 0; c < curves.size(); ++c) {
    result.curves[c].nodes = curves[c].pieces() * layout.nodes;
    result.curves[c].plies.phase = curves[c].phase();
    for (int p = 0; p < curves[c].pieces(); ++p)
      copies.starts.push_back(on_grid(curves[c].start(p), layout.step()));
  }
  for (std::vector<float>& mean : kinds.means) {
    for (int i = 0; i < layout.shape_values(); i += 3) {
      const V3d vector(mean[i], mean[i + 1], mean[i + 2]);
      if (i < 3 * layout.nodes)
        copies.shape.push_back(on_grid(vector, layout.step()));
      else  // The flattest ones have the largest that validate() takes.
        copies.squeezes.push_back(on_grid(vector * (1 - 0x1p-7), 0x1p-8));
    }
    for (int i = layout.shape_values(); i < layout.values(); i += light_values_per_station)
      orthonormal.from_orthonormal(std::span(mean).subspan(i, light_values_per_station));
    const auto begin = mean.begin() + layout.shape_values();
    const auto end = begin + layout.light_values();
    copies.light.insert(copies.light.end(), begin, end);
    copies.light_through.insert(copies.light_through.end(), end, mean.end());
  }
  round_light(copies.light);
  round_light(copies.light_through);
  const YarnCounts counts = counts_of(result);
  const FabricLimits limits;
  if (counts.nodes > limits.nodes || counts.stations > limits.stations) return data;
  expand_copies(result, period);
  return validate(result, period) ? result : data;
}

}  // namespace selvedge
