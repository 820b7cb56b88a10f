// OpenGL objects of the index pass: textures that name texels, and the program that writes them down.
#pragma once

#include "format/fabric.h"
#include "format/image.h"
#include "viewer/gl_functions.h"

namespace selvedge {

/// The program of shaders.h. GRAPHICS_UNAVAILABLE with the compiler's words where it is refused.
Result<GLuint> make_index_program(const GlFunctions& gl);

/// Index texture (paper section 6 and 6.1): level k has the resolution of the fabric's level k; texel (x, y)
/// of it holds (x, y, k). Repeats, nearest texel of the nearest level. Levels that the fabric does not have
/// are never chosen. Precondition: the fabric has at least one level and its sizes follow level_size.
GLuint make_index_texture(const GlFunctions& gl, const Fabric& fabric);

/// The same levels holding k alone, linear between levels: the paper's second pass. Gives the fractional
/// level that OpenGL chose.
GLuint make_level_texture(const GlFunctions& gl, const Fabric& fabric);

/// A linear RGBA picture with all its mip levels, repeating, trilinear. Precondition: four channels.
GLuint make_colour_texture(const GlFunctions& gl, const Image& image);

/// A texture to draw into or to fetch from: one level, no filter.
GLuint make_plain_texture(const GlFunctions& gl, GLenum format, int width, int height);

}  // namespace selvedge
