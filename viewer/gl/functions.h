// The OpenGL functions that the viewer calls, loaded from the current context. The exported gl* symbols of a
// library are never linked: with two OpenGL libraries in one process they may belong to the other one.
#pragma once

#include <GL/glcorearb.h>

#include "viewer/gl/context.h"

namespace selvedge {

/// Members are named as in OpenGL without the prefix: gl.Clear is glClear.
struct GlFunctions {
#define SELVEDGE_GL_FUNCTIONS(F)                                         \
  F(PFNGLATTACHSHADERPROC, AttachShader)                                 \
  F(PFNGLBEGINQUERYPROC, BeginQuery)                                     \
  F(PFNGLBINDBUFFERBASEPROC, BindBufferBase)                             \
  F(PFNGLBINDFRAMEBUFFERPROC, BindFramebuffer)                           \
  F(PFNGLBINDSAMPLERPROC, BindSampler)                                   \
  F(PFNGLBINDTEXTUREUNITPROC, BindTextureUnit)                           \
  F(PFNGLBINDVERTEXARRAYPROC, BindVertexArray)                           \
  F(PFNGLBLENDFUNCPROC, BlendFunc)                                       \
  F(PFNGLCHECKNAMEDFRAMEBUFFERSTATUSPROC, CheckNamedFramebufferStatus)   \
  F(PFNGLCLEARNAMEDFRAMEBUFFERFIPROC, ClearNamedFramebufferfi)           \
  F(PFNGLCLEARNAMEDFRAMEBUFFERFVPROC, ClearNamedFramebufferfv)           \
  F(PFNGLCLEARNAMEDFRAMEBUFFERUIVPROC, ClearNamedFramebufferuiv)         \
  F(PFNGLCOLORMASKPROC, ColorMask)                                       \
  F(PFNGLCOMPILESHADERPROC, CompileShader)                               \
  F(PFNGLCREATEBUFFERSPROC, CreateBuffers)                               \
  F(PFNGLCREATEFRAMEBUFFERSPROC, CreateFramebuffers)                     \
  F(PFNGLCREATEPROGRAMPROC, CreateProgram)                               \
  F(PFNGLCREATEQUERIESPROC, CreateQueries)                               \
  F(PFNGLCREATESAMPLERSPROC, CreateSamplers)                             \
  F(PFNGLCREATESHADERPROC, CreateShader)                                 \
  F(PFNGLCREATETEXTURESPROC, CreateTextures)                             \
  F(PFNGLCREATEVERTEXARRAYSPROC, CreateVertexArrays)                     \
  F(PFNGLDELETEBUFFERSPROC, DeleteBuffers)                               \
  F(PFNGLDELETEFRAMEBUFFERSPROC, DeleteFramebuffers)                     \
  F(PFNGLDELETEPROGRAMPROC, DeleteProgram)                               \
  F(PFNGLDELETEQUERIESPROC, DeleteQueries)                               \
  F(PFNGLDELETESAMPLERSPROC, DeleteSamplers)                             \
  F(PFNGLDELETESHADERPROC, DeleteShader)                                 \
  F(PFNGLDELETETEXTURESPROC, DeleteTextures)                             \
  F(PFNGLDELETEVERTEXARRAYSPROC, DeleteVertexArrays)                     \
  F(PFNGLDEPTHFUNCPROC, DepthFunc)                                       \
  F(PFNGLDISABLEPROC, Disable)                                           \
  F(PFNGLDRAWARRAYSPROC, DrawArrays)                                     \
  F(PFNGLDRAWELEMENTSPROC, DrawElements)                                 \
  F(PFNGLENABLEPROC, Enable)                                             \
  F(PFNGLENABLEVERTEXARRAYATTRIBPROC, EnableVertexArrayAttrib)           \
  F(PFNGLENDQUERYPROC, EndQuery)                                         \
  F(PFNGLFINISHPROC, Finish)                                             \
  F(PFNGLGENERATETEXTUREMIPMAPPROC, GenerateTextureMipmap)               \
  F(PFNGLGETERRORPROC, GetError)                                         \
  F(PFNGLGETINTEGER64VPROC, GetInteger64v)                               \
  F(PFNGLGETPROGRAMINFOLOGPROC, GetProgramInfoLog)                       \
  F(PFNGLGETPROGRAMIVPROC, GetProgramiv)                                 \
  F(PFNGLGETQUERYOBJECTUI64VPROC, GetQueryObjectui64v)                   \
  F(PFNGLGETQUERYOBJECTUIVPROC, GetQueryObjectuiv)                       \
  F(PFNGLGETSHADERINFOLOGPROC, GetShaderInfoLog)                         \
  F(PFNGLGETSHADERIVPROC, GetShaderiv)                                   \
  F(PFNGLLINKPROGRAMPROC, LinkProgram)                                   \
  F(PFNGLNAMEDBUFFERSTORAGEPROC, NamedBufferStorage)                     \
  F(PFNGLNAMEDBUFFERSUBDATAPROC, NamedBufferSubData)                     \
  F(PFNGLNAMEDFRAMEBUFFERDRAWBUFFERSPROC, NamedFramebufferDrawBuffers)   \
  F(PFNGLNAMEDFRAMEBUFFERREADBUFFERPROC, NamedFramebufferReadBuffer)     \
  F(PFNGLNAMEDFRAMEBUFFERTEXTUREPROC, NamedFramebufferTexture)           \
  F(PFNGLNAMEDFRAMEBUFFERTEXTURELAYERPROC, NamedFramebufferTextureLayer) \
  F(PFNGLPIXELSTOREIPROC, PixelStorei)                                   \
  F(PFNGLQUERYCOUNTERPROC, QueryCounter)                                 \
  F(PFNGLREADPIXELSPROC, ReadPixels)                                     \
  F(PFNGLSAMPLERPARAMETERIPROC, SamplerParameteri)                       \
  F(PFNGLSHADERSOURCEPROC, ShaderSource)                                 \
  F(PFNGLSTENCILFUNCPROC, StencilFunc)                                   \
  F(PFNGLSTENCILOPPROC, StencilOp)                                       \
  F(PFNGLTEXTUREPARAMETERIPROC, TextureParameteri)                       \
  F(PFNGLTEXTURESTORAGE2DPROC, TextureStorage2D)                         \
  F(PFNGLTEXTURESTORAGE3DPROC, TextureStorage3D)                         \
  F(PFNGLTEXTURESUBIMAGE2DPROC, TextureSubImage2D)                       \
  F(PFNGLUNIFORM1FPROC, Uniform1f)                                       \
  F(PFNGLUNIFORM1IPROC, Uniform1i)                                       \
  F(PFNGLUNIFORM2FPROC, Uniform2f)                                       \
  F(PFNGLUNIFORM3FPROC, Uniform3f)                                       \
  F(PFNGLUNIFORM4FPROC, Uniform4f)                                       \
  F(PFNGLUNIFORMMATRIX4FVPROC, UniformMatrix4fv)                         \
  F(PFNGLUSEPROGRAMPROC, UseProgram)                                     \
  F(PFNGLVERTEXARRAYATTRIBBINDINGPROC, VertexArrayAttribBinding)         \
  F(PFNGLVERTEXARRAYATTRIBFORMATPROC, VertexArrayAttribFormat)           \
  F(PFNGLVERTEXARRAYELEMENTBUFFERPROC, VertexArrayElementBuffer)         \
  F(PFNGLVERTEXARRAYVERTEXBUFFERPROC, VertexArrayVertexBuffer)           \
  F(PFNGLVIEWPORTPROC, Viewport)

#define SELVEDGE_GL_MEMBER(type, name) type name = nullptr;
  SELVEDGE_GL_FUNCTIONS(SELVEDGE_GL_MEMBER)
#undef SELVEDGE_GL_MEMBER
};

/// Precondition: the context is current. GRAPHICS_UNAVAILABLE names the first function that is missing.
Result<GlFunctions> load_gl_functions(const GraphicsContext& context);

}  // namespace selvedge
