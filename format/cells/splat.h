// Splatter: the depth of yarn, and the piece at it, for all rays of one direction through a repeating cell.
//
// The image is a grid of width x height texels over one period of the plane z = `plane`; the ray of a texel
// passes the plane at the texel's centre. Rows follow y, columns x (yarns.h). Everything repeats.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "format/cells/cell_view.h"
#include "format/cells/yarn_pieces.h"

namespace selvedge {

inline constexpr float no_depth = -1e30F;
inline constexpr int columns_behind = 16;  ///< of a DepthGrid
inline constexpr int rows_behind = 3;      ///< of a DepthGrid, whose numbers mean nothing
inline int stride_of(int width) { return width + columns_behind; }

/// Depths of a cell or of a window in it; `stride` - `width` columns follow each row, which of a whole cell
/// repeat its first ones.
struct DepthGrid {
  CellSize size;            ///< that it was made for
  V2i period{0, 0};         ///< texels of the cell
  V2i window_origin{0, 0};  ///< texel of the cell
  int width = 0;
  int height = 0;
  int stride = 0;
  std::vector<float> z;             ///< mm, where the ray meets yarn; no_depth where it meets none
  std::vector<std::int32_t> piece;  ///< undefined where it meets none; empty if unwanted
  void resize(const CellSize& image, bool with_pieces);
};

struct SplatView {
  V2f slope{0, 0};  ///< way along x and y of a ray for each mm of height, towards the viewer
  /// Width of what a ray stands for, mm: of thinner hairs only a fraction is met, and these are as much
  /// wider.
  float ray_width = 0;
  bool has_hairs = true;
};

/// Pieces, and how far a map moves them, mm.
struct ShownRange : PieceRange {
  V2f shift{0, 0};
};

/// Pieces that a window may show, in their order: plies, then hairs that rays of a view's width meet. Of a
/// map in the order of its stitches.
struct ShownPieces {
  std::vector<ShownRange> plies, hairs;
  int hair_count() const;
};
void find_pieces(const CellYarn& yarn, const YarnPieces& pieces, const SplatView& view,
                 const DepthGrid& window, ShownPieces& shown);

/// A hair that a window shows.
struct SeenHair {
  std::int32_t piece = 0;
  std::uint32_t number = 0;  ///< in the ranges of those that it may show; of a shaded one, its shading
  float radius = 0;          ///< as its rays see it, mm
  V2f shift{0, 0};           ///< how far a map moves it, mm
};
/// Adds the hairs of ranges that the window shows, and half a texel around it.
void find_hairs(const CellYarn& yarn, const YarnPieces& pieces, const SplatView& view,
                const DepthGrid& window, std::span<const ShownRange> ranges, std::vector<SeenHair>& hairs);

/// The repeat of an image, mm.
V2f image_period(const CellYarn& yarn, const CellSize& size);

/// Slope of rays from a unit direction: rays rise by at least min_ray_rise (lifted.h).
V2f ray_slope(const V3f& direction);

struct HairColours {
  std::span<const std::uint32_t> shadings;  ///< of the hairs of ranges
  std::span<const Group> colours;           ///< [shading][plane], radiance
};
/// Blends hairs, as lines of their fraction of each texel, over texels whose yarn `seen` has, in the order of
/// the pieces. `raw`: [row][column][plane], radiance and opacity.
void blend_hairs(const CellYarn& yarn, const YarnPieces& pieces, const SplatView& view, const DepthGrid& seen,
                 std::span<const ShownRange> hairs, const HairColours& colours, std::span<Group> raw);

/// Draws pieces into a grid of at least min_cell_texels x min_cell_texels, whose size is set.
void splat(const CellYarn& yarn, const YarnPieces& pieces, const SplatView& view,
           std::span<const ShownRange> ranges, DepthGrid& grid);
/// Draws what the grid shows.
void splat(const CellYarn& yarn, const YarnPieces& pieces, const SplatView& view, DepthGrid& grid);

}  // namespace selvedge
