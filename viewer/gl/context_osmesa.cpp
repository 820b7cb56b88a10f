#include <GL/osmesa.h>

#include <array>

#include "viewer/gl/context.h"

namespace selvedge {
namespace {

class OsmesaContext final : public GraphicsContext {
 public:
  explicit OsmesaContext(OSMesaContext context) : context_(context) {}
  OsmesaContext& operator=(OsmesaContext&&) = delete;
  ~OsmesaContext() override { OSMesaDestroyContext(context_); }

  Result<void> make_current() override {
    // All drawing goes to framebuffer objects; OSMesa's own buffer is a dummy.
    if (OSMesaMakeCurrent(context_, pixel_.data(), GL_UNSIGNED_BYTE, 1, 1) != GL_TRUE)
      return fail(Code::graphics_unavailable, "", "OSMesa", "the context cannot be made current");
    return {};
  }

  Function function(const char* name) const override { return OSMesaGetProcAddress(name); }

 private:
  OSMesaContext context_;
  std::array<unsigned char, 4> pixel_{};
};

}  // namespace

Result<std::unique_ptr<GraphicsContext>> make_osmesa_context() {
  // Mesa's software rasteriser has at most 4.5; asking for more fails.
  constexpr std::array attributes{OSMESA_FORMAT,
                                  OSMESA_RGBA,
                                  OSMESA_PROFILE,
                                  OSMESA_CORE_PROFILE,
                                  OSMESA_CONTEXT_MAJOR_VERSION,
                                  4,
                                  OSMESA_CONTEXT_MINOR_VERSION,
                                  5,
                                  0};
  OSMesaContext context = OSMesaCreateContextAttribs(attributes.data(), nullptr);
  if (context == nullptr)
    return fail(Code::graphics_unavailable, "", "OSMesa", "no OpenGL 4.5 core context can be created");
  return std::make_unique<OsmesaContext>(context);
}

}  // namespace selvedge
