// The OpenGL functions that the viewer calls, loaded from the current context. Exported gl* symbols are never
// linked: with two OpenGL libraries in one process they may belong to the wrong one.
#pragma once

#define GL_GLEXT_PROTOTYPES  // for their types
#include <GL/glcorearb.h>

#include "viewer/gl/context.h"

namespace selvedge {

/// Members are named as in OpenGL without the prefix: gl.Clear is glClear.
struct GlFunctions {
// clang-format off
#define SELVEDGE_GL_FUNCTIONS(F) \
  F(AttachShader) F(BindFramebuffer) F(BindSampler) F(BindTextureUnit) F(BindVertexArray) \
  F(CheckNamedFramebufferStatus) F(ClearNamedFramebufferfi) F(ClearNamedFramebufferfv) F(CompileShader) \
  F(CreateBuffers) F(CreateFramebuffers) F(CreateProgram) F(CreateSamplers) F(CreateShader) \
  F(CreateTextures) F(CreateVertexArrays) F(DeleteBuffers) F(DeleteFramebuffers) F(DeleteProgram) \
  F(DeleteSamplers) F(DeleteShader) F(DeleteTextures) F(DeleteVertexArrays) F(DepthFunc) F(Disable) \
  F(DrawElements) F(Enable) F(EnableVertexArrayAttrib) F(Finish) F(GenerateTextureMipmap) F(GetError) \
  F(GetProgramInfoLog) F(GetProgramiv) F(GetShaderInfoLog) F(GetShaderiv) F(LinkProgram) \
  F(NamedBufferStorage) F(NamedBufferSubData) F(NamedFramebufferDrawBuffers) \
  F(NamedFramebufferReadBuffer) F(NamedFramebufferTexture) F(PixelStorei) F(ReadPixels) \
  F(SamplerParameteri) F(ShaderSource) F(StencilFunc) F(StencilOp) F(TextureParameteri) \
  F(TextureStorage2D) F(TextureSubImage2D) F(Uniform1f) F(Uniform1i) F(Uniform3f) F(Uniform4f) \
  F(UseProgram) F(VertexArrayAttribBinding) F(VertexArrayAttribFormat) F(VertexArrayElementBuffer) \
  F(VertexArrayVertexBuffer) F(Viewport)
// clang-format on
// NOLINTNEXTLINE(bugprone-macro-parentheses): the name of a member
#define SELVEDGE_GL_MEMBER(name) decltype(&gl##name) name = nullptr;
  SELVEDGE_GL_FUNCTIONS(SELVEDGE_GL_MEMBER)
#undef SELVEDGE_GL_MEMBER
};

/// Precondition: the context is current. GRAPHICS_UNAVAILABLE names the first function that is missing.
Result<GlFunctions> load_gl_functions(const GraphicsContext& context);

}  // namespace selvedge
