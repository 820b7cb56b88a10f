#include "converter/light/line_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <numeric>

#include <Eigen/Dense>

#include "converter/light/station_fit.h"
#include "converter/light/yarn_lines.h"
#include "format/base/parallel.h"
#include "format/base/scratch_pool.h"

namespace selvedge {
namespace {

constexpr int functions = light_functions_of_yarn;
constexpr int columns = columns_of_light;
/// Terms of the lustre: Chebyshev's U_0, U_1 and U_2, which the stored moments have.
constexpr int orders = light_moments + 1;
/// Weight of a place that hardly any view shows, and of covered ones.
constexpr double covered_weight = 0.05;
/// Fronts beyond which a station is one part: their light takes 350 bytes each.
constexpr int many_fronts = 1 << 15;
/// Directions whose lines are followed at a time, and links that are merged so.
constexpr int directions_at_once = 8;
constexpr std::size_t max_links = 1 << 21;
/// The gloss of fibres as a lustre of the body, whose kernel is alike: light leaves at the angle to the fibre
/// at which it came.
constexpr float lustre_of_gloss = 0.7F;

using Functions = std::array<float, functions>;
using Moments = std::array<Functions, orders>;
template <typename T>
using ByColour = std::array<T, 3>;

std::array<float, orders> chebyshev(float x) { return {1, 2 * x, 4 * x * x - 1}; }

/// Evenly over the upper half of the sphere by its area: a spiral of golden angles.
V3f spiral_direction(int index, int count) {
  const double z = (index + 0.5) / count;
  const double r = std::sqrt(1 - z * z);
  const double turn = index * std::numbers::pi * (3 - std::sqrt(5.0));
  return V3f(V3d(r * std::cos(turn), r * std::sin(turn), z));
}

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
  Wall wall;
  wall.gloss = w > 0 ? w * mean_gloss_albedo(curve.gloss.roughness) : 0;
  const float dull = through != V3f(0, 0, 0) ? 1 - wall.gloss : 1 - w;
  wall.back = curve.albedo * dull;
  wall.through = through * dull;
  wall.inside_back = curve.albedo + through * (1 - dull);
  return wall;
}

/// Light that patches get from each other, in the measure of the lines between them.
class Exchange {
 public:
  struct Link {
    std::int32_t to, from;
    float area;  ///< of the line
  };
  struct Part {
    std::int32_t from;
    float weight;
  };
  explicit Exchange(int rows) : start_(rows + 1, 0) {}
  /// Sums the areas of equal links.
  void add(std::span<const Link> links);
  /// Makes form factors of the sums.
  void divide_by(std::span<const float> areas) {
    for (std::size_t row = 0; row < areas.size(); ++row)
      for (std::size_t k = start_[row]; k < start_[row + 1]; ++k) parts_[k].weight /= areas[row];
  }
  std::span<const Part> row(int patch) const {
    return std::span(parts_).subspan(start_[patch], start_[patch + 1] - start_[patch]);
  }

 private:
  std::vector<std::size_t> start_;
  std::vector<Part> parts_;  ///< of each row by rising `from`
};

void Exchange::add(std::span<const Link> links) {
  std::vector<std::size_t> first(start_.size() + 1, 0);
  for (const Link& link : links) ++first[link.to + 2];
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<Part> added(links.size());
  for (const Link& link : links) added[first[link.to + 1]++] = {link.from, link.area};
  std::vector<Part> sums;
  sums.reserve(parts_.size() + added.size() / 2);
  for (std::size_t row = 0; row + 1 < start_.size(); ++row) {
    const std::span more(added.data() + first[row], first[row + 1] - first[row]);
    std::ranges::stable_sort(more, {}, &Part::from);
    const auto before = this->row(static_cast<int>(row));
    const std::size_t begin = sums.size();
    std::ranges::merge(before, more, std::back_inserter(sums), {}, &Part::from, &Part::from);
    start_[row] = begin;
    std::size_t end = begin;
    for (std::size_t k = begin; k < sums.size(); ++k) {
      if (end > begin && sums[end - 1].from == sums[k].from)
        sums[end - 1].weight += sums[k].weight;
      else
        sums[end++] = sums[k];
    }
    sums.resize(end);
  }
  start_.back() = sums.size();
  parts_ = std::move(sums);
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
  std::array<double, light_moments> means_over(const Moments& met) const {
    std::array<double, orders> sums{};
    for (int n = 0; n < orders; ++n) {
      for (int j = 0; j < functions; ++j) {
        for (int k = 0; k < functions; ++k)
          sums[n] += static_cast<double>(met[0][j] * products[j][k] * met[n][k]);
      }
    }
    std::array<double, light_moments> means{};
    for (int n = 0; n < light_moments && sums[0] > 0; ++n) means[n] = sums[n + 1] / sums[0];
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
      : yarns_(yarns), o_(options), patches_(yarns, parts_for(yarns)), exchange_(patches_.count()) {
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
  void find_places(int curve, std::vector<LitPlace>& all) const;

 private:
  static int parts_for(const Yarns& yarns) {
    int fronts = 0;
    for (const YarnCurve& curve : yarns.data().curves)
      fronts += curve.stations * curve.plies.count * YarnPatches::around;
    return fronts > many_fronts ? 1 : 2;
  }
  bool is_front(int patch) const { return patch < patches_.fronts(); }
  bool is_inside(int patch) const { return patch >= patches_.first_inside(); }
  /// Diffuse light that goes back, of which a hair has all.
  V3f back_of(int patch) const {
    const Wall& wall = walls_[curve_[patch]];
    return is_front(patch) || is_inside(patch) ? wall.back : wall.back + wall.through;
  }

  void find_exchange();
  void light_directly(bool below);
  void light_first(bool below);
  void send_first(const PatchFace& from, const PatchFace& to, float area, bool with_moments);
  void send(int patch, int colour, std::vector<Functions>& sent) const;
  bool solve(int colour);
  void add_to(std::vector<LitPlace>& places, int curve, bool below) const;

  const Yarns& yarns_;
  LineLightOptions o_;
  YarnPatches patches_;
  std::vector<Wall> walls_;               ///< of the curves
  std::vector<float> lustre_;             ///< likewise
  std::vector<int> curve_;                ///< of the patches
  std::vector<LineCrossings> crossings_;  ///< by direction, without what is inside
  std::vector<float> area_;               ///< of the lines that pass a patch
  Exchange exchange_;
  std::vector<Moments> direct_;  ///< irradiance from the sky, by U_n of the light along the fibre
  std::vector<Moments> met_;     ///< of fronts: light by way of one other patch, likewise, over all colours
  std::vector<Functions> sky_;   ///< irradiance from the sky
  std::vector<std::array<double, light_moments>> moments_;  ///< of fronts: of the light that they meet
  using Light = ByColour<std::vector<Functions>>;
  Light light_;               ///< irradiance by way of others
  std::array<Light, 2> lit_;  ///< the same from above and below, when it is found
};

void LineLight::find_exchange() {
  float thinnest = 1e30F;
  for (const YarnCurve& curve : yarns_.data().curves) thinnest = std::min(thinnest, radius_of_plies(curve));
  // About as many lines for each patch.
  const float spacing = o_.spacing * thinnest * std::sqrt(2 / static_cast<float>(patches_.parts()));
  area_.assign(patches_.count(), 0);
  std::vector<Exchange::Link> links;
  const auto link = [&](int a, int b, float area) {
    area_[a] += area;
    area_[b] += area;
    links.push_back({a, b, area});
    links.push_back({b, a, area});
  };
  crossings_.resize(o_.directions);
  ScratchPool<LineScratch> scratch;
  for (int first = 0; first < o_.directions; first += directions_at_once) {
    const int end = std::min(o_.directions, first + directions_at_once);
    parallel_for(first, end, [&](int i) {
      crossings_[i] =
          cross_yarn(yarns_, patches_, spiral_direction(i, o_.directions), spacing, i, *scratch.lend());
    });
    for (int i = first; i < end; ++i) {
      LineCrossings& c = crossings_[i];
      for (const auto& [upper, lower] : c.outside) link(upper.patch, lower.patch, c.area);
      for (const auto& [a, b] : c.inside) link(patches_.inside_of(a), patches_.inside_of(b), c.area);
      for (const auto* faces : {&c.lit, &c.lit_below}) {
        for (const PatchFace& face : *faces) area_[face.patch] += c.area;
      }
      c.inside = std::vector<std::array<std::int32_t, 2>>();
    }
    if (links.size() < max_links && end < o_.directions) continue;
    exchange_.add(links);
    links.clear();
  }
  exchange_.divide_by(area_);
}

bool LineLight::light(bool below) {
  light_directly(below);
  light_first(below);
  std::array<bool, 3> settled{};
  parallel_for(0, 3, [&](int colour) { settled[colour] = solve(colour); });
  lit_[below ? 1 : 0] = std::move(light_);
  return settled[0] && settled[1] && settled[2];
}

/// Projects light of the sky that the lines see on the functions, by least squares over their directions.
void LineLight::light_directly(bool below) {
  const int m = o_.directions;
  Eigen::MatrixXd basis(m, functions);
  for (int i = 0; i < m; ++i) {
    V3f from = spiral_direction(i, m);
    if (below) from = {-from.x, -from.y, from.z};  // backwards, and mirrored into the upper half
    const auto values = light_basis(from);
    for (int k = 0; k < functions; ++k) basis(i, k) = static_cast<double>(values[k]);
  }
  const Eigen::MatrixXf project = (basis.transpose() * basis).ldlt().solve(basis.transpose()).cast<float>();
  direct_.assign(patches_.first_inside(), Moments{});
  for (int i = 0; i < m; ++i) {
    const LineCrossings& c = crossings_[i];
    for (const PatchFace& face : below ? c.lit_below : c.lit) {
      const auto u = chebyshev(face.along);
      // Lines of m directions, and backwards, pass a place in the mean of the cosine over the sphere, 1/2:
      // irradiance is m / 2 times what falls on the area of its lines.
      const float scale = c.area * static_cast<float>(m) / (2 * area_[face.patch]);
      for (int n = 0; n < orders; ++n) {
        for (int k = 0; k < functions; ++k) direct_[face.patch][n][k] += scale * u[n] * project(k, i);
      }
    }
  }
}

/// Sends light that came from the sky on from one face to another, by the lustre of the body and the gloss.
void LineLight::send_first(const PatchFace& from, const PatchFace& to, float area, bool with_moments) {
  const Wall& wall = walls_[curve_[from.patch]];
  const V3f back = back_of(from.patch);
  const Moments& direct = direct_[from.patch];
  const auto u = chebyshev(from.along);
  Functions body{};
  Functions gloss{};
  float of_body = 1;
  float of_gloss = wall.gloss;
  for (int n = 0; n < orders; ++n) {
    for (int k = 0; k < functions; ++k) {
      body[k] += of_body * u[n] * direct[n][k];
      gloss[k] += of_gloss * u[n] * direct[n][k];
    }
    of_body *= -lustre_[curve_[from.patch]];
    of_gloss *= -lustre_of_gloss;
  }
  const float weight = area / area_[to.patch];
  for (int c = 0; c < 3; ++c) {
    Functions& irradiance = light_[c][to.patch];
    for (int k = 0; k < functions; ++k) irradiance[k] += weight * (back[c] * body[k] + gloss[k]);
  }
  if (!with_moments || !is_front(to.patch)) return;
  const auto v = chebyshev(to.along);
  const float all = back.x + back.y + back.z;
  for (int n = 0; n < orders; ++n) {
    for (int k = 0; k < functions; ++k)
      met_[to.patch][n][k] += weight * v[n] * (all * body[k] + 3 * gloss[k]);
  }
}

/// Lights patches by way of one other, and keeps of the sky's light what is needed then.
void LineLight::light_first(bool below) {
  for (std::vector<Functions>& light : light_) light.assign(patches_.count(), Functions{});
  if (!below) met_.assign(patches_.fronts(), Moments{});
  for (const LineCrossings& c : crossings_) {
    for (const auto& [upper, lower] : c.outside) {
      send_first(upper, lower, c.area, !below);
      send_first(lower, upper, c.area, !below);
    }
  }
  if (below || !o_.both_sides) crossings_ = std::vector<LineCrossings>();
  sky_.clear();
  for (const Moments& direct : direct_) sky_.push_back(direct[0]);
  direct_ = std::vector<Moments>();
  if (below) return;
  for (const Moments& met : met_) moments_.push_back(even_light().means_over(met));
  met_ = std::vector<Moments>();
}

/// Sends on the light of a colour that reached a patch by way of others, and the sky's through its wall.
void LineLight::send(int patch, int colour, std::vector<Functions>& sent) const {
  const Wall& wall = walls_[curve_[patch]];
  const std::vector<Functions>& all = light_[colour];
  const Functions& light = all[patch];
  Functions& out = sent[patch];
  if (is_inside(patch)) {
    const int first = (patch - patches_.first_inside()) * YarnPatches::inside_parts;
    float area = 1e-30F;
    Functions mean{};
    for (int p = first; p < first + YarnPatches::inside_parts; ++p) {
      area += area_[p];
      for (int k = 0; k < functions; ++k) mean[k] += area_[p] * (sky_[p][k] + all[p][k]);
    }
    for (int k = 0; k < functions; ++k)
      out[k] = wall.inside_back[colour] * light[k] + wall.through[colour] * mean[k] / area;
    return;
  }
  const float back = back_of(patch)[colour] + wall.gloss;
  for (int k = 0; k < functions; ++k) out[k] = back * light[k];
  if (!is_front(patch)) return;
  const Functions& inside = all[patches_.inside_of(patch)];
  for (int k = 0; k < functions; ++k) out[k] += wall.through[colour] * inside[k];
}

/// Adds to the light by way of one other patch what comes by way of more: by Gauss and Seidel, in both
/// orders by turns.
bool LineLight::solve(int colour) {
  constexpr int max_sweeps = 500;
  constexpr double tolerance = 2e-4;
  const std::vector<Functions> by_one = light_[colour];
  std::vector<Functions>& light = light_[colour];
  std::vector<Functions> sent(patches_.count(), Functions{});
  for (int p = 0; p < patches_.count(); ++p) send(p, colour, sent);
  double before = 0;
  for (int sweep = 0; sweep < max_sweeps; ++sweep) {
    double change = 0;
    double all = 0;
    for (int step = 0; step < patches_.count(); ++step) {
      const int p = sweep % 2 == 0 ? step : patches_.count() - 1 - step;
      Functions sum = by_one[p];
      for (const auto& [from, weight] : exchange_.row(p)) {
        const Functions& arriving = sent[from];
        for (int k = 0; k < functions; ++k) sum[k] += weight * arriving[k];
      }
      // The first function is even light.
      change += std::abs(static_cast<double>(sum[0] - light[p][0]));
      all += std::abs(static_cast<double>(sum[0]));
      light[p] = sum;
      send(p, colour, sent);
      if (is_front(p)) send(patches_.inside_of(p), colour, sent);
      if (is_inside(p)) {
        const int first = (p - patches_.first_inside()) * YarnPatches::inside_parts;
        for (int front = first; front < first + YarnPatches::inside_parts; ++front) send(front, colour, sent);
      }
    }
    // The rest of a geometric series is missing.
    const double rate = before > 0 ? std::min(change / before, 0.999) : 0.999;
    if (change * rate / (1 - rate) <= tolerance * all) return true;
    before = change;
  }
  return false;
}

/// The place at an angle about a ply, between two stations.
LitPlace place_at(const Yarns& yarns, int curve, float station, int ply, float angle) {
  LitPlace place;
  place.station = static_cast<double>(station);
  place.light.setZero();
  const YarnCurve& c = yarns.data().curves[curve];
  const auto at_frame = [&](const YarnFrame& frame) {
    const V3f& from = c.plies.count == 1 ? frame.across : frame.out;
    const V3f beside = frame.tangent.cross(frame.across);
    const V3f round = from * std::cos(angle) + frame.tangent.cross(from) * std::sin(angle);
    YarnPoint at;
    at.cosine = round.dot(frame.across);
    at.sine = round.dot(beside);
    at.side = {frame.out.dot(frame.across), frame.out.dot(beside)};
    place.up += static_cast<double>(frame.normal_of(round).z) / 2;
    return at;
  };
  const int first = static_cast<int>(station);
  const float fraction = station - static_cast<float>(first);
  const bool wraps = first + 1 == c.stations;
  const int plies = c.plies.count;
  const int next_ply = wraps ? ((ply + c.plies.shift) % plies + plies) % plies : ply;
  YarnPoint at = at_frame(yarns.frame_at(curve, first, ply));
  const YarnPoint next = at_frame(yarns.frame_at(curve, wraps ? 0 : first + 1, next_ply));
  const V2f turned = V2f(at.cosine, at.sine) * (1 - fraction) + V2f(next.cosine, next.sine) * fraction;
  at.cosine = turned.normalized().x;
  at.sine = turned.normalized().y;
  at.side = (at.side * (1 - fraction) + next.side * fraction).normalized();
  const auto values = angle_factors(c.plies, at);
  for (int k = 0; k < angle_functions; ++k) place.functions[k] = static_cast<double>(values[k]);
  return place;
}

/// A place for every front, and one for what other yarn covers of it.
void LineLight::find_places(int c, std::vector<LitPlace>& all) const {
  constexpr float pi = std::numbers::pi_v<float>;
  const YarnCurve& curve = yarns_.data().curves[c];
  all.clear();
  const int plies = curve.plies.count;
  const int parts = curve.stations * patches_.parts();
  // Plies touch their neighbours so far from their outermost line.
  const float reach = plies == 1 ? pi : pi / 2 + pi / static_cast<float>(plies);
  // Nearly the largest: nothing covers it.
  std::vector<float> areas(
      area_.begin() + patches_.front(c, 0, 0, 0),
      area_.begin() + patches_.front(c, parts - 1, plies - 1, YarnPatches::around - 1) + 1);
  const auto high = areas.begin() + static_cast<std::ptrdiff_t>(areas.size() * 9 / 10);
  std::ranges::nth_element(areas, high);
  const double full = std::max(static_cast<double>(*high), 1e-30);
  for (int part = 0; part < parts; ++part) {
    for (int ply = 0; ply < plies; ++ply) {
      for (int a = 0; a < YarnPatches::around; ++a) {
        const float angle = -pi + (static_cast<float>(a) + 0.5F) * (2 * pi / YarnPatches::around);
        const float station = (static_cast<float>(part) + 0.5F) / static_cast<float>(patches_.parts());
        LitPlace place = place_at(yarns_, c, station, ply, angle);
        double seen = 1;  // roughly the fraction of views
        if (plies > 1)
          seen = static_cast<double>((std::cos(angle) - std::cos(reach)) / (1 - std::cos(reach)));
        const double open = std::min(1.0, static_cast<double>(area_[patches_.front(c, part, ply, a)]) / full);
        place.weight = open * std::max(covered_weight, seen);
        all.push_back(place);
        place.weight = std::abs(angle) <= reach ? (1 - open) * covered_weight : 0;
        place.open = false;
        all.push_back(place);
      }
    }
  }
  add_to(all, c, false);
  if (o_.both_sides) add_to(all, c, true);
}

void LineLight::add_to(std::vector<LitPlace>& places, int c, bool below) const {
  const EvenLight& even = even_light();
  const Light& light = lit_[below ? 1 : 0];
  const YarnCurve& curve = yarns_.data().curves[c];
  const Gloss& gloss = curve.gloss;
  const V3f reflected =
      curve.albedo * (1 - gloss.weight) + V3f(gloss.weight * mean_gloss_albedo(gloss.roughness));
  int front = patches_.front(c, 0, 0, 0);
  for (std::size_t i = 0; i < places.size(); i += 2, ++front) {
    PlaceLight& to = places[i].light;
    // Who sees a place from above has no light from below but the stored; the cloth turned over adds what
    // comes straight to places that face down.
    const bool direct = below && places[i].up > 0;
    const int inside = patches_.inside_of(front);
    std::array<double, 2> mean{};  // of the light that the surface reflects, and that comes through it
    for (int k = 0; k < columns; ++k) {
      const std::vector<Functions>& of_colour = light[k % 3];
      const float outside = of_colour[front][k / 3] + (direct ? sky_[front][k / 3] : 0);
      const float back = reflected[k % 3] * outside;
      const float through = walls_[c].through[k % 3] * of_colour[inside][k / 3];
      to[(below ? columns : 0) + k] = static_cast<double>((back + through) * std::numbers::inv_pi_v<float>);
      mean[0] += static_cast<double>(reflected[k % 3] * of_colour[front][k / 3] * even.mean[k / 3]);
      mean[1] += static_cast<double>(through * even.mean[k / 3]);
    }
    if (below || gloss.lustre == 0 || !(mean[0] > 0)) continue;
    for (int n = 0; n < light_moments; ++n)
      to[2 * columns + n] = moments_[front][n] * mean[0] / (mean[0] + mean[1]);
  }
}

}  // namespace

bool light_yarn(YarnData& data, const V2f& period, std::span<const V3f> through,
                const LineLightOptions& options) {
  const auto stations = static_cast<std::size_t>(counts_of(data).stations);
  data.light.assign(stations * light_values_per_station, 0);
  data.through.assign(options.both_sides ? data.light.size() : 0, 0);
  const Yarns yarns(data, period);
  LineLight light(yarns, through, options);
  bool settled = light.light(false);
  if (options.both_sides) settled = light.light(true) && settled;
  std::vector<int> first(data.curves.size(), 0);
  for (std::size_t c = 1; c < first.size(); ++c) first[c] = first[c - 1] + data.curves[c - 1].stations;
  ScratchPool<std::vector<LitPlace>> scratch;
  parallel_for(0, static_cast<int>(first.size()), [&](int c) {
    const auto places = scratch.lend();
    light.find_places(c, *places);
    fit_stations(*places, c, first[c], through[c] != V3f(0, 0, 0), data);
  });
  return settled;
}

}  // namespace selvedge
