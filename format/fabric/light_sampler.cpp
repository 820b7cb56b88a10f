#include "format/fabric/light_sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "format/fabric/evaluate.h"
#include "format/fabric/lifted.h"

namespace selvedge {
namespace {

using std::numbers::pi;

/// Fraction of the lights that is drawn whatever the energies are estimated to be.
constexpr double floor_weight = 0.1;

/// Single precision does not resolve the directions of sharper lobes. They may be drawn wider than they are.
constexpr double max_exponent = 1e6;

constexpr double max_energy = 1e100;

double mean(const V3d& colour) { return (colour.x + colour.y + colour.z) / 3; }

V3d upper(const V3d& direction) { return {direction.x, direction.y, std::abs(direction.z)}; }

V3d interpolated(const std::vector<V3f>& values, const DirectionTaps& taps) {
  V3d sum(0, 0, 0);
  for (std::size_t tap = 0; tap < 4; ++tap)
    sum += V3d(values[taps.cell[tap]]) * static_cast<double>(taps.weight[tap]);
  return sum;
}

/// Squares of directions are disks of equal area, lifted; disks of equal fractions of the cosine are the
/// hemisphere seen from above. From one to the other and back, the radius r, which is the larger of both
/// coordinates, changes alone (z = 1 - r^2 here, sqrt(1 - r^2) there).
double squared_radius(const V2d& from_middle) {
  const double r = std::max(std::abs(from_middle.x), std::abs(from_middle.y));
  return r * r;
}

V2d to_cosine(const V2d& square) {
  const V2d from_middle = square * 2.0 - V2d(1, 1);
  return (from_middle * std::sqrt(2 - squared_radius(from_middle)) + V2d(1, 1)) / 2.0;
}

V2d from_cosine(const V2d& square) {
  const V2d from_middle = square * 2.0 - V2d(1, 1);
  const double z = std::sqrt(std::max(0.0, 1 - squared_radius(from_middle)));
  return (from_middle / std::sqrt(1 + z) + V2d(1, 1)) / 2.0;
}

/// The integral of max(0, n.l) cos^exponent about an axis, n.axis being `cosine`: exact for lobes above the
/// horizon of n and nearly so for those half below it.
double lobe_energy(double cosine, double exponent) {
  const double spread = 0.64 / (exponent + 0.64);
  return pi / (exponent + 2) * (cosine + std::sqrt(cosine * cosine + spread));
}

/// The integral of indirect light over all lights on its side, mean over the colours.
double indirect_energy(const LightTransfer& transfer) {
  const auto colours = [&](std::size_t function) {
    return mean(V3d(transfer[3 * function], transfer[3 * function + 1], transfer[3 * function + 2]));
  };
  // Integrals of 1, z and 3 z^2 - 1 with the cosine; the other functions' is 0.
  return pi * colours(0) + 2 * pi / 3 * colours(3) + pi / 2 * colours(8);
}

}  // namespace

V3d CosineLobe::sample(const V2d& random) const {
  const double logarithm = std::log1p(-random.x) / (exponent + 1);
  const double cosine = std::exp(logarithm);
  const double sine = std::sqrt(-std::expm1(2 * logarithm));
  V3d tangent(tangent_of(V3f(axis)));
  tangent = (tangent - axis * tangent.dot(axis)).normalized();
  const double angle = 2 * pi * random.y;
  return axis * cosine + (tangent * std::cos(angle) + axis.cross(tangent) * std::sin(angle)) * sine;
}

double CosineLobe::pdf(const V3d& light) const {
  const double cosine = axis.dot(light);
  return cosine > 0 ? (exponent + 1) / (2 * pi) * std::pow(cosine, exponent) : 0;
}

V3d LightCells::sample(const V2d& random) const {
  const auto found = std::upper_bound(cumulative.begin(), cumulative.end() - 1, random.x);
  const auto cell = static_cast<int>(found - cumulative.begin());
  const double before = cell > 0 ? cumulative[cell - 1] : 0;
  const double within = std::min((random.x - before) / (cumulative[cell] - before), 1.0);
  return square_to_hemisphere(square_point(cell, {within, random.y}));
}

V2d LightCells::square_point(int cell, const V2d& within) const {
  const int row = cell / grid.columns;
  const V2d square((cell % grid.columns + within.x) / grid.columns, (row + within.y) / grid.rows);
  return is_cosine_weighted ? from_cosine(square) : square;
}

double LightCells::pdf(const V3d& light) const {
  if (light.z < 0) return 0;
  V2d square = hemisphere_to_square(light);
  if (is_cosine_weighted) square = to_cosine(square);
  const int cell = std::min(static_cast<int>(square.y * grid.rows), grid.rows - 1) * grid.columns +
                   std::min(static_cast<int>(square.x * grid.columns), grid.columns - 1);
  const double fraction = cumulative[cell] - (cell > 0 ? cumulative[cell - 1] : 0);
  return fraction * grid.count() * (is_cosine_weighted ? light.z / pi : 1 / (2 * pi));
}

V3d sample_visible_normal(const V3d& view, double roughness, const V2d& random) {
  const V3d stretched = V3d(roughness * view.x, view.y, view.z).normalized();
  const double across = std::hypot(stretched.x, stretched.y);
  const V3d first = across > 0 ? V3d(-stretched.y, stretched.x, 0) / across : V3d(1, 0, 0);
  const double radius = std::sqrt(random.x);
  const double x = radius * std::cos(2 * pi * random.y);
  const double half = (1 + stretched.z) / 2;
  const double y =
      (1 - half) * std::sqrt(std::max(0.0, 1 - x * x)) + half * radius * std::sin(2 * pi * random.y);
  const V3d slopes =
      first * x + stretched.cross(first) * y + stretched * std::sqrt(std::max(0.0, 1 - x * x - y * y));
  return V3d(roughness * slopes.x, slopes.y, std::max(1e-12, slopes.z)).normalized();
}

V3d FibreGloss::sample(const V2d& random) const {
  const V3d facet = sample_visible_normal(view, roughness, random);
  const V3d light = facet * (2 * view.dot(facet)) - view;
  return frame[0] * light.x + frame[1] * light.y + frame[2] * light.z;
}

double FibreGloss::pdf(const V3d& light) const {
  const V3d h = (V3d(light.dot(frame[0]), light.dot(frame[1]), light.dot(frame[2])) + view).normalized();
  if (!(h.z > 0)) return 0;
  const double q = h.x * h.x / (roughness * roughness) + h.y * h.y + h.z * h.z;
  return 1 / (pi * roughness * q * q * (1 + smith_lambda(view, roughness)) * 4 * view.z);
}

template <class Shape>
void LightSampler::add(Half half, double energy, Shape shape) {
  if (energy > 0) parts_[half].push_back({std::min(energy, max_energy), std::move(shape)});
}

void LightSampler::add_texel(const FabricLevel& level, const FabricInfo& info, Half half, double weight) {
  const int texel = wrap_texel(uv_.y, level.height) * level.width + wrap_texel(uv_.x, level.width);
  const std::vector<V3f> factors = light_factors(level, info, texel, view_);
  const double scale = weight * info.radiance_scale;
  V3d t(1, 0, 0);
  V3d b(0, 1, 0);
  V3d n(0, 0, 1);
  if (level.has(LayerKind::frame)) {
    t = V3d(level.frame()[texel].tangent);
    n = V3d(level.frame()[texel].normal);
    b = n.cross(t);
  }
  const V3d seen(V3d(view_).dot(t), V3d(view_).dot(b), V3d(view_).dot(n));
  const double length = n.length();
  const V3d normal = length > 0 ? n / length : V3d(0, 0, 1);
  floors_.push_back({half, normal, weight});

  const int lobes = level.has(LayerKind::lobes) ? level.lobe_count() : 0;
  V3d rho(1, 1, 1);
  for (int c = 0; c < 3 && level.has(LayerKind::lobes); ++c) {
    const float* p = &level.lobes()[(std::size_t{3} * texel + c) * parameter_count(lobes)];
    rho[c] = p[0];
    for (int j = 0; j < lobes; ++j) {
      // c_j is the product of the light with this, also where the frame is not quite one of unit vectors.
      const float* lobe = p + 1 + 4 * j;
      const V3d most = t * (lobe[0] * seen.x) + b * (lobe[1] * seen.y) + n * (lobe[2] * seen.z);
      if (!(most.length() > 0)) continue;
      const V3d axis = most.normalized();
      const double factor =
          factors.size() == 1
              ? factors.front()[c]
              : interpolated(factors, interpolate(info.lights, hemisphere_to_square(upper(axis))))[c];
      const double exponent = lobe[3];
      const double energy =
          length * lobe_energy(axis.dot(normal), exponent) * std::pow(most.length(), exponent);
      add(half, scale / 3 * factor * energy, CosineLobe{axis, std::min(exponent, max_exponent)});
    }
  }
  if (factors.size() == 1) {
    add(half, scale * pi * length * mean(rho * V3d(factors.front())), CosineLobe{normal, 1});
    return;
  }
  // Without a frame the cosine is the cells'. Cells of a tilted texel have its cosine in their middle.
  LightCells cells{info.lights, !level.has(LayerKind::frame)};
  for (int k = 0; k < info.lights.count(); ++k) {
    const V2d place = cells.square_point(k, {0.5, 0.5});
    const double facing = cells.is_cosine_weighted ? 0.5 : std::max(0.0, n.dot(square_to_hemisphere(place)));
    cells.cumulative.push_back(facing * mean(rho * interpolated(factors, interpolate(info.lights, place))));
  }
  std::partial_sum(cells.cumulative.begin(), cells.cumulative.end(), cells.cumulative.begin());
  const double sum = cells.cumulative.back();
  if (!(sum > 0)) return;
  for (double& cumulative : cells.cumulative) cumulative /= sum;
  add(half, scale * 2 * pi / info.lights.count() * sum, std::move(cells));
}

void LightSampler::add_yarn(const Yarns& yarns, double weight) {
  const auto hit = yarns.trace(uv_, fabric_.reference_height, view_);
  if (!hit) return;
  YarnPoint point = yarns.point_at(*hit);
  yarns.perturb_by_strands(point, view_);
  const YarnCurve& curve = yarns.data().curves[point.curve];
  const double gloss = curve.gloss.weight;
  const V3d normal(point.strand_normal);
  const double brightness = weight * point.brightness;
  add(above, (1 - gloss) * mean(V3d(curve.albedo)) * brightness, CosineLobe{normal, 1});
  // As Yarns::direct_reflectance() has it.
  const V3d fibre(point.fibre);
  V3d view(clamp_rise(view_));
  view = (view + normal * std::max(0.0, min_facing_cosine - normal.dot(view))).normalized();
  FibreGloss facets{{fibre, normal.cross(fibre), normal}, {0, 0, 1}, 1};
  facets.view = V3d(view.dot(fibre), view.dot(facets.frame[1]), view.dot(normal));
  facets.roughness = std::max(min_gloss_width, static_cast<double>(curve.gloss.roughness));
  add(above, gloss * weight, facets);
  for (const Half half : {above, below}) {
    if (half == below && yarns.data().light_through.empty()) continue;
    add(half, indirect_energy(yarns.transfer_at(point, half == below)) * brightness, CosineLobe{});
    floors_.push_back({half, V3d(0, 0, 1), weight});
  }
}

void LightSampler::add_point(int level, double weight) {
  if (!(weight > 0)) return;
  if (level < 0) {
    add_yarn(*fabric_.levels.front().yarns(), weight);
    return;
  }
  add_texel(fabric_.levels[level], fabric_, above, weight);
  if (const Fabric* through = fabric_.find_side(Side::through))
    add_texel(through->levels[level], *through, below, weight);
}

LightSampler::LightSampler(const Fabric& fabric, double level, const V2d& uv, const V3f& view)
    : fabric_(fabric), level_(level), coordinates_(uv), uv_(uv), view_(view) {
  if (!(view.z > 0)) return;
  const auto& yarns = fabric.levels.front().yarns();
  const bool has_yarn = yarns != nullptr;
  if (has_yarn) uv_ = yarns->displaced_place(uv);
  const LevelBlend levels = level_blend(level, static_cast<int>(fabric.levels.size()), has_yarn ? -1 : 0);
  const auto alpha = [&](int k) {
    return static_cast<double>(evaluate(fabric, k, uv, V3f(0, 0, 1), view).alpha);
  };
  if (levels.weight > 0) {
    const double near = (1 - levels.weight) * alpha(levels.finer_level);
    const double far = levels.weight * alpha(levels.finer_level + 1);
    add_point(levels.finer_level, near / (near + far));
    add_point(levels.finer_level + 1, far / (near + far));
  } else {
    add_point(levels.finer_level, 1);
  }

  double total = 0;
  for (const auto& parts : parts_)
    for (const Part& part : parts) total += part.fraction;
  const double scale = total > 0 ? (1 - floor_weight) / total : 0;
  for (auto& parts : parts_)
    for (Part& part : parts) part.fraction *= scale;
  double weights = 0;
  for (const Floor& floor : floors_) weights += floor.weight;
  for (const Floor& floor : floors_) {
    const double fraction = (total > 0 ? floor_weight : 1) * floor.weight / weights;
    parts_[floor.half].push_back({fraction, CosineLobe{floor.axis, 1}});
  }
}

LightSample LightSampler::sample(const V3d& random) const {
  LightSample result;
  double rest = random.x;
  const Part* drawn = nullptr;
  Half half = above;
  for (const Half side : {above, below}) {
    for (const Part& part : parts_[side]) {
      if (rest < 0) break;
      drawn = &part;
      half = side;
      rest -= part.fraction;
    }
  }
  if (drawn != nullptr) {
    const V2d pair(random.y, random.z);
    V3d light = upper(std::visit([&](const auto& shape) { return shape.sample(pair); }, drawn->shape));
    if (half == below) light.z = -light.z;
    result.light = V3f(light);
    result.pdf = pdf(result.light);
  }
  const Shading shading = evaluate(fabric_, level_, coordinates_, result.light, view_);
  result.alpha = shading.alpha;
  for (int c = 0; c < 3 && result.pdf > 0; ++c)
    result.weight[c] = std::min(shading.radiance[c] / result.pdf, std::numeric_limits<float>::max());
  return result;
}

float LightSampler::pdf(const V3f& light) const {
  // Single precision leaves lights a little longer or shorter, which the power of a sharp lobe would show.
  const V3d unit = V3d(light).normalized();
  const V3d l = upper(unit);
  const V3d mirror(l.x, l.y, -l.z);
  double sum = 0;
  for (const Part& part : parts_[unit.z < 0 ? below : above])
    sum += part.fraction *
           std::visit([&](const auto& shape) { return shape.pdf(l) + shape.pdf(mirror); }, part.shape);
  return static_cast<float>(sum);
}

}  // namespace selvedge
