// An OpenGL context without a window, behind the one interface that the rest of the viewer sees; each kind is
// a file and a factory function.
#pragma once

#include <memory>
#include <string>

#include "format/base/error.h"

namespace selvedge {

/// An OpenGL 4.5 core context. It belongs to the thread on which it was made current last.
class GraphicsContext {
 public:
  using Function = void (*)();

  virtual ~GraphicsContext() = default;
  virtual Result<void> make_current() = 0;
  /// Address of an OpenGL function in this context; null if there is none. The context must be current.
  virtual Function function(const char* name) const = 0;
};

/// Whose OpenGL draws.
enum class ContextKind { automatic, osmesa, egl };

/// A context of Mesa's software rasteriser: no display, no GPU. GRAPHICS_UNAVAILABLE where that fails.
Result<std::unique_ptr<GraphicsContext>> make_osmesa_context();

/// A context of EGL without a surface: a graphics processor's where there is one, else Mesa's software
/// rasteriser. GRAPHICS_UNAVAILABLE where that fails.
Result<std::unique_ptr<GraphicsContext>> make_egl_context();

}  // namespace selvedge
