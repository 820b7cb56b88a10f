// Options of a frame and statistics of its rendering.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "format/fabric/footprint.h"
#include "format/fabric/smooth_light.h"
#include "format/picture/environment.h"
#include "format/scene/lights.h"

namespace selvedge {

/// Who finds the triangles, which the CPU shades: OpenGL (hybrid), the CPU where it can (raster), or OpenGL
/// with nearest texels and all colours of the index pass rounded to 8 bits, as published (paper);
/// docs/view.md.
enum class RenderPath { hybrid, raster, paper };
inline constexpr std::array<std::string_view, 3> path_names{"hybrid", "raster", "paper"};

/// Sizes that determine the memory of a renderer.
struct FrameSize {
  int width = 800;
  int height = 600;
  int supersample = 1;  ///< the frame is drawn this many times larger per side, then averaged
  int layers = 8;       ///< maximum number of surfaces that a pixel shows behind each other
  /// Rows that are drawn at a time, an even number: cell images have to fit for these. 0: a third.
  int band_rows = 0;
};

/// Bounds of the patches that share a cell image (viewer/cells/patches.h); a patch above one of them is
/// split.
struct PatchLimits {
  /// Pixels along the longest side, of more than one repeat: pixels of an image are of one size.
  float max_side_pixels = 256;
  /// Repeats along a side, at least 1: what varies over more of them has one image.
  float max_side_repeats = 32;
  /// Degrees that normals turn from their mean, times the pixels of a repeat, of more than one repeat: yarn
  /// of height h repeats is seen h * turn * pixels off its place.
  float max_turn_degree_pixels = 80;
  /// Degrees that normals turn and rays differ in any case, of more than one repeat: highlights go with them.
  /// With more than two rays along a pixel's side fewer, in proportion.
  float max_turn_degrees = 4;
  /// Pixels along the longest side of a patch whose normals turn out of sight or away from a light: their
  /// mean is neither.
  float max_outline_pixels = 4;
  /// Pixels between yarn at the border of a patch of at most one repeat and its place:
  /// Patches::View::offset().
  float max_offset_pixels = 0.5F;
  /// That offset times the pixels of the patch's longer side up to which it stays whole in any case: an image
  /// costs its margin and its setting-up, too. With more than two rays along a pixel's side less, in
  /// proportion.
  float max_offset_area = 50;
};

/// How cell images are made and kept (viewer/cells). The defaults are for pictures at rest.
struct CellImageOptions {
  float samples_per_pixel_side = 4;    ///< of an image along a pixel's side
  float max_patch_rays_per_side = 16;  ///< along a pixel's side: more make patches no finer
  int max_tile_samples = 1 << 15;      ///< along a tile of a map, of which an image has a window
  PatchLimits patches;
  // As in CellView.
  bool hair_shadows = true;
  int shading_block_size = 1;
  float shadow_texels_per_pixel = 2;
  float rays_per_pixel_side = 8;
  float max_piece_pixels = 1.5F;
  /// Whether the picture moves: then patches and images may depend on the frames before.
  bool is_moving = false;
  /// Fraction of the images in sight, in (0, 1], that a frame makes again where view or light have changed.
  float remade_fraction = 1;
  float min_transparency = 0.5F / 255;  ///< of a pixel, for surfaces behind it to be drawn
  std::size_t memory_bytes = std::size_t{256}
                             << 20;  ///< bytes of all images; their shadow grids take a quarter more

  /// Converts samples, texels of shadows and detail from pixels of the picture to pixels of the frame, and
  /// the limits of patches to frames of more than max_patch_rays_per_side.
  void scale_to_frame_pixels(int supersample, float footprint_pixels) {
    const float fraction = footprint_pixels / static_cast<float>(supersample);
    for (float* per_pixel : {&samples_per_pixel_side, &shadow_texels_per_pixel, &rays_per_pixel_side})
      *per_pixel *= fraction;
    const float coarser = std::max(static_cast<float>(supersample) / max_patch_rays_per_side, 1.0F);
    for (float* pixels : {&patches.max_side_pixels, &patches.max_turn_degree_pixels,
                          &patches.max_outline_pixels, &patches.max_offset_pixels, &max_piece_pixels})
      *pixels *= coarser;
    const float turn = std::min(2 * fraction * coarser, 1.0F);
    patches.max_turn_degrees *= turn;
    patches.max_offset_area *= turn * footprint_pixels * footprint_pixels * coarser * coarser;
  }
};

/// For frames that move.
inline constexpr CellImageOptions moving_cell_images{
    .samples_per_pixel_side = 2,
    .patches = {.max_side_pixels = 128,
                .max_side_repeats = 4,
                .max_turn_degree_pixels = 720,
                .max_turn_degrees = 25,
                .max_outline_pixels = 16,
                .max_offset_pixels = 7,
                .max_offset_area = 40},
    .hair_shadows = false,
    .shading_block_size = 2,
    .shadow_texels_per_pixel = 1,
    .max_piece_pixels = 2,
    .is_moving = true,
    .remade_fraction = 0.25F,
    .min_transparency = 3.0F / 255,
};

/// Square blocks of a picture, row by row from its lower left.
struct FrameBlocks {
  int block_size = 8;  ///< pixels
  int columns = 0;
  std::vector<std::uint8_t> is_drawn;  ///< 0: not
  /// Whether some of these pixels' rows are drawn.
  bool has_drawn_rows(int first_row, int rows) const {
    const auto row = is_drawn.begin() + static_cast<std::ptrdiff_t>(first_row / block_size) * columns;
    const auto end =
        is_drawn.begin() + static_cast<std::ptrdiff_t>((first_row + rows - 1) / block_size + 1) * columns;
    return std::any_of(row, end, [](std::uint8_t block) { return block != 0; });
  }
};

/// Options that may change from frame to frame.
struct DrawOptions {
  LevelOptions levels;
  CellImageOptions cells;
  std::vector<Light> lights;
  /// Times pi, the even radiance in `smooth_light` that its environment has not: mirror images lack it.
  float mirrored_ambient_irradiance = 0;
  /// Smooth light from all around, on everything.
  std::optional<SmoothLight> smooth_light;
  /// The environment that `smooth_light` is of, for mirror images on surfaces without fabric and as a
  /// backdrop.
  std::shared_ptr<const Environment> environment;
  /// The environment is seen beside the scene and through it, in a mirror of this roughness; -1: the scene
  /// stands on a floor that shows nothing but its shadow (floor.h).
  float backdrop_roughness = -1;
  /// Texels per side of a shadow map, one for each light that can cast shadows (shadows.h); 0: no shadows.
  int shadow_map_size = 0;
  /// Once this is true, drawing stops early, and the frame is incomplete. Null: nothing interrupts it.
  const std::atomic<bool>* interrupt_flag = nullptr;
  /// The same from this moment on.
  std::chrono::steady_clock::time_point deadline = std::chrono::steady_clock::time_point::max();
  bool is_interrupted() const {
    return (interrupt_flag != nullptr && interrupt_flag->load(std::memory_order_relaxed)) ||
           (deadline != std::chrono::steady_clock::time_point::max() &&
            std::chrono::steady_clock::now() >= deadline);
  }
  /// Pixels outside of these stay empty. Null: all are drawn.
  const FrameBlocks* blocks = nullptr;
};

/// Statistics of surfaces that are shaded.
struct LayerCount {
  std::int64_t covered_pixels = 0;    ///< of the nearest layer, in the supersampled frame
  std::int64_t evaluated_pixels = 0;  ///< over all layers
  std::int64_t cloth_pixels = 0;      ///< of these, with fabric that is not clear
  int layers = 0;                     ///< largest number in one pixel
  LayerCount& operator+=(const LayerCount& b) {
    covered_pixels += b.covered_pixels;
    evaluated_pixels += b.evaluated_pixels;
    cloth_pixels += b.cloth_pixels;
    layers = std::max(layers, b.layers);
    return *this;
  }
};

/// Statistics of a rendering; times in seconds. Drawing and evaluation of different bands overlap, so the
/// times add up to more than the frame's.
struct RenderStats : LayerCount {
  double prepare_seconds = 0;   ///< context, vertices, fabrics; and the textures of all frames so far
  double project_seconds = 0;   ///< projecting vertices and sorting triangles into bands
  double shadow_seconds = 0;    ///< drawing shadow maps
  double geometry_seconds = 0;  ///< drawing with OpenGL
  double read_back_seconds = 0;
  double evaluation_seconds = 0;  ///< texels, frames and shading on the CPU
  double filter_seconds = 0;
  std::int64_t triangles = 0;
  std::int64_t peak_image_bytes = 0;  ///< the most that cell images took at once
  std::int64_t decoded_pictures = 0;  ///< of all frames so far
  std::vector<std::string> remarks;   ///< options and materials that could not be honoured, one line each
};

/// The times in reports.
inline constexpr std::array<std::pair<const char*, double RenderStats::*>, 7> render_seconds{
    {{"prepare", &RenderStats::prepare_seconds},
     {"project", &RenderStats::project_seconds},
     {"shadows", &RenderStats::shadow_seconds},
     {"geometry", &RenderStats::geometry_seconds},
     {"readBack", &RenderStats::read_back_seconds},
     {"evaluation", &RenderStats::evaluation_seconds},
     {"filter", &RenderStats::filter_seconds}}};

}  // namespace selvedge
