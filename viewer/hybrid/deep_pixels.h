// Pixels where one side of the cloth lies behind itself, and all that lies there.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "viewer/hybrid/visibility_pass.h"

namespace selvedge {

/// One side of the cloth in a band, with the list that its triangles are numbers of.
struct DrawnSide {
  VisibleSide seen;
  std::vector<std::uint32_t> list;
  /// Nothing where no surface of the scene needs it.
  PbrPixel pbr_at(std::size_t i) const {
    return seen.colours.empty() ? PbrPixel{} : PbrPixel{seen.colours[i], seen.pbr[i]};
  }
};

/// A surface at a deep pixel.
struct DeepHit {
  std::uint32_t pixel = 0;  ///< y * width + x of the band
  float depth = 0;
  std::uint32_t triangle = 0;  ///< of the mesh
  bool back = false;
  PbrPixel pbr;
};

/// The surfaces of pixels: those of pixel i are hits starts[i] ... starts[i + 1] - 1, nearest first.
struct DeepLayers {
  std::vector<DeepHit> hits;
  std::vector<std::uint32_t> starts{0};
  std::size_t pixels() const { return starts.size() - 1; }
};

/// They wait until all their layers are known.
class DeepPixels {
 public:
  DeepPixels(int width, int rows);

  struct Pixel {
    std::uint32_t pixel = 0;
    std::array<std::uint8_t, 2> counts{};  ///< surfaces of the front and of the back
  };
  /// Each pixel at most once.
  void add(std::span<const Pixel> pixels);
  bool empty() const { return pixels_.empty(); }
  /// Whether some pixel has a surface of this side in round `round`.
  bool has_more(int side, int round) const;
  /// FrameTiles::tiles of the pixels that have.
  std::vector<std::uint8_t> tiles(int side, int round) const;
  /// Adds what a round has shown of a side at these pixels.
  void add_round(int side, int round, const DrawnSide& drawn);
  /// Finds all surfaces at these pixels on the processor, on all cores: far less work than drawing everything
  /// again for a few of them. Not for scenes with surfaces without fabric, whose masks OpenGL knows.
  void cast(const MergedSurfaces& mesh, const ProjectedVertices& projected,
            const std::array<DrawnSide, 2>& sides, int first_row);
  /// The bytes do not depend on the order in which the surfaces were found.
  DeepLayers sorted() const;

 private:
  struct Place {
    std::size_t tile;
    std::uint32_t bit;
  };
  Place place_of(std::uint32_t pixel) const;

  int width_;
  int rows_;
  int tile_columns_;
  std::vector<std::uint64_t> tiles_;  ///< which pixels of each tile, row by row
  std::vector<Pixel> pixels_;
  std::vector<DeepHit> hits_;
};

}  // namespace selvedge
