// Composites the surfaces at each pixel from front to back until nothing more shows through.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "viewer/hybrid/shade.h"
#include "viewer/hybrid/visibility_pass.h"
#include "viewer/raster/raster.h"

namespace selvedge {

/// Maximum number of surfaces that a pixel can show behind each other.
inline constexpr int max_layers = 64;

/// The surfaces at a band's pixels.
struct BandSurfaces {
  std::array<DrawnSide, 2>
      sides;                     ///< front and back, as OpenGL has drawn them; of a cast band only the lists
  std::array<Raster, 2> raster;  ///< of a cast band, and of another one with deep pixels
  bool is_cpu_raster = false;
  /// At y * width + x, no_triangle_side: none. Memory of shade_band().
  std::vector<TriangleSide> nearest, behind;
  bool has_pbr() const { return !sides[0].colours.empty(); }
  PbrPixel pbr_at(TriangleSide surface, std::size_t i) const { return sides[surface % 2].pbr_at(i); }
  /// Sets up `raster` from the lists.
  void draw_band(const FrameScene& scene, int first_row, int rows);
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

/// The deep pixels of a band, those in which one side of the cloth covers itself, of a scene with surfaces
/// without fabric, collected until OpenGL has drawn all their layers: only it evaluates the masks of such
/// surfaces.
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
  /// Adds the surfaces that a round has drawn at these pixels. Returns whether some pixel has one more.
  bool add_depth_layer(int side, int round, const DrawnSide& drawn);
  DeepLayers sorted_layers();

 private:
  std::vector<Pixel> pixels_;
  std::vector<DeepHit> hits_;
  std::vector<PbrPixel> pbr_;
};

/// Shades and overwrites the pixels of a band, at most `layers` surfaces deep, on all cores. In a scene with
/// surfaces without fabric only the nearest surface of deep pixels; if more shows behind it, they are added
/// to `deep`.
LayerCount shade_band(const FrameScene& scene, CellPass& cells, BandSurfaces& surfaces, int layers,
                      const BandPixels& pixels, DeepPixels& deep);

/// The other surfaces of deep pixels of such a scene. Precondition: all their layers are known.
LayerCount shade_deep_pixels(const FrameScene& scene, CellPass& cells, DeepPixels& deep, int layers,
                             const BandPixels& pixels);

/// Light of one surface at a pixel, counted from the lower left. Its cell image has been made.
V4f shade_surface(const FrameScene& scene, TriangleSide seen, const V2i& pixel, const PbrPixel& pbr);

}  // namespace selvedge
