// The WebAssembly module of the browser: cell images of the garments on a page, and their places in an atlas.
//
// Fabrics, garments and tiles have numbers; a garment or tile that is removed leaves its number to another
// one. Tile 0 is no tile. Coordinates are in the axes of their mesh, m.
#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>

#include <Imath/half.h>

#include "format/base/parallel.h"
#include "format/scene/tangents.h"
#include "viewer/raster/raster.h"
#include "viewer/web/cells/page.h"

namespace selvedge {

void parallel_for(int begin, int end, const std::function<void(int)>& body) {
  for (int i = begin; i < end; ++i) body(i);
}

namespace web {

Page page;

namespace {

// Messages that cells.js writes to input() and reads, in words of 32 bits.

struct ShapeInput {
  V3f position, normal;
};
struct VertexInput : ShapeInput {
  V2f uv;
};

/// Before `lights`; distances in the axes of the mesh.
struct FrameInput {
  float is_parallel;
  V3f position, right, up, to_viewer;
  V2f window_centre, window_half_size;
  float near, far;
  V2f size;  ///< pixels
  float samples, remade_fraction;
  float forced_level, has_around;
  std::array<V3f, smooth_function_count> around;
  std::array<V3f, 3> around_axes;  ///< the mesh's, in the light's
};
struct LightInput {
  float kind;  ///< LightKind
  V3f direction, irradiance, position;
};

struct TableNumbers {
  std::uint32_t first, count;  ///< entries of the garment
  const TableEntry* entries;
  std::uint32_t tile_count;
  const TileNumbers* tiles;
  std::uint32_t missing, wanted;  ///< patches in sight that have no image of their own, and all in sight
};

struct UploadNumbers {
  std::uint32_t count;
  const void* places;
  std::uint32_t texels;
  const void *halves, *heights;
};

/// As many as TileNumbers holds.
constexpr int max_repeat_texels = 2044;
constexpr double min_fill = 0.05;
/// A frame that moves visits one of this number of patches that have images, in front and behind.
constexpr int visits_of_front = 4;
constexpr int visits_behind = 8;
/// Bound, in bytes, on a garment's images that it makes again.
constexpr double max_remade = 200e3;
/// Part of the atlas from which on it is not packed again.
constexpr double max_packed = 0.85;
/// A coarse frame, by which patches are found.
constexpr int columns = 256;
constexpr int rows = 256;
/// Bound on off_middle(), halves of the picture; patches behind others are as much farther.
constexpr float max_off_middle = 1e3F;

/// Images as halves: sign and one bit of the fraction differ (CellTexel).
void upload(const CellLook& look, TileNumber number) {
  const Tile& tile = page.atlas[number];
  const std::size_t texels = static_cast<std::size_t>(tile.size.x) * tile.size.y;
  auto& [places, halves, heights] = page.uploads;
  places.push_back({tile.place, tile.size});
  const std::size_t first = heights.size();
  halves.resize(4 * (first + texels));
  heights.resize(first + texels);
  for (std::size_t i = 0; i < 4 * texels; ++i) halves[4 * first + i] = (*look.texels)[i] >> 1;
  for (std::size_t i = 0; look.heights != nullptr && i < texels; ++i)
    heights[first + i] = static_cast<std::uint8_t>(look.heights[i] + 128);
  page.tiles.resize(std::max<std::size_t>(page.tiles.size(), number + 1));
  const auto whole = [](float x) { return static_cast<std::uint32_t>(std::lround(x)); };
  const auto half = [](float x) { return std::uint32_t{Imath::half(x).bits()}; };
  const auto x = static_cast<std::uint32_t>(tile.place.x), y = static_cast<std::uint32_t>(tile.place.y);
  const Group& size = look.size;
  page.tiles[number] = {
      x | y / 8 << 11 | whole(size[0]) << 21,
      whole(size[1]) | whole(4 * size[2]) << 11 | std::bit_cast<std::uint32_t>(look.scale) >> 23 << 24,
      whole(4 * size[3]) | half(look.scale * look.inverse_brightness) << 13,
      half(look.parallax[0]) | half(look.parallax[1]) << 16};
}

/// Bytes of all garments' images in sight as fine as wanted.
double all_need() {
  double sum = 0;
  for (const auto& garment : page.garments) sum += garment ? garment->needed_bytes : 0;
  return sum;
}

void clear_atlas() {
  const int height = page.atlas.rows();
  page.atlas = {};
  page.atlas.set_rows(height);
  page.uploads = {};
}

/// Lets a patch show its image of now; whether that has a tile.
bool place_look(Garment& garment, PatchSide patch) {
  const CellLook& look = garment.store->look(patch);
  std::uint64_t& image = garment.shown[patch].image;
  image = 0;
  if (look.texels == nullptr) return true;
  const std::uint64_t wanted = garment.first_image + look.image;
  if (page.atlas.find(wanted, page.last_use_mark) == 0) {
    const V2i size(static_cast<int>(look.window_size[0]) + 1, static_cast<int>(look.window_size[1]) + 1);
    const TileNumber tile = page.atlas.add(wanted, size, page.last_use_mark);
    if (tile == 0) return false;
    upload(look, tile);
  }
  image = wanted;
  return true;
}

/// Makes room in the atlas of tiles that no patch in sight shows. Returns whether there is more.
bool drop_unseen() {
  const std::uint64_t now = ++page.last_use_mark;
  for (const auto& garment : page.garments) {
    if (!garment) continue;
    for (const PatchNeed& need : garment->needs) page.atlas.find(garment->shown[need.patch].image, now);
  }
  const bool any = page.atlas.evict(now);
  page.has_moved |= any;
  return any;
}

/// Makes room in the atlas of the gaps between tiles, once a frame. Returns whether there is more.
bool pack() {
  if (page.packed_frame == page.frame ||
      page.atlas.texel_count() > max_packed * Atlas::width * page.atlas.rows())
    return false;
  page.packed_frame = page.frame;
  std::vector<std::pair<Garment*, PatchSide>> places;
  for (const auto& garment : page.garments) {
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
  page.has_moved = true;
  for (const auto& [garment, patch] : places) place_look(*garment, patch);
  return true;
}

/// Gives the images of patches tiles.
void show(Garment& garment, std::span<const PatchNeed> needs) {
  for (const PatchNeed& need : needs) {
    garment.shown[need.patch].last_frame = page.frame;
    const std::uint64_t old = garment.shown[need.patch].image;
    bool is_placed = place_look(garment, need.patch);
    if (!is_placed && !page.is_full && drop_unseen()) is_placed = place_look(garment, need.patch);
    if (!is_placed && !page.is_full && pack()) is_placed = place_look(garment, need.patch);
    if (is_placed) continue;
    garment.shown[need.patch].image = old;
    if (page.is_full || page.fill_fraction <= min_fill) continue;
    page.fill_fraction = std::max(0.8 * page.fill_fraction, min_fill);
    page.needed_bytes_when_full = all_need();
    page.is_full = true;
  }
}

/// Sets the depths of a coarse frame: distances in front of the viewer; of a parallel projection 1.
void draw_depths(Garment& garment, const ProjectedVertices& projected) {
  const auto [near, far] = std::pair(garment.camera.near, garment.camera.far);
  const bool is_parallel = garment.camera.projection == Projection::parallel;
  std::array<std::vector<std::uint32_t>, 2> sides;  // triangles seen from in front and from behind
  for (std::uint32_t i = 0; i < garment.mesh.triangles.size(); ++i) {
    const auto corner = [&](int k) {
      const Group& at = projected.screen[garment.mesh.triangles[i].corners[k]];
      return V3f(at[0], at[1], at[2]);
    };
    sides[corner(0).cross(corner(1)).dot(corner(2)) < 0 ? 1 : 0].push_back(i);
  }
  Raster raster;
  RasterRows drawn;
  garment.depths.assign(std::size_t{columns} * rows, HUGE_VALF);
  for (const bool back : {false, true}) {
    raster.begin(garment.mesh, projected, sides[back ? 1 : 0], back, 0, rows);
    for (int y = 0; y < rows; ++y) {
      if (y % Raster::strip_rows == 0) raster.draw(y / Raster::strip_rows, drawn);
      const float* from = &drawn.depth[drawn.stride * (y % Raster::strip_rows)];
      for (float* to = &garment.depths[y * columns]; to != &garment.depths[y * columns] + columns;
           ++to, ++from) {
        const double distance = is_parallel ? 1 : near * far / (far - *from * (far - near));
        if (*from < 1) *to = std::min(*to, static_cast<float>(distance));
      }
    }
  }
}

/// How far a patch is from the middle of the picture, in halves of it, less half its side.
float off_middle(const Camera& camera, const Patch& patch) {
  const V3d away = V3d(patch.mean_position) - camera.position;
  const double depth = camera.projection == Projection::parallel ? 1 : -away.dot(camera.to_viewer);
  const V2d at = V2d(away.dot(camera.right), away.dot(camera.up)) / depth - camera.window_centre;
  const V2d size = camera.window_half_size;
  return std::fmin(static_cast<float>((at / size).length() - 0.5 * std::sqrt(patch.area) / depth / size.y),
                   max_off_middle);
}

/// Orders the patches in sight for their images, and those that are shown stay: first come patches without
/// one, then, while it moves, those that were not looked at for longest; and of these the middle's.
void choose_visits(Garment& garment) {
  const Patches& patches = garment.store->patches();
  const bool is_moving = garment.options.cells.is_moving;
  const auto visit = [&](std::size_t first, std::size_t end, int part) {
    std::vector<std::tuple<std::uint64_t, float, std::size_t>> all;
    for (std::size_t i = first; i < end; ++i) {
      const PatchSide patch = garment.needs[i].patch;
      const auto& [image, last_frame] = garment.shown[patch];
      const bool is_there = image != 0 && page.atlas.find(image, 0) != 0;
      all.emplace_back(is_moving && is_there ? last_frame : 0, off_middle(garment.camera, patches[patch / 2]),
                       i);
    }
    std::ranges::sort(all);
    const auto shown = std::ranges::find_if(all, [](const auto& each) { return std::get<0>(each) != 0; });
    const auto count = shown - all.begin() + (all.end() - shown + part - 1) / part;
    for (const auto& [last_frame, off, i] : std::span(all).first(static_cast<std::size_t>(count))) {
      garment.visits.push_back(garment.needs[i]);
      garment.visits_off_middle.push_back(off + (first > 0 ? max_off_middle : 0));
    }
  };
  garment.visits.clear();
  garment.visits_off_middle.clear();
  visit(0, garment.front_need_count, is_moving ? visits_of_front : 1);
  garment.front_visit_count = garment.visits.size();
  visit(garment.front_need_count, garment.needs.size(), is_moving ? visits_behind : 1);
}

/// Notes what is in sight: depths of a coarse frame, then which triangles lie behind them.
void mark_visible(Garment& garment) {
  const MergedSurfaces& mesh = garment.mesh;
  const Patches& patches = garment.store->patches();
  const ProjectedVertices projected = project(mesh, clip_matrix(garment.camera, V3d(0, 0, 0)), columns, rows);
  const auto screen = [&](std::uint32_t vertex) {
    const Group& g = projected.screen[vertex];
    const float inverse = 1 / g[2];
    return V3f(0.5F * columns + g[0] * inverse, 0.5F * rows + g[1] * inverse, g[2]);
  };
  draw_depths(garment, projected);
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
    const auto before_viewer =
        std::ranges::count_if(t.corners, [&](std::uint32_t c) { return projected.screen[c][2] > 0; });
    if (before_viewer == 0) continue;
    bool behind = false;
    bool back = false;
    if (before_viewer == 3) {
      const V3f a = screen(t.corners[0]);
      const V3f b = screen(t.corners[1]);
      const V3f c = screen(t.corners[2]);
      if (std::max({a.x, b.x, c.x}) < 0 || std::max({a.y, b.y, c.y}) < 0 ||
          std::min({a.x, b.x, c.x}) > columns || std::min({a.y, b.y, c.y}) > rows)
        continue;
      back = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y) < 0;
      const float tolerance = 0.5F * (std::max({a.z, b.z, c.z}) - std::min({a.z, b.z, c.z})) +
                              4 * static_cast<float>(garment.camera.window_half_size.y) / rows * a.z;
      behind = hidden({a, b, c, (a + b + c) / 3.0F}, tolerance);
    }
    const std::uint8_t flag = static_cast<std::uint8_t>((back ? 2 : 1) << (behind ? 2 : 0));
    patches.for_each_patch(place, patches.extent(mesh, i),
                           [&](std::uint32_t patch) { garment.flags[patch] |= flag; });
  }
  garment.needs.clear();
  const auto add = [&](std::uint8_t mask, std::uint8_t without) {
    for (PatchSide i = 0; i < 2 * garment.flags.size(); ++i) {
      const int flag = garment.flags[i / 2] >> i % 2;
      if (patches.shown(i / 2).in_frame && (flag & mask) != 0 && (flag & without) == 0)
        garment.needs.push_back({i, ~0U, 0});
    }
  };
  add(1, 0);
  garment.front_need_count = garment.needs.size();
  add(4, 1);
  garment.finished_visit_count = 0;
  // Garments share the memory by their needs.
  garment.needed_bytes = garment.store->bytes_of(garment.needs);
  const double all = all_need();
  garment.memory_bytes = page.fill_fraction * static_cast<double>(page.image_memory_bytes) *
                         (all > 0 ? garment.needed_bytes / all : 1);
  choose_visits(garment);
}

/// The first entry of a free run of this length in the table.
std::size_t room_in_table(std::size_t entries) {
  std::vector<std::pair<std::size_t, std::size_t>> taken;
  for (const auto& garment : page.garments)
    if (garment && garment->store)
      taken.emplace_back(garment->first_table_entry, garment->store->patches().table().size());
  std::sort(taken.begin(), taken.end());
  std::size_t first = 0;
  for (const auto& [begin, count] : taken) {
    if (begin >= first + entries) break;
    first = begin + count;
  }
  page.table.resize(std::max(page.table.size(), first + entries));
  return first;
}

/// Gives a garment's mesh a shape: positions and normals of vertices, and tangents with them.
Tangents update_shape(Garment& garment, const auto& vertices) {
  std::vector<V3d> positions, normals;
  for (const auto& vertex : vertices) {
    positions.emplace_back(vertex.position);
    normals.push_back(V3d(vertex.normal).normalized());
  }
  Tangents tangents = compute_tangents(positions, normals, garment.uvs, garment.corners, Facing::normals);
  MergedSurfaces& mesh = garment.mesh;
  mesh.positions.clear();
  mesh.attributes.clear();
  mesh.triangles.clear();
  for (std::size_t i = 0; i < tangents.tangents.size(); ++i) {
    const std::size_t source = i < positions.size() ? i : tangents.copy_sources[i - positions.size()];
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
    t.has_degenerate_uvs = tangents.degenerate_uvs[i / 3] != 0;
  }
  return tangents;
}

}  // namespace
}  // namespace web
}  // namespace selvedge

using namespace selvedge;
using namespace selvedge::web;

/// Address of room for `count` numbers of 32 bits.
EXPORT(input) void* input(std::uint32_t count) {
  page.input_words.resize(count);
  return page.input_words.data();
}

/// Sets the bytes of images, and returns the rows of the atlas.
EXPORT(set_memory) std::uint32_t set_memory(std::uint32_t bytes) {
  page.image_memory_bytes = std::clamp(bytes, 4U << 20, 128U << 20);
  page.atlas.set_rows(static_cast<int>(page.image_memory_bytes / ((sizeof(CellTexel) + 1) * Atlas::width)));
  return static_cast<std::uint32_t>(page.atlas.rows());
}

/// Adds a mesh in a fabric; input: VertexInput of each vertex, then three vertices of each triangle (whole).
/// Returns its number.
EXPORT(add_garment)
std::uint32_t add_garment(std::uint32_t fabric, std::uint32_t vertices, std::uint32_t triangles) {
  auto& garments = page.garments;
  auto place = std::find(garments.begin(), garments.end(), nullptr);
  if (place == garments.end()) place = garments.insert(place, nullptr);
  *place = std::make_unique<Garment>();
  Garment& garment = **place;
  garment.first_image = ++page.made_garment_count << 40;
  garment.fabric = page.fabrics[fabric];
  garment.sides = {*garment.fabric->sides};
  SurfaceMaterial& material = garment.materials.emplace_back();
  material.fabric = 0;
  material.keeps_opacity = true;
  const std::span given(input_as<VertexInput>(), vertices);
  for (const VertexInput& v : given) garment.uvs.emplace_back(v.uv);
  const auto* const corners = reinterpret_cast<const std::uint32_t*>(given.data() + vertices);
  garment.corners.assign(corners, corners + 3 * std::size_t{triangles});
  const Tangents tangents = update_shape(garment, given);
  const MergedSurfaces& mesh = garment.mesh;
  const auto same = std::ranges::find_if(
      garments, [&](const auto& other) { return other && other->store && other->fabric == garment.fabric; });
  garment.store = std::make_unique<CellStore>(mesh, garment.materials, garment.sides, V3d(0, 0, 0),
                                              same != garments.end() ? (*same)->store.get() : nullptr);
  const Patches& patches = garment.store->patches();
  garment.shown.resize(2 * patches.count());
  garment.first_table_entry = room_in_table(patches.table().size());
  garment.charts.resize(vertices);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Patches::Chart& chart = patches.chart(patches.place(static_cast<std::uint32_t>(i)).chart);
    // The last corner's numbers are the triangle's: others may lie in several charts, where the texture is
    // mirrored.
    const std::uint32_t vertex = mesh.triangles[i].corners[2];
    garment.charts[vertex < vertices ? vertex : tangents.copy_sources[vertex - vertices]] = {
        static_cast<float>(garment.first_table_entry + chart.first_table_entry),
        static_cast<float>(chart.first_repeat.x),
        static_cast<float>(chart.first_repeat.y),
        patches.finest_patches_per_repeat(),
        static_cast<float>(chart.size_in_patches.x),
        static_cast<float>(chart.size_in_patches.y)};
  }
  return static_cast<std::uint32_t>(place - garments.begin());
}
/// Gives a garment another shape; input: position and normal of each vertex.
EXPORT(pose_garment) void pose_garment(std::uint32_t number) {
  Garment& garment = *page.garments[number];
  update_shape(garment, std::span(input_as<ShapeInput>(), garment.uvs.size()));
  garment.store->update_shape();
}
EXPORT(charts_of) const ChartNumbers* charts_of(std::uint32_t garment) {
  return page.garments[garment]->charts.data();
}
EXPORT(remove_garment) void remove_garment(std::uint32_t garment) { page.garments[garment].reset(); }
EXPORT(remove_fabric) void remove_fabric(std::uint32_t fabric) { page.fabrics[fabric].reset(); }
/// Gives a fabric the content of another one, whose repeat is as large and which is then gone. Garments show
/// their images until they have others.
EXPORT(replace_fabric) void replace_fabric(std::uint32_t number, std::uint32_t by) {
  const auto old = std::exchange(page.fabrics[number], std::exchange(page.fabrics[by], nullptr));
  const CellStore* first = nullptr;
  for (const auto& garment : page.garments) {
    if (!garment || garment->fabric != old) continue;
    garment->fabric = page.fabrics[number];
    garment->sides = {*garment->fabric->sides};
    garment->store->exchange_fabric(garment->sides.front(), first);
    first = garment->store.get();
    for (Garment::Shown& shown : garment->shown) shown.last_frame = 0;
  }
}
/// Whether a frame has come to all patches in front; these alone show images then, and those within them.
EXPORT(end_front) bool end_front(std::uint32_t number) {
  Garment& garment = *page.garments[number];
  if (garment.finished_visit_count < garment.front_visit_count) return false;
  for (Garment::Shown& shown : garment.shown)
    if (shown.last_frame == 0) shown.image = 0;
  return true;
}
/// 1: images have found no room since the last call, and the next frames' are coarser; + 2: tiles have moved,
/// also other garments'.
EXPORT(take_events) std::uint32_t take_events() {
  return (std::exchange(page.is_full, false) ? 1 : 0) + (std::exchange(page.has_moved, false) ? 2 : 0);
}

/// Begins a frame of a garment; input: FrameInput, then LightInput of each light. Returns the patches in
/// sight.
EXPORT(begin_frame) std::uint32_t begin_frame(std::uint32_t number, std::uint32_t lights) {
  Garment& garment = *page.garments[number];
  const auto& in = *input_as<FrameInput>();
  garment.camera = {.projection = in.is_parallel != 0 ? Projection::parallel : Projection::perspective,
                    .position = V3d(in.position),
                    .right = V3d(in.right),
                    .up = V3d(in.up),
                    .to_viewer = V3d(in.to_viewer),
                    .window_centre = V2d(in.window_centre),
                    .window_half_size = V2d(in.window_half_size),
                    .near = in.near,
                    .far = in.far};
  DrawOptions& options = garment.options;
  options.cells = moving_cell_images;
  options.cells.max_tile_samples = max_repeat_texels;
  options.cells.is_moving = in.remade_fraction < 1;
  // Parts of repeats have images of whole ones, for which there is little room.
  options.cells.patches.max_offset_pixels = in.remade_fraction < 1 ? 32 : 16;
  if (in.remade_fraction >= 1) options.cells.patches.max_side_pixels = 48;
  options.cells.samples_per_pixel_side = in.samples;
  options.cells.remade_fraction = in.remade_fraction;
  options.cells.memory_bytes = page.image_memory_bytes / page.garments.size();
  if (in.remade_fraction < 1) {
    if (all_need() < 0.9 * page.needed_bytes_when_full) page.fill_fraction = max_fill_fraction;
    const auto affordable = static_cast<float>(max_remade / std::max(garment.needed_bytes, 1.0));
    options.cells.remade_fraction =
        std::clamp(visits_of_front * std::min(in.remade_fraction, affordable), 0.01F, 0.99F);
  }
  options.levels.forced_level = static_cast<int>(in.forced_level);
  options.levels.footprint_pixels = 1;
  if (in.remade_fraction <= 0) {
    options.levels.footprint_pixels = 2;
    // Fewer samples than later frames want, which make these images again.
    options.cells.samples_per_pixel_side = 0.49F * in.samples;
    options.cells.patches.max_side_repeats = 32;
    options.cells.patches.max_turn_degree_pixels = 1e4F;
    options.cells.patches.max_outline_pixels = 20;
  }
  garment.smooth_light.coefficients = in.around;
  garment.smooth_light =
      turned(garment.smooth_light, in.around_axes[0], in.around_axes[1], in.around_axes[2]);
  garment.lights.clear();
  for (const LightInput& given : std::span(reinterpret_cast<const LightInput*>(&in + 1), lights))
    garment.lights.push_back({.direction = V3d(given.direction),
                              .irradiance = given.irradiance,
                              .kind = static_cast<LightKind>(static_cast<int>(given.kind)),
                              .position = V3d(given.position)});
  ++page.frame;
  CellLights cell_lights;
  cell_lights.lights = garment.lights;
  cell_lights.smooth_light = in.has_around != 0 ? &garment.smooth_light : nullptr;
  garment.store->end();
  garment.store->begin({garment.camera, V2i(in.size), options, 1, cell_lights});
  mark_visible(garment);
  return static_cast<std::uint32_t>(garment.visits.size());
}

/// Makes images of a frame's next `count` patches. Returns how many patches are left.
EXPORT(make_images) std::uint32_t make_images(std::uint32_t number, std::uint32_t count) {
  Garment& garment = *page.garments[number];
  const bool behind = garment.finished_visit_count >= garment.front_visit_count;
  const std::size_t end = std::min(garment.finished_visit_count + count,
                                   behind ? garment.visits.size() : garment.front_visit_count);
  const std::span<const PatchNeed> needs(&garment.visits[garment.finished_visit_count],
                                         end - garment.finished_visit_count);
  if (!needs.empty()) {
    for (const int coarsening : {0, CellStore::max_coarsening})
      if (garment.store->make({needs, behind, coarsening, garment.memory_bytes, garment.needed_bytes})
              .is_made)
        break;
    show(garment, needs);
  }
  garment.finished_visit_count = end;
  return static_cast<std::uint32_t>(garment.visits.size() - end);
}

/// How far the next patch is from the middle of the picture, in halves of it; more of one behind others.
EXPORT(next_off_middle) float next_off_middle(std::uint32_t number) {
  const Garment& garment = *page.garments[number];
  const bool is_finished = garment.finished_visit_count == garment.visits.size();
  return is_finished ? HUGE_VALF : garment.visits_off_middle[garment.finished_visit_count];
}

/// Fills the table of a garment.
EXPORT(table_of) const TableNumbers* table_of(std::uint32_t number) {
  static TableNumbers result;
  const Garment& garment = *page.garments[number];
  const Patches& patches = garment.store->patches();
  const auto tile_of = [&](std::uint32_t patch, std::uint32_t side) {
    const std::uint64_t image = garment.shown[2 * patch + side].image;
    return image != 0 ? page.atlas.find(image, 0) : 0;
  };
  // A patch without an image shows those around it and within it.
  const auto shown = [&](std::uint32_t patch, std::uint32_t side) {
    TileNumber tile = tile_of(patch, side);
    for (std::uint32_t at = patch; tile == 0 && patches.parent(at) != at; tile = tile_of(at, side))
      at = patches.parent(at);
    for (std::uint32_t at = patch; tile == 0 && patches.child(at) != at; tile = tile_of(at, side))
      at = patches.child(at);
    return tile;
  };
  const std::span<const std::uint32_t> chosen = patches.table();
  const std::span<TableEntry> to(&page.table[garment.first_table_entry], chosen.size());
  // Rows of a patch have its tiles.
  constexpr TableEntry unknown{0xFFFF, 0xFFFF};
  std::vector<TableEntry> of_patch(patches.count(), unknown);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    TableEntry& tiles = of_patch[chosen[i]];
    if (tiles == unknown)
      for (std::uint32_t side = 0; side < 2; ++side)
        tiles[side] = static_cast<std::uint16_t>(shown(chosen[i], side));
    to[i] = tiles;
  }
  const auto missing = std::ranges::count_if(
      garment.needs, [&](const PatchNeed& need) { return tile_of(need.patch / 2, need.patch % 2) == 0; });
  result = {static_cast<std::uint32_t>(garment.first_table_entry),
            static_cast<std::uint32_t>(chosen.size()),
            to.data(),
            static_cast<std::uint32_t>(page.tiles.size()),
            page.tiles.data(),
            static_cast<std::uint32_t>(missing),
            static_cast<std::uint32_t>(garment.needs.size())};
  return &result;
}

/// All tiles are to be uploaded again.
EXPORT(forget_tiles) void forget_tiles() { clear_atlas(); }

/// Tiles that are new since the last call.
EXPORT(take_uploads) const UploadNumbers* take_uploads() {
  static UploadNumbers result;
  static decltype(page.uploads) taken;
  taken = std::exchange(page.uploads, {});
  const auto& [places, halves, heights] = taken;
  result = {static_cast<std::uint32_t>(places.size()), places.data(),
            static_cast<std::uint32_t>(heights.size()), halves.data(), heights.data()};
  return &result;
}
/// Fraction of the light of one side that the other side gets (CellLights::brightness()).
EXPORT(beyond_of) float beyond_of(std::uint32_t garment) {
  return page.garments[garment]->store->transmitted_fraction(0);
}
