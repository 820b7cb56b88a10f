// OpenGL objects of the geometry passes.
#pragma once

#include <string>

#include "format/picture/image.h"
#include "viewer/gl/functions.h"

namespace selvedge {

/// GRAPHICS_UNAVAILABLE with the compiler's words where it is refused.
Result<GLuint> make_program(const GlFunctions& gl, const std::string& vertex, const std::string& fragment);

/// GRAPHICS_UNAVAILABLE if OpenGL has reported errors since the last call.
Result<void> check_errors(const GlFunctions& gl, const char* place);

/// A linear RGBA picture with all its mip levels, repeating, trilinear. Precondition: four channels.
GLuint make_colour_texture(const GlFunctions& gl, const Image& image);

/// A texture to draw into or to fetch from: one level, no filter.
GLuint make_plain_texture(const GlFunctions& gl, GLenum format, int width, int height);

}  // namespace selvedge
