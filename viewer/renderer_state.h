// The inside of a renderer (renderer.h).
#pragma once

#include <array>
#include <chrono>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "viewer/gl/context.h"
#include "viewer/hybrid/layers.h"
#include "viewer/paper/layers.h"
#include "viewer/renderer.h"
#include "viewer/scene/materials.h"

namespace selvedge {

/// Adds the time since the last call to one of the stages.
class Watch {
 public:
  void add_to(double& stage) {
    const auto now = std::chrono::steady_clock::now();
    stage += std::chrono::duration<double>(now - last_).count();
    last_ = now;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// What a renderer holds from one frame to the next, and how each path draws a frame of it.
struct Renderer::State {
  RenderOptions options;
  int width = 1;  ///< of the supersampled frame
  int height = 1;
  int band_rows = 1;
  V3d origin{0, 0, 0};
  MergedSurfaces mesh;
  Materials materials;
  std::vector<std::string> remarks;
  std::vector<PackedFabric> packed;
  std::unique_ptr<GraphicsContext> context;
  GlFunctions gl;
  std::unique_ptr<VisibilityPass> pass;  ///< goes before its context
  std::unique_ptr<ShaderPath> shader;    ///< draws in place of the pass, where it is there
  std::unique_ptr<PaperPass> paper;      ///< the same
  PaperKinds kinds;
  std::vector<SurfaceMaterial> kind_looks;
  PaperFrames coded;
  std::unique_ptr<ShadowPass> shadows;  ///< made when shadows are asked for
  double prepare = 0;
  std::span<const ShadowMap> maps;  ///< of the frame that is being drawn
  /// Rows on their way: while one band is shaded the next is drawn.
  struct Band {
    std::array<DrawnSide, 2> sides;
    std::vector<V4f> large;  ///< pixels, where supersampled
  };
  std::array<Band, 2> bands;

  ShadingScene shading_of(const Camera& camera, const RenderOptions& look) const {
    return {camera, width,         height, materials.materials, packed,    look.lights, &mesh,
            origin, materials.pbr, maps,   look.ambient,        look.power};
  }
  /// Draws the maps that the look asks for; reads them back, unless the shader path alone needs them.
  Result<void> draw_shadows(const RenderOptions& look, bool read);
  /// Makes the pass if it is not there; the shader path needs it for probes and texel edges only.
  Result<void> need_pass();
  Result<void> draw_shader(const Camera& camera, const RenderOptions& look, Frame& frame, Watch& watch,
                           RenderStats& stats);
  Result<void> make_paper(const Scene& scene, const std::vector<Surface>& surfaces,
                          const std::vector<Fabric>& fabrics);
  Result<void> draw_paper(const Camera& camera, const RenderOptions& look, int first_row, Frame& frame,
                          Watch& watch, RenderStats& stats);
  Result<void> draw_nearest(TriangleLists lists, const FrameTiles& where, std::array<DrawnSide, 2>& sides,
                            Watch& watch, RenderStats& stats);
  Result<void> draw_behind(const IndexScene& index, FrameTiles where, std::array<DrawnSide, 2>& sides,
                           DeepPixels& deep, Watch& watch, RenderStats& stats);
  Result<void> shade(const IndexScene& index, const ShadingScene& shading, int first_row, Band& band,
                     Frame& frame, RenderStats& stats);
  Result<void> draw_hybrid(const Camera& camera, const RenderOptions& look, Frame& frame, Watch& watch,
                           RenderStats& stats);
  /// Where a band's pixels go: the frame itself, or a supersampled piece of it, which filter() takes there.
  BandPixels pixels_of(Band& band, int first_row, Frame& frame) const;
  void filter(const Band& band, const BandPixels& pixels, Frame& frame) const;
};

}  // namespace selvedge
