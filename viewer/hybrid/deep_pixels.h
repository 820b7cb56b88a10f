// Deep pixels: those in which one side of the cloth covers itself, and all surfaces in them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "viewer/hybrid/visibility_pass.h"
#include "viewer/raster/raster.h"

namespace selvedge {

/// One side of the cloth in a band, and the list of triangles that its numbers index.
struct DrawnSide {
  VisibleSide visible;
  std::vector<std::uint32_t> triangle_list;
  /// Empty if no surface of the scene needs it.
  PbrPixel pbr_at(std::size_t i) const {
    return visible.colours.empty() ? PbrPixel{} : PbrPixel{visible.colours[i], visible.pbr[i]};
  }
};

/// Hits by pixel, nearest first: starts[i] ... starts[i + 1] - 1 are hits of one pixel.
struct DeepLayers {
  std::vector<DeepHit> hits;
  std::vector<std::uint32_t> starts{0};
  std::vector<PbrPixel> pbr;  ///< empty if no surface of the scene needs it
  std::size_t pixels() const { return starts.size() - 1; }
  PbrPixel pbr_of(const DeepHit& hit) const { return pbr.empty() ? PbrPixel{} : pbr[hit.pbr_index]; }
};

/// Sorts hits by pixel. The order does not depend on the order of `hits`.
DeepLayers sort_by_pixel(std::size_t pixels, std::span<const DeepHit> hits);

/// The deep pixels of a band of a scene with surfaces without fabric, collected until OpenGL has drawn all
/// their layers: only it evaluates the masks of such surfaces.
class DeepPixels {
 public:
  struct Pixel {
    std::uint32_t index_in_band = 0;
    std::array<std::uint8_t, 2> counts{};  ///< number of surfaces by side (front, back)
    Group transparency{};                  ///< what its quarters show of what is behind the nearest
  };
  /// Adds pixels, each at most once.
  void add_pixels(std::span<const Pixel> more) { pixels_.insert(pixels_.end(), more.begin(), more.end()); }
  bool empty() const { return pixels_.empty(); }
  Group& transparency_at(std::size_t number) { return pixels_[number].transparency; }
  /// Whether some pixel has a surface of this side in this round.
  bool has_depth_layer(int side, int round) const;
  /// Adds the surfaces that a round has drawn at these pixels.
  void add_depth_layer(int side, int round, const DrawnSide& drawn);
  DeepLayers sorted_layers();

 private:
  std::vector<Pixel> pixels_;
  std::vector<DeepHit> hits_;
  std::vector<PbrPixel> pbr_;
};

}  // namespace selvedge
