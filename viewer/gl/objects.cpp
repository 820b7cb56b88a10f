#include "viewer/gl/objects.h"

#include <fmt/format.h>

#include <algorithm>

#include "format/base/guard.h"
#include "format/base/mip.h"

namespace selvedge {
namespace {

[[noreturn]] void fail_graphics(const char* place, std::string why) {
  throw Failure{{Code::graphics_unavailable, "", place, std::move(why)}};
}

/// Adds a shader to a program, which deletes it.
void attach_shader(const GlFunctions& gl, GLuint program, GLenum stage, const char* text) {
  const GLuint shader = gl.CreateShader(stage);
  gl.AttachShader(program, shader);
  gl.DeleteShader(shader);
  gl.ShaderSource(shader, 1, &text, nullptr);
  gl.CompileShader(shader);
  GLint good = 0;
  gl.GetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (good != 0) return;
  std::array<char, 1024> log{};
  gl.GetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
  fail_graphics("shader", log.data());
}

GLint gl_wrap(Wrap wrap) {
  return wrap == Wrap::repeat ? GL_REPEAT : wrap == Wrap::mirror ? GL_MIRRORED_REPEAT : GL_CLAMP_TO_EDGE;
}

}  // namespace

std::string shader_text(const std::string& definitions, std::initializer_list<const char*> parts) {
  std::string text = "#version 450 core\n" + definitions;
  for (const char* part : parts) text += part;
  return text;
}

void check_errors(const GlFunctions& gl, const char* place) {
  const GLenum error = gl.GetError();
  if (error == GL_NO_ERROR) return;
  while (gl.GetError() != GL_NO_ERROR) {
  }
  fail_graphics(place, fmt::format("OpenGL reports error {:#06x}", error));
}

GLuint make_plain_texture(const GlFunctions& gl, GLenum format, int width, int height) {
  GLuint texture = 0;
  gl.CreateTextures(GL_TEXTURE_2D, 1, &texture);
  gl.TextureStorage2D(texture, 1, format, width, height);
  gl.TextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl.TextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
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

void add_attribute(const GlFunctions& gl, GLuint array, GLuint location, GLuint buffer, GLint components,
                   std::size_t offset, std::size_t stride) {
  gl.VertexArrayVertexBuffer(array, location, buffer, static_cast<GLintptr>(offset),
                             static_cast<GLsizei>(stride));
  gl.EnableVertexArrayAttrib(array, location);
  gl.VertexArrayAttribFormat(array, location, components, GL_FLOAT, GL_FALSE, 0);
  gl.VertexArrayAttribBinding(array, location, location);
}

void GlObjects::clear() {
  const auto remove = [](const auto& function, std::vector<GLuint>& objects) {
    function(static_cast<GLsizei>(objects.size()), objects.data());
    objects.clear();
  };
  remove(gl_.DeleteFramebuffers, framebuffers_);
  remove(gl_.DeleteTextures, textures_);
  remove(gl_.DeleteSamplers, samplers_);
  remove(gl_.DeleteVertexArrays, arrays_);
  remove(gl_.DeleteBuffers, buffers_);
  for (const GLuint program : programs_) gl_.DeleteProgram(program);
  programs_.clear();
}

GLuint GlObjects::program(const std::string& vertex, const std::string& fragment) {
  const GLuint program = programs_.emplace_back(gl_.CreateProgram());
  attach_shader(gl_, program, GL_VERTEX_SHADER, vertex.c_str());
  attach_shader(gl_, program, GL_FRAGMENT_SHADER, fragment.c_str());
  gl_.LinkProgram(program);
  GLint good = 0;
  gl_.GetProgramiv(program, GL_LINK_STATUS, &good);
  if (good != 0) return program;
  std::array<char, 1024> log{};
  gl_.GetProgramInfoLog(program, static_cast<GLsizei>(log.size()), nullptr, log.data());
  fail_graphics("program", log.data());
}

GLuint GlObjects::buffer(std::size_t bytes, const void* data, GLbitfield flags) {
  constexpr std::size_t min_bytes = 16;
  GLuint& buffer = buffers_.emplace_back();
  gl_.CreateBuffers(1, &buffer);
  const bool small = bytes < min_bytes;
  gl_.NamedBufferStorage(buffer, static_cast<GLsizeiptr>(std::max(bytes, min_bytes)), small ? nullptr : data,
                         flags | (small ? GL_DYNAMIC_STORAGE_BIT : 0U));
  if (small && bytes > 0 && data != nullptr)
    gl_.NamedBufferSubData(buffer, 0, static_cast<GLsizeiptr>(bytes), data);
  return buffer;
}

GLuint GlObjects::plain_texture(GLenum format, int width, int height) {
  return textures_.emplace_back(make_plain_texture(gl_, format, width, height));
}

GLuint GlObjects::sampler(Wrap u, Wrap v, bool nearest) {
  GLuint& sampler = samplers_.emplace_back();
  gl_.CreateSamplers(1, &sampler);
  gl_.SamplerParameteri(sampler, GL_TEXTURE_WRAP_S, gl_wrap(u));
  gl_.SamplerParameteri(sampler, GL_TEXTURE_WRAP_T, gl_wrap(v));
  gl_.SamplerParameteri(sampler, GL_TEXTURE_MAG_FILTER, nearest ? GL_NEAREST : GL_LINEAR);
  gl_.SamplerParameteri(sampler, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  return sampler;
}

GLuint GlObjects::framebuffer(std::span<const GLuint> colours, GLenum depth_attachment, GLuint depth) {
  GLuint& made = framebuffers_.emplace_back();
  gl_.CreateFramebuffers(1, &made);
  std::vector<GLenum> attachments;
  for (const GLuint colour : colours) {
    attachments.push_back(GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(attachments.size()));
    gl_.NamedFramebufferTexture(made, attachments.back(), colour, 0);
  }
  gl_.NamedFramebufferDrawBuffers(made, static_cast<GLsizei>(attachments.size()), attachments.data());
  gl_.NamedFramebufferTexture(made, depth_attachment, depth, 0);
  if (gl_.CheckNamedFramebufferStatus(made, GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    fail_graphics("frame buffer", "OpenGL refuses it");
  return made;
}

}  // namespace selvedge
