#include "converter/mesh/map_joints.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <tuple>
#include <vector>

#include "format/base/disjoint_sets.h"

namespace selvedge {
namespace {

/// Where a curve passes a border of stitches, the ends of two.
struct Border {
  int curve = 0;
  int node = 0;          ///< of its curve
  V3d lattice{0, 0, 0};  ///< where the border, and its line, begin
};

bool runs_up(const YarnCurve& curve) { return curve.repeat_offset.x == 0; }

/// The borders of a curve begin at this one: one for each stitch, at its left or lower side.
std::vector<int> first_borders(const YarnData& yarns) {
  std::vector<int> first{0};
  for (const YarnCurve& curve : yarns.curves)
    first.push_back(first.back() + (runs_up(curve) ? yarns.map.kinds.y : yarns.map.kinds.x));
  return first;
}

/// The smallest border of each set that the map joins, by the order of first_borders().
std::vector<int> joined_borders(const YarnData& yarns) {
  const YarnMap& map = yarns.map;
  const V2i n = map.kinds;
  const std::vector<int> first = first_borders(yarns);
  DisjointSets sets(first.back());
  const auto join = [&](int a, int b) {
    const auto [low, high] = std::minmax({sets.root(a), sets.root(b)});
    sets.unite(high, low);
  };
  // Curves of each row and column, in their order.
  std::array<std::vector<std::vector<int>>, 2> curves{std::vector<std::vector<int>>(n.y),
                                                      std::vector<std::vector<int>>(n.x)};
  for (std::size_t c = 0; c < yarns.curves.size(); ++c)
    curves[runs_up(yarns.curves[c]) ? 1 : 0][map.lines[c]].push_back(static_cast<int>(c));
  for (int y = 0; y < map.size.y; ++y)
    for (int x = 0; x < map.size.x; ++x) {
      const int own = map.shown[y * map.size.x + x];
      const int right = map.shown[y * map.size.x + (x + 1) % map.size.x];
      const int above = map.shown[(y + map.size.y - 1) % map.size.y * map.size.x + x];
      const auto& from = curves[0][own / n.x];
      const auto& to = curves[0][right / n.x];
      for (std::size_t k = 0; k < std::min(from.size(), to.size()); ++k)
        join(first[from[k]] + (own % n.x + 1) % n.x, first[to[k]] + right % n.x);
      const auto& up_from = curves[1][own % n.x];
      const auto& up_to = curves[1][above % n.x];
      for (std::size_t k = 0; k < std::min(up_from.size(), up_to.size()); ++k)
        join(first[up_from[k]] + (n.y - own / n.x) % n.y, first[up_to[k]] + n.y - 1 - above / n.x);
    }
  std::vector<int> joined;
  for (int border = 0; border < first.back(); ++border) joined.push_back(sets.root(border));
  return joined;
}

/// Nodes of a curve, and how it goes on beyond them.
struct Chain {
  const YarnCurve& curve;
  std::span<const V3f> nodes;
  V3d turns;
  V3d at(int i) const {
    const int count = curve.nodes;
    const int repeat = i >= 0 ? i / count : -((count - 1 - i) / count);
    return V3d(nodes[i - repeat * count]) + turns * static_cast<double>(repeat);
  }
  V3d tangent(int i) const {
    const V3d before = at(i) - at(i - 1);
    const V3d after = at(i + 1) - at(i);
    return (before * after.length2() + after * before.length2()).normalized();
  }
};

V3d turns_of(const YarnCurve& curve, const V2f& period) {
  return {curve.repeat_offset.x * static_cast<double>(period.x),
          curve.repeat_offset.y * static_cast<double>(period.y), 0};
}

/// The borders of all curves, at these nodes, or at those that lie on them.
std::vector<Border> borders_of(const YarnData& yarns, const V2f& period,
                               std::span<const std::vector<int>> border_nodes = {}) {
  std::vector<Border> borders;
  for_each_curve(yarns, [&](std::size_t c, const YarnCurve& curve, std::span<const V3f> nodes) {
    const V2i n = yarns.map.kinds;
    const int axis = runs_up(curve) ? 1 : 0;
    V3d lattice(0, 0, 0);
    lattice[1 - axis] = static_cast<double>(period[1 - axis]) / n[1 - axis] *
                        (axis == 1 ? yarns.map.lines[c] : n.y - 1 - yarns.map.lines[c]);
    const double cell = static_cast<double>(period[axis]) / n[axis];
    int node = 0;
    for (int k = 0; k < n[axis]; ++k) {
      lattice[axis] = k * cell;
      const auto is_off = [&] {
        return std::abs(static_cast<double>(nodes[node][axis]) - k * cell) > 1e-5 * cell;
      };
      while (border_nodes.empty() && node + 1 < curve.nodes && is_off()) ++node;
      borders.push_back({static_cast<int>(c), border_nodes.empty() ? node : border_nodes[c][k], lattice});
    }
  });
  return borders;
}

/// A place of a chain: node, and fraction of its segment.
struct JointPlace {
  double at;
  V3d position;
};

JointPlace place_at(const Chain& chain, double at) {
  const int i = static_cast<int>(std::floor(at));
  return {at, chain.at(i) + (chain.at(i + 1) - chain.at(i)) * (at - i)};
}

/// Lengths of a chain from one node up to the next ones.
std::vector<double> lengths_of(const Chain& chain, int from, int to) {
  std::vector<double> lengths{0};
  for (int i = from; i < to; ++i)
    lengths.push_back(lengths.back() + (chain.at(i + 1) - chain.at(i)).length());
  return lengths;
}

/// Where a length ends, in nodes.
double node_at(const std::vector<double>& lengths, double length) {
  const auto i = std::ranges::upper_bound(lengths, length) - lengths.begin() - 1;
  return static_cast<double>(i) + (length - lengths[i]) / (lengths[i + 1] - lengths[i]);
}

/// Where a curve passes the borders of its stitches; of yarn that passes one several times, nearest to where
/// the stitch begins (`begins` of set_map()).
std::vector<JointPlace> passages_of(const Chain& chain, int stitches, double cell,
                                    const std::vector<double>* begins) {
  const int axis = runs_up(chain.curve) ? 1 : 0;
  const int count = chain.curve.nodes;
  const std::vector<double> lengths = lengths_of(chain, 0, chain.curve.nodes);
  std::vector<JointPlace> passages;
  for (int k = 0; k < stitches; ++k) {
    std::vector<double> passed;
    for (int i = -count; i < 2 * count; ++i) {
      const double from = chain.at(i)[axis] - k * cell;
      const double to = chain.at(i + 1)[axis] - k * cell;
      if ((from < 0) != (to < 0)) passed.push_back(i + from / (from - to));
    }
    double best = passed[passed.size() / 2];
    if (begins != nullptr) {
      const double begin = node_at(lengths, (*begins)[k] * lengths.back());
      best = *std::ranges::min_element(passed, {}, [&](double at) { return std::abs(at - begin); });
    }
    passages.push_back(place_at(chain, best));
  }
  return passages;
}

/// Moves a knit so that the feet of its loops stand in rows and columns, and all around them with them.
/// `begins` as of set_map().
void straighten(YarnCell& cell, std::span<const std::vector<double>> begins) {
  constexpr double loop_length = 1.5;  // of its stitch's width, at least
  const V2i n = cell.yarns.map.kinds;
  const V2d stitch = cell.period / V2d(n);
  std::vector<V2d> off(std::size_t{1} * n.x * n.y, V2d(0, 0));  // [row][border]
  std::vector<int> feet(off.size());
  for_each_curve(cell.yarns, [&](std::size_t c, const YarnCurve& curve, std::span<const V3f> nodes) {
    const Chain chain{curve, nodes, turns_of(curve, V2f(cell.period))};
    const std::vector<double> lengths = lengths_of(chain, 0, chain.curve.nodes);
    const auto is_loop = [&](int k) {
      const double end = k + 1 < n.x ? begins[c][k + 1] : 1;
      return (end - begins[c][k]) * lengths.back() > loop_length * stitch.x;
    };
    const int row = n.y - 1 - cell.yarns.map.lines[c];
    for (int k = 0; k < n.x; ++k) {
      if (!is_loop(k) && !is_loop((k + n.x - 1) % n.x)) continue;
      const V3d foot = place_at(chain, node_at(lengths, begins[c][k] * lengths.back())).position;
      off[row * n.x + k] += V2d(foot.x - k * stitch.x, foot.y - row * stitch.y);
      ++feet[row * n.x + k];
    }
  });
  V2d mean(0, 0);
  for (std::size_t b = 0; b < off.size(); ++b) mean += off[b] /= std::max(feet[b], 1);
  mean /= static_cast<double>(off.size());
  const auto at = [&](int k, int row) {
    return off[((row % n.y) + n.y) % n.y * n.x + ((k % n.x) + n.x) % n.x] - mean;
  };
  for (V3f& node : cell.yarns.nodes) {
    const V2d place((static_cast<double>(node.x) - mean.x) / stitch.x,
                    (static_cast<double>(node.y) - mean.y) / stitch.y);
    const V2i low(static_cast<int>(std::floor(place.x)), static_cast<int>(std::floor(place.y)));
    const V2d part = place - V2d(low);
    const V2d moved = (at(low.x, low.y) * (1 - part.x) + at(low.x + 1, low.y) * part.x) * (1 - part.y) +
                      (at(low.x, low.y + 1) * (1 - part.x) + at(low.x + 1, low.y + 1) * part.x) * part.y;
    node -= V3f(V3d(moved.x, moved.y, 0));
  }
}

/// Gives a curve nodes where its stitches begin, and lets it begin there; returns these nodes.
std::vector<int> add_border_nodes(const std::vector<JointPlace>& begins, const V2f& period, YarnCurve& curve,
                                  std::vector<V3f>& nodes) {
  constexpr double near = 0.25;  // of a segment, within which a border takes the place of a node
  const int count = curve.nodes;
  const Chain chain{curve, nodes, turns_of(curve, period)};
  const double begin = begins.front().at;
  std::vector<JointPlace> places = begins;
  for (int i = static_cast<int>(std::ceil(begin)); i < begin + count - near; ++i) {
    const auto is_near = [&](const JointPlace& place) { return std::abs(place.at - i) < near; };
    if (std::ranges::none_of(begins, is_near)) places.push_back({1.0 * i, chain.at(i)});
  }
  std::ranges::sort(places, {}, &JointPlace::at);
  std::vector<int> borders;
  std::vector<V3f> squeezes;
  std::vector<V3f> all;
  for (const auto& [at, position] : places) {
    if (borders.size() < begins.size() && begins[borders.size()].at == at)
      borders.push_back(static_cast<int>(all.size()));
    all.emplace_back(position);
    const int i = (static_cast<int>(std::floor(at)) + count) % count;
    if (!curve.squeezes.empty())
      squeezes.emplace_back(
          squeeze_between(V3d(curve.squeezes[i]), V3d(curve.squeezes[(i + 1) % count]), at - std::floor(at)));
  }
  curve.nodes = static_cast<int>(all.size());
  curve.squeezes = std::move(squeezes);
  nodes = std::move(all);
  return borders;
}

/// Means over the borders that are joined, at each of them.
template <class Value>
std::vector<Value> means_of(const std::vector<Value>& values, const std::vector<int>& joined) {
  std::vector<Value> means = values;
  std::vector<double> counts(values.size(), 1);
  for (std::size_t b = 0; b < values.size(); ++b) {
    const std::size_t first = joined[b];
    if (first == b) continue;
    means[first] += values[b];
    ++counts[first];
  }
  for (std::size_t b = 0; b < values.size(); ++b) {
    const std::size_t first = joined[b];
    if (first == b) means[b] /= counts[b];
    means[b] = means[first];
  }
  return means;
}

/// End of a stitch; its place counts from the border's lattice.
struct End {
  V3d place{0, 0, 0}, tangent{0, 0, 0}, squeeze{0, 0, 0};
  void operator+=(const End& e) { place += e.place, tangent += e.tangent, squeeze += e.squeeze; }
  void operator/=(double count) { place /= count, tangent.normalize(), squeeze /= count; }
};

/// The ends at all borders; squeezes, of which g and -g are one, as at the first that each is joined to.
std::vector<End> ends_of(const YarnData& yarns, const V2f& period, const std::vector<Border>& borders,
                         const std::vector<int>& joined) {
  std::vector<End> ends;
  for_each_curve(yarns, [&](std::size_t c, const YarnCurve& curve, std::span<const V3f> nodes) {
    const Chain chain{curve, nodes, turns_of(curve, period)};
    for (; ends.size() < borders.size() && borders[ends.size()].curve == static_cast<int>(c);) {
      const Border& border = borders[ends.size()];
      const std::size_t first = joined[ends.size()];
      End& end = ends.emplace_back(End{chain.at(border.node) - border.lattice, chain.tangent(border.node)});
      if (!curve.squeezes.empty()) end.squeeze = V3d(curve.squeezes[border.node]);
      if (end.squeeze.dot(ends[first].squeeze) < 0) end.squeeze = -end.squeeze;
    }
  });
  return ends;
}

/// Moves the yarn between borders so that its ends are the means.
void join_ends(YarnData& yarns, const V2f& period, const std::vector<Border>& borders) {
  const std::vector<int> joined = joined_borders(yarns);
  const std::vector<End> ends = ends_of(yarns, period, borders, joined);
  std::vector<End> means = means_of(ends, joined);
  for (std::size_t b = 0; b < means.size(); ++b)
    means[b].place[runs_up(yarns.curves[borders[b].curve]) ? 1 : 0] = 0;
  constexpr double reach_radii = 5;
  std::size_t first_border = 0;
  std::size_t first_node = 0;
  for (YarnCurve& curve : yarns.curves) {
    const int count = runs_up(curve) ? yarns.map.kinds.y : yarns.map.kinds.x;
    const std::vector<V3f> given(yarns.nodes.begin() + first_node,
                                 yarns.nodes.begin() + first_node + curve.nodes);
    const Chain chain{curve, given, turns_of(curve, period)};
    for (int k = 0; k < count; ++k) {
      const std::size_t a = first_border + k;
      const std::size_t b = first_border + (k + 1) % count;
      const int from = borders[a].node;
      const int to = k + 1 == count ? curve.nodes : borders[b].node;
      const std::vector<double> lengths = lengths_of(chain, from, to);
      for (int i = from; i < to; ++i) {
        // Over a few radii: the rest of a loop stays where it touches others.
        const double s = lengths[i - from] / lengths.back();
        const double rest = 1 - s;
        const double reach = std::min(0.5 * lengths.back(), reach_radii * static_cast<double>(curve.radius));
        V3d move(0, 0, 0);
        for (const auto& [border, away, sense] :
             {std::tuple(a, s * lengths.back(), 1.0), std::tuple(b, rest * lengths.back(), -1.0)}) {
          const double far = std::min(1.0, away / reach);
          move += (means[border].place - ends[border].place) * ((1 - far) * (1 - far) * (1 + 2 * far)) +
                  (means[border].tangent - ends[border].tangent) * (sense * away * (1 - far) * (1 - far));
        }
        yarns.nodes[first_node + i] = V3f(chain.at(i) + move);
        if (curve.squeezes.empty()) continue;
        V3d squeeze(curve.squeezes[i]);
        for (const auto& [border, part] : {std::pair(a, rest), std::pair(b, s)}) {
          const V3d change = means[border].squeeze - ends[border].squeeze;
          const double sense = ends[border].squeeze.dot(V3d(curve.squeezes[i])) < 0 ? -1 : 1;
          squeeze += change * (sense * part * part * (3 - 2 * part));
        }
        // Less than the largest that validate() takes.
        const double largest = 0.999 * std::sqrt(1 - static_cast<double>(min_flattening));
        curve.squeezes[i] = V3f(squeeze * std::min(1.0, largest / std::max(squeeze.length(), 1e-9)));
      }
    }
    first_border += count;
    first_node += curve.nodes;
  }
}

/// Turns coefficients of light about an axis to count angles from upwards (`sense` 1), or back (-1).
struct Turn {
  double angle = 0;
  double last_order = 2;  ///< of the last two functions of the angle
  template <class Values>
  void apply(Values& values, int sense) const {
    const auto turn = [&](int first, int second, double by) {
      const double cosine = std::cos(by);
      const double sine = sense * std::sin(by);
      const double c = values[first];
      values[first] = c * cosine + values[second] * sine;
      values[second] = values[second] * cosine - c * sine;
    };
    constexpr int each = 3 * yarn_light_function_count;
    for (int i = 0; i < each; ++i) {
      turn(each + i, 2 * each + i, angle);
      turn(3 * each + i, 4 * each + i, last_order * angle);
    }
    for (int m = transfer_values_per_station; m < light_values_per_station; m += angle_function_count) {
      turn(m + 1, m + 2, angle);
      turn(m + 3, m + 4, last_order * angle);
    }
  }
};

/// The stations about a border.
struct LightEnd {
  int first = 0, stations = 0;  ///< of its curve
  double station = 0;
  double reach = 1;  ///< stations that follow it
  Turn turn;
  std::size_t offset(int k) const {
    return std::size_t{light_values_per_station} * (first + ((k % stations) + stations) % stations);
  }
};
using LightValues = Eigen::Array<double, light_values_per_station, 1>;
using StoredLight = Eigen::Array<float, light_values_per_station, 1>;

std::vector<LightEnd> light_ends(const YarnData& yarns, const V2f& period) {
  std::vector<LightEnd> ends;
  const std::vector<Border> borders = borders_of(yarns, period);
  int first = 0;
  for_each_curve(yarns, [&](std::size_t c, const YarnCurve& curve, std::span<const V3f> nodes) {
    const Chain chain{curve, nodes, turns_of(curve, period)};
    const auto segments = make_segments(curve, nodes, period);
    for (; ends.size() < borders.size() && borders[ends.size()].curve == static_cast<int>(c);) {
      const int node = borders[ends.size()].node;
      const Yarns::Segment& segment = segments[std::size_t{1} * node * curve.plies.divisions];
      const V3d tangent = chain.tangent(node);
      const V3d across(segment.across[0]);
      const double angle = std::atan2(tangent.cross(across).z, across.z);
      const int count = runs_up(curve) ? yarns.map.kinds.y : yarns.map.kinds.x;
      ends.push_back({first,
                      curve.stations,
                      static_cast<double>(segment.start_station),
                      std::max(1.0, 0.25 * curve.stations / count),
                      {angle, curve.plies.count > 1 && curve.plies.sides == 1 ? 1.0 : 2.0}});
    }
    first += curve.stations;
  });
  return ends;
}

LightValues light_at(const std::vector<float>& light, const LightEnd& end) {
  const int whole = static_cast<int>(end.station);
  const double fraction = end.station - whole;
  const auto stored = [&](int k) {
    return Eigen::Map<const StoredLight>(&light[end.offset(k)]).cast<double>();
  };
  LightValues values = stored(whole) * (1 - fraction) + stored(whole + 1) * fraction;
  end.turn.apply(values, 1);
  return values;
}

/// Means at joined borders.
std::vector<LightValues> mean_light(const std::vector<float>& light, const std::vector<LightEnd>& ends,
                                    const std::vector<int>& joined) {
  std::vector<LightValues> lights;
  for (const LightEnd& end : ends) lights.push_back(light_at(light, end));
  return means_of(lights, joined);
}

}  // namespace

Result<void> set_map(YarnCell& cell, const YarnMap& map, std::span<const int> yarns_of_rows,
                     std::span<const std::vector<double>> begins) {
  constexpr int steps_per_radius = 64;
  constexpr int fine_steps = 32;  // of a step
  YarnData& yarns = cell.yarns;
  yarns.map = map;
  for (int x = 0; x < map.kinds.x && yarns_of_rows.empty(); ++x) yarns.map.lines.push_back(x);
  for (int y = map.kinds.y - 1; y >= 0; --y)
    yarns.map.lines.insert(yarns.map.lines.end(),
                           yarns_of_rows.empty() ? 1 : yarns_of_rows[map.kinds.y - 1 - y], y);
  const auto runs_on = [](const YarnCurve& curve) {
    return curve.repeat_offset == V2i(1, 0) || curve.repeat_offset == V2i(0, 1);
  };
  if (yarns.map.lines.size() != yarns.curves.size() || !std::ranges::all_of(yarns.curves, runs_on))
    return fail(Code::mesh_invalid, "", "--kinds", "its yarns are no rows and columns of stitches");
  double radius = cell.period.x;
  for (const YarnCurve& curve : yarns.curves)
    radius = std::min(radius, static_cast<double>(ply_or_yarn_radius(curve)));
  const double step = std::exp2(std::floor(std::log2(radius / steps_per_radius)));
  V3d scale(1, 1, 1);
  for (int axis = 0; axis < 2; ++axis) {
    const double whole = map.kinds[axis] * step * std::round(cell.period[axis] / map.kinds[axis] / step);
    scale[axis] = whole / cell.period[axis];
    cell.period[axis] = whole;
  }
  const V2f period(cell.period);
  for (V3f& node : yarns.nodes) node = V3f(V3d(node) * scale);
  if (!begins.empty()) straighten(cell, begins);
  std::vector<V3f> all;
  std::vector<std::vector<int>> border_nodes;
  std::size_t first = 0;
  for (std::size_t c = 0; c < yarns.curves.size(); ++c) {
    YarnCurve& curve = yarns.curves[c];
    const auto from = yarns.nodes.begin() + static_cast<std::ptrdiff_t>(first);
    std::vector<V3f> own(from, from + curve.nodes);
    first += own.size();
    const int axis = runs_up(curve) ? 1 : 0;
    const auto places =
        passages_of({curve, own, turns_of(curve, period)}, map.kinds[axis],
                    cell.period[axis] / map.kinds[axis], begins.empty() ? nullptr : &begins[c]);
    border_nodes.push_back(add_border_nodes(places, period, curve, own));
    all.insert(all.end(), own.begin(), own.end());
  }
  yarns.nodes = std::move(all);
  // Several times: directions follow from the moved nodes.
  for (int k = 0; k < 4; ++k) join_ends(yarns, period, borders_of(yarns, period, border_nodes));
  move_to_ground(cell);
  const auto fine = static_cast<float>(step / fine_steps);
  for (V3f& node : yarns.nodes)
    for (int i = 0; i < 3; ++i) node[i] = fine * std::round(node[i] / fine);
  return {};
}

void join_light(YarnData& yarns, const V2f& period) {
  constexpr int sweeps = 8;  // stations of a weave lie between two joints
  const std::vector<int> joined = joined_borders(yarns);
  const std::vector<LightEnd> ends = light_ends(yarns, period);
  for (std::vector<float>* light : {&yarns.station_light, &yarns.light_through}) {
    for (int sweep = 0; sweep < sweeps && !light->empty(); ++sweep) {
      const std::vector<LightValues> means = mean_light(*light, ends, joined);
      for (std::size_t b = 0; b < ends.size(); ++b) {
        const LightEnd& end = ends[b];
        LightValues change = means[b] - light_at(*light, end);
        end.turn.apply(change, -1);
        const int whole = static_cast<int>(end.station);
        const double fraction = end.station - whole;
        const auto weight = [&](int k) {
          return std::max(0.0, 1 - std::abs(k - end.station) / (end.reach + 1));
        };
        const double sum = (1 - fraction) * weight(whole) + fraction * weight(whole + 1);
        const int reach = static_cast<int>(std::ceil(end.reach)) + 1;
        for (int k = whole - reach; k <= whole + 1 + reach; ++k)
          Eigen::Map<StoredLight>(&(*light)[end.offset(k)]) += (change * weight(k) / sum).cast<float>();
      }
    }
  }
}

JointGaps joint_gaps(const YarnData& yarns, const V2f& period) {
  JointGaps gaps;
  const std::vector<int> joined = joined_borders(yarns);
  const std::vector<Border> borders = borders_of(yarns, period);
  const std::vector<End> ends = ends_of(yarns, period, borders, joined);
  const std::vector<LightEnd> light = light_ends(yarns, period);
  std::vector<LightValues> means;
  if (!yarns.station_light.empty()) means = mean_light(yarns.station_light, light, joined);
  const auto keep = [](double& gap, double other) { gap = std::max(gap, other); };
  for (std::size_t b = 0; b < ends.size(); ++b) {
    const End& one = ends[b];
    const End& other = ends[joined[b]];
    const auto radius = static_cast<double>(yarns.curves[borders[b].curve].radius);
    keep(gaps.place_radii, (one.place - other.place).length() / radius);
    const double cosine = std::min(1.0, one.tangent.dot(other.tangent));
    keep(gaps.degrees, std::acos(cosine) * 180 / std::numbers::pi);
    keep(gaps.squeeze, (one.squeeze - other.squeeze).length());
    if (means.empty()) continue;
    const auto of_transfer = [](const LightValues& all) { return all.head(transfer_values_per_station); };
    const double whole = of_transfer(means[b]).matrix().norm();
    if (whole > 0)
      keep(gaps.light,
           of_transfer(light_at(yarns.station_light, light[b]) - means[b]).matrix().norm() / whole);
  }
  return gaps;
}

}  // namespace selvedge
