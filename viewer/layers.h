// From the surfaces that lie behind each other at a pixel to its colour, nearest first, until nothing more
// shows through.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "viewer/shade.h"
#include "viewer/visibility_pass.h"

namespace selvedge {

/// The most surfaces behind each other that a pixel can show.
inline constexpr int most_layers = 64;

/// One side of the cloth in a band, with the list that its triangles are numbers of.
struct DrawnSide {
  VisibleSide seen;
  std::vector<std::uint32_t> list;
};

/// Where a band's pixels go: radiance times opacity, and opacity. Row y, counted from the band's bottom,
/// begins at bottom + y * stride.
struct BandPixels {
  int first_row = 0;  ///< of the frame
  int width = 1;
  int rows = 1;
  V4f* bottom = nullptr;
  std::ptrdiff_t stride = 0;
  V4f& at(int x, int y) const { return bottom[y * stride + x]; }
};

/// What a band did.
struct LayerCount {
  std::int64_t covered = 0;    ///< pixels in which something is seen
  std::int64_t evaluated = 0;  ///< over all layers
  int layers = 0;              ///< the most in one pixel
  LayerCount& operator+=(const LayerCount& b);
};

/// A surface at a deep pixel.
struct DeepHit {
  std::uint32_t pixel = 0;  ///< y * width + x of the band
  float depth = 0;
  std::uint32_t triangle = 0;  ///< of the mesh
  bool back = false;
  CorePixel core;
};

/// Pixels where one side of the cloth lies behind itself. They wait until all their layers are known.
class DeepPixels {
 public:
  struct Pixel {
    std::uint32_t pixel = 0;
    std::array<std::uint8_t, 2> counts{};  ///< surfaces of the front and of the back
  };
  void add(std::span<const Pixel> pixels) { pixels_.insert(pixels_.end(), pixels.begin(), pixels.end()); }
  bool empty() const { return pixels_.empty(); }
  /// Whether some pixel has a surface of this side in round `round`.
  bool has_more(int side, int round) const;
  /// FrameTiles::tiles of the pixels that have.
  std::vector<std::uint8_t> tiles(int width, int rows, int side, int round) const;
  /// Takes what a round has shown of a side at these pixels.
  void take(int side, int round, const DrawnSide& drawn);
  /// Finds all surfaces at these pixels on the processor, on all cores: far less work than drawing everything
  /// again for a few of them. Not for scenes with surfaces without fabric, whose masks OpenGL knows.
  void cast(const MergedSurfaces& mesh, const ProjectedVertices& projected,
            const std::array<DrawnSide, 2>& sides, const BandPixels& band);
  /// Sorted by pixel, and by depth within a pixel.
  std::vector<DeepHit> sorted() const;

 private:
  std::vector<Pixel> pixels_;
  std::vector<DeepHit> hits_;
};

/// Shades the pixels of a band, which are overwritten, at most `layers` surfaces deep; on all cores. Deep
/// pixels stay empty and are given back in `deep`.
LayerCount shade_band(const IndexScene& index, const ShadingScene& shading,
                      const std::array<DrawnSide, 2>& sides, int layers, const BandPixels& pixels,
                      DeepPixels& deep);

/// The same for the deep ones, all of whose layers are known by now.
LayerCount shade_deep(const IndexScene& index, const ShadingScene& shading, const DeepPixels& deep,
                      int layers, const BandPixels& pixels);

}  // namespace selvedge
