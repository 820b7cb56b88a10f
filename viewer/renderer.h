// A scene with its fabrics, ready to be drawn again and again: everything that does not change from frame to
// frame is done once.
#pragma once

#include <memory>
#include <vector>

#include "format/scene.h"
#include "viewer/render.h"

namespace selvedge {

class Renderer {
 public:
  /// Size, supersampling and the number of layers are fixed here. `fabrics[i]` is scene.fabrics[i]; they must
  /// outlive the object, the scene need not. Errors as render() (render.h).
  static Result<std::unique_ptr<Renderer>> create(const Scene& scene, const std::vector<Fabric>& fabrics,
                                                  const RenderOptions& options);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// The scene from `camera`; lights and levels are those of `look`, whose sizes do not count. The bytes do
  /// not depend on the number of threads, nor on the frames before. To be called on the thread that created
  /// the object. `frame` is given back to be filled again.
  Result<void> draw(const Camera& camera, const RenderOptions& look, Frame& frame, RenderStats& stats);

  /// What could not be honoured, one line each.
  const std::vector<std::string>& remarks() const;

 private:
  struct State;
  explicit Renderer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace selvedge
