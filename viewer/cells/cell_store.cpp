#include "viewer/cells/cell_store.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>

#include "format/base/parallel.h"
#include "format/fabric/yarn_sky.h"

namespace selvedge {
namespace {

/// The least cosine between view and a patch's normal: patches at an outline may face away in the mean.
constexpr float min_facing_patch = 0.08F;
constexpr float min_lamp_rise = 0.1F;  ///< of a light over a patch of texels
/// How far an image is outdated when its view or a light has turned by a radian.
constexpr float staleness_per_radian = 30;
/// Images of other patches are of use until then.
constexpr float max_outdated = 16;
/// Look-ups follow the relief of older images. The error grows with the pixels of a repeat: from this number
/// on a frame makes CellImageOptions::remade_fraction of the images, of smaller repeats at least this
/// fraction of it.
constexpr float fresh_pixels = 30;
constexpr double min_fresh = 0.4;
/// Cost (CellStore::Work) of images that one call may make for the first time while the picture moves, if
/// these are more than three tenths of all.
constexpr double max_missing = 2.5e5;
constexpr double cost_of_image = 1500;  ///< besides the cost of its samples
/// Coarse shading saves little of smaller images.
constexpr int many_samples = 96 * 96;
constexpr float large_cell_factor_at_rest = 1.5F;  ///< large_cell_sample_factor_ at rest, of few rays

/// CellLights::brightness(): yarn stands out of the cloth.
constexpr float transmitted_by_yarn = 0.15F;
constexpr float transmitted_by_thin_cloth = 0.5F;
/// Texels of cloth without yarn change with the view as if some of them lay so high, repeats.
constexpr float relief_of_texels = 0.2F;

/// Pixels around a part of a repeat that its image has, too, besides its offset.
constexpr float part_margin_pixels = 1;

/// Pixels of coarser images are larger, in steps of a quarter of an octave.
constexpr float step_larger = 1.189207F;
constexpr float max_larger = 64;
constexpr std::size_t needs_per_task = 64;

double image_bytes(const CellView& view) {
  const V2i texels = view.size.texels();
  const double of_texel = static_cast<double>(sizeof(CellTexel)) * view.plane_count + 1;  // its height
  return of_texel * (texels.x + 1) * (texels.y + 1);
}

/// Parts of the repeat that a patch covers.
RepeatParts parts_of(const ShownPatch& shown, int units_per_repeat) {
  RepeatParts parts = 0;
  const int count = std::max(shown.units_per_side * parts_per_side / units_per_repeat, 1);
  for (int axis = 0; axis < 2; ++axis) {
    const int unit = shown.first_unit[axis] & (units_per_repeat - 1);
    const std::uint32_t first = (std::uint32_t{1} << count) - 1;
    parts |= RepeatParts{first << unit * parts_per_side / units_per_repeat} << (parts_per_side * axis);
  }
  return parts;
}

}  // namespace

V3f mean_radiance(const SmoothLight& light, const V3f& n) {
  // The integrals of cosine and functions by their degree (Ramamoorthi and Hanrahan 2001), by pi.
  const auto basis = smooth_basis(n.x, n.y, n.z);
  V3f sum(0, 0, 0);
  for (std::size_t k = 0; k < smooth_function_count; ++k)
    sum += light.coefficients[k] * ((k == 0 ? 1.0F : k < 4 ? 2.0F / 3 : 0.25F) * basis[k]);
  return {std::max(sum.x, 0.0F), std::max(sum.y, 0.0F), std::max(sum.z, 0.0F)};
}

float CellLights::brightness(const V3f& normal, const V3f& point, const SmoothLight* around_there,
                             float transmitted_fraction, float environment_gain) const {
  float sum = 0;
  for (const Light& light : lights) {
    const auto& [direction, e] = illumination_at(light, origin + V3d(point));
    const float cosine = normal.dot(V3f(direction));
    sum += (light.is_environment_part ? environment_gain : 1) * (e.x + e.y + e.z) / 3 *
           ((1 - transmitted_fraction) * std::max(cosine, 0.0F) + transmitted_fraction * 0.5F * (1 + cosine));
  }
  if (around_there != nullptr) {
    const V3f mean = mean_radiance(*around_there, normal);
    sum += std::numbers::pi_v<float> * (mean.x + mean.y + mean.z) / 3;
  }
  // Not 0 where nothing shines, and finite.
  return std::clamp(sum, 1e-30F, 1e30F);
}

/// The purpose of an image.
struct CellStore::Purpose {
  CellView view;
  V2f pixel_width_texels{1, 1};
  RepeatParts parts = whole_repeat;
  /// Lights with a plane of their own; of the others, those that shine.
  std::uint32_t plane_lights = 0, lit = 0;
  float brightness = 1;
};

/// An image. Counts its bytes.
struct CellStore::Kept : Purpose {
  explicit Kept(std::size_t& all_bytes) : bytes(all_bytes) {}
  Kept(const Kept&) = delete;
  Kept& operator=(const Kept&) = delete;
  ~Kept() { bytes -= image.bytes(); }
  std::size_t& bytes;
  CellImage image;
  float samples = 1;
  int forced = -1;           ///< LevelOptions::forced
  bool moved = false;        ///< made while the picture moved
  std::uint64_t used = 0;    ///< call of make()
  std::uint64_t number = 0;  ///< CellLook::image
};

struct CellStore::Wanted : Purpose {
  CellSource source;
  const Cloth* cloth = nullptr;
  const Fabric* fabric = nullptr;
  V2f period{1, 1};  ///< mm, of what an image repeats
  bool shows_map = false;
  bool seen_through_holes = false;
  V2i first_stitch{0, 0};             ///< CellSize::first_stitch
  float margin = part_margin_pixels;  ///< pixels
  /// The yarn's; null where it does not vary.
  const Variation* variation() const {
    const Variation* const own = source.yarn != nullptr ? &source.yarn->yarns().variation() : nullptr;
    return own != nullptr && own->varies() ? own : nullptr;
  }
};

struct CellStore::Work {
  PatchSide patch = 0;
  float outdated = 0;
  float change = 0;  ///< on the screen
  double cost = 0;
  Wanted wanted;
  std::shared_ptr<Kept> kept;
};

CellStore::ClothSide::ClothSide(const Fabric& seen) : fabric(seen), texels(seen) {
  const std::shared_ptr<const Yarns>& yarns = seen.levels.front().yarns();
  if (!yarns) return;
  yarn.emplace(*yarns, seen.reference_height, std::span<const float>());
  shadows.emplace(*yarn);
}

std::shared_ptr<std::vector<CellStore::Cloth>> CellStore::cloths_of(std::span<const FabricSides> fabrics) {
  auto cloths = std::make_shared<std::vector<Cloth>>();
  for (const FabricSides& sides : fabrics) {
    Cloth& cloth = cloths->emplace_back();
    cloth.front = std::make_unique<ClothSide>(*sides.front);
    if (sides.back_fabric) cloth.back = std::make_unique<ClothSide>(*sides.back_fabric);
    cloth.transmitted_fraction = sides.lets_light_through() ? transmitted_by_thin_cloth : 0;
    for (const bool behind : {false, true}) {
      const ClothSide& side = cloth.seen_from(behind);
      if (!side.yarn) continue;
      const Yarns& yarns = side.yarn->yarns();
      const float plane = side.yarn->reference_height();
      const float relief = std::max(yarns.geometry().max_z - plane, plane - yarns.geometry().min_z);
      cloth.patches = {std::max(cloth.patches.relief, relief / std::max(yarns.tile().x, yarns.tile().y)),
                       V2f(yarns.tiles_per_repeat()), !yarns.data().map.empty()};
      cloth.transmitted_fraction = transmitted_by_yarn;
      cloth.has_yarn = true;
    }
    if (!cloth.has_yarn) cloth.patches.relief = relief_of_texels;
  }
  return cloths;
}

CellStore::CellStore(const MergedSurfaces& mesh, std::span<const SurfaceMaterial> materials,
                     std::span<const FabricSides> fabrics, const V3d& origin, const CellStore* shared)
    : mesh_(mesh),
      materials_(materials),
      origin_(origin),
      cloths_(shared != nullptr ? shared->cloths_ : cloths_of(fabrics)),
      patches_(mesh, materials, [&] {
        std::vector<PatchFabric> all;
        for (const Cloth& cloth : *cloths_) all.push_back(cloth.patches);
        return all;
      }()) {
  kept_.resize(2 * patches_.count());
  look_numbers_.resize(2 * patches_.count());
}

void CellStore::exchange_fabric(const FabricSides& fabric, const CellStore* shared) {
  cloths_ = shared != nullptr ? shared->cloths_ : cloths_of({&fabric, 1});
  patches_.set_relief(cloths_->front().patches.relief);
  std::ranges::fill(kept_, nullptr);
  std::ranges::fill(look_numbers_, 0);
  looks_.resize(1);
  aliases_.clear();
  alive_.clear();
}

CellStore::~CellStore() = default;

bool CellStore::needs_neighbours(PatchSide patch) const {
  const Wanted one = pixel_of(patch);
  return patches_.is_part(patch / 2) && (is_economical_ || one.shows_map) && one.variation() != nullptr;
}

RepeatPlace CellStore::lookup_place(PatchSide patch, const RepeatPlace& place) const {
  const Wanted one = pixel_of(patch);
  const Variation* const variation = one.variation();
  if (variation == nullptr) return place;
  return displaced_place(*variation, place,
                         offset_weight(variation_fade(*variation, one.pixel_width_texels)));
}

bool CellStore::is_made(PatchSide patch) const { return kept_[patch] && kept_[patch]->used >= frame_; }

void CellStore::begin(const CellFrame& frame) {
  camera_ = &frame.camera;
  interrupts_ = &frame.options;
  options_ = frame.options.cells;
  levels_ = frame.options.levels;
  is_economical_ = frame.is_economical;
  options_.scale_to_frame_pixels(frame.supersample, levels_.footprint_pixels);
  large_cell_sample_factor_ = options_.is_moving || frame.supersample > 2 ? 1 : large_cell_factor_at_rest;
  lights_ = frame.lights;
  lights_.origin = origin_;
  frame_ = call_ + 1;
  memory_ = {};
  demand_ = 0;
  late_.assign(kept_.size(), 0);
  for (Cloth& cloth : *cloths_) {
    for (ClothSide* side : {cloth.front.get(), cloth.back.get()}) {
      if (side == nullptr || !side->yarn) continue;
      side->shadows->set_memory(options_.memory_bytes / 8 / cloths_->size());
      if (lights_.smooth_light == nullptr || !side->sky.empty()) continue;  // lamps need none
      side->sky = sky_transfer(side->yarn->yarns(),
                               side->yarn->has_large_cell() ? side->shadows->sky_caster() : LightCaster());
      side->yarn->set_sky_transfer(side->sky);
    }
  }
  patches_.choose(frame.camera, origin_, frame.size, options_.patches, lights_.lights, options_.is_moving);
}

/// Levels and size of an image for pixels that are so much larger.
void CellStore::set_size(Wanted& wanted, float samples, float larger) const {
  const V2f shown = wanted.pixel_width_texels * levels_.footprint_pixels;
  // Coarse images of yarn are of the yarn, too: the means of its texels are a little brighter or darker.
  const V2f finest = wanted.pixel_width_texels * std::min(levels_.footprint_pixels, 1.0F);
  CellLevels& levels = wanted.view.levels = shown_levels(*wanted.fabric, finest, levels_.forced_level);
  if (levels.yarn_weight > 0) {
    if (wanted.source.yarn->has_large_cell() && !wanted.seen_through_holes)
      samples *= large_cell_sample_factor_;
    wanted.view.size =
        cell_size(shown * larger, samples, wanted.shows_map ? options_.max_tile_samples : max_cell_samples);
  } else {
    levels = shown_levels(*wanted.fabric, shown * larger, levels_.forced_level);
    wanted.view.size = texel_cell_size(*wanted.fabric, shown, levels.finer_level);
  }
  wanted.view.size.shows_map = wanted.shows_map;
  wanted.view.size.first_stitch = wanted.first_stitch;
  if (wanted.parts != whole_repeat && (levels.yarn_weight > 0 || wanted.shows_map))
    set_window(wanted.parts, wanted.margin, wanted.view.size);
}

/// The fabric and the pixels of a patch.
CellStore::Wanted CellStore::pixel_of(PatchSide patch) const {
  Wanted wanted;
  wanted.cloth = &(*cloths_)[materials_[mesh_.triangles[patches_[patch / 2].any_triangle].surface].fabric];
  ClothSide& cloth = wanted.cloth->seen_from(patch % 2 != 0);
  wanted.source = cloth.source();
  wanted.fabric = &cloth.fabric;
  wanted.period = cloth.yarn ? cloth.yarn->yarns().tile() : cloth.fabric.period_mm;
  wanted.shows_map = wanted.cloth->patches.has_map;
  const ShownPatch& shown = patches_.shown(patch / 2);
  wanted.pixel_width_texels = shown.pixel_width_texels;
  if (!(is_economical_ || wanted.shows_map) || !patches_.is_part(patch / 2)) return wanted;
  const V2i repeat = patches_.repeat_of(patch / 2);
  wanted.first_stitch = V2i(repeat.x, -1 - repeat.y) * map_tile_stitches;
  wanted.parts = parts_of(shown, patches_.units_per_repeat());
  wanted.margin += shown.offset;
  // Rows that leave their places: pages look no neighbours up.
  if (wanted.shows_map)
    wanted.margin += max_row_offset / (static_cast<float>(map_tile_stitches) *
                                       std::min(shown.pixel_width_texels.x, shown.pixel_width_texels.y));
  return wanted;
}

CellStore::Wanted CellStore::wanted(const PatchNeed& need, float samples, bool behind) const {
  const Patch& patch = patches_[need.patch / 2];
  const float side = need.patch % 2 == 0 ? 1.0F : -1.0F;
  Wanted result = pixel_of(need.patch);
  result.parts &= need.parts;
  result.seen_through_holes = behind;
  const V3f to_viewer = camera_->projection == Projection::parallel
                            ? V3f(camera_->to_viewer)
                            : V3f((camera_->position - origin_ - V3d(patch.mean_position)).normalized());
  V3f normal = patch.mean_normal.length() > 0 ? patch.mean_normal.normalized() * side : to_viewer;
  if (const float facing = normal.dot(to_viewer); facing < min_facing_patch)
    normal = (normal + to_viewer * (min_facing_patch - facing)).normalized();
  V3f tangent = patch.mean_tangent - normal * normal.dot(patch.mean_tangent);
  if (!(tangent.length2() > 1e-12F)) {
    const V3f axis = std::abs(normal.x) < 0.9F ? V3f(1, 0, 0) : V3f(0, 1, 0);
    tangent = axis - normal * normal.dot(axis);
  }
  tangent.normalize();
  const V3f up = normal.cross(tangent) * (patch.handedness < 0 ? -side : side);
  const auto local = [&](const V3f& d) { return V3f(d.dot(tangent), d.dot(up), d.dot(normal)); };
  result.view.view = local(to_viewer).normalized();

  result.plane_lights = need.lit & need.unlit;
  const std::uint32_t off = need.unlit & ~need.lit;
  float lifted = 0;  // brightness
  for (std::size_t i = 0; i < lights_.lights.size(); ++i) {
    const Light& light = lights_.lights[i];
    const std::uint32_t bit = i < 32 ? 1U << i : 0;
    if ((off & bit) != 0) continue;
    const auto& [direction, irradiance] = illumination_at(light, origin_ + V3d(patch.mean_position));
    if ((result.plane_lights & bit) == 0) result.lit |= bit;
    const int plane =
        (result.plane_lights & bit) != 0 ? 1 + std::popcount(result.plane_lights & (bit - 1)) : 0;
    V3f lamp = local(V3f(direction));
    // Parts of texels' patch may face a light that its mean does not.
    if (!result.cloth->has_yarn && std::abs(lamp.z) < min_lamp_rise) {
      lifted += (irradiance.x + irradiance.y + irradiance.z) / 3 * (1 - result.cloth->transmitted_fraction) *
                (min_lamp_rise - std::max(lamp.z, 0.0F));
      lamp.z = min_lamp_rise;
      lamp.normalize();
    }
    result.view.lamps.push_back({lamp, irradiance, plane});
  }
  result.view.plane_count = 1 + std::popcount(result.plane_lights);
  const SmoothLight* around = lights_.smooth_light;
  SmoothLight mean;
  if (around != nullptr && !lights_.vertex_lights.empty()) {
    for (const std::uint32_t corner : mesh_.triangles[patch.any_triangle].corners)
      for (std::size_t k = 0; k < smooth_function_count; ++k)
        mean.coefficients[k] += lights_.vertex_lights[corner].coefficients[k] / 3.0F;
    around = &mean;
  }
  if (around != nullptr) result.view.environment = turned(*around, tangent, up, normal);
  result.brightness =
      lights_.brightness(normal, patch.mean_position, around, result.cloth->transmitted_fraction) + lifted;
  result.view.has_hairs = !behind;
  result.view.hair_shadows = options_.hair_shadows;
  result.view.shadow_texels_per_pixel = options_.shadow_texels_per_pixel;
  result.view.rays_per_pixel_side = options_.rays_per_pixel_side;
  result.view.max_piece_pixels = options_.max_piece_pixels;
  set_size(result, samples, 1);
  const V2i& count = result.view.size.repeat_samples;
  result.view.shading_block_size = count.x * count.y > many_samples ? options_.shading_block_size : 1;
  return result;
}

/// How far an image is from what is wanted: 0 as it is, infinite: of no use.
float CellStore::outdated(const Kept& kept, const Wanted& wanted, float samples) const {
  // Lights with a plane of their own may be in shadow or not; others must be as they were.
  if ((wanted.plane_lights & ~kept.plane_lights) != 0 || ((wanted.lit ^ kept.lit) & ~kept.plane_lights) != 0)
    return HUGE_VALF;
  if (kept.view.lamps.size() < wanted.view.lamps.size() || kept.forced != levels_.forced_level ||
      kept.moved > options_.is_moving || (wanted.parts & ~kept.parts) != 0)
    return HUGE_VALF;
  const V2f wider = wanted.pixel_width_texels / kept.pixel_width_texels;
  const float ratio = std::max({wider.x, 1 / wider.x, wider.y, 1 / wider.y});
  if (ratio > 2) return HUGE_VALF;
  float worst = 2 * (ratio - 1);
  const auto turn = [](const V3f& a, const V3f& b) { return (a - b).length(); };
  worst = std::max(worst, turn(kept.view.view, wanted.view.view) * staleness_per_radian);
  if (kept.view.lamps.size() == wanted.view.lamps.size()) {
    for (std::size_t i = 0; i < wanted.view.lamps.size(); ++i) {
      const CellLamp& now = wanted.view.lamps[i];
      const CellLamp& then = kept.view.lamps[i];
      worst = std::max(worst, turn(now.direction, then.direction) * staleness_per_radian);
      const float bright = now.irradiance.length();
      worst = std::max(worst, 10 * (now.irradiance - then.irradiance).length() / std::max(bright, 1e-9F));
    }
  }
  if (wanted.view.environment.has_value() != kept.view.environment.has_value()) return HUGE_VALF;
  if (wanted.view.environment) {
    const float bright = wanted.view.environment->coefficients[0].length();
    for (std::size_t k = 0; k < smooth_function_count; ++k) {
      const float change =
          (wanted.view.environment->coefficients[k] - kept.view.environment->coefficients[k]).length();
      worst = std::max(worst, 5 * change / std::max(bright, 1e-9F));
    }
  }
  if (kept.samples < samples) worst = std::max(worst, 1.0F);
  return worst;
}

double CellStore::bytes_of(std::span<const PatchNeed> needs) const {
  double bytes = 0;
  for (const PatchNeed& need : needs) {
    Wanted one = pixel_of(need.patch);
    set_size(one, options_.samples_per_pixel_side, 1);
    bytes += image_bytes(one.view);
  }
  return bytes;
}

/// Bounds the bytes of a call's images, whose sizes it sets. Returns by how much their pixels are larger;
/// none: even the coarsest do not fit.
std::optional<float> CellStore::budget(std::span<Work> all, float samples, const CellRequest& request) {
  const auto most = static_cast<double>(options_.memory_bytes);
  double full = 0;
  for (const Work& work : all) {
    const double bytes = image_bytes(work.wanted.view);
    full += bytes;
    // A patch that another call of this frame has seen counts once.
    if (request.coarsening == 0 && !is_made(work.patch)) demand_ += bytes;
  }
  if (request.coarsening == 0) {
    // Images that the next frame shows again have room beside each other.
    const double whole = std::max({full, request.frame_need_bytes, options_.is_moving ? last_demand_ : 0});
    room_ = whole > most ? most / whole * full : most;
    memory_.wanted_bytes = std::max(memory_.wanted_bytes, whole);
  }
  float larger = 1;
  if (full > room_) {
    // Makes sizes smaller until all images fit.
    const auto fits = [&] {
      double sum = 0;
      for (Work& work : all) {
        set_size(work.wanted, samples, larger);
        sum += image_bytes(work.wanted.view);
      }
      return sum <= room_;
    };
    larger = max_larger;
    if (fits())
      // Sizes are not monotonic.
      for (larger = step_larger; !fits();) larger = std::min(larger * step_larger, max_larger);
    else if (request.coarsening < max_coarsening)
      return std::nullopt;
  }
  memory_.is_coarser |= larger > 1 || request.coarsening > 0;
  return larger;
}

/// Tells how far the images that patches have are outdated. `tight`: images that take more than is wanted
/// make room.
void CellStore::age(std::span<Work> all, float samples, bool tight) const {
  parallel_each(all.size(), needs_per_task, [&](std::size_t i) {
    Work& work = all[i];
    if (tight && work.kept &&
        (work.kept->samples > samples ||
         static_cast<double>(work.kept->image.bytes()) > image_bytes(work.wanted.view)))
      work.kept = nullptr;
    work.outdated = work.kept ? outdated(*work.kept, work.wanted, samples) : HUGE_VALF;
    if (work.outdated == HUGE_VALF && options_.is_moving && !tight) {
      work.kept = related_image(work.patch, work.wanted, samples);
      if (work.kept) work.outdated = outdated(*work.kept, work.wanted, samples) + 1;
    }
    const CellView& view = work.wanted.view;
    work.cost = static_cast<double>(view.size.count()) * (1 + 0.1 * view.plane_count) + cost_of_image;
  });
}

/// Whether a frame that moves lacks more images than it has time for: then these patches are late.
bool CellStore::postpone(std::span<const Work> all) {
  double missing = 0, whole = 0;
  for (const Work& work : all) {
    missing += work.outdated == HUGE_VALF ? work.cost : 0;
    whole += work.cost;
  }
  if (!is_economical_ || options_.remade_fraction == 1 || missing < std::max(max_missing, 0.3 * whole))
    return false;
  bool any = false;
  for (const Work& work : all) {
    if (work.outdated < HUGE_VALF || patches_.parent_side(work.patch) == work.patch) continue;
    late_[work.patch] = 1;
    any = true;
  }
  return any;
}

/// The images that are made in this call: first of useless ones, then of those that changed most on screen.
std::vector<CellStore::Work*> CellStore::order(std::span<Work> all) {
  // Some calls for few patches make none again.
  double allowed = options_.remade_fraction < 1 ? std::min(allowance_, 0.0) : 0;
  std::vector<Work*> order;
  for (Work& work : all) {
    // Images of moving frames that turned less look the same.
    if (work.outdated > (options_.remade_fraction < 1 ? 0.25F : 0)) order.push_back(&work);
    work.change = work.outdated * patches_.shown_area(work.patch / 2);
    // A patch that another call of this frame has seen counts once.
    if (is_made(work.patch)) continue;
    const V2f& pixel = work.wanted.pixel_width_texels;
    const double of_repeat = 1 / std::max(std::min(pixel.x, pixel.y) * fresh_pixels, 1e-6F);
    const double less = options_.remade_fraction < 1 ? std::clamp(of_repeat, min_fresh, 1.0) : 1;
    allowed += work.cost * options_.remade_fraction * less;
  }
  // At rest all are made, in the order of the request.
  if (options_.is_moving) std::ranges::stable_sort(order, std::ranges::greater(), &Work::change);
  std::size_t count = 0;
  double spent = 0;
  for (; count < order.size(); ++count) {
    Work& work = *order[count];
    if (work.outdated < HUGE_VALF) {
      if (options_.is_moving && spent >= allowed) break;
      spent += work.cost;
    }
    work.kept = std::make_shared<Kept>(bytes_);
    work.kept->number = ++made_;
  }
  order.resize(count);
  allowance_ = allowed - spent;
  return order;
}

/// Makes images, for which it makes room.
void CellStore::render(std::span<const Work> all, std::span<Work* const> order, float samples) {
  for (const Work& work : all) {
    if (!kept_[work.patch]) alive_.push_back(work.patch);
    kept_[work.patch] = work.kept;
    if (work.kept) work.kept->used = call_;
  }
  double coming = 0;  // bytes
  for (const Work* work : order) coming += image_bytes(work->wanted.view);
  trim(coming);
  parallel_for(0, static_cast<int>(order.size()), [&](int i) {
    thread_local CellScratch scratch;
    if (interrupts_->is_interrupted()) return;
    Wanted& made = order[i]->wanted;
    Kept& kept = *order[i]->kept;
    make_cell_image(made.source, made.view, scratch, kept.image);
    static_cast<Purpose&>(kept) = std::move(made);
    if (kept.view.size.is_whole()) kept.parts = whole_repeat;
    kept.samples = samples;
    kept.forced = levels_.forced_level;
    kept.moved = options_.is_moving;
  });
  for (const Work* work : order) bytes_ += work->kept->image.bytes();
  // An interrupted frame lacks parts.
  for (const Work& work : all)
    if (work.kept && work.kept->image.texels.empty()) kept_[work.patch].reset();
  memory_.peak_bytes = std::max(memory_.peak_bytes, static_cast<double>(bytes_));
  std::erase_if(alive_, [&](PatchSide patch) { return !kept_[patch]; });
}

/// The part of its image that a patch shows.
CellLook CellStore::look_of(const Work& work) const {
  if (!kept_[work.patch]) return {};
  const Kept& kept = *kept_[work.patch];
  const CellImage& image = kept.image;
  const SurfaceMaterial& material =
      materials_[mesh_.triangles[patches_[work.patch / 2].any_triangle].surface];
  // Matt texels are as bright as their normal implies; yarn stands out of the cloth.
  const bool has_yarn = (*cloths_)[material.fabric].has_yarn;
  CellLook look{.size = {image.repeat_texels.x, image.repeat_texels.y, image.origin.x, image.origin.y},
                .inverse_brightness = 1 / kept.brightness,
                .scale = image.radiance_scale,
                .min_gain = has_yarn ? 0.5F : 0.0F,
                .max_gain = has_yarn ? 2.0F : 8.0F,
                .window_size = {static_cast<float>(image.width), static_cast<float>(image.height), 0, 0},
                .texels = image.texels.data(),
                .height_step = image.height_step,
                .plane_lights = kept.plane_lights,
                .fills_holes = !material.keeps_opacity,
                .image = kept.number};
  if (!image.heights.empty()) {
    const V2f slope = ray_slope(kept.view.view);
    look.heights = image.heights.data();
    look.parallax = {slope.x, slope.y, image.height_step * image.repeat_texels.x / work.wanted.period.x,
                     image.height_step * image.repeat_texels.y / work.wanted.period.y};
  }
  if (const Variation* const variation = look.variation = work.wanted.variation(); variation != nullptr) {
    look.fade = variation_fade(*variation, work.wanted.pixel_width_texels);
    look.offset_weight = offset_weight(look.fade);
  }
  return look;
}

CellLook& CellStore::own_look(PatchSide patch) {
  if (look_numbers_[patch] == 0) {
    look_numbers_[patch] = static_cast<std::uint32_t>(looks_.size());
    looks_.emplace_back();
  }
  return looks_[look_numbers_[patch]];
}

void CellStore::share_look(PatchSide patch, PatchSide other) {
  own_look(patch) = CellLook(look(other));  // a copy: looks_ may grow
  aliases_.push_back(patch);
}

CellAnswer CellStore::make(const CellRequest& request) {
  if (request.budget_bytes > 0) options_.memory_bytes = static_cast<std::size_t>(request.budget_bytes);
  for (const PatchSide patch : aliases_) own_look(patch) = {};
  aliases_.clear();
  float samples = options_.samples_per_pixel_side;
  std::vector<Work> all(request.needs.size());
  parallel_each(all.size(), needs_per_task, [&](std::size_t i) {
    all[i].patch = request.needs[i].patch;
    all[i].wanted = wanted(request.needs[i], samples, request.seen_through_holes);
    all[i].kept = kept_[all[i].patch];
  });
  const std::optional<float> larger = budget(all, samples, request);
  if (!larger) return {false, request.coarsening + 1};
  double held = 0;
  for (const Work& work : all)
    held += std::max(image_bytes(work.wanted.view),
                     work.kept ? static_cast<double>(work.kept->image.bytes()) : 0);
  samples /= *larger;
  age(all, samples, *larger > 1 || held > room_);
  if (postpone(all)) return {false, request.coarsening};
  ++call_;
  render(all, order(all), samples);
  for (const Work& work : all) own_look(work.patch) = look_of(work);
  return {true, request.coarsening};
}

/// An image of a patch around or within this one that is of use.
std::shared_ptr<CellStore::Kept> CellStore::related_image(PatchSide patch, const Wanted& wanted,
                                                          float samples) const {
  const std::uint32_t side = patch % 2;
  const std::uint32_t up = patches_.parent(patch / 2);
  const std::uint32_t down = patches_.child(patch / 2);
  for (const std::uint32_t related : {up, down, patches_.parent(up), patches_.child(down)}) {
    const std::shared_ptr<Kept>& kept = kept_[2 * related + side];
    if (kept && kept->view.size.is_whole() && outdated(*kept, wanted, samples) < max_outdated) return kept;
  }
  return nullptr;
}

/// Forgets images of earlier calls, the oldest first, until the others leave this number of bytes free.
void CellStore::trim(double coming) {
  const auto fits = [&] {
    return static_cast<double>(bytes_) + coming <= static_cast<double>(options_.memory_bytes);
  };
  if (fits()) return;
  std::ranges::stable_sort(alive_, std::ranges::greater(),
                           [&](PatchSide patch) { return kept_[patch]->used; });
  while (!fits() && !alive_.empty() && kept_[alive_.back()]->used < call_) {
    kept_[alive_.back()].reset();
    own_look(alive_.back()) = {};
    alive_.pop_back();
  }
}

}  // namespace selvedge
