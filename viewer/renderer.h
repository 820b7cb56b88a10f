// Renders a scene and its fabrics to frames: all of the paper's section 6. Needs no display and no GPU.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "format/picture/frame.h"
#include "format/scene/scene.h"
#include "viewer/frame/frame_path.h"
#include "viewer/gl/context.h"

namespace selvedge {

/// All options of a rendering.
struct RenderOptions : FrameSize, DrawOptions {
  RenderPath path = RenderPath::hybrid;
  /// The OpenGL implementation. Automatic: Mesa's software rasteriser: pixels return to the CPU anyway.
  ContextKind context = ContextKind::automatic;
};

/// The texel of a level at the middle of a pixel.
struct ProbedTexel {
  int level = 0;    ///< -1: the yarn itself
  V2i texel{0, 0};  ///< row 0 at the top
  float weight = 0;
};

/// The nearest surface at a pixel. Directions are in the fabric's frame.
struct PixelProbe {
  V2i pixel{0, 0};  ///< from the frame's top left
  std::uint32_t surface = 0;
  std::uint32_t triangle = 0;  ///< index into MergedSurfaces::triangles
  bool is_back = false;        ///< the back of the cloth is visible
  V3d position{0, 0, 0};       ///< m, world
  int fabric = -1;             ///< -1: the surface has neither fabric nor texels
  V2d uv{0, 0};                ///< in [0, 1], without whole repeats
  V2d texels_per_pixel{0, 0};  ///< of the whole fabric's level 0, along u and v
  std::vector<ProbedTexel> texels;
  V3f to_viewer{0, 0, 1};      ///< unit, towards the viewer
  std::vector<V3f> to_lights;  ///< unit, towards each light
  V3f radiance{0, 0, 0};       ///< not multiplied by alpha
  float alpha = 0;
};

/// Prepares once everything that the frames of a scene share.
class Renderer {
 public:
  /// `fabrics[i]` is scene.fabrics[i]; they must outlive the object, the scene need not. Draws with
  /// `context`, or creates one if that is null. Errors as render().
  static Result<std::unique_ptr<Renderer>> create(const Scene& scene, const std::vector<Fabric>& fabrics,
                                                  const RenderOptions& options,
                                                  std::unique_ptr<GraphicsContext> context = nullptr);
  ~Renderer();

  /// Draws the scene from `camera`. The bytes depend neither on the number of threads nor, if all images
  /// are made again (CellImageOptions::moves), on earlier frames.
  /// Call on the thread that created the object. The memory of `frame` is reused.
  Result<void> draw(const Camera& camera, const DrawOptions& options, Frame& frame, RenderStats& stats);

  /// Pictures that differ by tints alone: each of `frames` has the bytes that draw() gives the scene with one
  /// of `tints`. These are many times cheaper than frames by themselves, as images of fabrics are shared.
  Result<void> draw(const Camera& camera, const DrawOptions& options, std::span<const Tints> tints,
                    std::vector<Frame>& frames, RenderStats& stats);

  /// Replaces the scene by one with other vertices, of the same materials and fabrics, as if the object had
  /// been created with it; while it moves (CellImageOptions::moves), light from all around keeps
  /// the shadows that it had. After an error, draw only after a successful replacement.
  Result<void> replace(const Scene& scene);

  /// Changes the frame's size, not meshes and fabrics. After an error, draw only after a successful resize.
  Result<void> resize(const FrameSize& size);

  /// The nearest surface at a pixel, counted from the top left of the supersampled frame, if there is one.
  /// Precondition: the pixel lies in the frame.
  Result<std::optional<PixelProbe>> probe_surface(const Camera& camera, const DrawOptions& options,
                                                  const V2i& pixel);

  const Tints& own_tints() const;  ///< of the scene

 private:
  struct State;
  explicit Renderer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// The factors on the light of the fabrics of a scene's instances.
Tints tints_of(const Scene& scene);

/// One frame. `fabrics[i]` is scene.fabrics[i]. The frame's bytes do not depend on the number of threads.
/// Errors: OPTION_OUT_OF_RANGE, GARMENT_EMPTY, GARMENT_NO_UVS, GRAPHICS_UNAVAILABLE. Preconditions: scene and
/// fabrics are as their readers leave them.
Result<Frame> render(const Scene& scene, const std::vector<Fabric>& fabrics, const Camera& camera,
                     const RenderOptions& options, RenderStats* stats = nullptr);

}  // namespace selvedge
