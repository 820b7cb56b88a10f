// Options of a frame and statistics of its rendering.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "format/fabric/level_options.h"
#include "format/fabric/smooth_light.h"
#include "format/picture/environment.h"
#include "format/scene/lights.h"

namespace selvedge {

/// The processor that shades: the CPU (hybrid), the CPU, which also finds the triangles where it can
/// (raster), or the CPU with nearest texels and all colours of the index pass rounded to 8
/// bits, as published (paper); docs/view.md.
enum class RenderPath { hybrid, raster, paper };
inline constexpr std::array<std::string_view, 3> path_names{"hybrid", "raster", "paper"};

/// Sizes that determine the memory of a renderer.
struct FrameSize {
  int width = 800;
  int height = 600;
  int supersample = 1;  ///< the frame is drawn this many times larger per side, then averaged
  int layers = 8;       ///< maximum number of surfaces that a pixel shows behind each other
};

/// Images of yarn (viewer/cells). The defaults are for pictures at rest.
struct CellImageOptions {
  float samples = 4;         ///< along a pixel's side
  float patch_pixels = 1;    ///< longest side of what more than one repeat shares an image, pixels
  float patch_repeats = 4;   ///< of the same, along a side
  float patch_turn = 360;    ///< PatchLimits::turn
  float patch_apart = 0.5F;  ///< PatchLimits::apart
  bool hairs = true;
  bool hairs_behind = true;  ///< on what only shows behind other surfaces
  bool hair_shadows = true;
  bool coarse_shading = false;  ///< CellView
  float shadow_texels = 2;      ///< CellView
  float detail = 8;             ///< CellView
  float piece_pixels = 1.5F;    ///< CellView
  float behind = 1;             ///< fraction of the samples of what only shows behind other surfaces
  float fresh =
      1;  ///< fraction of the images in sight that a frame makes again where view or light have changed
  float turns = 30;         ///< changes of a direction, in radians, times this are outdated by 1
  float rest = 0.5F / 255;  ///< transparency through which nothing is looked at
  std::size_t memory = std::size_t{256} << 20;  ///< bytes of all images; their shadow grids: a quarter
};

/// For frames that move.
inline constexpr CellImageOptions moving_cell_images{2,    128, 4, 720, 8, true,  false, false,
                                                     true, 1,   8, 2,   1, 0.25F, 30,    3.0F / 255};

/// Options that may change from frame to frame.
struct DrawOptions {
  LevelOptions levels;
  CellImageOptions cells;
  std::vector<Light> lights;
  /// Times pi, the even radiance in `around` that its environment has not: mirror images lack it.
  float ambient = 0;
  /// Smooth light from all around, on everything.
  std::optional<SmoothLight> around;
  /// The environment that `around` is of, for mirror images on surfaces without fabric and as a backdrop.
  std::shared_ptr<const Environment> environment;
  /// The environment is seen beside the scene and through it, in a mirror of this roughness; -1: the scene
  /// stands on a floor that shows nothing but its shadow (floor.h).
  float backdrop = -1;
  /// Texels per side of a shadow map, one for each light that can cast shadows (shadows.h); 0: no shadows.
  int shadows = 0;
  /// Once this is true, drawing ends soon, with a frame of which parts are old. Null: nothing interrupts it.
  const std::atomic<bool>* interrupted = nullptr;
  bool ends() const { return interrupted != nullptr && interrupted->load(std::memory_order_relaxed); }
};

/// Statistics of a rendering; times in seconds. Drawing and evaluation of different bands overlap, so the
/// times add up to more than the frame's.
struct RenderStats {
  double prepare =
      0;  ///< context, vertices, fabrics; once for all frames, and textures, of all frames so far
  double project = 0;   ///< projecting vertices and sorting triangles into bands
  double shadows = 0;   ///< drawing shadow maps, and reading them back for the CPU
  double geometry = 0;  ///< drawing with OpenGL
  double read_back = 0;
  double evaluation = 0;  ///< texels, frames and shading on the CPU
  double filter = 0;
  std::int64_t triangles = 0;
  std::int64_t covered_pixels = 0;    ///< of the nearest layer, in the supersampled frame
  std::int64_t evaluated_pixels = 0;  ///< over all layers
  int layers = 0;                     ///< largest number in one pixel
  std::int64_t image_bytes = 0;       ///< the most that cell images took at once
  std::vector<std::string> remarks;   ///< options and materials that could not be honoured, one line each
};

}  // namespace selvedge
