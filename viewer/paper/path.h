// The render path as published by Daubert et al. (2001, section 6), with colours of 8 bits.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "viewer/frame/frame_path.h"
#include "viewer/paper/layers.h"

namespace selvedge {

class PaperPath final : public FramePath {
 public:
  /// `gl` and `prepared`, made of the other arguments, must outlive the object. Errors and remarks as
  /// paper_kinds(); GRAPHICS_UNAVAILABLE.
  static Result<std::unique_ptr<PaperPath>> create(const GlFunctions& gl, const Scene& scene,
                                                   const std::vector<Surface>& surfaces,
                                                   const std::vector<Fabric>& fabrics,
                                                   const PreparedScene& prepared, const FrameSize& size,
                                                   std::vector<std::string>& remarks);

  Result<void> resize(const FrameSize& size) override;
  Result<void> draw(const FrameView& view, Frame& frame, RenderStats& stats) override;

 private:
  explicit PaperPath(const PreparedScene& scene) : scene_(scene) {}
  Result<void> draw_band(const FrameView& view, int first_row, Frame& frame, RenderStats& stats);

  const PreparedScene& scene_;
  FrameBands bands_;
  int layers_ = 1;
  PaperKinds kinds_;
  std::unique_ptr<PaperPass> pass_;
  PaperFrames coded_;
  std::vector<V4f> large_;
};

}  // namespace selvedge
