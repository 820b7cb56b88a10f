// View, light and pixels that a cell image is made for.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "format/base/vec.h"
#include "format/fabric/smooth_light.h"

namespace selvedge {

/// Light from one direction, in the frame of the fabric (yarns.h); from behind where z < 0.
struct CellLamp {
  V3f direction{0, 0, 1};   ///< unit, towards the light
  V3f irradiance{0, 0, 0};  ///< on a surface that faces it
  int plane = 0;            ///< of the image, to which its light is added
};

/// Smallest side of an image of yarn, in samples: smaller ones alias.
inline constexpr int min_cell_texels = 16;
/// Longest side of an image, in samples.
inline constexpr int max_cell_samples = 1024;

/// Sizes of an image: samples of a repeat along x (u) and y, and samples of a pixel.
struct CellSize {
  V2i repeat_samples{min_cell_texels, min_cell_texels};
  V2i pixel_samples{1, 1};
  int stride = 1;            ///< one of `stride` filtered samples is kept
  V2i window_origin{0, 0};   ///< of the samples that are made, multiples of `stride` in [0, samples)
  V2i window_samples{0, 0};  ///< its size from there on, which the repeat continues; 0: all of the repeat
  bool shows_map = false;    ///< the repeat is a tile of a map (Yarns::tile()), of which a window is made
  V2i first_stitch{0, 0};    ///< of the map, at the tile's corner; rows upwards
  /// The first sample of the window, of a tile in which its middle lies.
  V2i unwrapped_origin() const {
    V2i origin = window_origin;
    for (int axis = 0; axis < 2; ++axis)
      if (2 * window_origin[axis] + window_samples[axis] >= 2 * repeat_samples[axis])
        origin[axis] -= repeat_samples[axis];
    return origin;
  }
  bool is_whole() const { return window_samples.x == 0; }
  V2i rendered_samples() const { return is_whole() ? repeat_samples : window_samples; }
  std::size_t count() const { return std::size_t{1} * rendered_samples().x * rendered_samples().y; }
  /// Texels of the image, without the ones behind the last.
  V2i texels() const { return (is_whole() ? repeat_samples : window_samples - pixel_samples) / stride; }
  bool operator==(const CellSize&) const = default;
};

/// Parts of a repeat: bits from 0 on along u, from parts_per_side on along v.
using RepeatParts = std::uint64_t;
inline constexpr int parts_per_side = 32;
inline constexpr RepeatParts whole_repeat = ~RepeatParts{0};

/// Weights of the yarn and of two neighbouring levels of texels; their sum is 1.
struct CellLevels {
  float yarn_weight = 1;
  int finer_level = 0;       ///< level
  float coarser_weight = 0;  ///< fraction of the next level in what the yarn leaves
};

struct CellView {
  V3f view{0, 0, 1};  ///< unit, towards the viewer; z > 0
  std::vector<CellLamp> lamps{};
  std::optional<SmoothLight> environment{};  ///< in the frame of the fabric; added to plane 0
  CellLevels levels{};
  CellSize size{};
  int plane_count = 1;
  bool has_hairs = true;
  bool hair_shadows = true;
  float shadow_texels_per_pixel = 1;  ///< texels of shadow grids for each pixel
  float max_piece_pixels = 1.5F;      ///< longest piece of a ply; 1.5 cost 0.06 dB
  /// Hairs and strands are as sharp as with this number of rays along a pixel's side (Yarns::trace()).
  float rays_per_pixel_side = 8;
  /// The samples of one ply in a block of n x n share one shading: n.
  int shading_block_size = 1;
  /// Whether stations have tables of the lamps' light. Without, the light of many lamps is found at each
  /// point: all of one side, on the planes of their numbers, and without an environment.
  bool has_station_table = true;
};

}  // namespace selvedge
