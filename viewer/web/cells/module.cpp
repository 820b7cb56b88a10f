// The WebAssembly module of the browser: cell images of the garments on a page, and their places in an atlas.
//
// Arguments that are arrays lie at the address that input() returns. Fabrics, garments and tiles have
// numbers; a garment or tile that is removed leaves its number to another one. Tile 0 is no tile. Coordinates
// are in the axes of their mesh, m.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/level_values.h"
#include "format/scene/tangents.h"
#include "viewer/web/cells/atlas.h"

namespace selvedge {

void parallel_for(int begin, int end, const std::function<void(int)>& body) {
  for (int i = begin; i < end; ++i) body(i);
}

namespace web {
namespace {

std::vector<std::uint32_t> given;
const float* floats() { return reinterpret_cast<const float*>(given.data()); }
const std::int32_t* whole() { return reinterpret_cast<const std::int32_t*>(given.data()); }
V3f vector_at(std::size_t i) { return {floats()[i], floats()[i + 1], floats()[i + 2]}; }

struct LoadedFabric {
  Fabric fabric;
  std::vector<std::pair<LayerShape, Fabric>> others;  ///< sides that are not added yet
  LayerShape shape;
  std::optional<FabricSides> sides;
};
std::vector<std::shared_ptr<LoadedFabric>> fabrics;  ///< null: removed

/// A mesh in its fabric, and what is seen of it.
struct Garment {
  std::shared_ptr<const LoadedFabric> fabric;
  MergedSurfaces mesh;
  std::vector<V2d> uvs;
  std::vector<std::uint32_t> corners;
  std::vector<SurfaceMaterial> materials;
  std::vector<FabricSides> sides;
  std::unique_ptr<CellStore> store;
  std::vector<float> charts;      ///< of each vertex: first entry of its chart's table, its first u and v
  std::uint64_t first_image = 0;  ///< added to CellLook::image
  std::size_t table = 0;          ///< its first entry in the atlas's table
  Camera camera;
  std::vector<Light> lights;
  SmoothLight around;
  DrawOptions options;
  std::vector<PatchNeed> needs;  ///< of this frame, patches in front first
  std::size_t in_front = 0;
  std::vector<PatchNeed> visits;  ///< of these its images are made, or made again: the first in front, too
  std::size_t visits_in_front = 0;
  std::size_t done = 0;
  struct Shown {
    std::uint64_t image = 0;  ///< in the atlas's numbers
    std::uint64_t at = 0;     ///< frame that last chose it
  };
  std::vector<Shown> shown;  ///< of patches and sides
  double need = 0;           ///< for its images, bytes
  std::vector<float> depths;
  std::vector<std::uint8_t> flags;
};
std::vector<std::unique_ptr<Garment>> garments;  ///< null: removed

Atlas atlas;
std::uint64_t garments_made = 0;
std::uint64_t frame = 1;
std::uint64_t atlas_mark = 1;
std::uint64_t packed_at = 0;  ///< frame
std::size_t image_memory = 0;
/// Share of the atlas that images may fill: it has shelves of equal heights.
constexpr double max_fill = 0.75;
constexpr double min_fill = 0.05;
/// A frame that moves visits one of so many patches that have images, in front and behind.
constexpr int visits_of_front = 4;
constexpr int visits_behind = 8;
/// Share of the atlas from which on it is not packed again.
constexpr double max_packed = 0.85;
double fill = max_fill;
double full_need = 0;  ///< all_need() when images found no room
/// Whether images have found no room, and whether tiles have moved or are others', since it was asked.
bool is_full = false;
bool has_moved = false;
std::vector<std::uint16_t> table;  ///< [entry]: tiles of front and back
std::vector<float> tile_numbers;   ///< twelve of each tile
struct Upload {
  std::int32_t x, y, width, height;
  const std::uint16_t* halves;
  const std::uint8_t* heights;  ///< in steps, 128: in the plane; 0: none
};
std::vector<Upload> uploads;
std::vector<std::vector<std::uint16_t>> pixels;
std::vector<std::vector<std::uint8_t>> heights;

/// Images as halves: sign and one bit of the fraction differ (CellTexel).
void upload(const CellLook& look, TileNumber number) {
  const Tile& tile = atlas[number];
  std::vector<std::uint16_t>& halves =
      pixels.emplace_back(4 * static_cast<std::size_t>(tile.size.x) * tile.size.y);
  const std::uint16_t* from = look.texels->data();
  for (std::uint16_t& half : halves) half = static_cast<std::uint16_t>(*from++ >> 1);
  std::vector<std::uint8_t>& steps = heights.emplace_back(halves.size() / 4, std::uint8_t{0});
  for (std::size_t i = 0; look.heights != nullptr && i < steps.size(); ++i)
    steps[i] = static_cast<std::uint8_t>(look.heights[i] + 128);
  uploads.push_back({tile.place.x, tile.place.y, tile.size.x, tile.size.y, halves.data(), steps.data()});
  tile_numbers.resize(std::max(tile_numbers.size(), std::size_t{12} * (number + 1)));
  const float numbers[]{static_cast<float>(tile.place.x),
                        static_cast<float>(tile.place.y),
                        look.size[0],
                        look.size[1],
                        look.size[2],
                        look.size[3],
                        look.scale,
                        look.brightness,
                        look.relief[0],
                        look.relief[1],
                        look.relief[2],
                        look.relief[3]};
  std::memcpy(&tile_numbers[std::size_t{12} * number], numbers, sizeof numbers);
}

/// Bytes of all garments' images in sight as fine as wanted.
double all_need() {
  double sum = 0;
  for (const auto& garment : garments) sum += garment ? garment->need : 0;
  return sum;
}

void clear_atlas() {
  const int rows = atlas.rows();
  atlas = {};
  atlas.set_rows(rows);
  uploads.clear();
  pixels.clear();
  heights.clear();
}

/// Lets a patch show its image of now; whether that has a tile.
bool place_look(Garment& garment, PatchSide patch) {
  const CellLook& look = garment.store->look(patch);
  std::uint64_t& image = garment.shown[patch].image;
  image = 0;
  if (look.texels == nullptr) return true;
  const std::uint64_t wanted = garment.first_image + look.image;
  if (atlas.find(wanted, atlas_mark) == 0) {
    const V2i size(static_cast<int>(look.size[0]) + 1, static_cast<int>(look.size[1]) + 1);
    const TileNumber tile = atlas.add(wanted, size, atlas_mark);
    if (tile == 0) return false;
    upload(look, tile);
  }
  image = wanted;
  return true;
}

/// Makes room in the atlas of tiles that no patch in sight shows. Returns whether there is more.
bool drop_unseen() {
  const std::uint64_t now = ++atlas_mark;
  for (const auto& garment : garments) {
    if (!garment) continue;
    for (const PatchNeed& need : garment->needs) atlas.find(garment->shown[need.patch].image, now);
  }
  const bool any = atlas.evict(now);
  has_moved |= any;
  return any;
}

/// Makes room in the atlas of the gaps between tiles, once a frame. Returns whether there is more.
bool pack() {
  if (packed_at == frame || atlas.texels() > max_packed * Atlas::width * atlas.rows()) return false;
  packed_at = frame;
  std::vector<std::pair<Garment*, PatchSide>> places;
  for (const auto& garment : garments) {
    if (!garment) continue;
    for (const PatchNeed& need : garment->needs) {
      std::uint64_t& image = garment->shown[need.patch].image;
      if (image == garment->first_image + garment->store->look(need.patch).image)
        places.emplace_back(garment.get(), need.patch);
      else
        image = 0;
    }
  }
  std::stable_sort(places.begin(), places.end(), [](const auto& a, const auto& b) {
    return a.first->store->look(a.second).size[1] > b.first->store->look(b.second).size[1];
  });
  clear_atlas();
  has_moved = true;
  for (const auto& [garment, patch] : places) place_look(*garment, patch);
  return true;
}

/// Gives the images of patches tiles.
void show(Garment& garment, std::span<const PatchNeed> needs) {
  for (const PatchNeed& need : needs) {
    garment.shown[need.patch].at = frame;
    const std::uint64_t old = garment.shown[need.patch].image;
    bool is_placed = place_look(garment, need.patch);
    if (!is_placed && !is_full && drop_unseen()) is_placed = place_look(garment, need.patch);
    if (!is_placed && !is_full && pack()) is_placed = place_look(garment, need.patch);
    if (is_placed) continue;
    garment.shown[need.patch].image = old;
    if (is_full || fill <= min_fill) continue;
    fill = std::max(0.8 * fill, min_fill);
    full_need = all_need();
    is_full = true;
  }
}

/// Notes what is in sight: depths of a coarse frame, then which triangles lie behind them.
void look_for_patches(Garment& garment) {
  constexpr int columns = 256;
  constexpr int rows = 256;
  const MergedSurfaces& mesh = garment.mesh;
  const Patches& patches = garment.store->patches();
  const ProjectedVertices projected = project(mesh, clip_matrix(garment.camera, V3d(0, 0, 0)), columns, rows);
  const auto screen = [&](std::uint32_t vertex) {
    const Group& g = projected.screen[vertex];
    const float inverse = 1 / g[2];
    return V3f(0.5F * columns + g[0] * inverse, 0.5F * rows + g[1] * inverse, g[2]);
  };
  garment.depths.assign(std::size_t{columns} * rows, HUGE_VALF);
  const auto before_viewer = [&](const MergedTriangle& t) {
    return std::all_of(t.corners.begin(), t.corners.end(),
                       [&](std::uint32_t c) { return projected.screen[c][2] > 0; });
  };
  for (const MergedTriangle& t : mesh.triangles) {
    if (!before_viewer(t)) continue;
    const V3f a = screen(t.corners[0]);
    const V3f b = screen(t.corners[1]);
    const V3f c = screen(t.corners[2]);
    const float area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
    if (area == 0) continue;
    const int left = std::max(static_cast<int>(std::ceil(std::min({a.x, b.x, c.x}) - 0.5F)), 0);
    const int right = std::min(static_cast<int>(std::floor(std::max({a.x, b.x, c.x}) - 0.5F)), columns - 1);
    const int low = std::max(static_cast<int>(std::ceil(std::min({a.y, b.y, c.y}) - 0.5F)), 0);
    const int high = std::min(static_cast<int>(std::floor(std::max({a.y, b.y, c.y}) - 0.5F)), rows - 1);
    for (int y = low; y <= high; ++y) {
      for (int x = left; x <= right; ++x) {
        const V2f p(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
        const float v = ((p.x - a.x) * (c.y - a.y) - (c.x - a.x) * (p.y - a.y)) / area;
        const float w = ((b.x - a.x) * (p.y - a.y) - (p.x - a.x) * (b.y - a.y)) / area;
        if (v < 0 || w < 0 || v + w > 1) continue;
        float& depth = garment.depths[y * columns + x];
        depth = std::min(depth, a.z + (b.z - a.z) * v + (c.z - a.z) * w);
      }
    }
  }
  // 1 and 2: front and back in front; 4 and 8: behind others.
  garment.flags.assign(patches.count(), 0);
  // Whether all of these points that lie in the frame are hidden, and some do.
  const auto hidden = [&](const std::array<V3f, 4>& points, float tolerance) {
    int inside = 0;
    int behind = 0;
    for (const V3f& at : points) {
      if (!(at.x >= 0 && at.y >= 0 && at.x < columns && at.y < rows)) continue;
      ++inside;
      const float depth = garment.depths[static_cast<int>(at.y) * columns + static_cast<int>(at.x)];
      behind += at.z > depth + tolerance ? 1 : 0;
    }
    return inside > 0 && behind == inside;
  };
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const MergedTriangle& t = mesh.triangles[i];
    const Patches::Place& place = patches.place(static_cast<std::uint32_t>(i));
    const auto is_behind_viewer = [&](std::uint32_t c) { return !(projected.screen[c][2] > 0); };
    if (std::all_of(t.corners.begin(), t.corners.end(), is_behind_viewer)) continue;
    bool behind = false;
    bool back = false;
    if (before_viewer(t)) {
      const V3f a = screen(t.corners[0]);
      const V3f b = screen(t.corners[1]);
      const V3f c = screen(t.corners[2]);
      if (std::max({a.x, b.x, c.x}) < 0 || std::max({a.y, b.y, c.y}) < 0 ||
          std::min({a.x, b.x, c.x}) > columns || std::min({a.y, b.y, c.y}) > rows)
        continue;
      back = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y) < 0;
      const float tolerance = 0.5F * (std::max({a.z, b.z, c.z}) - std::min({a.z, b.z, c.z})) +
                              4 * static_cast<float>(garment.camera.window_half.y) / rows * a.z;
      behind = hidden({a, b, c, (a + b + c) / 3.0F}, tolerance);
    }
    const std::uint8_t flag = static_cast<std::uint8_t>((back ? 2 : 1) << (behind ? 2 : 0));
    patches.for_all(place, patches.extent(mesh, i),
                    [&](std::uint32_t patch) { garment.flags[patch] |= flag; });
  }
  garment.needs.clear();
  const auto add = [&](std::uint8_t mask, std::uint8_t without) {
    for (std::uint32_t i = 0; i < garment.flags.size(); ++i) {
      for (std::uint32_t side = 0; side < 2; ++side) {
        const int flag = garment.flags[i] >> side;
        if (patches.shown(i).in_frame && (flag & mask) != 0 && (flag & without) == 0)
          garment.needs.push_back({2 * i + side, ~0U, 0});
      }
    }
  };
  add(1, 0);
  garment.in_front = garment.needs.size();
  add(4, 1);
  garment.done = 0;
  // Garments share the memory by their needs.
  garment.need = garment.store->expect(garment.needs);
  const double all = all_need();
  garment.store->set_memory(fill * static_cast<double>(image_memory) * (all > 0 ? garment.need / all : 1));
  // Images that are shown stay; first come patches without an image, then those that were not looked at for
  // longest.
  const auto place_of = [&](const PatchNeed& need) {
    const Garment::Shown& shown = garment.shown[need.patch];
    return shown.image != 0 && atlas.find(shown.image, 0) != 0 ? shown.at : 0;
  };
  const auto earlier = [&](const PatchNeed& a, const PatchNeed& b) { return place_of(a) < place_of(b); };
  const auto behind = garment.needs.begin() + static_cast<std::ptrdiff_t>(garment.in_front);
  std::stable_sort(garment.needs.begin(), behind, earlier);
  std::stable_sort(behind, garment.needs.end(), earlier);
  const auto visit = [&](const auto& first, const auto& last, int share) {
    const auto has_none = [&](const PatchNeed& need) { return place_of(need) == 0; };
    const auto shown = std::find_if_not(first, last, has_none);
    const auto end = shown + (last - shown + share - 1) / share;
    garment.visits.insert(garment.visits.end(), first, end);
  };
  const bool moves = garment.options.cells.fresh < 1;
  garment.visits.clear();
  visit(garment.needs.begin(), behind, moves ? visits_of_front : 1);
  garment.visits_in_front = garment.visits.size();
  visit(behind, garment.needs.end(), moves ? visits_behind : 1);
}

/// The first entry of so many in the table that no garment has.
std::size_t room_in_table(std::size_t entries) {
  std::vector<std::pair<std::size_t, std::size_t>> taken;
  for (const auto& garment : garments) {
    if (garment && garment->store)
      taken.emplace_back(garment->table, garment->store->patches().table().size());
  }
  std::sort(taken.begin(), taken.end());
  std::size_t first = 0;
  for (const auto& [begin, count] : taken) {
    if (begin >= first + entries) break;
    first = begin + count;
  }
  table.resize(std::max(table.size(), 2 * (first + entries)));
  return first;
}

/// Gives a garment's mesh a shape: positions, and normals and tangents with them.
Tangents take_shape(Garment& garment, const std::vector<V3d>& positions, const std::vector<V3d>& normals) {
  Tangents tangents = compute_tangents(positions, normals, garment.uvs, garment.corners, Facing::normals);
  MergedSurfaces& mesh = garment.mesh;
  mesh.positions.clear();
  mesh.attributes.clear();
  mesh.triangles.clear();
  for (std::size_t i = 0; i < tangents.tangents.size(); ++i) {
    const std::size_t source = i < positions.size() ? i : tangents.copy_of[i - positions.size()];
    const V3f normal(normals[source]);
    const V4f& tangent = tangents.tangents[i];
    const V2f uv(garment.uvs[source]);
    mesh.positions.emplace_back(positions[source]);
    mesh.attributes.push_back(
        {Group{normal.x, normal.y, normal.z, uv.x}, Group{tangent.x, tangent.y, tangent.z, uv.y}});
  }
  for (std::size_t i = 0; i < tangents.indices.size(); i += 3) {
    MergedTriangle& t = mesh.triangles.emplace_back();
    t.corners = {tangents.indices[i], tangents.indices[i + 1], tangents.indices[i + 2]};
    t.handedness = tangents.tangents[t.corners[0]].w;
  }
  return tangents;
}

}  // namespace
}  // namespace web
}  // namespace selvedge

using namespace selvedge;
using namespace selvedge::web;

#define EXPORT(name) extern "C" __attribute__((export_name(#name)))

/// Address of room for so many numbers of 32 bits.
EXPORT(input) void* input(std::uint32_t count) {
  given.resize(count);
  return given.data();
}

/// Sets the bytes of images, and returns the rows of the atlas.
EXPORT(set_memory) std::uint32_t set_memory(std::uint32_t bytes) {
  constexpr std::uint32_t least = 4U << 20;
  constexpr std::uint32_t most = 128U << 20;
  image_memory = std::clamp(bytes, least, most);
  atlas.set_rows(static_cast<int>(image_memory / ((sizeof(CellTexel) + 1) * Atlas::width)));
  return static_cast<std::uint32_t>(atlas.rows());
}

/// Begins a fabric; input: width, height, levels (whole), period (2), height of the plane, thickness, columns
/// and rows of views and lights (whole). Returns its number.
EXPORT(add_fabric) std::uint32_t add_fabric() {
  fabrics.push_back(std::make_shared<LoadedFabric>());
  Fabric& fabric = fabrics.back()->fabric;
  fabric.period_mm = {floats()[3], floats()[4]};
  fabric.reference_height = floats()[5];
  fabric.thickness_mm = floats()[6];
  for (int k = 0; k < whole()[2]; ++k) {
    FabricLevel& level = fabric.levels.emplace_back();
    level.width = level_size(whole()[0], k);
    level.height = level_size(whole()[1], k);
  }
  return static_cast<std::uint32_t>(fabrics.size() - 1);
}

/// Begins a side of a fabric; input: side, columns and rows of views and lights, lobes, products, functions
/// of views and lights, curves, nodes, stations, fields, values of a station (whole), factor on radiance.
EXPORT(add_side) void add_side(std::uint32_t number) {
  LoadedFabric& loaded = *fabrics[number];
  const std::int32_t* n = whole();
  LayerShape shape;
  shape.side = static_cast<Side>(n[0]);
  shape.views = std::max(n[1] * n[2], 1);
  shape.lights = std::max(n[3] * n[4], 1);
  shape.lobes = n[5];
  shape.products = n[6];
  shape.view_functions = n[7];
  shape.light_functions = n[8];
  shape.yarns = {n[9], n[10], n[11], n[12], n[13]};
  shape.base_texels = loaded.fabric.levels.front().texels();
  Fabric* side = &loaded.fabric;
  if (shape.side == Side::front) {
    loaded.shape = shape;
  } else {
    side = &loaded.others.emplace_back(shape, loaded.fabric).second;
    for (FabricLevel& level : side->levels) {
      FabricLevel fresh;
      fresh.width = level.width;
      fresh.height = level.height;
      level = fresh;
    }
    side->sides = {};
  }
  side->side = shape.side;
  side->views = {n[1], n[2]};
  side->lights = {n[3], n[4]};
  side->radiance_scale = floats()[14];
}

/// Sets a layer of the side that was begun last; input: pairs of products (whole, two each), then its
/// channels of all texels.
EXPORT(add_layer)
void add_layer(std::uint32_t number, std::uint32_t kind, std::uint32_t k, std::uint32_t channels,
               std::uint32_t pairs) {
  LoadedFabric& loaded = *fabrics[number];
  const LayerShape& shape = loaded.others.empty() ? loaded.shape : loaded.others.back().first;
  FabricLevel& level = (loaded.others.empty() ? loaded.fabric : loaded.others.back().second).levels[k];
  for (std::uint32_t i = 0; i < pairs; ++i) level.pairs.emplace_back(whole()[2 * i], whole()[2 * i + 1]);
  const auto texels = static_cast<std::size_t>(level.texels());
  std::vector<std::vector<float>> planes;
  const float* from = floats() + 2 * std::size_t{pairs};
  for (std::uint32_t i = 0; i < channels; ++i, from += texels) planes.emplace_back(from, from + texels);
  std::vector<const std::vector<float>*> pointers;
  for (const std::vector<float>& plane : planes) pointers.push_back(&plane);
  set_pixels(level, static_cast<LayerKind>(kind), shape, pointers);
}

/// Ends a fabric; `shown` of other sides: input, [side][level], the level whose texels a level shows. Returns
/// 0 where it is refused.
EXPORT(end_fabric) std::uint32_t end_fabric(std::uint32_t number) {
  LoadedFabric& loaded = *fabrics[number];
  Fabric& fabric = loaded.fabric;
  const auto share_bases = [](Fabric& side) {
    const std::shared_ptr<const ProductBases> bases = side.levels.front().bases;
    for (FabricLevel& level : side.levels) level.bases = level.has(LayerKind::products) ? bases : nullptr;
  };
  share_bases(fabric);
  IssueSink sink("");
  if (loaded.shape.yarns.curves > 0)
    restore_yarns(fabric.levels.front(), loaded.shape, fabric.period_mm, default_memory, sink);
  if (sink.has_error()) return 0;
  const std::int32_t* shown = whole();
  for (auto& [shape, side] : loaded.others) {
    share_bases(side);
    restore_light_through(fabric.levels.front(), side.levels.front());
    const int levels = static_cast<int>(side.levels.size());
    for (int k = 0; k < levels; ++k, ++shown) {
      if (*shown > k) side.levels[k].take_texels(side.levels[*shown], *shown - k);
    }
    fabric.add_side(std::move(side));
  }
  loaded.others.clear();
  loaded.sides.emplace(fabric);
  return 1;
}

/// Sixteen words of the fabric's variation: keys of its four lattices, rows, lengths and log2_repeats along u
/// and along v (whole), offset and change along either (floats), share of yarn along v seen from in front and
/// from behind.
EXPORT(variation_of) const std::uint32_t* variation_of(std::uint32_t number) {
  static std::uint32_t result[16];
  const FabricSides& sides = *fabrics[number]->sides;
  const auto& yarns = sides.front->levels.front().yarns();
  const Variation variation = yarns ? yarns->variation() : Variation{};
  const auto& behind = sides.seen_from(true).levels.front().yarns();
  float numbers[6]{};
  for (std::uint32_t i = 0; i < 4; ++i) result[i] = variation_key(variation.seed, i);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const YarnRuns& runs = variation.runs[axis];
    for (std::size_t k = 0; k < 3; ++k)
      result[4 + 3 * axis + k] =
          static_cast<std::uint32_t>(std::array{runs.rows, runs.lengths, runs.log2_repeats}[k]);
    numbers[2 * axis] = runs.offset;
    numbers[2 * axis + 1] = runs.change;
  }
  numbers[4] = variation.share;
  numbers[5] = behind ? behind->variation().share : 0;
  std::memcpy(&result[10], numbers, sizeof numbers);
  return result;
}

/// f and alpha, of a texel or at texture coordinates (evaluate.h). Input: light and view. Returns the address
/// of four numbers.
EXPORT(evaluate_query)
const float* evaluate_query(std::uint32_t number, std::uint32_t behind, std::uint32_t of_texel, double level,
                            double x, double y) {
  static float result[4];
  const Fabric& seen = fabrics[number]->sides->seen_from(behind != 0);
  const V3f light = vector_at(0);
  const V3f view = vector_at(3);
  const Shading shading = of_texel != 0 ? evaluate(seen, static_cast<int>(level), static_cast<int>(x),
                                                   static_cast<int>(y), light, view)
                                        : evaluate(seen, level, V2d(x, y), light, view);
  for (int c = 0; c < 3; ++c) result[c] = shading.radiance[c];
  result[3] = shading.alpha;
  return result;
}

/// Adds a mesh in a fabric; input: of each vertex position, normal (3 each), u, v; then three vertices of
/// each triangle (whole). Returns its number.
EXPORT(add_garment)
std::uint32_t add_garment(std::uint32_t fabric, std::uint32_t vertices, std::uint32_t triangles) {
  auto place = std::find(garments.begin(), garments.end(), nullptr);
  if (place == garments.end()) place = garments.insert(place, nullptr);
  *place = std::make_unique<Garment>();
  Garment& garment = **place;
  garment.first_image = ++garments_made << 40;
  garment.fabric = fabrics[fabric];
  garment.sides = {*garment.fabric->sides};
  SurfaceMaterial& material = garment.materials.emplace_back();
  material.fabric = 0;
  material.keeps_opacity = true;
  std::vector<V3d> positions;
  std::vector<V3d> normals;
  for (std::uint32_t i = 0; i < vertices; ++i) {
    const float* v = floats() + 8 * std::size_t{i};
    positions.emplace_back(v[0], v[1], v[2]);
    normals.push_back(V3d(v[3], v[4], v[5]).normalized());
    garment.uvs.emplace_back(v[6], v[7]);
  }
  const std::uint32_t* const corners = &given[8 * std::size_t{vertices}];
  garment.corners.assign(corners, corners + 3 * std::size_t{triangles});
  const Tangents tangents = take_shape(garment, positions, normals);
  const MergedSurfaces& mesh = garment.mesh;
  const auto kin = std::ranges::find_if(
      garments, [&](const auto& other) { return other && other->store && other->fabric == garment.fabric; });
  garment.store = std::make_unique<CellStore>(mesh, garment.materials, garment.sides, V3d(0, 0, 0),
                                              kin != garments.end() ? (*kin)->store.get() : nullptr);
  const Patches& patches = garment.store->patches();
  garment.shown.resize(2 * patches.count());
  garment.table = room_in_table(patches.table().size());
  garment.charts.resize(6 * std::size_t{vertices});
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Patches::Place& place = patches.place(static_cast<std::uint32_t>(i));
    const Patches::Chart& chart = patches.chart(place.chart);
    const V2f uv = mesh.uv(mesh.triangles[i].corners[0]);
    const int units = patches.units_of_repeat();
    const float numbers[]{static_cast<float>(garment.table + chart.table),
                          std::floor(uv.x) - static_cast<float>(place.u / units),
                          std::floor(uv.y) - static_cast<float>(place.v / units),
                          patches.smallest_of_repeat(),
                          static_cast<float>(chart.size.x),
                          static_cast<float>(chart.size.y)};
    // The last corner's numbers are the triangle's: others may lie in several charts, where the texture is
    // mirrored.
    const std::uint32_t vertex = mesh.triangles[i].corners[2];
    const std::uint32_t source = vertex < vertices ? vertex : tangents.copy_of[vertex - vertices];
    std::memcpy(&garment.charts[6 * std::size_t{source}], numbers, sizeof numbers);
  }
  return static_cast<std::uint32_t>(place - garments.begin());
}
/// Gives a garment another shape; input: position and normal of each vertex.
EXPORT(pose_garment) void pose_garment(std::uint32_t number) {
  Garment& garment = *garments[number];
  std::vector<V3d> positions;
  std::vector<V3d> normals;
  for (std::size_t i = 0; i < garment.uvs.size(); ++i) {
    positions.emplace_back(vector_at(6 * i));
    normals.push_back(V3d(vector_at(6 * i + 3)).normalized());
  }
  take_shape(garment, positions, normals);
  garment.store->take_shape();
}
/// Six numbers of each vertex, by which the look-up finds its patch: first entry of its chart in the table,
/// first u and v, smallest patches along a repeat, columns and rows of the chart.
EXPORT(charts_of) const float* charts_of(std::uint32_t garment) { return garments[garment]->charts.data(); }
EXPORT(remove_garment) void remove_garment(std::uint32_t garment) { garments[garment].reset(); }
EXPORT(remove_fabric) void remove_fabric(std::uint32_t fabric) { fabrics[fabric].reset(); }
/// 1: images have found no room since the last call, and the next frames' are coarser; + 2: tiles have moved,
/// also other garments'.
EXPORT(take_events) std::uint32_t take_events() {
  return (std::exchange(is_full, false) ? 1 : 0) + (std::exchange(has_moved, false) ? 2 : 0);
}

/// Begins a frame of a garment. Input: projection (1: parallel), position (3), right (3), up (3), direction
/// to the viewer (3), centre (2) and half (2) of the window, nearest and farthest depth; width and height in
/// pixels; samples, share of images made again; forced level; whether there is light from all around; its
/// factors (27), and the mesh's axes in the factors' (9); lights, each: 1 for a point light, 0
/// for a directional one, direction (3), irradiance (3), position (3). Returns the patches in sight.
EXPORT(begin_frame) std::uint32_t begin_frame(std::uint32_t number, std::uint32_t lights) {
  Garment& garment = *garments[number];
  const float* n = floats();
  const auto next = [&] { return *n++; };
  const auto next3 = [&] {
    const V3d v(n[0], n[1], n[2]);
    n += 3;
    return v;
  };
  Camera& camera = garment.camera;
  camera.projection = next() != 0 ? Projection::parallel : Projection::perspective;
  camera.position = next3();
  camera.right = next3();
  camera.up = next3();
  camera.to_viewer = next3();
  camera.window_centre = {n[0], n[1]};
  camera.window_half = {n[2], n[3]};
  camera.near = n[4];
  camera.far = n[5];
  const V2i size(static_cast<int>(n[6]), static_cast<int>(n[7]));
  n += 8;
  DrawOptions& options = garment.options;
  options.cells = moving_cell_images;
  options.cells.samples = next();
  options.cells.fresh = next();
  options.cells.memory = image_memory / garments.size();
  if (options.cells.fresh < 1) {
    if (all_need() < 0.9 * full_need) fill = max_fill;
    options.cells.fresh = std::min(visits_of_front * options.cells.fresh, 0.99F);
  }
  options.levels.forced = static_cast<int>(next());
  const bool around = next() != 0;
  for (V3f& factor : garment.around.factors) factor = V3f(next3());
  const V3f along_x(next3());
  const V3f along_y(next3());
  garment.around = turned(garment.around, along_x, along_y, V3f(next3()));
  garment.lights.clear();
  for (std::uint32_t i = 0; i < lights; ++i) {
    Light& light = garment.lights.emplace_back();
    light.kind = static_cast<LightKind>(static_cast<int>(next()));
    light.direction = next3();
    light.irradiance = V3f(next3());
    light.position = next3();
  }
  ++frame;
  CellLights cell_lights;
  cell_lights.lights = garment.lights;
  cell_lights.around = around ? &garment.around : nullptr;
  garment.store->end();
  garment.store->begin(camera, size, options, 1, cell_lights);
  look_for_patches(garment);
  return static_cast<std::uint32_t>(garment.visits.size());
}

/// Makes images of the next so many patches of a frame. Returns how many patches are left.
EXPORT(make_images) std::uint32_t make_images(std::uint32_t number, std::uint32_t count) {
  Garment& garment = *garments[number];
  const bool behind = garment.done >= garment.visits_in_front;
  const std::size_t end =
      std::min(garment.done + count, behind ? garment.visits.size() : garment.visits_in_front);
  const std::span<const PatchNeed> needs(&garment.visits[garment.done], end - garment.done);
  if (!needs.empty()) {
    if (!garment.store->make(needs, behind, 0)) garment.store->make(needs, behind, CellStore::max_shared);
    show(garment, needs);
  }
  garment.done = end;
  return static_cast<std::uint32_t>(garment.visits.size() - end);
}

/// Fills the table of a garment. Returns the address of seven words: its first entry, its entries, their
/// address, two numbers of 16 bits each, tiles, the address of twelve numbers each: place (2) and size (2) in
/// the atlas, CellImage::first (2), factor on radiance, 1 / brightness, slopes (2), and texels along x and y
/// for a step of height and a slope of 1; patches in front that have no image of their own, and all in front.
EXPORT(table_of) const std::uint32_t* table_of(std::uint32_t number) {
  static std::uint32_t result[7];
  const Garment& garment = *garments[number];
  const Patches& patches = garment.store->patches();
  const auto tile_of = [&](std::uint32_t patch, std::uint32_t side) {
    const std::uint64_t image = garment.shown[2 * patch + side].image;
    return image != 0 ? atlas.find(image, 0) : 0;
  };
  // Of a patch without an image, those around it and within it.
  const auto shown = [&](std::uint32_t patch, std::uint32_t side) {
    TileNumber tile = tile_of(patch, side);
    for (std::uint32_t at = patch; tile == 0 && patches.parent(at) != at; tile = tile_of(at, side))
      at = patches.parent(at);
    for (std::uint32_t at = patch; tile == 0 && patches.child(at) != at; tile = tile_of(at, side))
      at = patches.child(at);
    return static_cast<std::uint16_t>(tile);
  };
  const std::span<const std::uint32_t> chosen = patches.table();
  std::uint16_t* const to = &table[2 * garment.table];
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const bool same = i > 0 && chosen[i] == chosen[i - 1];
    for (std::uint32_t side = 0; side < 2; ++side)
      to[2 * i + side] = same ? to[2 * i + side - 2] : shown(chosen[i], side);
  }
  std::uint32_t missing = 0;
  for (std::size_t i = 0; i < garment.in_front; ++i)
    missing += tile_of(garment.needs[i].patch / 2, garment.needs[i].patch % 2) == 0 ? 1 : 0;
  const auto address = [](const void* pointer) {
    return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(pointer));
  };
  result[0] = static_cast<std::uint32_t>(garment.table);
  result[1] = static_cast<std::uint32_t>(chosen.size());
  result[2] = address(to);
  result[3] = static_cast<std::uint32_t>(tile_numbers.size() / 12);
  result[4] = address(tile_numbers.data());
  result[5] = missing;
  result[6] = static_cast<std::uint32_t>(garment.in_front);
  return result;
}

/// All tiles are to be uploaded again.
EXPORT(forget_tiles) void forget_tiles() { clear_atlas(); }

EXPORT(upload_count) std::uint32_t upload_count() { return static_cast<std::uint32_t>(uploads.size()); }
/// Six words of each upload: place, size, and the addresses of its halves, four of each texel, and heights.
EXPORT(uploads_at) const void* uploads_at() { return uploads.data(); }
EXPORT(clear_uploads) void clear_uploads() {
  uploads.clear();
  pixels.clear();
  heights.clear();
}
/// Share of light of one side that the other side gets (CellLights::brightness()).
EXPORT(beyond_of) float beyond_of(std::uint32_t garment) { return garments[garment]->store->beyond(0); }
