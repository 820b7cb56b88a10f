#include "viewer/gl_objects.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "viewer/shaders.h"

namespace selvedge {
namespace {

Result<GLuint> compile(const GlFunctions& gl, GLenum stage, const char* text) {
  const GLuint shader = gl.CreateShader(stage);
  gl.ShaderSource(shader, 1, &text, nullptr);
  gl.CompileShader(shader);
  GLint good = 0;
  gl.GetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (good != 0) return shader;
  std::array<char, 1024> log{};
  gl.GetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
  gl.DeleteShader(shader);
  return fail(Code::graphics_unavailable, "", "shader", log.data());
}

GLuint make_mipmapped(const GlFunctions& gl, GLenum format, const Fabric& fabric) {
  const FabricLevel& finest = fabric.levels.front();
  const auto levels = static_cast<GLsizei>(std::min<std::size_t>(
      fabric.levels.size(), static_cast<std::size_t>(level_count(finest.width, finest.height))));
  GLuint texture = 0;
  gl.CreateTextures(GL_TEXTURE_2D, 1, &texture);
  gl.TextureStorage2D(texture, levels, format, finest.width, finest.height);
  gl.TextureParameteri(texture, GL_TEXTURE_MAX_LEVEL, levels - 1);
  gl.TextureParameteri(texture, GL_TEXTURE_WRAP_S, GL_REPEAT);
  gl.TextureParameteri(texture, GL_TEXTURE_WRAP_T, GL_REPEAT);
  gl.TextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  return texture;
}

}  // namespace

Result<GLuint> make_index_program(const GlFunctions& gl) {
  Result<GLuint> vertex = compile(gl, GL_VERTEX_SHADER, index_vertex_shader);
  if (!vertex) return vertex;
  Result<GLuint> fragment = compile(gl, GL_FRAGMENT_SHADER, index_fragment_shader);
  if (!fragment) {
    gl.DeleteShader(*vertex);
    return fragment;
  }
  const GLuint program = gl.CreateProgram();
  gl.AttachShader(program, *vertex);
  gl.AttachShader(program, *fragment);
  gl.LinkProgram(program);
  gl.DeleteShader(*vertex);
  gl.DeleteShader(*fragment);
  GLint good = 0;
  gl.GetProgramiv(program, GL_LINK_STATUS, &good);
  if (good != 0) return program;
  std::array<char, 1024> log{};
  gl.GetProgramInfoLog(program, static_cast<GLsizei>(log.size()), nullptr, log.data());
  gl.DeleteProgram(program);
  return fail(Code::graphics_unavailable, "", "program", log.data());
}

GLuint make_index_texture(const GlFunctions& gl, const Fabric& fabric) {
  const GLuint texture = make_mipmapped(gl, GL_RGBA16UI, fabric);
  gl.TextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST_MIPMAP_NEAREST);
  for (std::size_t k = 0; k < fabric.levels.size(); ++k) {
    const FabricLevel& level = fabric.levels[k];
    std::vector<std::uint16_t> texels;
    texels.reserve(static_cast<std::size_t>(level.texels()) * 4);
    for (int y = 0; y < level.height; ++y) {
      for (int x = 0; x < level.width; ++x) {
        for (const std::size_t value :
             {static_cast<std::size_t>(x), static_cast<std::size_t>(y), k, std::size_t{0}})
          texels.push_back(static_cast<std::uint16_t>(value));
      }
    }
    gl.TextureSubImage2D(texture, static_cast<GLint>(k), 0, 0, level.width, level.height, GL_RGBA_INTEGER,
                         GL_UNSIGNED_SHORT, texels.data());
  }
  return texture;
}

GLuint make_level_texture(const GlFunctions& gl, const Fabric& fabric) {
  // Half floats hold every level number exactly; the filter works in float.
  const GLuint texture = make_mipmapped(gl, GL_R16F, fabric);
  gl.TextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST_MIPMAP_LINEAR);
  for (std::size_t k = 0; k < fabric.levels.size(); ++k) {
    const FabricLevel& level = fabric.levels[k];
    const std::vector<float> texels(static_cast<std::size_t>(level.texels()), static_cast<float>(k));
    gl.TextureSubImage2D(texture, static_cast<GLint>(k), 0, 0, level.width, level.height, GL_RED, GL_FLOAT,
                         texels.data());
  }
  return texture;
}

GLuint make_colour_texture(const GlFunctions& gl, const Image& image) {
  GLuint texture = 0;
  gl.CreateTextures(GL_TEXTURE_2D, 1, &texture);
  gl.TextureStorage2D(texture, level_count(image.width, image.height), GL_RGBA16F, image.width, image.height);
  gl.TextureParameteri(texture, GL_TEXTURE_WRAP_S, GL_REPEAT);
  gl.TextureParameteri(texture, GL_TEXTURE_WRAP_T, GL_REPEAT);
  gl.TextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  gl.TextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  gl.TextureSubImage2D(texture, 0, 0, 0, image.width, image.height, GL_RGBA, GL_FLOAT, image.pixels.data());
  gl.GenerateTextureMipmap(texture);
  return texture;
}

GLuint make_plain_texture(const GlFunctions& gl, GLenum format, int width, int height) {
  GLuint texture = 0;
  gl.CreateTextures(GL_TEXTURE_2D, 1, &texture);
  gl.TextureStorage2D(texture, 1, format, width, height);
  gl.TextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl.TextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  return texture;
}

}  // namespace selvedge
