// A scene with its fabrics, ready to be drawn again and again: everything that does not change from frame to
// frame is done once.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "format/scene/scene.h"
#include "viewer/gl/context.h"
#include "viewer/hybrid/probe.h"
#include "viewer/render.h"

namespace selvedge {

class Renderer {
 public:
  /// `fabrics[i]` is scene.fabrics[i]; they must outlive the object, the scene need not. Draws with
  /// `context`, or with one of its own where that is null. Errors as render() (render.h).
  static Result<std::unique_ptr<Renderer>> create(const Scene& scene, const std::vector<Fabric>& fabrics,
                                                  const RenderOptions& options,
                                                  std::unique_ptr<GraphicsContext> context = nullptr);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// The scene from `camera`. The bytes do not depend on the number of threads, nor on the frames before. To
  /// be called on the thread that created the object. The memory of `frame` is used again.
  Result<void> draw(const Camera& camera, const DrawOptions& options, Frame& frame, RenderStats& stats);

  /// Meshes and fabrics stay as they are. After an error nothing may be drawn before a resize has succeeded.
  Result<void> resize(const FrameSize& size);

  /// What the nearest surface shows at a pixel, counted from the top left of the supersampled frame; none
  /// where there is nothing. Precondition: the pixel lies in the frame.
  Result<std::optional<PixelProbe>> probe(const Camera& camera, const DrawOptions& options, const V2i& pixel);

  /// Where texels end (draw_texel_edges()), for every pixel of the supersampled frame, top row first.
  Result<void> texel_edges(const Camera& camera, const DrawOptions& options,
                           std::vector<OverlayPixel>& overlay);

  /// What could not be honoured, one line each.
  const std::vector<std::string>& remarks() const;

 private:
  struct State;
  explicit Renderer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace selvedge
