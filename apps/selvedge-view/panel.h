// The panel of `show`, the picture behind it, and what the mouse does (Dear ImGui; panel.cpp is the only file
// that includes it).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/selvedge-view/window.h"
#include "viewer/show/picture.h"

namespace selvedge {

/// What the panel tells.
struct PanelInfo {
  const ShowPicture& picture;
  const std::optional<PixelProbe>& probe;
  double window_seconds = 0;  ///< for panel and window, the last time
  int divisor = 1;            ///< by which the picture is smaller than the window
  std::string keys;           ///< that were pressed (window.h)
  std::string message;        ///< what went wrong last; empty: nothing
};

/// What somebody wants, beside the state that they edit.
struct PanelWish {
  Change change = Change::none;
  bool close = false;
  bool resets_camera = false;
  std::string add_fabric;  ///< path; empty: none
};

class Panel {
 public:
  /// The window's context must be current, here and later. One at a time.
  explicit Panel(const Window& window);
  ~Panel();
  Panel(const Panel&) = delete;
  Panel& operator=(const Panel&) = delete;

  /// Begins a frame of the window with what has happened since the last one.
  void begin();
  /// Of the picture, beside the panel if that is shown, in a window of `window` pixels.
  V2i picture_size(const V2i& window) const;
  /// What the hands do over the picture.
  ShowInput input(const WindowDrags& drags) const;
  /// Where the mouse points at the picture, from its top left in [0, 1)^2; none where it does not.
  std::optional<V2d> cursor() const;
  /// Whether a button is held over the picture.
  bool holds() const;
  /// Lays the panel out, if it is shown, and edits `state`.
  PanelWish edit(const PanelInfo& info, ShowState& state);
  /// Draws a texture over the place of the picture, another above it unless that is 0, then the panel.
  void end(unsigned picture, unsigned overlay);

 private:
  void edit_view(const PanelInfo& info, ShowState& state, PanelWish& wish);
  void edit_light(const PanelInfo& info, ShowState& state, PanelWish& wish);
  void edit_fabrics(const PanelInfo& info, ShowState& state, PanelWish& wish);
  void take_keys(const PanelInfo& info, ShowState& state, PanelWish& wish);

  float width() const;  ///< that the panel takes from the window

  bool shown_ = true;
  std::string path_;  ///< that is being typed
};

}  // namespace selvedge
