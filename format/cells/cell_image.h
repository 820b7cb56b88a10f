// Cell images: pictures of one repeat of yarn, under parallel light and seen from one direction, filtered to
// pixels.
//
// A surface that shows many repeats in nearly the same view and light looks a pixel up in the image of its
// cell in place of tracing rays. Yarn is splatted (splat.h), shadows within the cell come from depth grids of
// the lights, and visible points are shaded as Yarns::point_at(), add_strands(), direct() and transfer_at()
// do.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "format/cells/cell_shadows.h"
#include "format/fabric/smooth_light.h"

namespace selvedge {

/// Light from one direction, in the frame of the fabric (yarns.h); from behind where z < 0.
struct CellLamp {
  V3f direction{0, 0, 1};   ///< unit, towards the light
  V3f irradiance{0, 0, 0};  ///< on a surface that faces it
  int plane = 0;            ///< of the image, to which its light is added
};

/// Sizes of an image: samples along x (u) and y, and samples of a pixel.
struct CellSize {
  V2i samples{min_cell_texels, min_cell_texels};
  V2i pixel{1, 1};
  int stride = 1;  ///< every so many filtered samples one is kept
  bool operator==(const CellSize&) const = default;
};

/// Longest side of an image, in samples.
inline constexpr int max_cell_samples = 1024;

/// For pixels of `pixel` repeats along u and v with so many samples a side; fewer if the image would be too
/// large.
CellSize cell_size(const V2f& pixel, float samples);

struct CellView {
  V3f view{0, 0, 1};  ///< unit, towards the viewer; z > 0
  std::vector<CellLamp> lamps;
  std::optional<SmoothLight> around;  ///< in the frame of the fabric; added to plane 0
  CellSize size;
  int planes = 1;
  bool hairs = true;
  bool hair_shadows = true;
  float shadow_texels = 1;    ///< texels of shadow grids for each pixel
  float piece_pixels = 1.5F;  ///< longest piece of a ply; 1.5 cost 0.06 dB
  /// Hairs and strands are seen as by so many rays along a pixel's side (Yarns::trace()).
  float detail = 8;
  /// One shading for 2 x 2 samples of one ply.
  bool coarse_shading = false;
};

/// Four channels of 16 bits, unsigned floats of 5 bits of exponent and 11 of mantissa: radiance times opacity
/// over the image's scale, and opacity.
using CellTexel = std::array<std::uint16_t, 4>;

struct CellImage {
  int width = 0;
  int height = 0;
  /// A pixel whose centre is (u, v) shows the texels at (u width - first.x, -v height - first.y), without
  /// whole repeats, where texel (i, j) has whole coordinates.
  V2f first{0, 0};
  float scale = 1;  ///< of radiance
  float above = 0;  ///< mean height of the visible yarn over CellYarn::plane(), mm
  int planes = 1;
  /// [plane][row][column]; the first row and column are repeated behind the last ones.
  std::vector<CellTexel> texels;
  int stride() const { return width + 1; }
  std::size_t plane_texels() const { return static_cast<std::size_t>(stride()) * (height + 1); }
  std::size_t bytes() const { return texels.size() * sizeof(CellTexel); }
};

/// Memory that calls reuse; one per thread.
struct CellScratch {
  DepthGrid seen;
  std::vector<Group> table;  ///< [station][angle function][slot]
  std::vector<Group> raw;    ///< [plane][row][column]: radiance, opacity
  std::vector<Group> rows, sums;
};

/// `shadows`: of the same yarn. The same bytes for the same arguments on processors of one vector width.
void make_cell_image(const CellYarn& yarn, const CellView& view, CellShadows& shadows, CellScratch& scratch,
                     CellImage& image);

/// Radiance that leaves points of the yarn towards the viewer, without shadows within the cell, as images
/// have it: for tests against Yarns.
struct CellPoint {
  std::int32_t piece = 0;
  V3f from_start{0, 0, 0};
};
std::vector<V3f> shade_points(const CellYarn& yarn, const YarnPieces& pieces, const CellView& view,
                              std::span<const CellPoint> points);

}  // namespace selvedge
