#include "apps/selvedge-view/window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>

namespace selvedge {
namespace {

class WindowContext final : public GraphicsContext {
 public:
  explicit WindowContext(GLFWwindow* window) : window_(window) {}
  Result<void> make_current() override {
    if (glfwGetCurrentContext() != window_) glfwMakeContextCurrent(window_);
    return {};
  }
  Function function(const char* name) const override { return glfwGetProcAddress(name); }

 private:
  GLFWwindow* window_;
};

/// GLFW's message on its last error.
std::string reason(const char* otherwise) {
  const char* text = nullptr;
  glfwGetError(&text);
  return text != nullptr ? text : otherwise;
}

}  // namespace

Result<std::unique_ptr<Window>> Window::open(const std::string& title, const V2i& size) {
  if (glfwInit() != GLFW_TRUE)
    return fail(Code::graphics_unavailable, "", "window", reason("there is no display"));
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_DEPTH_BITS, 0);
  glfwWindowHint(GLFW_STENCIL_BITS, 0);
  GLFWwindow* handle = glfwCreateWindow(size.x, size.y, title.c_str(), nullptr, nullptr);
  if (handle == nullptr) {
    auto error = fail(Code::graphics_unavailable, "", "window", reason("no OpenGL 4.5 core context"));
    glfwTerminate();
    return error;
  }
  glfwMakeContextCurrent(handle);
  std::unique_ptr<Window> window(new Window(handle));
  glfwSetWindowUserPointer(handle, window.get());
  glfwSetKeyCallback(handle,
                     [](GLFWwindow* sender, int key, int /*scancode*/, int action, int /*modifiers*/) {
                       if (action != GLFW_PRESS) return;
                       std::string& keys = window_of(sender).keys_;
                       if (key == GLFW_KEY_ESCAPE) keys.push_back(escape_key);
                       if (key == GLFW_KEY_SPACE) keys.push_back(' ');
                       if (key == GLFW_KEY_LEFT) keys.push_back('<');
                       if (key == GLFW_KEY_RIGHT) keys.push_back('>');
                       if (key >= GLFW_KEY_A && key <= GLFW_KEY_Z)
                         keys.push_back(static_cast<char>('A' + (key - GLFW_KEY_A)));
                     });
  glfwSetMouseButtonCallback(handle, [](GLFWwindow* sender, int button, int action, int /*modifiers*/) {
    std::array<bool, 3>& held = window_of(sender).held_;
    if (button >= 0 && button < static_cast<int>(held.size())) held[button] = action == GLFW_PRESS;
  });
  glfwSetCursorPosCallback(handle, [](GLFWwindow* sender, double x, double y) {
    Window& moved = window_of(sender);
    for (std::size_t i = 0; i < moved.held_.size(); ++i)
      if (moved.held_[i]) moved.drags_[i] += V2d(x, y) - moved.cursor_;
    moved.cursor_ = V2d(x, y);
  });
  glfwSetDropCallback(handle, [](GLFWwindow* sender, int count, const char** paths) {
    std::vector<std::string>& drops = window_of(sender).drops_;
    drops.insert(drops.end(), paths, paths + count);
  });
  return window;
}

Window& Window::window_of(GLFWwindow* handle) {
  return *static_cast<Window*>(glfwGetWindowUserPointer(handle));
}

Window::~Window() {
  glfwDestroyWindow(handle_);
  glfwTerminate();
}

std::unique_ptr<GraphicsContext> Window::context() const { return std::make_unique<WindowContext>(handle_); }

V2i Window::size() const {
  V2i size(0, 0);
  glfwGetFramebufferSize(handle_, &size.x, &size.y);
  return size;
}

float Window::scale() const {
  V2f content(1, 1);
  glfwGetWindowContentScale(handle_, &content.x, &content.y);
  V2i window(0, 0);
  glfwGetWindowSize(handle_, &window.x, &window.y);
  // Where the units are larger than pixels, they are scaled already.
  const int pixels = size().y;
  if (window.y <= 0 || pixels <= 0) return 1;
  return std::max(content.y * static_cast<float>(window.y) / static_cast<float>(pixels), 0.5F);
}

bool Window::wants_to_close() const { return glfwWindowShouldClose(handle_) != 0; }

bool Window::wait_for_events(double seconds) {
  if (seconds <= 0) {
    glfwPollEvents();
    return false;
  }
  const double start = glfwGetTime();
  glfwWaitEventsTimeout(seconds);
  return glfwGetTime() - start < seconds;
}

void Window::wake() { glfwPostEmptyEvent(); }

void Window::swap() { glfwSwapBuffers(handle_); }

}  // namespace selvedge
