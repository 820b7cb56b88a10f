// The picture of `show`, independent of its window: redoes exactly the work that a change requires.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "format/fabric/file.h"
#include "viewer/load.h"
#include "viewer/renderer.h"
#include "viewer/show/state.h"

namespace selvedge {

/// A picture as it was drawn last.
struct DrawnPicture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> bytes;  ///< in display.h's form
  Camera camera;
  std::vector<Light> lights;
  RenderStats stats;
  double draw_seconds = 0;
  double accuracy_db =
      0;  ///< dB of a full frame, as while something moves, against the picture at rest; 0: not known yet
  double scene_diagonal = 1;       ///< diagonal of the scene, m
  std::vector<std::string> clips;  ///< names of the file's clips
  double clip_seconds = 0;         ///< of the one that is shown
};

class ShowPicture {
 public:
  /// `fabrics[i]` is scene.fabrics[i]; further ones may follow.
  /// `motion`: of the scene's file; its first clip is shown.
  static Result<std::unique_ptr<ShowPicture>> create(Scene scene, std::vector<Fabric> fabrics,
                                                     std::optional<Motion> motion = {});

  /// The initial state, with the fabrics of the scene and `options` as an orbit; without an angle, from the
  /// side that frame_scene() finds.
  Result<ShowState> first_state(const CameraOptions& options, double aspect) const;

  /// Adds a fabric, which ShowState::fabrics can then refer to. Errors as read_fabric(), without effect on
  /// the picture.
  Result<void> add_fabric(const std::string& path);

  /// Updates the picture after a change, for a window of `size` pixels, drawn smaller by `divisor` per side.
  /// Ends soon once `*interrupted` is true; the next update must then be Redraw::frame or more.
  Result<void> update(const ShowState& state, Redraw change, const V2i& size, double divisor,
                      const std::atomic<bool>* interrupted = nullptr);

  /// Adds the next of rest_samples_per_side x rest_samples_per_side samples of each pixel to the picture of
  /// the last update(), in which they replace the first ones; after the last the picture has so much
  /// supersampling. Returns whether the picture changed: not if all are there or it was interrupted; on the
  /// hybrid path.
  Result<bool> refine(const ShowState& state, const std::atomic<bool>* interrupted = nullptr);
  static constexpr int rest_samples_per_side = 3;

  /// The nearest surface at a point of [0, 1)^2, from the top left, of the last picture, if there is one.
  Result<std::optional<PixelProbe>> probe_surface(const V2d& point);

  const Scene& scene() const { return scene_; }                           ///< its fabrics are fabrics()
  const Scene& dressed_scene() const { return sides_[0].dressed_scene; }  ///< in what is worn
  const std::vector<Fabric>& fabrics() const { return fabrics_; }

  /// The frame: left of the bar the fabrics that are compared with, else the worn ones.
  const Frame& frame() const { return two_ ? divided_ : sides_[0].frame; }
  const DrawnPicture& drawn() const { return drawn_; }

 private:
  /// The scene in one choice.
  struct ShownSide {
    Scene dressed_scene;
    std::unique_ptr<Renderer> renderer;
    Frame frame;
    Frame sample;
    Frame first;               ///< the frame before samples were added
    std::vector<V4f> samples;  ///< their sum
  };

  ShowPicture() = default;
  std::span<ShownSide> sides() { return {sides_.data(), two_ ? sides_.size() : 1}; }
  /// They point to the fabrics.
  void drop_renderers() {
    for (ShownSide& side : sides_) side.renderer.reset();
  }
  // These throw Failure.
  void load(const ShowState& state);
  void dress(const FabricChoice& choice, ShownSide& side) const;
  void load(const FabricChoice& choice, ShownSide& side);
  void pose(const ShowState& state);
  void draw(const ShowState& state);
  void display(const ShowState& state);
  void set_light(const ShowState& state);

  Scene scene_;
  std::optional<Motion> motion_;
  int posed_clip_ = 0;
  double posed_time_ = 0;
  bool is_posed_ = false;           ///< by this frame
  std::array<ShownSide, 2> sides_;  ///< ShowState::worn and ShowState::compared_fabrics
  bool two_ = false;                ///< the second is shown
  std::vector<Fabric> fabrics_;
  std::vector<V3d> corners_;
  RenderOptions options_;
  double aspect_ = 1;  ///< of the window; the picture's is rounded
  std::shared_ptr<Environment> turned_;
  const Surroundings* turned_of_ = nullptr;
  DrawnPicture drawn_;
  Frame divided_;    ///< of both sides
  float bar_ = 0;    ///< of `divided_`
  int refined_ = 0;  ///< number of samples added
};

}  // namespace selvedge
