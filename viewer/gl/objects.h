// OpenGL objects of the geometry passes.
#pragma once

#include <initializer_list>
#include <string>

#include "format/picture/image.h"
#include "viewer/gl/functions.h"

namespace selvedge {

/// A shader of GLSL 4.50: `definitions` (lines that begin with #define), then the parts in their order
/// (glsl.h).
std::string shader_text(const std::string& definitions, std::initializer_list<const char*> parts);

/// GRAPHICS_UNAVAILABLE with the compiler's words where it is refused.
Result<GLuint> make_program(const GlFunctions& gl, const std::string& vertex, const std::string& fragment);

/// GRAPHICS_UNAVAILABLE if OpenGL has reported errors since the last call.
Result<void> check_errors(const GlFunctions& gl, const char* place);

/// A linear RGBA picture with all its mip levels, repeating, trilinear. Precondition: four channels.
GLuint make_colour_texture(const GlFunctions& gl, const Image& image);

/// A texture to draw into or to fetch from: one level, no filter.
GLuint make_plain_texture(const GlFunctions& gl, GLenum format, int width, int height);

}  // namespace selvedge
