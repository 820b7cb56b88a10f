#include "viewer/gl/functions.h"

namespace selvedge {

Result<GlFunctions> load_gl_functions(const GraphicsContext& context) {
  GlFunctions gl;
  const char* missing = nullptr;
  const auto load = [&]<class F>(F& function, const char* name) {
    function = reinterpret_cast<F>(context.function(name));
    if (function == nullptr && missing == nullptr) missing = name;
  };
#define SELVEDGE_GL_LOAD(name) load(gl.name, "gl" #name);
  SELVEDGE_GL_FUNCTIONS(SELVEDGE_GL_LOAD)
#undef SELVEDGE_GL_LOAD
  if (missing != nullptr)
    return fail(Code::graphics_unavailable, "", missing, "the OpenGL context lacks this function");
  return gl;
}

}  // namespace selvedge
