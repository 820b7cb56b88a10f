#include "converter/light/line_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <numbers>
#include <numeric>

#include <Eigen/Dense>

#include "converter/light/station_fit.h"
#include "converter/light/yarn_lines.h"
#include "format/base/parallel.h"
#include "format/base/scratch_pool.h"
#include "format/simd/wide.h"

namespace selvedge {
namespace {

constexpr int functions = yarn_light_function_count;
constexpr int columns = light_columns;
/// Terms of the lustre: Chebyshev's U_0, U_1 and U_2, which the stored moments have.
constexpr int orders = light_moment_count + 1;
/// Weight of a place that hardly any view shows, and of covered ones.
constexpr double covered_weight = 0.05;
/// Stations of plies beyond which a station is one part with half of the fronts, whose light takes 350 bytes
/// each, with fewer lines, whose noise neighbouring stations even out (station_fit.cpp).
constexpr int many_ply_stations = 1 << 11;
constexpr float directions_of_many = 0.4375F;  ///< over the usual number
constexpr float spacing_of_many = 1.2F;        ///< likewise
/// Directions whose lines are followed at a time, and links that are merged so.
constexpr int directions_at_once = 8;
constexpr std::size_t max_links = 1 << 21;
/// The gloss of fibres as a lustre of the body, whose kernel is alike: light leaves at the angle to the fibre
/// at which it came.
constexpr float lustre_of_gloss = 0.7F;

using Functions = std::array<float, functions>;
using Moments = std::array<Functions, orders>;
/// The functions of three colours, [colour * functions + function], and zeros up to whole vectors.
struct alignas(64) ColourValues {
  std::array<float, 32> v{};
};
static_assert(3 * functions <= 32);

std::array<float, orders> chebyshev(float x) { return {1, 2 * x, 4 * x * x - 1}; }

/// Fractions of light that a patch sends on.
struct Wall {
  V3f back{0, 0, 0};  ///< of what falls on it, without the gloss
  float gloss = 0;
  V3f through{0, 0, 0};  ///< of what falls on its outside, to the inside, and of its inside to the outside
  V3f inside_back{0, 0, 0};  ///< of what falls on its inside
};

/// As the mesh's surface reflects (yarn_brdf.h). `through`: YarnCell::through.
Wall wall_of(const YarnCurve& curve, const V3f& through) {
  const float w = curve.gloss.weight;
  Wall wall{.gloss = w > 0 ? w * mean_gloss_albedo(curve.gloss.roughness) : 0};
  const float dull = through != V3f(0, 0, 0) ? 1 - wall.gloss : 1 - w;
  wall.back = curve.albedo * dull;
  wall.through = through * dull;
  wall.inside_back = curve.albedo + through * (1 - dull);
  return wall;
}

/// Light that patches get from each other, in the measure of the lines between them.
class Exchange {
 public:
  struct Part {
    std::int32_t from;
    float weight;
  };
  explicit Exchange(int rows) : start_(rows + 1, 0), first_(rows + 2) {}
  /// Sums the areas of equal links. `for_each_link` calls its argument, twice over, for each: with the patch
  /// that is lit, the one that lights it, and the area of their line.
  template <class ForEachLink>
  void add(const ForEachLink& for_each_link);
  /// Makes form factors of the sums, to which nothing is added any more.
  void divide_by(std::span<const float> areas) {
    added_ = sums_ = std::vector<Part>();
    for (std::size_t row = 0; row < areas.size(); ++row)
      for (std::size_t k = start_[row]; k < start_[row + 1]; ++k) parts_[k].weight /= areas[row];
  }
  std::span<const Part> row(int patch) const {
    return std::span(parts_).subspan(start_[patch], start_[patch + 1] - start_[patch]);
  }

 private:
  std::vector<std::size_t> start_;
  std::vector<Part> parts_;  ///< of each row by rising `from`
  std::vector<std::size_t> first_;
  std::vector<Part> added_, sums_;
};

template <class ForEachLink>
void Exchange::add(const ForEachLink& for_each_link) {
  std::ranges::fill(first_, 0);
  for_each_link([&](int to, int, float) { ++first_[to + 2]; });
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  added_.resize(first_.back());
  for_each_link([&](int to, int from, float area) { added_[first_[to + 1]++] = {from, area}; });
  std::vector<Part>& sums = sums_;
  sums.clear();
  // At least twice as many as before, since memory of its size returns to the system.
  if (const std::size_t room = parts_.size() + added_.size() / 2; sums.capacity() < room)
    sums.reserve(2 * room);
  for (std::size_t row = 0; row + 1 < start_.size(); ++row) {
    const std::span more(added_.data() + first_[row], first_[row + 1] - first_[row]);
    std::ranges::stable_sort(more, {}, &Part::from);
    const auto before = this->row(static_cast<int>(row));
    const std::size_t begin = sums.size();
    std::ranges::merge(before, more, std::back_inserter(sums), {}, &Part::from, &Part::from);
    start_[row] = begin;
    std::size_t end = begin;
    for (std::size_t k = begin; k < sums.size(); ++k)
      if (end > begin && sums[end - 1].from == sums[k].from)
        sums[end - 1].weight += sums[k].weight;
      else
        sums[end++] = sums[k];
    sums.resize(end);
  }
  start_.back() = sums.size();
  std::swap(parts_, sums);
}

/// Adds what patches send to the one that has this row, for all colours at once.
SELVEDGE_WIDE
void add_row(std::span<const Exchange::Part> row, const ColourValues* sent, ColourValues& to) {
  using Half = float __attribute__((vector_size(64)));
  Half low;
  Half high;
  std::memcpy(&low, to.v.data(), sizeof low);
  std::memcpy(&high, &to.v[16], sizeof high);
  for (const Exchange::Part& part : row) {
    Half arriving;
    std::memcpy(&arriving, sent[part.from].v.data(), sizeof arriving);
    low += part.weight * arriving;
    std::memcpy(&arriving, &sent[part.from].v[16], sizeof arriving);
    high += part.weight * arriving;
  }
  std::memcpy(to.v.data(), &low, sizeof low);
  std::memcpy(&to.v[16], &high, sizeof high);
}

/// `back` times the light of a side of a wall, and `through` times the other side's.
SELVEDGE_WIDE
void send_on(const V3f& back, const ColourValues& light, const V3f& through, const ColourValues& other,
             ColourValues& sent) {
  for (int c = 0; c < 3; ++c)
    for (int k = c * functions; k < (c + 1) * functions; ++k)
      sent.v[k] = back[c] * light.v[k] + through[c] * other.v[k];
}

/// How a patch reflects light of the sky.
struct FirstReflection {
  V3f back;
  float gloss, lustre;
};
/// Adds to the irradiance of another patch, and to the light that it has met, both `weight` times.
SELVEDGE_WIDE
void reflect_first(const FirstReflection& by, const Moments& direct, const std::array<float, orders>& u,
                   float weight, float* irradiance, const std::array<float, orders>& v, Moments* met) {
  Functions body{};
  Functions gloss{};
  float of_body = 1;
  float of_gloss = by.gloss;
  for (int n = 0; n < orders; ++n) {
    for (int k = 0; k < functions; ++k) {
      body[k] += of_body * u[n] * direct[n][k];
      gloss[k] += of_gloss * u[n] * direct[n][k];
    }
    of_body *= -by.lustre;
    of_gloss *= -lustre_of_gloss;
  }
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < functions; ++k) *irradiance++ += weight * (by.back[c] * body[k] + gloss[k]);
  if (met == nullptr) return;
  const float all = by.back.x + by.back.y + by.back.z;
  for (int n = 0; n < orders; ++n)
    for (int k = 0; k < functions; ++k) (*met)[n][k] += weight * v[n] * (all * body[k] + 3 * gloss[k]);
}

/// Inner products of the functions over light from evenly all around, and their means.
struct EvenLight {
  std::array<Functions, functions> products{};
  Functions mean{};
  EvenLight() {
    constexpr int count = 256;
    for (int i = 0; i < count; ++i) {
      const auto basis = light_basis(spiral_direction(i, count));
      for (int j = 0; j < functions; ++j) {
        mean[j] += basis[j] / count;
        for (int k = 0; k < functions; ++k) products[j][k] += basis[j] * basis[k] / count;
      }
    }
  }
  /// The means of U_1 and U_2 by which they come nearest to the light under all lights.
  std::array<double, light_moment_count> means_over(const Moments& met) const {
    std::array<double, orders> sums{};
    for (int n = 0; n < orders; ++n) {
      for (int j = 0; j < functions; ++j)
        for (int k = 0; k < functions; ++k)
          sums[n] += static_cast<double>(met[0][j] * products[j][k] * met[n][k]);
    }
    std::array<double, light_moment_count> means{};
    for (int n = 0; n < light_moment_count && sums[0] > 0; ++n) means[n] = sums[n + 1] / sums[0];
    return means;
  }
};
const EvenLight& even_light() {
  static const EvenLight even;
  return even;
}

class LineLight {
 public:
  LineLight(const Yarns& yarns, std::span<const V3f> through, const LineLightOptions& options)
      : yarns_(yarns),
        o_(options),
        patches_(is_large(yarns) ? YarnPatches(yarns, 1, 8) : YarnPatches(yarns, 2, 16)),
        exchange_(patches_.count()) {
    if (is_large(yarns)) {
      o_.direction_count = static_cast<int>(directions_of_many * static_cast<float>(o_.direction_count));
      o_.spacing_radii *= spacing_of_many;
    }
    const auto& curves = yarns.data().curves;
    for (std::size_t c = 0; c < curves.size(); ++c) {
      walls_.push_back(wall_of(curves[c], through[c]));
      lustre_.push_back(curves[c].gloss.lustre);
    }
    curve_.resize(patches_.count());
    for (int p = 0; p < patches_.count(); ++p) curve_[p] = patches_.curve_of(p);
    find_exchange();
  }

  /// Finds the light of every patch by way of others: from above, or from below.
  bool light(bool below);
  /// Sets `all` to the places of a curve, lit from the sides that have been found.
  void find_places(int curve, std::vector<LitPoint>& all) const;

 private:
  static bool is_large(const Yarns& yarns) {
    int ply_stations = 0;
    for (const YarnCurve& curve : yarns.data().curves) ply_stations += curve.stations * curve.plies.count;
    return ply_stations > many_ply_stations;
  }
  bool is_front(int patch) const { return patch < patches_.front_patch_count(); }
  bool is_inside(int patch) const { return patch >= patches_.first_inside_patch(); }
  /// Diffuse light that goes back, of which a hair has all.
  V3f back_of(int patch) const {
    const Wall& wall = walls_[curve_[patch]];
    return is_front(patch) || is_inside(patch) ? wall.back : wall.back + wall.through;
  }

  void find_exchange();
  void light_directly(bool below);
  void light_first(bool below);
  void send_first(const PatchFace& from, const PatchFace& to, float area, bool with_moments);
  void send(int patch, std::vector<ColourValues>& sent) const;
  bool solve(std::vector<ColourValues>& settled);
  void add_to(std::vector<LitPoint>& places, int curve, bool below) const;

  const Yarns& yarns_;
  LineLightOptions o_;
  YarnPatches patches_;
  std::vector<Wall> walls_;               ///< of the curves
  std::vector<float> lustre_;             ///< likewise
  std::vector<int> curve_;                ///< of the patches
  std::vector<LineCrossings> crossings_;  ///< by direction, without what is inside
  std::vector<float> area_;               ///< of the lines that pass a patch
  std::vector<int> met_by_lines_;         ///< patches that some do
  Exchange exchange_;
  std::vector<Moments> direct_;  ///< irradiance from the sky, by U_n of the light along the fibre
  std::vector<Moments> met_;     ///< of fronts: light by way of one other patch, likewise, over all colours
  std::vector<Functions> sky_;   ///< irradiance from the sky
  std::vector<std::array<double, light_moment_count>> moments_;  ///< of fronts: of the light that they meet
  std::vector<ColourValues> light_;                              ///< irradiance by way of others
  std::array<std::vector<ColourValues>, 2> lit_;  ///< the same from above and below, when it is found
};

void LineLight::find_exchange() {
  float thinnest = 1e30F;
  for (const YarnCurve& curve : yarns_.data().curves)
    thinnest = std::min(thinnest, ply_or_yarn_radius(curve));
  // About as many lines for each patch.
  const int patches_of_station = patches_.parts_per_station() * patches_.fronts_around_ply();
  const float spacing = o_.spacing_radii * thinnest * std::sqrt(32 / static_cast<float>(patches_of_station));
  std::vector<std::int32_t> pieces;
  for (const Yarns::Segment& s : yarns_.geometry().segments)
    if (const auto i = static_cast<std::int32_t>(&s - yarns_.geometry().segments.data());
        !o_.is_followed || o_.is_followed(s.start))
      pieces.push_back(i);
  area_.assign(patches_.count(), 0);
  crossings_.resize(o_.direction_count);
  ScratchPool<LineScratch> scratch;
  std::size_t links = 0;
  for (int first = 0, end = 0, unlinked = 0; first < o_.direction_count; first = end) {
    end = std::min(o_.direction_count, first + directions_at_once);
    parallel_for(first, end, [&](int i) {
      crossings_[i] = trace_lines(yarns_, patches_, pieces, spiral_direction(i, o_.direction_count), spacing,
                                  i, *scratch.acquire());
    });
    // Lines take about half of the time.
    if (o_.progress) o_.progress(0.5 * end / o_.direction_count);
    for (int i = first; i < end; ++i)
      links += 2 * (crossings_[i].open_air_links.size() + crossings_[i].inside_links.size());
    if (links < max_links && end < o_.direction_count) continue;
    exchange_.add([&](const auto& link) {
      for (int i = unlinked; i < end; ++i) {
        const LineCrossings& c = crossings_[i];
        for (const auto& [upper, lower] : c.open_air_links) {
          link(upper.patch, lower.patch, c.area);
          link(lower.patch, upper.patch, c.area);
        }
        for (const auto& [a, b] : c.inside_links) {
          link(patches_.inside_patch(a), patches_.inside_patch(b), c.area);
          link(patches_.inside_patch(b), patches_.inside_patch(a), c.area);
        }
      }
    });
    for (links = 0; unlinked < end; ++unlinked) {
      LineCrossings& c = crossings_[unlinked];
      for (const auto& [upper, lower] : c.open_air_links) {
        area_[upper.patch] += c.area;
        area_[lower.patch] += c.area;
      }
      for (const auto& [a, b] : c.inside_links) {
        area_[patches_.inside_patch(a)] += c.area;
        area_[patches_.inside_patch(b)] += c.area;
      }
      for (const auto* faces : {&c.sky_above, &c.sky_below})
        for (const PatchFace& face : *faces) area_[face.patch] += c.area;
      c.inside_links = std::vector<std::array<std::int32_t, 2>>();
    }
  }
  exchange_.divide_by(area_);
  for (int p = 0; p < patches_.count(); ++p)
    if (area_[p] > 0) met_by_lines_.push_back(p);
}

bool LineLight::light(bool below) {
  light_directly(below);
  light_first(below);
  return solve(lit_[below ? 1 : 0]);
}

/// Projects light of the sky that the lines see on the functions, by least squares over their directions.
void LineLight::light_directly(bool below) {
  const int m = o_.direction_count;
  Eigen::MatrixXd basis(m, functions);
  for (int i = 0; i < m; ++i) {
    V3f from = spiral_direction(i, m);
    if (below) from = {-from.x, -from.y, from.z};  // backwards, and mirrored into the upper half
    const auto values = light_basis(from);
    for (int k = 0; k < functions; ++k) basis(i, k) = static_cast<double>(values[k]);
  }
  const Eigen::MatrixXf project = (basis.transpose() * basis).ldlt().solve(basis.transpose()).cast<float>();
  direct_.assign(patches_.first_inside_patch(), Moments{});
  for (int i = 0; i < m; ++i) {
    const LineCrossings& c = crossings_[i];
    for (const PatchFace& face : below ? c.sky_below : c.sky_above) {
      const auto u = chebyshev(face.fibre_cosine);
      // Lines of m directions, and backwards, pass a place in the mean of the cosine over the sphere, 1/2:
      // irradiance is m / 2 times what falls on the area of its lines.
      const float scale = c.area * static_cast<float>(m) / (2 * area_[face.patch]);
      for (int n = 0; n < orders; ++n)
        for (int k = 0; k < functions; ++k) direct_[face.patch][n][k] += scale * u[n] * project(k, i);
    }
  }
}

/// Sends light that came from the sky on from one face to another, by the lustre of the body and the gloss.
void LineLight::send_first(const PatchFace& from, const PatchFace& to, float area, bool with_moments) {
  const int curve = curve_[from.patch];
  const float weight = area / area_[to.patch];
  Moments* const met = with_moments && is_front(to.patch) ? &met_[to.patch] : nullptr;
  reflect_first({back_of(from.patch), walls_[curve].gloss, lustre_[curve]}, direct_[from.patch],
                chebyshev(from.fibre_cosine), weight, light_[to.patch].v.data(), chebyshev(to.fibre_cosine),
                met);
}

/// Lights patches by way of one other, and keeps of the sky's light what is needed then.
void LineLight::light_first(bool below) {
  light_.assign(patches_.count(), {});
  if (!below) met_.assign(patches_.front_patch_count(), Moments{});
  for (const LineCrossings& c : crossings_) {
    for (const auto& [upper, lower] : c.open_air_links) {
      send_first(upper, lower, c.area, !below);
      send_first(lower, upper, c.area, !below);
    }
  }
  if (below || !o_.both_sides) crossings_ = std::vector<LineCrossings>();
  sky_.clear();
  for (const Moments& direct : direct_) sky_.push_back(direct[0]);
  direct_ = std::vector<Moments>();
  if (below) return;
  for (const Moments& met : met_)
    moments_.push_back(area_[moments_.size()] > 0 ? even_light().means_over(met)
                                                  : std::array<double, light_moment_count>{});
  met_ = std::vector<Moments>();
}

/// Sends on the light that reached a patch by way of others, and the sky's through its wall.
void LineLight::send(int patch, std::vector<ColourValues>& sent) const {
  const Wall& wall = walls_[curve_[patch]];
  if (!is_inside(patch)) {
    send_on(back_of(patch) + V3f(wall.gloss), light_[patch], is_front(patch) ? wall.through : V3f(0),
            light_[is_front(patch) ? patches_.inside_patch(patch) : patch], sent[patch]);
    return;
  }
  const int first = (patch - patches_.first_inside_patch()) * YarnPatches::fronts_per_inside;
  float area = 1e-30F;
  ColourValues mean;
  for (int p = first; p < first + YarnPatches::fronts_per_inside; ++p) {
    area += area_[p];
    for (int k = 0; k < 3 * functions; ++k) mean.v[k] += area_[p] * (sky_[p][k % functions] + light_[p].v[k]);
  }
  const float* light = light_[patch].v.data();
  float* out = sent[patch].v.data();
  for (int k = 0; k < 3 * functions; ++k)
    out[k] = wall.inside_back[k / functions] * light[k] + wall.through[k / functions] * mean.v[k] / area;
}

/// Adds to the light by way of one other patch what comes by way of more, by symmetric Gauss-Seidel sweeps.
/// `settled`: each colour as it is when it no longer changes.
bool LineLight::solve(std::vector<ColourValues>& settled) {
  constexpr int max_sweeps = 500;
  constexpr double tolerance = 2e-4;
  const std::vector<ColourValues> by_one = light_;
  settled.resize(light_.size());
  std::vector<ColourValues> sent(light_.size());
  for (const int p : met_by_lines_) send(p, sent);
  std::array<double, 3> before{};
  std::vector<int> colours{0, 1, 2};  // that change
  const auto keep = [&](int colour) {
    for (std::size_t p = 0; p < light_.size(); ++p)
      std::copy_n(&light_[p].v[colour * functions], functions, &settled[p].v[colour * functions]);
  };
  for (int sweep = 0; sweep < max_sweeps && !colours.empty(); ++sweep) {
    std::array<double, 3> change{};
    std::array<double, 3> all{};
    for (std::size_t step = 0; step < met_by_lines_.size(); ++step) {
      const int p = met_by_lines_[sweep % 2 == 0 ? step : met_by_lines_.size() - 1 - step];
      ColourValues sum = by_one[p];
      add_row(exchange_.row(p), sent.data(), sum);
      for (const int c : colours) {
        // The first function is even light.
        const float even = sum.v[c * functions];
        change[c] += std::abs(static_cast<double>(even - light_[p].v[c * functions]));
        all[c] += std::abs(static_cast<double>(even));
      }
      light_[p] = sum;
      send(p, sent);
      if (is_front(p)) send(patches_.inside_patch(p), sent);
      if (is_inside(p)) {
        const int first = (p - patches_.first_inside_patch()) * YarnPatches::fronts_per_inside;
        for (int front = first; front < first + YarnPatches::fronts_per_inside; ++front) send(front, sent);
      }
    }
    std::erase_if(colours, [&](int c) {
      // The rest of a geometric series is missing.
      const double rate = before[c] > 0 ? std::min(change[c] / before[c], 0.999) : 0.999;
      const bool small = change[c] * rate / (1 - rate) <= tolerance * all[c];
      if (small) keep(c);
      return small;
    });
    before = change;
    const double left = std::ranges::max(change) / std::max(std::ranges::max(all), 1e-300);
    if (o_.progress && left > 0) o_.progress(std::clamp(1 - 0.5 * std::log(left / tolerance) / 9, 0.5, 1.0));
  }
  for (const int c : colours) keep(c);
  return colours.empty();
}

/// The place at an angle about a ply, between two stations.
LitPoint place_at(const Yarns& yarns, int curve, float station, int ply, float angle) {
  LitPoint place;
  place.station = static_cast<double>(station);
  place.light.setZero();
  const YarnCurve& c = yarns.data().curves[curve];
  const auto at_frame = [&](const YarnFrame& frame) {
    const V3f& from = c.plies.count == 1 ? frame.across : frame.axis_to_ply;
    const V3f beside = frame.tangent.cross(frame.across);
    const V3f round = from * std::cos(angle) + frame.tangent.cross(from) * std::sin(angle);
    YarnPoint at;
    at.angle_cosine = round.dot(frame.across);
    at.angle_sine = round.dot(beside);
    at.ply_side = {frame.axis_to_ply.dot(frame.across), frame.axis_to_ply.dot(beside)};
    place.normal_z += static_cast<double>(frame.surface_normal(round).z) / 2;
    return at;
  };
  const int first = static_cast<int>(station);
  const float fraction = station - static_cast<float>(first);
  const bool wraps = first + 1 == c.stations;
  const int plies = c.plies.count;
  const int next_ply = wraps ? ((ply + c.plies.shift) % plies + plies) % plies : ply;
  YarnPoint at = at_frame(yarns.frame_at(curve, first, ply));
  const YarnPoint next = at_frame(yarns.frame_at(curve, wraps ? 0 : first + 1, next_ply));
  const V2f turned = V2f(at.angle_cosine, at.angle_sine) * (1 - fraction) +
                     V2f(next.angle_cosine, next.angle_sine) * fraction;
  at.angle_cosine = turned.normalized().x;
  at.angle_sine = turned.normalized().y;
  at.ply_side = (at.ply_side * (1 - fraction) + next.ply_side * fraction).normalized();
  const auto values = angle_factors(c.plies, at);
  for (int k = 0; k < angle_function_count; ++k) place.angle_values[k] = static_cast<double>(values[k]);
  return place;
}

/// A place for every front, and one for what other yarn covers of it.
void LineLight::find_places(int c, std::vector<LitPoint>& all) const {
  constexpr float pi = std::numbers::pi_v<float>;
  const YarnCurve& curve = yarns_.data().curves[c];
  all.clear();
  const int plies = curve.plies.count;
  const int parts = curve.stations * patches_.parts_per_station();
  const int around = patches_.fronts_around_ply();
  all.reserve(std::size_t{2} * parts * plies * around);
  // Plies touch their neighbours so far from their outermost line.
  const float reach = plies == 1 ? pi : pi / 2 + pi / static_cast<float>(plies);
  // Nearly the largest: nothing covers it.
  std::vector<float> areas(area_.begin() + patches_.front_patch(c, 0, 0, 0),
                           area_.begin() + patches_.front_patch(c, parts - 1, plies - 1, around - 1) + 1);
  if (o_.is_followed) std::erase(areas, 0.0F);
  if (areas.empty()) return;
  const auto high = areas.begin() + static_cast<std::ptrdiff_t>(areas.size() * 9 / 10);
  std::ranges::nth_element(areas, high);
  const double full = std::max(static_cast<double>(*high), 1e-30);
  for (int part = 0; part < parts; ++part) {
    const bool is_followed =
        !o_.is_followed || o_.is_followed(yarns_.frame_at(c, part / patches_.parts_per_station()).position);
    for (int ply = 0; ply < plies; ++ply) {
      for (int a = 0; a < around; ++a) {
        const float angle = -pi + (static_cast<float>(a) + 0.5F) * (2 * pi / static_cast<float>(around));
        const float station =
            (static_cast<float>(part) + 0.5F) / static_cast<float>(patches_.parts_per_station());
        LitPoint place = place_at(yarns_, c, station, ply, angle);
        double seen = 1;  // roughly the fraction of views
        if (plies > 1)
          seen = static_cast<double>((std::cos(angle) - std::cos(reach)) / (1 - std::cos(reach)));
        const double open =
            std::min(1.0, static_cast<double>(area_[patches_.front_patch(c, part, ply, a)]) / full);
        place.weight = open * std::max(covered_weight, seen);
        all.push_back(place);
        place.weight = is_followed && std::abs(angle) <= reach ? (1 - open) * covered_weight : 0;
        place.is_visible = false;
        all.push_back(place);
      }
    }
  }
  add_to(all, c, false);
  if (o_.both_sides) add_to(all, c, true);
}

void LineLight::add_to(std::vector<LitPoint>& places, int c, bool below) const {
  const EvenLight& even = even_light();
  const std::vector<ColourValues>& light = lit_[below ? 1 : 0];
  const YarnCurve& curve = yarns_.data().curves[c];
  const Gloss& gloss = curve.gloss;
  const V3f reflected =
      curve.albedo * (1 - gloss.weight) + V3f(gloss.weight * mean_gloss_albedo(gloss.roughness));
  int front = patches_.front_patch(c, 0, 0, 0);
  for (std::size_t i = 0; i < places.size(); i += 2, ++front) {
    LightColumns& to = places[i].light;
    // Who sees a place from above has no light from below but the stored; the cloth turned over adds what
    // comes straight to places that face down.
    const bool direct = below && places[i].normal_z > 0;
    const int inside = patches_.inside_patch(front);
    std::array<double, 2> mean{};  // of the light that the surface reflects, and that comes through it
    for (int k = 0; k < columns; ++k) {
      const int function = k % 3 * functions + k / 3;
      const float lit = light[front].v[function];
      const float outside = lit + (direct ? sky_[front][k / 3] : 0);
      const float back = reflected[k % 3] * outside;
      const float through = walls_[c].through[k % 3] * light[inside].v[function];
      to[(below ? columns : 0) + k] = static_cast<double>((back + through) * std::numbers::inv_pi_v<float>);
      mean[0] += static_cast<double>(reflected[k % 3] * lit * even.mean[k / 3]);
      mean[1] += static_cast<double>(through * even.mean[k / 3]);
    }
    if (below || gloss.lustre == 0 || !(mean[0] > 0)) continue;
    for (int n = 0; n < light_moment_count; ++n)
      to[2 * columns + n] = moments_[front][n] * mean[0] / (mean[0] + mean[1]);
  }
}

}  // namespace

V3f spiral_direction(int index, int count) {
  const double z = (index + 0.5) / count;
  const double r = std::sqrt(1 - z * z);
  const double turn = index * std::numbers::pi * (3 - std::sqrt(5.0));
  return V3f(V3d(r * std::cos(turn), r * std::sin(turn), z));
}

bool compute_yarn_light(YarnData& data, const V2f& period, std::span<const V3f> through,
                        const LineLightOptions& options) {
  const auto stations = static_cast<std::size_t>(counts_of(data).stations);
  data.station_light.assign(stations * light_values_per_station, 0);
  data.light_through.assign(options.both_sides ? data.station_light.size() : 0, 0);
  const Yarns yarns(data, period);
  LineLight light(yarns, through, options);
  bool settled = light.light(false);
  if (options.both_sides) settled = light.light(true) && settled;
  std::vector<int> first(data.curves.size(), 0);
  for (std::size_t c = 1; c < first.size(); ++c) first[c] = first[c - 1] + data.curves[c - 1].stations;
  ScratchPool<std::vector<LitPoint>> scratch;
  parallel_for(0, static_cast<int>(first.size()), [&](int c) {
    const auto places = scratch.acquire();
    light.find_places(c, *places);
    if (!places->empty()) fit_stations(*places, c, first[c], through[c] != V3f(0, 0, 0), data);
  });
  return settled;
}

}  // namespace selvedge
