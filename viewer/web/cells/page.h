// State of a page in the WebAssembly module. Arguments that are arrays lie at the address that input()
// returns.
#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "viewer/web/cells/atlas.h"

#define EXPORT(name) extern "C" __attribute__((export_name(#name)))

namespace selvedge::web {

/// By which the look-up finds a vertex's patch.
struct ChartNumbers {
  float entry;                      ///< first of its chart in the table
  float u, v;                       ///< first of the chart
  float finest_patches_per_repeat;  ///< patches along a repeat
  float columns, rows;              ///< of the chart
};

/// A tile as the shader reads it, from the lowest bit on: 11 of its column, 10 of an eighth of its row, 11
/// and 11 of a repeat's texels, 13 of four times its first u; 8 of the exponent of its scale; 13 of its first
/// v; halves of its scale by its brightness, and of the slope of its rays.
using TileNumbers = std::array<std::uint32_t, 4>;
/// Tiles of front and back.
using TableEntry = std::array<std::uint16_t, 2>;

struct LoadedFabric {
  Fabric fabric;
  std::vector<std::pair<LayerShape, Fabric>> pending_sides;  ///< sides that are not added yet
  LayerShape shape;
  std::optional<FabricSides> sides;
};

/// A mesh in its fabric, and what is seen of it.
struct Garment {
  std::shared_ptr<const LoadedFabric> fabric;
  MergedSurfaces mesh;
  std::vector<V2d> uvs;
  std::vector<std::uint32_t> corners;
  std::vector<SurfaceMaterial> materials;
  std::vector<FabricSides> sides;
  std::unique_ptr<CellStore> store;
  std::vector<ChartNumbers> charts;   ///< of the vertices
  std::uint64_t first_image = 0;      ///< added to CellLook::image
  std::size_t first_table_entry = 0;  ///< its first entry in the atlas's table
  Camera camera;
  std::vector<Light> lights;
  SmoothLight smooth_light;
  DrawOptions options;
  std::vector<PatchNeed> needs;  ///< of this frame, patches in front first
  std::size_t front_need_count = 0;
  std::vector<PatchNeed> visits;  ///< of these its images are made, or made again: the first in front, too
  std::vector<float> visits_off_middle;  ///< next_off_middle() of each
  std::size_t front_visit_count = 0;
  std::size_t finished_visit_count = 0;
  struct Shown {
    std::uint64_t image = 0;       ///< in the atlas's numbers
    std::uint64_t last_frame = 0;  ///< frame that last chose it
  };
  std::vector<Shown> shown;  ///< of patches and sides
  double needed_bytes = 0;   ///< for its images, bytes
  double memory_bytes = 0;   ///< for them, of the page's, bytes
  std::vector<float> depths;
  std::vector<std::uint8_t> flags;
};

/// Part of the atlas that images may fill: it has shelves of equal heights.
constexpr double max_fill_fraction = 0.75;

/// All garments of a page, and the atlas of their images.
struct Page {
  std::vector<std::uint32_t> input_words;              ///< by input()
  std::vector<std::shared_ptr<LoadedFabric>> fabrics;  ///< null: removed
  std::vector<std::unique_ptr<Garment>> garments;      ///< null: removed
  std::uint64_t made_garment_count = 0;

  Atlas atlas;
  std::uint64_t frame = 1;
  std::uint64_t last_use_mark = 1;
  std::uint64_t packed_frame = 0;  ///< frame
  std::size_t image_memory_bytes = 0;
  double fill_fraction = max_fill_fraction;
  double needed_bytes_when_full = 0;  ///< all_need() when images found no room
  bool is_full = false;               ///< images have found no room since take_events()
  bool has_moved = false;             ///< tiles have moved since take_events()
  std::vector<TableEntry> table;
  std::vector<TileNumbers> tiles;
  struct {
    std::vector<std::array<V2i, 2>> places;  ///< and sizes, of tiles whose texels lie one after the other
    std::vector<std::uint16_t> halves;       ///< four of each texel
    std::vector<std::uint8_t> heights;       ///< in steps, 128: in the plane; 0: none
  } uploads;
};
extern Page page;

template <class T>
const T* input_as() {
  return reinterpret_cast<const T*>(page.input_words.data());
}

}  // namespace selvedge::web
