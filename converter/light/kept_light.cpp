#include "converter/light/kept_light.h"

#include <algorithm>
#include <cmath>

namespace selvedge {
namespace {

/// Yarn that lies closer to its former place, in radii, is where it was.
constexpr float same_place = 0.3F;
/// Yarn that lies so, some stitches away, lies alike; and the least alike from which light is borrowed.
constexpr float alike_place = 0.6F;
constexpr float max_unlike_radii = 2;
/// Stitches each way from which light is borrowed.
constexpr int field_reach = 10;
/// Radii about a change in which light is another, and from where it comes.
constexpr float changed_radii = 6;
constexpr float lit_radii = 14;

struct Place {
  YarnFrame frame;
  int curve, station;
  std::size_t number, next;  ///< among all stations: of this one and of the next of its curve
};

std::vector<Place> places_of(const YarnData& data, const V2f& period) {
  YarnData bare{data.curves, data.nodes, {}, {}};
  for (YarnCurve& curve : bare.curves) curve.hairs = {};
  const Yarns yarns(std::move(bare), period);
  std::vector<Place> places;
  const auto& curves = yarns.data().curves;
  for (int c = 0; c < static_cast<int>(curves.size()); ++c) {
    const std::size_t first = places.size();
    for (int s = 0; s < curves[c].stations; ++s)
      places.push_back({yarns.frame_at(c, s), c, s, places.size(), first + (s + 1) % curves[c].stations});
  }
  return places;
}

/// Points of a repeat in square cells.
class Buckets {
 public:
  Buckets(const V2f& period, float reach) : period_(period) {
    for (int k = 0; k < 2; ++k) count_[k] = std::clamp(static_cast<int>(period[k] / reach), 1, 1024);
    cells_.resize(static_cast<std::size_t>(count_.x) * count_.y);
  }
  /// The way between two points, to the nearest of their repeats.
  V3f way(const V3f& from, const V3f& to) const {
    V3f d = to - from;
    for (int k = 0; k < 2; ++k) d[k] -= std::round(d[k] / period_[k]) * period_[k];
    return d;
  }
  void add(const V3f& point, std::size_t number) {
    cells_[cell(at(point, 0), at(point, 1))].emplace_back(point, number);
  }
  /// Calls visit(point, number) for those nearer than the reach, and others.
  template <class Visit>
  void for_each_near(const V3f& point, const Visit& visit) const {
    for (int y = 0; y < std::min(count_.y, 3); ++y)
      for (int x = 0; x < std::min(count_.x, 3); ++x)
        for (const auto& [other, number] : cells_[cell(at(point, 0) + x - 1, at(point, 1) + y - 1)])
          visit(other, number);
  }
  bool has_within(const V3f& point, float distance) const {
    bool found = false;
    for_each_near(point, [&](const V3f& other, std::size_t) {
      const V3f d = way(point, other);
      found = found || d.x * d.x + d.y * d.y < distance * distance;
    });
    return found;
  }

 private:
  int at(const V3f& point, int k) const {
    return static_cast<int>(std::floor(point[k] / period_[k] * static_cast<float>(count_[k])));
  }
  std::size_t cell(int x, int y) const {
    const auto wrapped = [](int i, int n) { return (i % n + n) % n; };
    return static_cast<std::size_t>(wrapped(y, count_.y)) * count_.x + wrapped(x, count_.x);
  }
  V2f period_;
  V2i count_;
  std::vector<std::vector<std::pair<V3f, std::size_t>>> cells_;
};

/// Adds `weight` times a station's light, which counts angles from another direction.
void add_turned(const float* from, const Place& place, const YarnFrame& frame, bool sides, float weight,
                float* to) {
  const V3f& across = place.frame.across;
  const float c = across.dot(frame.across);
  const float s = across.dot(frame.tangent.cross(frame.across));
  const auto turn = [&](int stride, int values, int offset) {
    for (int k = 0; k < values; ++k) {
      const float* const f = from + offset + k;
      float* const t = to + offset + k;
      t[0] += weight * f[0];
      for (int pair = 1; pair < angle_function_count; pair += 2) {
        const bool doubled = pair > 1 && !sides;
        const float cosine = doubled ? c * c - s * s : c;
        const float sine = doubled ? 2 * c * s : s;
        t[pair * stride] += weight * (cosine * f[pair * stride] - sine * f[(pair + 1) * stride]);
        t[(pair + 1) * stride] += weight * (sine * f[pair * stride] + cosine * f[(pair + 1) * stride]);
      }
    }
  };
  turn(3 * yarn_light_function_count, 3 * yarn_light_function_count, 0);
  for (int n = 0; n < light_moment_count; ++n)
    turn(1, 1, transfer_values_per_station + n * angle_function_count);
}

}  // namespace

bool relight_near_changes(YarnData& data, const V2f& period, std::span<const V3f> through, const Yarns& last,
                          LineLightOptions options, const V2f& stitch) {
  if (period != last.period()) return false;
  const auto values = static_cast<std::size_t>(light_values_per_station);
  const bool borrows = stitch != V2f(0);
  const std::vector<Place> places = places_of(data, period);
  const std::vector<Place> before = places_of(last.data(), period);
  std::vector<V3f> steps{V3f(0)};
  for (int row = -field_reach; borrows && row <= field_reach; ++row)
    for (int column = -field_reach; column <= field_reach; ++column)
      steps.emplace_back(stitch.x * static_cast<float>(column), stitch.y * static_cast<float>(row), 0);
  std::stable_sort(steps.begin(), steps.end(),
                   [](const V3f& a, const V3f& b) { return a.length2() < b.length2(); });
  float thickest = 0;
  for (const YarnCurve& curve : data.curves) thickest = std::max(thickest, curve.radius);
  float spacing = thickest;
  Buckets buckets(period, spacing);
  for (const Place& place : before)
    spacing =
        std::max(spacing, buckets.way(place.frame.position, before[place.next].frame.position).length());
  buckets = Buckets(period, spacing);
  for (const Place& place : before) buckets.add(place.frame.position, place.number);
  Buckets changed(period, lit_radii * thickest);
  std::size_t changes = 0;
  std::vector<bool> is_left(before.size(), true);
  std::vector<float> kept(places.size() * values, 0);
  std::vector<float> kept_through(options.both_sides ? kept.size() : 0, 0);
  for (const Place& place : places) {
    const YarnCurve& curve = data.curves[place.curve];
    const float same = same_place * curve.radius;
    float nearest = borrows ? max_unlike_radii * curve.radius : same;
    float fraction = 0;
    const Place* found = nullptr;
    for (const V3f& step : steps) {
      const V3f at = place.frame.position + step;
      buckets.for_each_near(at, [&](const V3f& point, std::size_t number) {
        const Place& other = before[number];
        const YarnCurve& of_other = last.data().curves[other.curve];
        if (of_other.albedo != curve.albedo || of_other.radius != curve.radius ||
            other.frame.tangent.dot(place.frame.tangent) < 0.5F)
          return;
        const V3f d = buckets.way(point, at);
        const V3f on = buckets.way(point, before[other.next].frame.position);
        const float f = std::clamp(d.dot(on) / std::max(on.length2(), 1e-12F), 0.0F, 1.0F);
        const float distance = (d - on * f).length();
        if (distance >= nearest) return;
        nearest = distance;
        fraction = f;
        found = &other;
      });
      if (nearest < (step == V3f(0) ? same : alike_place * curve.radius)) break;
    }
    if (found == nullptr) {
      changed.add(place.frame.position, ++changes);
      continue;
    }
    for (const auto& [number, weight] :
         {std::pair(found->number, 1 - fraction), std::pair(found->next, fraction)}) {
      is_left[number] = false;
      add_turned(&last.data().station_light[number * values], before[number], place.frame,
                 curve.plies.sides == 1, weight, &kept[place.number * values]);
      if (options.both_sides)
        add_turned(&last.data().light_through[number * values], before[number], place.frame,
                   curve.plies.sides == 1, weight, &kept_through[place.number * values]);
    }
  }
  if (changes > places.size() / 2) return false;
  if (borrows && changes == 0) {
    data.station_light = std::move(kept);
    data.light_through = std::move(kept_through);
    return true;
  }
  for (const Place& place : before)
    if (is_left[place.number]) changed.add(place.frame.position, ++changes);
  options.is_followed = [&](const V3f& point) { return changed.has_within(point, lit_radii * thickest); };
  compute_yarn_light(data, period, through, options);
  for (const Place& place : places) {
    if (changed.has_within(place.frame.position, changed_radii * thickest)) continue;
    const auto at = static_cast<std::ptrdiff_t>(place.number * values);
    std::copy_n(kept.begin() + at, values, data.station_light.begin() + at);
    if (options.both_sides) std::copy_n(kept_through.begin() + at, values, data.light_through.begin() + at);
  }
  return true;
}

}  // namespace selvedge
