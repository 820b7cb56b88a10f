// The picture in the window of `show`: what has to be done again after a change, and no more. Knows of no
// window.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viewer/load.h"
#include "viewer/renderer.h"
#include "viewer/show/state.h"

namespace selvedge {

class ShowPicture {
 public:
  using MakeContext = std::function<std::unique_ptr<GraphicsContext>()>;

  /// `fabrics[i]` is scene.fabrics[i]; more may follow. `make_context` is called for every new scene; null
  /// contexts are as for Renderer::create().
  static Result<std::unique_ptr<ShowPicture>> create(Scene scene, std::vector<Fabric> fabrics,
                                                     MakeContext make_context);

  /// Of these fabrics levels are read when a picture first asks for them, and kept.
  static Result<std::unique_ptr<ShowPicture>> create(OpenScene open, MakeContext make_context);

  /// A state with the fabrics of the scene and `options` as an orbit.
  Result<ShowState> first_state(const CameraOptions& options, double aspect) const;

  /// Adds a fabric for ShowState::fabrics to name. Errors as read_fabric(); the picture stays as it was.
  Result<void> add_fabric(const std::string& path);

  /// Does what `change` asks for, for a window of `size` pixels, drawn smaller by `divisor` per side.
  Result<void> update(const ShowState& state, Change change, const V2i& size, int divisor);

  /// What is seen at a point of [0, 1)^2, from the top left, of the picture last drawn; none where there is
  /// nothing.
  Result<std::optional<PixelProbe>> probe(const V2d& at);

  const Scene& scene() const { return scene_; }
  const std::vector<std::string>& fabric_names() const { return fabric_names_; }
  const std::vector<Fabric>& fabrics() const { return fabrics_; }  ///< as far as they are read
  std::uint64_t bytes_read() const;                         ///< of the files that are read level by level
  std::uint64_t file_bytes() const { return file_bytes_; }  ///< all of these
  double size() const { return size_; }                     ///< diagonal of the scene, m

  const Frame& frame() const { return frame_; }
  const Camera& camera() const { return camera_; }
  const std::vector<Light>& lights() const { return options_.lights; }
  /// What the picture may ask for and no file has.
  const Issues& warnings() const { return warnings_; }
  const RenderStats& stats() const { return stats_; }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }      ///< of `frame`, as display.h
  const std::vector<OverlayPixel>& overlay() const { return overlay_; }  ///< empty: not asked for
  double draw_seconds() const { return draw_seconds_; }
  double overlay_seconds() const { return overlay_seconds_; }
  double display_seconds() const { return display_seconds_; }

 private:
  ShowPicture() = default;
  Result<void> load(const ShowState& state);
  Result<void> read_levels(const ShowState& state);
  Result<void> draw(const ShowState& state);

  MakeContext make_context_;
  Scene scene_;
  Scene dressed_;  ///< in the fabrics that were chosen
  std::vector<Fabric> fabrics_;
  std::vector<FabricReader> readers_;  ///< of the first fabrics, or none
  std::uint64_t file_bytes_ = 0;
  std::vector<std::string> fabric_names_;
  std::vector<V3d> corners_;
  double size_ = 1;
  std::unique_ptr<Renderer> renderer_;
  RenderOptions options_;
  Camera camera_;
  Frame frame_;
  RenderStats stats_;
  Issues warnings_;
  std::vector<std::uint8_t> bytes_;
  std::vector<OverlayPixel> overlay_;
  double draw_seconds_ = 0;
  double overlay_seconds_ = 0;
  double display_seconds_ = 0;
};

}  // namespace selvedge
