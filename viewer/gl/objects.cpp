#include "viewer/gl/objects.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "format/fabric/fabric.h"

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

}  // namespace

std::string shader_text(const std::string& definitions, std::initializer_list<const char*> parts) {
  std::string text = "#version 450 core\n" + definitions;
  for (const char* part : parts) text += part;
  return text;
}

Result<GLuint> make_program(const GlFunctions& gl, const std::string& vertex_text,
                            const std::string& fragment_text) {
  Result<GLuint> vertex = compile(gl, GL_VERTEX_SHADER, vertex_text.c_str());
  if (!vertex) return vertex;
  Result<GLuint> fragment = compile(gl, GL_FRAGMENT_SHADER, fragment_text.c_str());
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

Result<void> check_errors(const GlFunctions& gl, const char* place) {
  const GLenum error = gl.GetError();
  if (error == GL_NO_ERROR) return {};
  while (gl.GetError() != GL_NO_ERROR) {
  }
  return fail(Code::graphics_unavailable, "", place, fmt::format("OpenGL reports error {:#06x}", error));
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
