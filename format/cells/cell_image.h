// Cell images: pictures of one repeat of a fabric, under parallel light and seen from one direction, filtered
// to pixels.
//
// A surface that shows many repeats in nearly the same view and light looks a pixel up in the image of its
// cell in place of evaluating the fabric there. Texels are evaluated once each (cell_texels.h). Yarn is
// splatted (splat.h), shadows within the cell come from depth grids of the lights, and visible points are
// shaded as Yarns::point_at(), add_strands(), direct_reflectance() and transfer_at() do.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "format/cells/cell_shadows.h"
#include "format/cells/cell_texels.h"

namespace selvedge {

/// One side of a fabric, or parts of it. All must outlive the images' making.
struct CellSource {
  const CellYarn* yarn = nullptr;      ///< null: texels alone
  CellShadows* shadows = nullptr;      ///< of the yarn
  const CellTexels* texels = nullptr;  ///< null: yarn alone
};

/// For pixels of `pixel` repeats along u and v with `samples` samples a side; fewer if the repeat had more
/// than `max_samples`.
CellSize cell_size(const V2f& pixel, float samples, int max_samples = max_cell_samples);

/// Lets an image show these parts of the repeat, and a margin of pixels around them, if that is less than
/// all.
void set_window(RepeatParts parts, float pixels_around, CellSize& size);

/// Four channels of 16 bits, unsigned floats of 5 bits of exponent and 11 of mantissa: radiance times opacity
/// over the image's scale, and opacity.
using CellTexel = std::array<std::uint16_t, 4>;

struct CellImage {
  int width = 0;
  int height = 0;
  /// A pixel whose centre is (u, v) shows the texels at (u repeat_texels.x - origin.x, -v repeat_texels.y -
  /// origin.y), without whole repeats, where texel (i, j) has whole coordinates.
  V2f origin{0, 0};
  V2f repeat_texels{0, 0};   ///< texels of a repeat: width and height, or more of a window (CellSize)
  float radiance_scale = 1;  ///< of radiance
  int plane_count = 1;
  /// [plane][row][column]; behind the last row and column is one more, of whole images the first.
  std::vector<CellTexel> texels;
  /// Mean heights of the yarn that texels show over CellYarn::reference_height(), in steps, in the order of a
  /// plane; of holes, of yarn beside them. Odd where that yarn runs along v (variation.h). Empty without
  /// yarn.
  std::vector<std::int8_t> heights;
  float height_step = 0;  ///< mm
  int stride() const { return width + 1; }
  std::size_t plane_texels() const { return static_cast<std::size_t>(stride()) * (height + 1); }
  std::size_t bytes() const { return texels.size() * sizeof(CellTexel) + heights.size(); }
};

/// CellImage::height_step of yarn, whose plane lies at `reference`, mm.
float height_step(const Yarns& yarns, float reference);

/// Memory that calls reuse; one per thread.
struct CellScratch {
  DepthGrid depths;
  std::vector<Group> station_table;  ///< [station][angle function][slot]
  std::vector<Group> samples;        ///< [row][column][plane]: radiance, opacity
  ShownPieces shown;
  std::vector<SeenHair> seen_hairs;
  std::vector<std::uint32_t> hair_shadings;  ///< of the hairs of `shown`, in `hairs`
  std::vector<Group> hairs;                  ///< [shading][plane]: radiance, opacity
  std::vector<Group> row_sums, pixel_sums;
  std::vector<std::uint32_t> shading_source_indices;  ///< of samples: the one whose light they show
  /// Pieces and stations that an image has marked, by its number.
  std::uint32_t image = 0;
  std::vector<std::uint32_t> marked_pieces, marked_stations;
  std::vector<std::uint32_t> stations;  ///< of light, that the image asks for
};

/// The pieces of yarn that an image shows.
const YarnPieces& shown_pieces(const CellYarn& yarn, const CellView& view);
/// The points of an image's yarn before they are filtered: scratch.samples, the lowest row first, and
/// scratch.depths.
void make_yarn_samples(const CellSource& source, const CellView& view, CellScratch& scratch);

/// The same bytes for the same arguments on processors of one vector width.
void make_cell_image(const CellSource& source, const CellView& view, CellScratch& scratch, CellImage& image);

}  // namespace selvedge
