// Draws frames on all paths (RenderPath; paper section 6): OpenGL or the CPU finds the triangles at the
// pixels, the CPU their texels and light.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "viewer/cells/cell_pass.h"
#include "viewer/frame/frame_path.h"
#include "viewer/hybrid/layers.h"
#include "viewer/hybrid/probe.h"

namespace selvedge {

/// Throws GRAPHICS_UNAVAILABLE where OpenGL fails.
class FrameRenderer {
 public:
  /// `gl` and `scene` must outlive the object. With RenderPath::paper, what OpenGL would write in the
  /// published path is rounded to its colours of 8 bits, nearest texels alone; with RenderPath::raster, the
  /// CPU finds the triangles, if all surfaces have a fabric.
  FrameRenderer(const GlFunctions& gl, const PreparedScene& scene, const FrameSize& size, RenderPath kind)
      : scene_(scene),
        kind_(kind),
        bands_(bands_of(size)),
        layers_(size.layers),
        pass_(gl, scene.mesh, scene.materials, bands_),
        cells_(scene) {}

  void resize(const FrameSize& size);
  /// Takes another shape of the scene's mesh; all but positions, normals and tangents are as they were.
  void update_shape() { cells_.update_shape(); }
  /// Fills all pixels of `frames`, one for each of the view's tints, which have the size of the last resize()
  /// already; adds to `stats`. The context must be current whenever a function of the path is called, the
  /// destructor included.
  void draw(const FrameView& view, std::span<Frame> frames, RenderStats& stats);

  /// As Renderer::probe_surface().
  std::optional<PixelProbe> probe_surface(const FrameView& view, const V2i& pixel);

 private:
  /// A band in progress: while one is shaded the next is drawn.
  struct Band {
    BandSurfaces surfaces;
    std::vector<std::vector<V4f>> large;  ///< supersampled pixels, of each picture
  };

  /// Whether the CPU finds the triangles: of blocks it draws no others.
  bool casts(const DrawOptions& options) const {
    return kind_ != RenderPath::paper && !pass_.has_pbr() &&
           (kind_ == RenderPath::raster || options.blocks != nullptr);
  }
  /// Begins a frame.
  FrameScene begin(const FrameView& view, const ProjectedVertices& projected);
  void draw_nearest(TriangleLists lists, int first_row, int rows, std::array<DrawnSide, 2>& sides,
                    Stopwatch& watch, RenderStats& stats);
  void draw_behind(int first_row, int rows, std::array<DrawnSide, 2>& sides, DeepPixels& deep,
                   Stopwatch& watch, RenderStats& stats);
  void shade(const FrameScene& scene, int first_row, Band& band, std::span<Frame> frames, RenderStats& stats);

  const PreparedScene& scene_;
  RenderPath kind_;
  FrameBands bands_;
  int layers_;
  VisibilityPass pass_;
  std::array<Band, 2> in_flight_;
  CellPass cells_;
};

}  // namespace selvedge
