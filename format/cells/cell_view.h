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
  V2i samples{min_cell_texels, min_cell_texels};
  V2i pixel{1, 1};
  int stride = 1;    ///< every so many filtered samples one is kept
  V2i first{0, 0};   ///< of the samples that are made, multiples of `stride` in [0, samples)
  V2i window{0, 0};  ///< so many from there on, which the repeat continues; 0: all of the repeat
  bool is_whole() const { return window.x == 0; }
  V2i made() const { return is_whole() ? samples : window; }
  std::size_t count() const { return std::size_t{1} * made().x * made().y; }
  /// Texels of the image, without the ones behind the last.
  V2i texels() const { return (is_whole() ? samples : window - pixel) / stride; }
  bool operator==(const CellSize&) const = default;
};

/// Parts of a repeat: bits from 0 on along u, from parts_of_side on along v.
using RepeatParts = std::uint64_t;
inline constexpr int parts_of_side = 32;
inline constexpr RepeatParts whole_repeat = ~RepeatParts{0};

/// Weights of the yarn and of two neighbouring levels of texels; their sum is 1.
struct CellLevels {
  float yarn = 1;
  int finer = 0;      ///< level
  float coarser = 0;  ///< fraction of the next level in what the yarn leaves
};

struct CellView {
  V3f view{0, 0, 1};  ///< unit, towards the viewer; z > 0
  std::vector<CellLamp> lamps;
  std::optional<SmoothLight> around;  ///< in the frame of the fabric; added to plane 0
  CellLevels levels;
  CellSize size;
  int planes = 1;
  bool hairs = true;
  bool hair_shadows = true;
  float shadow_texels = 1;    ///< texels of shadow grids for each pixel
  float piece_pixels = 1.5F;  ///< longest piece of a ply; 1.5 cost 0.06 dB
  /// Hairs and strands are seen as by so many rays along a pixel's side (Yarns::trace()).
  float detail = 8;
  /// One shading for the samples of one ply among so many x so many.
  int shaded_together = 1;
};

}  // namespace selvedge
