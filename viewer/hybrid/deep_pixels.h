// Deep pixels: those in which one side of the cloth covers itself, and all surfaces in them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "viewer/hybrid/visibility_pass.h"

namespace selvedge {

/// One side of the cloth in a band, and the list of triangles that its numbers index.
struct DrawnSide {
  VisibleSide seen;
  std::vector<std::uint32_t> list;
  /// Empty if no surface of the scene needs it.
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

/// The surfaces of pixels: pixel i has hits starts[i] ... starts[i + 1] - 1, nearest first.
struct DeepLayers {
  std::vector<DeepHit> hits;
  std::vector<std::uint32_t> starts{0};
  std::size_t pixels() const { return starts.size() - 1; }
};

/// The deep pixels of a band, collected until all their layers are known.
class DeepPixels {
 public:
  DeepPixels(int width, int rows);

  struct Pixel {
    std::uint32_t pixel = 0;
    std::array<std::uint8_t, 2> counts{};  ///< number of surfaces by side (front, back)
  };
  /// Adds pixels, each at most once.
  void add(std::span<const Pixel> pixels);
  bool empty() const { return pixels_.empty(); }
  /// Whether some pixel has a surface of this side in this round.
  bool has_more(int side, int round) const;
  /// FrameTiles::tiles of these pixels.
  std::vector<std::uint8_t> tiles(int side, int round) const;
  /// Adds the surfaces that a round has drawn at these pixels.
  void add_round(int side, int round, const DrawnSide& drawn);
  /// Finds all surfaces at these pixels on the CPU, on all cores: far less work than further rounds of OpenGL
  /// for a few pixels. Precondition: all surfaces have a fabric; only OpenGL evaluates the masks of others.
  void cast(const MergedSurfaces& mesh, const ProjectedVertices& projected,
            const std::array<DrawnSide, 2>& sides, int first_row);
  /// All layers; the bytes do not depend on the order in which surfaces were added.
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
  std::vector<std::uint64_t> tiles_;  ///< mask of pixels of each tile, row by row
  std::vector<Pixel> pixels_;
  std::vector<DeepHit> hits_;
};

}  // namespace selvedge
