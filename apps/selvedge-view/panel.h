// The panel of `show`, the picture behind it, and mouse input (Dear ImGui, in panel.cpp).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/selvedge-view/screen_texture.h"
#include "apps/selvedge-view/window.h"
#include "viewer/show/background.h"

namespace selvedge {

/// A fabric to choose by its picture.
struct OfferThumbnail {
  OfferThumbnail(std::string file, const GlFunctions& gl) : path(std::move(file)), picture(gl) {}
  std::string path;
  ScreenTexture picture;
};

/// Data that the panel displays.
struct PanelInfo {
  const ShownPicture& picture;
  const std::optional<PixelProbe>& probe;
  const std::vector<std::unique_ptr<OfferThumbnail>>& offers;
  std::string keys;     ///< pressed keys (window.h)
  std::string message;  ///< the last error, or empty
};

/// Requests of the user, beside changes of the state.
struct PanelRequest {
  Redraw redraw = Redraw::none;
  bool close = false;
  bool resets_camera = false;
  bool saves_picture = false;
  bool saves_garment = false;   ///< as it is worn
  bool copies_command = false;  ///< the command line that draws the picture
  std::string add_file;         ///< path, or empty
  std::string wear_path;        ///< a fabric that is to be worn by everything, or empty
};

/// The size of the picture beside the panel, before the window has one.
V2i picture_size(const Window& window);

class Panel {
 public:
  /// The window's context must be current during all calls. Only one panel at a time.
  explicit Panel(const Window& window);
  ~Panel();
  Panel& operator=(Panel&&) = delete;

  /// Begins a frame of the window with the events since the last one.
  void begin();
  /// The size of the picture, beside the panel if that is shown, in a window of `window` pixels.
  V2i picture_size(const V2i& window) const;
  /// Mouse input over the picture.
  ShowInput input(const WindowDrags& drags) const;
  /// The mouse on the picture, from its top left in [0, 1)^2; nothing if it is elsewhere.
  std::optional<V2d> cursor() const;
  /// Whether a mouse button is down over the picture.
  bool is_mouse_pressed() const;
  /// Lays the panel out, if it is shown, and edits `state`.
  PanelRequest edit(const PanelInfo& info, ShowState& state);
  /// Puts text on the clipboard.
  static void copy(const std::string& text);
  /// Draws the picture's texture, then the panel.
  void end(unsigned picture);

 private:
  void edit_view(const PanelInfo& info, ShowState& state, PanelRequest& request);
  void edit_light(ShowState& state, PanelRequest& request);
  static void edit_clip(const PanelInfo& info, ShowState& state, PanelRequest& request);
  void edit_bar(const PanelInfo& info, ShowState& state, PanelRequest& request) const;
  static void edit_offers(const PanelInfo& info, PanelRequest& request);
  void edit_fabrics(const PanelInfo& info, ShowState& state, PanelRequest& request);
  void handle_keys(const PanelInfo& info, ShowState& state, PanelRequest& request);

  float width() const;  ///< of the panel in the window

  bool shown_ = true;
  std::string path_;  ///< text of the path field
};

}  // namespace selvedge
