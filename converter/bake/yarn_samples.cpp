#include "converter/bake/yarn_samples.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "format/cells/cell_image.h"
#include "format/fabric/yarn_section.h"

namespace selvedge {
namespace {

/// Points at least: of all texels, whose errors average out, and of one along a side, of many and of few.
constexpr double min_points = 1 << 14;
constexpr double min_side_of_many = 3;
constexpr double min_side_of_few = 6;
/// Bytes of the points under the lights that are sampled together.
constexpr std::size_t max_point_bytes = std::size_t{24} << 20;
/// The detail with which strands and hairs are seen; less where there are more hairs than this for a
/// point: each is shaded under every light. Twill loses less than 0.1 dB of its finest level.
constexpr float max_detail = 64;
constexpr float hairs_of_point = 1;
constexpr float shadow_texels_per_pixel = 4;
constexpr float piece_texels = 0.5F;
constexpr std::size_t shadow_bytes = std::size_t{96} << 20;

/// Fewer hairs, as much thicker, where there are more pieces of them than this for a point.
void keep_fewer_hairs(YarnData& yarn, double points) {
  constexpr double max_pieces_of_point = 4;
  double pieces = 0;
  for (const YarnCurve& curve : yarn.curves) pieces += std::abs(curve.hairs.count) * (hair_point_count - 1);
  const double kept = max_pieces_of_point * points / std::max(pieces, 1.0);
  for (YarnCurve& curve : yarn.curves) {
    YarnHairs& hairs = curve.hairs;
    if (kept >= 1 || hairs.count == 0) continue;
    const int sense = hairs.count > 0 ? 1 : -1;
    const int count = std::max(1, static_cast<int>(std::lround(sense * hairs.count * kept)));
    hairs.radius *= static_cast<float>(sense * hairs.count) / static_cast<float>(count);
    hairs.count = sense * count;
  }
}

V3f rgb(const Group& group) { return {group[0], group[1], group[2]}; }

}  // namespace

struct YarnSampler::Scratch {
  CellScratch cell;
  std::array<std::unique_ptr<CellShadows>, 2> of_pairs;  ///< by side; no other pair has a pair's light
  /// [texel][light]: sums over the points of one colour, over the number of all points; opacity belongs to
  /// the first light.
  std::array<std::vector<Group>, 2> halves;
};

struct YarnSampler::SideOfYarn {
  Yarns yarns;
  CellYarn cell;
  mutable CellShadows shadows;
  float hairs = 0;
  float hair_width = 0;  ///< mean, mm
  SideOfYarn(YarnData data, const V2f& period, float plane)
      : yarns(std::move(data), period), cell(yarns, plane, {}), shadows(cell) {
    shadows.set_memory(shadow_bytes);
    for (const Yarns::Segment& s : yarns.geometry().segments) {
      if (!(s.hair_threshold > 0)) continue;
      ++hairs;
      hair_width += 2 * s.radius;
    }
    hair_width /= std::max(hairs, 1.0F);
  }

  /// `width`: of a texel, mm.
  float detail_of(float points, float width) const {
    return hairs <= hairs_of_point * points
               ? max_detail
               : std::min(max_detail, width * hairs_of_point * points / (hairs * hair_width));
  }

  /// Adds the means of the visible normals of plies; hairs have none.
  void add_normals(const DepthGrid& seen, const CellView& view, const V2i& texels,
                   std::vector<V3f>& to) const {
    const V2f slope = ray_slope(view.view);
    const V2f& period = yarns.period();
    const YarnPieces& pieces = shown_pieces(cell, view);
    const int points = view.size.stride;
    for (int row = 0; row < seen.height; ++row) {
      for (int column = 0; column < seen.width; ++column) {
        const std::size_t i = static_cast<std::size_t>(row) * seen.stride + column;
        if (!(seen.z[i] > no_depth)) continue;
        const Yarns::Segment& s = pieces.segment(seen.piece[i]);
        const float up = seen.z[i] - cell.reference_height();
        V3f off(
            (static_cast<float>(column) + 0.5F) * period.x / static_cast<float>(seen.width) + slope.x * up,
            (static_cast<float>(row) + 0.5F) * period.y / static_cast<float>(seen.height) + slope.y * up,
            seen.z[i]);
        off -= s.start;
        for (int k = 0; k < 2; ++k) off[k] -= std::round((off[k] - s.along[k] / 2) / period[k]) * period[k];
        const V3f along = squeezed(s.along, s.squeeze);
        const V3f round = squeezed(off, s.squeeze);
        const float fraction = std::clamp(round.dot(along) * s.inverse_length2, 0.0F, 1.0F);
        const V3f tangent = squeezed(mix(s.tangent[0], s.tangent[1], fraction), s.squeeze).normalized();
        const V3f q = round - along * fraction;
        const V3f normal = squeezed((q - tangent * tangent.dot(q)).normalized(), s.squeeze).normalized();
        to[static_cast<std::size_t>(texels.y - 1 - row / points) * texels.x + column / points] +=
            normal / static_cast<float>(points * points);
      }
    }
  }
};

int points_per_texel(const V2i& texels, int samples) {
  const double side = std::sqrt(min_points / texels.x / texels.y);
  const double min_side = std::clamp(side, min_side_of_many, min_side_of_few);
  int points = static_cast<int>(std::lround(std::max(min_side, std::sqrt(samples))));
  while (std::min(texels.x, texels.y) * points < min_cell_texels) points *= 2;
  return points * points;
}

YarnSampler::YarnSampler(YarnData lit, const YarnCell& cell, float plane, const V2i& texels, bool both_sides)
    : texels_(texels) {
  const V2f period(cell.period);
  const auto thickness = static_cast<float>(cell.thickness);
  for (const YarnCurve& curve : lit.curves) hairs_.push_back(curve.hairs);
  keep_fewer_hairs(lit, points_per_texel(texels, 1) * texels.x * texels.y);
  sides_.push_back(std::make_unique<SideOfYarn>(std::move(lit), period, plane));
  if (both_sides)
    sides_.push_back(std::make_unique<SideOfYarn>(turned_over(sides_.front()->yarns, thickness), period,
                                                  thickness - plane));
}

YarnSampler::~YarnSampler() = default;

YarnData YarnSampler::take_yarn() {
  const Yarns yarns = std::move(sides_.front()->yarns);
  sides_.clear();
  YarnData yarn = yarns.data();
  for (std::size_t c = 0; c < hairs_.size(); ++c) yarn.curves[c].hairs = hairs_[c];
  return yarn;
}

void YarnSampler::sample(const V3f& direction, std::span<const V3f> lights, int samples, CellShadows& shadows,
                         std::vector<V3f>* normals, Scratch& scratch) const {
  const bool behind = direction.z < 0;
  const SideOfYarn& side = *sides_[behind ? 1 : 0];
  const int points = static_cast<int>(std::lround(std::sqrt(samples)));
  CellView view{.view = behind ? mirrored(direction) : direction,
                .size = {texels_ * points, V2i(points, points), points}};
  const std::size_t plane = view.size.count();
  view.rays_per_pixel_side =
      side.detail_of(static_cast<float>(plane), side.yarns.period().x / static_cast<float>(texels_.x));
  view.shadow_texels_per_pixel = shadow_texels_per_pixel;
  view.max_piece_pixels = piece_texels;
  view.has_station_table = false;
  const auto texels = static_cast<std::size_t>(texels_.x) * static_cast<std::size_t>(texels_.y);
  for (std::vector<Group>& half : scratch.halves) half.assign(texels * lights.size(), Group{});
  const std::size_t at_once =
      std::clamp<std::size_t>(max_point_bytes / (plane * sizeof(Group)), 1, lights.size());
  for (std::size_t first = 0, end = 0; first < lights.size(); first = end) {
    while (end < std::min(first + at_once, lights.size()) && (lights[end].z < 0) == (lights[first].z < 0))
      ++end;
    const auto some = lights.subspan(first, end - first);
    view.plane_count = static_cast<int>(some.size());
    view.lamps.clear();
    for (int l = 0; l < view.plane_count; ++l)
      view.lamps.push_back({behind ? mirrored(some[l]) : some[l], V3f(1, 1, 1), l});
    make_yarn_samples({&side.cell, &shadows, nullptr}, view, scratch.cell);
    add_points(points, lights.size(), first, some.size(), scratch);
  }
  if (normals != nullptr) side.add_normals(scratch.cell.depths, view, texels_, *normals);
}

void YarnSampler::add_points(int points, std::size_t lights, std::size_t first, std::size_t count,
                             Scratch& scratch) const {
  const float part = 1 / static_cast<float>(points * points);
  const int width = texels_.x * points;
  const float* point = scratch.cell.samples.front().data();
  for (int row = 0; row < texels_.y * points; ++row) {
    // Rows begin with the lowest, texels with the topmost.
    const std::size_t texel = static_cast<std::size_t>(texels_.y - 1 - row / points) * texels_.x;
    for (int column = 0; column < width; ++column) {
      float* const sum =
          scratch.halves[(row + column) % 2][(texel + column / points) * lights + first].data();
      for (std::size_t k = 0; k < 4 * count; ++k) sum[k] += *point++ * part;
    }
  }
}

ViewSamples YarnSampler::sample_view(const V3f& view, std::span<const V3f> lights, int samples,
                                     NoiseSum& noise) const {
  ViewSamples out;
  const auto texels = static_cast<std::size_t>(texels_.x) * static_cast<std::size_t>(texels_.y);
  out.normal.assign(texels, V3f(0, 0, 0));
  const auto scratch = scratch_.acquire();
  sample(view, lights, samples, sides_[view.z < 0 ? 1 : 0]->shadows, &out.normal, *scratch);
  const auto& [a, b] = scratch->halves;
  out.alpha.resize(texels);
  out.radiance.reserve(texels * lights.size());
  for (std::size_t l = 0; l < lights.size(); ++l) {
    for (std::size_t t = 0; t < texels; ++t) {
      const Group& one = a[t * lights.size() + l];
      const Group& other = b[t * lights.size() + l];
      if (l == 0) out.alpha[t] = std::min(1.0F, one[3] + other[3]);
      const V3f sum = rgb(one) + rgb(other);
      out.radiance.push_back(out.alpha[t] > 0 ? sum / out.alpha[t] : V3f(0, 0, 0));
      noise.squared_error += static_cast<double>((rgb(one) - rgb(other)).length2());
      noise.squared_signal += static_cast<double>(sum.length2());
    }
  }
  return out;
}

PairSamples YarnSampler::sample_pair(const DirectionPair& pair, int samples, NoiseSum& noise) const {
  PairSamples out{.width = texels_.x, .height = texels_.y, .pairs = {pair}};
  const auto scratch = scratch_.acquire();
  const std::size_t side = pair.view.z < 0 ? 1 : 0;
  std::unique_ptr<CellShadows>& shadows = scratch->of_pairs[side];
  if (shadows == nullptr) {
    shadows = std::make_unique<CellShadows>(sides_[side]->cell);
    shadows->set_memory(0);
  }
  sample(pair.view, {&pair.light, 1}, samples, *shadows, nullptr, *scratch);
  const auto& [a, b] = scratch->halves;
  for (std::size_t t = 0; t < a.size(); ++t) {
    const V3f sum = rgb(a[t]) + rgb(b[t]);
    const float alpha = std::min(1.0F, a[t][3] + b[t][3]);
    out.alpha.push_back(alpha);
    out.alpha_noise.push_back(a[t][3] - b[t][3]);
    out.radiance.push_back(alpha > 0 ? sum / alpha : V3f(0, 0, 0));
    out.noise.push_back(rgb(a[t]) - rgb(b[t]));
    noise.squared_error += static_cast<double>(out.noise.back().length2());
    noise.squared_signal += static_cast<double>(sum.length2());
  }
  return out;
}

}  // namespace selvedge
