// The loop of `show`: from the events to a request, from the newest picture to the window.
#pragma once

#include "apps/common/report.h"
#include "apps/selvedge-view/panel.h"
#include "apps/selvedge-view/screen_texture.h"
#include "viewer/show/background.h"

namespace selvedge {

class ShowLoop {
 public:
  struct Options {
    std::string input;                ///< the garment or fabric that is shown first
    std::string screenshot;           ///< of the window as it was when it closed, .png; empty: none
    bool needs_last_picture = false;  ///< the report after the end shows the picture of the last events
  };
  ShowLoop(Options options, Window& window, PictureThread& background, const GlFunctions& gl,
           const ShowState& state);

  /// Until the window is closed. Throws Failure.
  void run();
  Json to_json() const;

 private:
  /// One frame of the window without its swap. Returns whether the user wants to close it.
  bool step();
  /// The command line of the picture; empty for a fabric.
  std::string command() const;
  void send_request(Redraw change, const V2i& size, const std::optional<V2d>& probed);
  /// Updates by the thread of the picture.
  void receive();

  const Options options_;
  Window& window_;
  PictureThread& background_;
  const GlFunctions& gl_;
  std::vector<std::unique_ptr<OfferThumbnail>> offers_;
  std::string input_;  ///< the garment or fabric that is shown
  CameraOptions first_camera_;
  ShowState state_;
  Panel panel_;
  ScreenTexture shown_;
  std::shared_ptr<const ShownPicture> picture_ = std::make_shared<const ShownPicture>();
  V2i window_size_{0, 0};
  Redraw pending_ = Redraw::scene;
  V2i requested_size_{0, 0};
  std::optional<V2d> requested_probe_;
  int generation_ = 0;
  bool finished_ = false;  ///< picture and probe answer the last request
  int settling_ = 0;       ///< frames that the panel still needs
  bool closes_ = false;
  std::optional<int> closes_after_;  ///< so many frames
  std::optional<PixelProbe> probe_;
  std::uint64_t request_number_ = 0;
  std::optional<V2d> aimed_;  ///< where the mouse was ...
  V3d aim_{0, 0, 0};          ///< ... over this point, world, m
  const std::optional<PixelProbe> no_probe_;
  std::string message_;
  Stopwatch clip_watch_;  ///< since the last frame of a clip
};

}  // namespace selvedge
