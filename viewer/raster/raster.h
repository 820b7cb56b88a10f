// Finds the surfaces at a frame's pixels on the CPU: several times as fast as a software OpenGL whose frame
// is read back (viewer/hybrid/visibility_pass.h), for scenes whose surfaces all have a fabric.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "viewer/scene/mesh.h"

namespace selvedge {

/// A surface at a pixel in which one side of the cloth covers itself.
struct DeepHit {
  std::uint32_t pixel = 0;  ///< y * width + x of the band
  float depth = 0;
  TriangleSide surface = 0;
  std::uint32_t deep_pixel = 0;  ///< of the pixel, of all deep ones
  std::uint32_t pbr_index = 0;   ///< of DeepLayers::pbr
};

/// Some rows of one side of the cloth, bottom row first; pixel (x, y) at y * stride + x.
struct RasterRows {
  std::size_t stride = 0;
  std::vector<float> depth;           ///< OpenGL's, smaller is nearer; 1: empty pixel
  std::vector<std::int32_t> surface;  ///< TriangleSide; undefined in empty pixels
  std::vector<std::int32_t> count;    ///< number of surfaces behind each other
};

/// In place of a surface behind the nearest one, where one side of the cloth covers itself.
inline constexpr TriangleSide deep_triangle_side = no_triangle_side - 1;

/// The nearest surfaces of a row's pixels, and the other side's behind them; no_triangle_side: none. `from`:
/// of the row's first pixel in the rows of both sides.
void merge_sides(const std::array<RasterRows, 2>& sides, std::size_t from, std::span<TriangleSide> nearest,
                 std::span<TriangleSide> behind);

/// One side of the cloth in a band of a frame.
class Raster {
 public:
  static constexpr int strip_rows = 16;
  /// Sets up triangles that may cover pixels of a band (list_bands()), of which the front or the back is
  /// seen.
  void begin(const MergedSurfaces& mesh, const ProjectedVertices& projected,
             std::span<const std::uint32_t> list, bool back, int first_row, int rows);
  /// Draws the rows from strip * strip_rows of the band on. A pixel's centre on an edge belongs to one of
  /// the triangles that share it. From any thread.
  void draw(int strip, RasterRows& to) const;
  /// Adds all surfaces at some pixels of a strip, in any order; the pixels ascend. From any thread.
  void find_hits(int strip, std::span<const std::uint32_t> pixels, std::vector<DeepHit>& to) const;

 private:
  /// A projected triangle, from the centre of the frame's first pixel: a pixel (x, y) lies within it where
  /// a x + b y + c of all its edges is positive, and where it is 0 for edges on the left or below.
  struct Edge {
    double a, b, c;
    double inverse;  ///< of -a; 0: parallel to rows
  };
  struct Triangle {
    std::array<Edge, 3> edges;
    std::array<double, 3> depth;  ///< of the pixel (x, y): depth[0] x + depth[1] y + depth[2]
    int low = 0, high = -1;       ///< rows of the band
    TriangleSide surface = 0;
    std::uint64_t columns = 0;  ///< bits of the 64ths of the frame's width that it may touch
    double depth_at(int x, int y) const { return depth[0] * x + depth[1] * y + depth[2]; }
  };
  template <class Wanted, class Visit>
  void each_span(int strip, const Wanted& wanted, const Visit& visit) const;
  static Triangle set_up(const MergedSurfaces& mesh, const ProjectedVertices& projected,
                         TriangleSide surface);

  int width_ = 0, first_row_ = 0, rows_ = 0;
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> strips_;  ///< first of `listed_` of each strip, and its end
  std::vector<std::uint32_t> listed_;  ///< indices into `triangles_`, in their order
};

}  // namespace selvedge
