// A window with its own OpenGL context (GLFW; window.cpp is the only file that includes it).
#pragma once

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "format/base/vec.h"
#include "viewer/gl/context.h"

struct GLFWwindow;

namespace selvedge {

inline constexpr char escape_key = 27;

/// Movement of the mouse while a button was down, in the window's units (y down): left, right, middle.
using WindowDrags = std::array<V2d, 3>;
inline const WindowDrags no_drags{V2d(0, 0), V2d(0, 0), V2d(0, 0)};

class Window {
 public:
  /// Opens a window with an OpenGL 4.5 core context, current on this thread. Only one window at a time.
  /// GRAPHICS_UNAVAILABLE without a display or such a context.
  static Result<std::unique_ptr<Window>> open(const std::string& title, const V2i& size);
  ~Window();
  Window& operator=(Window&&) = delete;

  /// The window's context for other drawing code; must not outlive the window.
  std::unique_ptr<GraphicsContext> context() const;

  /// Size of the drawing area in pixels; 0 while minimised.
  V2i size() const;
  /// How much larger text must be than on a screen of 1 x, in the units of mouse and panel.
  float scale() const;
  bool wants_to_close() const;
  /// Waits for events, at most `seconds`, and handles them. Returns whether there were any.
  bool wait_for_events(double seconds);
  /// Ends that wait; from any thread.
  static void wake();
  void swap();
  /// The keys pressed since the last call: upper case letters and escape_key. Includes keys already released.
  std::string poll_keys() { return std::exchange(keys_, {}); }
  /// Files that were dropped on the window since the last call.
  std::vector<std::string> poll_drops() { return std::exchange(drops_, {}); }
  /// Drags since the last call.
  WindowDrags poll_drags() { return std::exchange(drags_, no_drags); }

  GLFWwindow* handle() const { return handle_; }

 private:
  explicit Window(GLFWwindow* handle) : handle_(handle) {}
  static Window& window_of(GLFWwindow* handle);

  GLFWwindow* handle_;
  std::string keys_;
  std::vector<std::string> drops_;
  V2d cursor_{0, 0};
  std::array<bool, 3> held_{};
  WindowDrags drags_ = no_drags;
};

}  // namespace selvedge
