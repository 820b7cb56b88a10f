#include "viewer/cells/patches.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "format/base/disjoint_sets.h"

namespace selvedge {
namespace {

/// Largest number of smallest patches: more of them are larger.
constexpr double max_cells = 1 << 18;
/// Sides of the smallest patches, if these are not too many, and of the largest: powers of two.
constexpr int finest_level = -3;
constexpr int finest_level_of_map = -5;
constexpr float max_part_of_tile = 0.5F;  ///< side of a patch in cloth with a map, tiles
constexpr int coarsest_level = 5;
constexpr std::int32_t no_chart = -1;
constexpr float min_area = 1e-20F;  ///< of a triangle, m^2: all charts have a surface
/// Texture coordinates beyond are on it.
constexpr double farthest = 1 << 30;
/// Patches are split for point lights while they reach so far, in distances to the light.
constexpr float wide_for_light = 0.1F;
/// Least cosine between ray and normal by which offsets are lengthened.
constexpr float min_view_cosine = 0.1F;
constexpr float merging = 0.8F;  ///< factor on limits of patches that the last frame split

struct Box {
  PatchFabric fabric;
  V2d low{HUGE_VAL, HUGE_VAL};
  V2d high{-HUGE_VAL, -HUGE_VAL};
  double cells(int level) const {
    const double side = std::exp2(level);
    return (std::floor((high.x - low.x) / side) + std::max(1 / side, 1.0)) *
           (std::floor((high.y - low.y) / side) + std::max(1 / side, 1.0));
  }
};

V2i level_size(const Patches::Chart& chart, std::size_t level) {
  const auto halved = [&](int size) { return ((size - 1) >> level) + 1; };
  return {halved(chart.size_in_patches.x), halved(chart.size_in_patches.y)};
}

void add(const Patch& part, Patch& sum) {
  if (!(part.area > 0)) return;
  sum.mean_normal += part.mean_normal;
  sum.mean_tangent += part.mean_tangent;
  sum.mean_dp_du += part.mean_dp_du;
  sum.mean_dp_dv += part.mean_dp_dv;
  sum.mean_position += part.mean_position;
  sum.area += part.area;
  sum.handedness += part.handedness;
  sum.any_triangle = part.any_triangle;
}

/// Cosine of the farthest turn of a patch's normals, as if they filled a cap: the mean of unit vectors of a
/// cap of cosine c is (1 + c) / 2 long.
float turn_cosine(const Patch& patch) { return 2 * patch.mean_normal.length() - 1; }

}  // namespace

Patches::Patches(const MergedSurfaces& mesh, std::span<const SurfaceMaterial> materials,
                 std::span<const PatchFabric> fabrics) {
  places_.resize(mesh.triangles.size());
  DisjointSets components(mesh.positions.size());  // vertices that triangles join
  is_counted_.resize(mesh.triangles.size());
  std::vector<std::uint8_t> is_charted(mesh.positions.size());  // vertices
  for (const bool degenerate_uvs : {false, true}) {
    std::vector<std::uint32_t> joined;  // vertices
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const MergedTriangle& t = mesh.triangles[i];
      const auto& [a, b, c] = t.corners;
      if (materials[t.surface].fabric < 0 || t.has_degenerate_uvs != degenerate_uvs) continue;
      if (degenerate_uvs && (is_charted[a] | is_charted[b] | is_charted[c]) != 0) continue;
      is_counted_[i] = 1;
      components.unite(static_cast<int>(a), static_cast<int>(b));
      components.unite(static_cast<int>(b), static_cast<int>(c));
      joined.insert(joined.end(), {a, b, c});
    }
    for (const std::uint32_t vertex : joined) is_charted[vertex] = degenerate_uvs ? 0 : 1;
  }
  std::unordered_map<int, std::int32_t> numbers;
  std::vector<Box> boxes;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const MergedTriangle& t = mesh.triangles[i];
    if (is_counted_[i] == 0) continue;
    const auto [at, fresh] = numbers.try_emplace(components.root(static_cast<int>(t.corners[0])),
                                                 static_cast<std::int32_t>(boxes.size()));
    if (fresh) boxes.emplace_back().fabric = fabrics[materials[t.surface].fabric];
    places_[i].chart = at->second;
    Box& box = boxes[at->second];
    for (const std::uint32_t corner : t.corners) {
      V2d uv = t.has_degenerate_uvs ? V2d(0, 0) : V2d(mesh.uv(corner) * box.fabric.repeats_per_uv);
      for (int axis = 0; axis < 2; ++axis) uv[axis] = std::clamp(uv[axis], -farthest, farthest);
      box.low = {std::min(box.low.x, std::floor(uv.x)), std::min(box.low.y, std::floor(uv.y))};
      box.high = {std::max(box.high.x, std::floor(uv.x)), std::max(box.high.y, std::floor(uv.y))};
    }
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const MergedTriangle& t = mesh.triangles[i];
    if (materials[t.surface].fabric < 0) continue;
    for (const std::uint32_t corner : t.corners)
      if (is_counted_[i] == 0 && is_charted[corner] != 0)
        places_[i].chart = numbers.at(components.root(static_cast<int>(corner)));
  }
  first_level_ = std::ranges::any_of(fabrics, &PatchFabric::has_map) ? finest_level_of_map : finest_level;
  const auto cells = [&] {
    double sum = 0;
    for (const Box& box : boxes) sum += box.cells(first_level_);
    return sum;
  };
  while (first_level_ < 30 && cells() > max_cells) ++first_level_;
  std::size_t table = 0;
  for (const Box& box : boxes) {
    Chart& chart = charts_.emplace_back();
    chart.fabric = box.fabric;
    chart.first_repeat = V2i(box.low);
    const double side = std::exp2(first_level_);
    // All of the last repeat.
    const double units = units_per_repeat() - 1;
    chart.size_in_patches = {static_cast<int>((box.high.x - box.low.x) / side + units) + 1,
                             static_cast<int>((box.high.y - box.low.y) / side + units) + 1};
    chart.first_table_entry = table;
    table += static_cast<std::size_t>(chart.size_in_patches.x) * chart.size_in_patches.y;
    for (int level = 0; level <= std::max(coarsest_level - first_level_, 0); ++level) {
      chart.level_starts.push_back(patches_.size());
      const V2i size = level_size(chart, static_cast<std::size_t>(level));
      patches_.resize(patches_.size() + static_cast<std::size_t>(size.x) * size.y);
      if (size == V2i(1, 1)) break;
    }
  }
  table_.resize(table);
  shown_.resize(patches_.size());
  for (std::size_t i = 0; i < places_.size(); ++i) {
    Place& place = places_[i];
    if (place.chart == no_chart) continue;
    const V2d uv(this->place(mesh, i, 0));
    const V2d& low = boxes[place.chart].low;
    const double units = units_per_repeat();
    constexpr double last = 1 << 30;
    place.u = static_cast<std::int32_t>(std::clamp((std::floor(uv.x) - low.x) * units, -last, last));
    place.v = static_cast<std::int32_t>(std::clamp((std::floor(uv.y) - low.y) * units, -last, last));
  }
  add_up(mesh);
}

Patches::Extent Patches::extent(const MergedSurfaces& mesh, std::size_t triangle) const {
  const V2f first = place(mesh, triangle, 0);
  const auto units = static_cast<float>(units_per_repeat());
  V2f low(HUGE_VALF, HUGE_VALF);
  V2f high(-HUGE_VALF, -HUGE_VALF);
  for (std::size_t k = 0; k < 3; ++k) {
    const V2f at = (place(mesh, triangle, k) - V2f(std::floor(first.x), std::floor(first.y))) * units;
    low = {std::min(low.x, std::floor(at.x)), std::min(low.y, std::floor(at.y))};
    high = {std::max(high.x, std::floor(at.x)), std::max(high.y, std::floor(at.y))};
  }
  const auto whole = [](float x) { return static_cast<std::int32_t>(std::clamp(x, -1e9F, 1e9F)); };
  return {whole(low.x), whole(low.y), whole(high.x), whole(high.y)};
}

/// Adds samples of a triangle, about twice along each smallest patch, to those.
void Patches::add_triangle(const MergedSurfaces& mesh, std::uint32_t number) {
  const Place& place = places_[number];
  const Chart& chart = charts_[place.chart];
  const MergedTriangle& t = mesh.triangles[number];
  std::array<V3f, 3> p;
  std::array<V3f, 3> n;
  std::array<V3f, 3> tangent;
  std::array<V2f, 3> uv;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t vertex = t.corners[k];
    p[k] = mesh.positions[vertex];
    n[k] = mesh.normal(vertex);
    tangent[k] = mesh.tangent(vertex);
    uv[k] = this->place(mesh, number, k);
  }
  const V2f first(std::floor(uv[0].x), std::floor(uv[0].y));
  for (V2f& c : uv) c -= first;
  const V2f one = uv[1] - uv[0];
  const V2f two = uv[2] - uv[0];
  const V3f e1 = p[1] - p[0];
  const V3f e2 = p[2] - p[0];
  const float area = std::max(0.5F * e1.cross(e2).length(), min_area);
  const float det = one.x * two.y - two.x * one.y;
  const bool has_scale = !t.has_degenerate_uvs && std::abs(det) > 0;
  const float side = std::exp2(static_cast<float>(first_level_));
  const float longest = std::max({std::abs(one.x), std::abs(one.y), std::abs(two.x), std::abs(two.y),
                                  std::abs(one.x - two.x), std::abs(one.y - two.y)}) /
                        side;
  // Thin triangles have as many for their area: the two centroids of a part find the patches along it.
  const float height = std::abs(det) / (std::max(longest, 1e-30F) * side * side);
  const float wanted = std::min(2 * longest, std::sqrt(8 * longest * (height + 0.5F)));
  const int parts = has_scale ? static_cast<int>(std::clamp(std::ceil(wanted), 1.0F, 2048.0F)) : 1;
  const float weight = area / static_cast<float>(parts * parts);
  Patch sample;
  sample.any_triangle = number;
  sample.area = weight;
  sample.handedness = t.handedness * weight;
  // Change of place for a repeat, by the inverse of the matrix (one, two).
  sample.mean_dp_du = (has_scale ? (e1 * two.y - e2 * one.y) / det : V3f(0, 0, 0)) * weight;
  sample.mean_dp_dv = (has_scale ? (e2 * one.x - e1 * two.x) / det : V3f(0, 0, 0)) * weight;
  for (int a = 0; a < parts; ++a) {
    for (int b = 0; b < 2 * (parts - a) - 1; ++b) {
      // Centroids of the parts, upright and turned over.
      const float third = b % 2 == 0 ? 1.0F / 3 : 2.0F / 3;
      const float l1 = (static_cast<float>(a) + third) / static_cast<float>(parts);
      const float l2 = (static_cast<float>(b / 2) + third) / static_cast<float>(parts);  // NOLINT: whole
      const float l0 = 1 - l1 - l2;
      const auto mean = [&](const auto& corners) {
        return corners[0] * l0 + corners[1] * l1 + corners[2] * l2;
      };
      const V2f at = mean(uv);
      const auto unit_of = [&](float c) {
        const float repeat = std::floor(c);
        return unit_at(static_cast<int>(std::clamp(repeat, -1e8F, 1e8F)), c - repeat);
      };
      sample.mean_normal = mean(n).normalized() * weight;
      sample.mean_tangent = mean(tangent) * weight;
      sample.mean_position = mean(p) * weight;
      add(sample, patches_[chart.level_starts[0] +
                           cell(place.v, unit_of(at.y), chart.size_in_patches.y) * chart.size_in_patches.x +
                           cell(place.u, unit_of(at.x), chart.size_in_patches.x)]);
    }
  }
}

/// Adds the patches of each level to the next level, and sets relatives_.
void Patches::add_levels(const Chart& chart) {
  for (std::size_t level = 1; level < chart.level_starts.size(); ++level) {
    const V2i size = level_size(chart, level);
    const V2i finer = level_size(chart, level - 1);
    for (int y = 0; y < finer.y; ++y) {
      for (int x = 0; x < finer.x; ++x) {
        const auto child = static_cast<std::uint32_t>(chart.level_starts[level - 1] +
                                                      static_cast<std::size_t>(y) * finer.x + x);
        const auto parent = static_cast<std::uint32_t>(chart.level_starts[level] +
                                                       static_cast<std::size_t>(y / 2) * size.x + x / 2);
        add(patches_[child], patches_[parent]);
        relatives_[child][0] = parent;
        if (patches_[child].area > 0) relatives_[parent][1] = child;
      }
    }
  }
}

void Patches::add_up(const MergedSurfaces& mesh) {
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    if (is_counted_[i] != 0) add_triangle(mesh, static_cast<std::uint32_t>(i));
  relatives_.resize(patches_.size());
  for (std::uint32_t i = 0; i < patches_.size(); ++i) relatives_[i] = {i, i};
  for (Chart& chart : charts_) {
    add_levels(chart);
    chart.any_patch = static_cast<std::uint32_t>(chart.level_starts.back());
    while (!(patches_[chart.any_patch].area > 0)) ++chart.any_patch;
  }
  for (Patch& patch : patches_) {
    if (!(patch.area > 0)) continue;
    const float scale = 1 / patch.area;
    for (V3f* mean : {&patch.mean_normal, &patch.mean_tangent, &patch.mean_dp_du, &patch.mean_dp_dv,
                      &patch.mean_position})
      *mean *= scale;
  }
}

/// A patch on the screen.
struct Patches::Projected {
  V2f pixel_width_texels{
      16, 16};  ///< ShownPatch::pixel_width_texels; the default shows the mean of a patch without a scale
  bool in_frame = false;
  float repeats = 1;           ///< along a side
  float pixels_of_repeat = 0;  ///< along its longer side
  float longest = 0;           ///< side, pixels
  float radius = 0;            ///< m
  float depth = 1;             ///< m; of a parallel projection 1
  float facing = 0;            ///< cosine between normal and ray
};

/// A camera and its frame.
struct Patches::View {
  V3f position, right, up, back;
  bool parallel;
  float scale;     ///< pixels for a metre, at unit depth in perspective
  V2f half_frame;  ///< pixels
  V2f centre;      ///< of the window, pixels
  PatchLimits limits, merging_limits;
  V3d origin;
  std::span<const Light> lights;
  Projected project(const Patch& patch, float repeats) const;
  bool splits(const Patch& patch, const Projected& seen, const PatchLimits& bounds) const;
  float offset(const Patch& patch, const Projected& seen, float relief) const;
  V3f towards(const Light& light, const Patch& patch) const {
    return light.kind == LightKind::directional ? V3f(light.direction)
                                                : V3f(light.position - origin - V3d(patch.mean_position));
  }
  /// Whether normals of a patch, which turn so far, face a light and face away from it.
  bool turns_away(const Patch& patch, float spread) const {
    return std::any_of(lights.begin(), lights.end(), [&](const Light& light) {
      return std::abs(patch.mean_normal.dot(towards(light, patch).normalized())) < spread;
    });
  }
  /// Whether a patch, which reaches so far, m, is near to a point light or a spot.
  bool is_near_light(const Patch& patch, float reach_of_patch) const {
    return std::any_of(lights.begin(), lights.end(), [&](const Light& light) {
      return light.kind != LightKind::directional &&
             reach_of_patch > wide_for_light * towards(light, patch).length();
    });
  }
};

Patches::Projected Patches::View::project(const Patch& patch, float repeats) const {
  Projected seen;
  seen.repeats = repeats;
  const V3f away = patch.mean_position - position;
  const bool has_scale = patch.mean_dp_du.length2() > 0;
  seen.radius =
      has_scale ? repeats * (patch.mean_dp_du.length() + patch.mean_dp_dv.length()) : std::sqrt(patch.area);
  V3f to_viewer = back;
  if (!parallel) {
    seen.depth = std::max(-away.dot(back), 0.05F * seen.radius);
    const float distance = away.length();
    if (distance > 0) to_viewer = away * (-1 / distance);
  }
  seen.facing = std::abs(patch.mean_normal.dot(to_viewer));
  const float pixels = scale / seen.depth;  // of a metre
  const V2f middle = V2f(away.dot(right), away.dot(up)) * pixels - centre;
  const float reach = seen.radius * pixels;
  seen.in_frame = std::abs(middle.x) < half_frame.x + reach && std::abs(middle.y) < half_frame.y + reach;
  // Change of pixels for a step, and its inverse for a repeat: its rows' lengths are a pixel's width along
  // u and v.
  const V3f across = parallel ? back / back.dot(right.cross(up)) : back;
  const auto on_screen = [&](const V3f& step) {
    const V2f flat(step.dot(right), step.dot(up));
    if (!parallel)
      return (flat + V2f(away.dot(right), away.dot(up)) / seen.depth * step.dot(across)) * pixels;
    const V3f moved = across * step.dot(right.cross(up));
    return (flat - V2f(moved.dot(right), moved.dot(up))) * pixels;
  };
  const V2f a = on_screen(patch.mean_dp_du);
  const V2f b = on_screen(patch.mean_dp_dv);
  const float det = std::max(std::abs(a.x * b.y - a.y * b.x), 0.02F * (a.length2() + b.length2()) + 1e-20F);
  if (has_scale) seen.pixel_width_texels = V2f(b.length() / det, a.length() / det);
  seen.pixels_of_repeat = std::max(a.length(), b.length());
  seen.longest = repeats * seen.pixels_of_repeat;
  return seen;
}

/// Whether one image is too little for a patch of more than one repeat.
bool Patches::View::splits(const Patch& patch, const Projected& seen, const PatchLimits& bounds) const {
  // Rays of a patch turn as its normals do, and its pixels are of one size.
  constexpr auto radians = static_cast<float>(radians_per_degree);
  const float cosine = turn_cosine(patch);
  const float spread = std::sqrt(std::max(0.0F, 1 - cosine * cosine));
  const float degrees = std::min(bounds.max_turn_degree_pixels / std::max(seen.pixels_of_repeat, 1e-3F),
                                 bounds.max_turn_degrees);
  return cosine < std::cos(degrees * radians) ||
         (!parallel && 0.5F * seen.radius > bounds.max_turn_degrees * radians * seen.depth) ||
         seen.longest > bounds.max_side_pixels || seen.repeats > bounds.max_side_repeats ||
         (seen.longest > bounds.max_outline_pixels && (seen.facing < spread || turns_away(patch, spread)));
}

/// Pixels between yarn at the border of a patch and its place: half the angles by which rays and normals turn
/// over the patch, times the height of the yarn, by the cosine to the ray.
float Patches::View::offset(const Patch& patch, const Projected& seen, float relief) const {
  const float apart = parallel ? 0 : 0.5F * seen.longest / scale;
  const float turn = 0.5F * std::acos(std::clamp(turn_cosine(patch), -1.0F, 1.0F));
  return (apart + turn) * relief * seen.pixels_of_repeat / std::max(seen.facing, min_view_cosine);
}

void Patches::choose(const Camera& camera, const V3d& origin, const V2i& frame, const PatchLimits& limits,
                     std::span<const Light> lights, bool is_moving) {
  std::swap(splits_, split_before_);
  splits_.assign(patches_.size(), 0);
  if (!is_moving) split_before_.clear();
  PatchLimits merging_limits = limits;
  for (float* limit : {&merging_limits.max_side_pixels, &merging_limits.max_turn_degree_pixels,
                       &merging_limits.max_turn_degrees, &merging_limits.max_outline_pixels,
                       &merging_limits.max_offset_pixels, &merging_limits.max_offset_area})
    *limit *= merging;
  View view{V3f(camera.position - origin),
            V3f(camera.right),
            V3f(camera.up),
            V3f(camera.projection == Projection::parallel ? camera.to_viewer : camera.image_normal()),
            camera.projection == Projection::parallel,
            static_cast<float>(frame.x / (2 * camera.window_half_size.x)),
            V2f(static_cast<float>(frame.x), static_cast<float>(frame.y)) * 0.5F,
            V2f(camera.window_centre),
            limits,
            merging_limits,
            origin,
            lights};
  view.centre *= view.scale;
  for (const Chart& chart : charts_) {
    const std::size_t top = chart.level_starts.size() - 1;
    const V2i size = level_size(chart, top);
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x) choose_in(chart, view, top, {x, y}, chart.any_patch);
  }
  if (!is_moving) splits_.clear();  // a change begins anew
}

void Patches::choose_in(const Chart& chart, const View& view, std::size_t level, const V2i& at,
                        std::uint32_t above) {
  const V2i size = level_size(chart, level);
  auto number =
      static_cast<std::uint32_t>(chart.level_starts[level] + static_cast<std::size_t>(at.y) * size.x + at.x);
  const Patch& patch = patches_[number];
  bool splits = false;
  if (!(patch.area > 0)) {
    number = above;
  } else {
    const float repeats = std::exp2(static_cast<float>(level) + static_cast<float>(first_level_));
    const Projected seen = view.project(patch, repeats);
    ShownPatch& shown = shown_[number];
    shown = {seen.pixel_width_texels, seen.in_frame, at * (1 << level), 1 << level, 0};
    if (level > 0 && repeats <= 1) shown.offset = view.offset(patch, seen, chart.fabric.relief);
    const bool was_split = !split_before_.empty() && split_before_[number] != 0;
    const PatchLimits& limits = was_split ? view.merging_limits : view.limits;
    const float fraction = was_split ? merging : 1;
    const bool has_map = chart.fabric.has_map;
    if (level > 0 && seen.in_frame)
      splits = (seen.longest > fraction && view.is_near_light(patch, seen.radius / 2 / fraction)) ||
               (repeats > 1 && view.splits(patch, seen, limits)) ||
               (repeats <= 1 &&
                shown.offset > std::max(limits.max_offset_pixels, limits.max_offset_area / seen.longest)) ||
               (has_map && repeats > max_part_of_tile);
  }
  if (splits) {
    splits_[number] = 1;
    const V2i finer = level_size(chart, level - 1);
    for (int y = 2 * at.y; y < std::min(2 * at.y + 2, finer.y); ++y)
      for (int x = 2 * at.x; x < std::min(2 * at.x + 2, finer.x); ++x)
        choose_in(chart, view, level - 1, {x, y}, number);
    return;
  }
  const int side = 1 << level;
  for (int y = at.y * side; y < std::min((at.y + 1) * side, chart.size_in_patches.y); ++y) {
    const auto row =
        table_.begin() + static_cast<std::ptrdiff_t>(chart.first_table_entry +
                                                     static_cast<std::size_t>(y) * chart.size_in_patches.x);
    std::fill(row + at.x * side, row + std::min((at.x + 1) * side, chart.size_in_patches.x), number);
  }
}

}  // namespace selvedge
