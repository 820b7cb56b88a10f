#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <array>
#include <vector>

#include "viewer/gl/context.h"

namespace selvedge {
namespace {

Error unavailable(const char* reason) { return {Code::graphics_unavailable, "", "EGL", reason}; }

template <class F>
F extension(const char* name) {
  return reinterpret_cast<F>(eglGetProcAddress(name));
}

class EglContext final : public GraphicsContext {
 public:
  EglContext(EGLDisplay display, EGLContext context) : display_(display), context_(context) {}
  EglContext& operator=(EglContext&&) = delete;
  ~EglContext() override {
    if (eglGetCurrentContext() == context_)
      eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    // The display is not terminated: it is shared by the whole process.
    eglDestroyContext(display_, context_);
  }

  Result<void> make_current() override {
    // The current API is per thread, initially OpenGL ES.
    if (eglBindAPI(EGL_OPENGL_API) == EGL_TRUE &&
        eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_TRUE)
      return {};
    return tl::unexpected(unavailable("the context cannot be made current"));
  }

  Function function(const char* name) const override { return eglGetProcAddress(name); }

 private:
  EGLDisplay display_;
  EGLContext context_;
};

std::unique_ptr<GraphicsContext> context_of(EGLDisplay display) {
  if (display == EGL_NO_DISPLAY || eglInitialize(display, nullptr, nullptr) != EGL_TRUE) return nullptr;
  constexpr std::array wanted{EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                              EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  // All drawing goes to framebuffer objects, so any configuration will do, or none if EGL allows it.
  if (eglChooseConfig(display, wanted.data(), &config, 1, &count) != EGL_TRUE || count == 0) config = nullptr;
  constexpr std::array attributes{EGL_CONTEXT_MAJOR_VERSION,
                                  4,
                                  EGL_CONTEXT_MINOR_VERSION,
                                  5,
                                  EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                  EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                  EGL_NONE};
  EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, attributes.data());
  if (context == EGL_NO_CONTEXT) return nullptr;
  auto result = std::make_unique<EglContext>(display, context);
  if (!result->make_current()) return nullptr;
  return result;
}

}  // namespace

Result<std::unique_ptr<GraphicsContext>> make_egl_context() {
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE)
    return tl::unexpected(unavailable("there is no OpenGL behind it"));
  // Displays without a window system: every device, then Mesa's surfaceless platform. EGL lists GPUs before
  // software devices.
  std::vector<EGLDisplay> displays;
  if (const auto get = extension<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT")) {
    const auto query = extension<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
    std::array<EGLDeviceEXT, 32> devices{};
    EGLint count = 0;
    if (query != nullptr && query(static_cast<EGLint>(devices.size()), devices.data(), &count) == EGL_TRUE)
      for (EGLint i = 0; i < count; ++i)
        displays.push_back(get(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr));
    displays.push_back(get(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
  }
  for (EGLDisplay display : displays)
    if (auto context = context_of(display)) return context;
  return tl::unexpected(unavailable("no device gives an OpenGL 4.5 core context without a window"));
}

}  // namespace selvedge
