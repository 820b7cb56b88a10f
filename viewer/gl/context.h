// OpenGL contexts without a window: one interface, and a factory function for each kind.
#pragma once

#include <memory>

#include "format/base/error.h"

namespace selvedge {

/// An OpenGL 4.5 core context. It belongs to the thread on which it was made current last.
class GraphicsContext {
 public:
  using Function = void (*)();

  virtual ~GraphicsContext() = default;
  virtual Result<void> make_current() = 0;
  /// Address of an OpenGL function in this context; null if absent. The context must be current.
  virtual Function function(const char* name) const = 0;
};

/// The OpenGL implementation.
enum class ContextKind { automatic, osmesa, egl };

/// A context of Mesa's software rasteriser: no display, no GPU. GRAPHICS_UNAVAILABLE where that fails.
Result<std::unique_ptr<GraphicsContext>> make_osmesa_context();

/// A surfaceless EGL context: of a GPU if there is one, else of Mesa's software rasteriser.
/// GRAPHICS_UNAVAILABLE where that fails.
Result<std::unique_ptr<GraphicsContext>> make_egl_context();

}  // namespace selvedge
