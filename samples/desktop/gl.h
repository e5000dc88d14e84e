// The OpenGL 3.3 functions that this client calls, from the driver that SDL has opened.
#pragma once

#include <SDL.h>
#include <SDL_opengl.h>

// The functions that libGL itself exports (OpenGL 1.1) are called directly; these are looked up.
#define DESKTOP_GL_FUNCTIONS(F)                                \
  F(PFNGLACTIVETEXTUREPROC, ActiveTexture)                     \
  F(PFNGLATTACHSHADERPROC, AttachShader)                       \
  F(PFNGLBINDBUFFERPROC, BindBuffer)                           \
  F(PFNGLBINDFRAMEBUFFERPROC, BindFramebuffer)                 \
  F(PFNGLBINDVERTEXARRAYPROC, BindVertexArray)                 \
  F(PFNGLBUFFERDATAPROC, BufferData)                           \
  F(PFNGLCOMPILESHADERPROC, CompileShader)                     \
  F(PFNGLCREATEPROGRAMPROC, CreateProgram)                     \
  F(PFNGLCREATESHADERPROC, CreateShader)                       \
  F(PFNGLDELETEBUFFERSPROC, DeleteBuffers)                     \
  F(PFNGLDELETESHADERPROC, DeleteShader)                       \
  F(PFNGLDELETEVERTEXARRAYSPROC, DeleteVertexArrays)           \
  F(PFNGLDRAWELEMENTSINSTANCEDPROC, DrawElementsInstanced)     \
  F(PFNGLENABLEVERTEXATTRIBARRAYPROC, EnableVertexAttribArray) \
  F(PFNGLFRAMEBUFFERTEXTURE2DPROC, FramebufferTexture2D)       \
  F(PFNGLGENBUFFERSPROC, GenBuffers)                           \
  F(PFNGLGENFRAMEBUFFERSPROC, GenFramebuffers)                 \
  F(PFNGLGENERATEMIPMAPPROC, GenerateMipmap)                   \
  F(PFNGLGENVERTEXARRAYSPROC, GenVertexArrays)                 \
  F(PFNGLGETPROGRAMINFOLOGPROC, GetProgramInfoLog)             \
  F(PFNGLGETPROGRAMIVPROC, GetProgramiv)                       \
  F(PFNGLGETUNIFORMLOCATIONPROC, GetUniformLocation)           \
  F(PFNGLLINKPROGRAMPROC, LinkProgram)                         \
  F(PFNGLSHADERSOURCEPROC, ShaderSource)                       \
  F(PFNGLUNIFORM1IPROC, Uniform1i)                             \
  F(PFNGLUNIFORM3FPROC, Uniform3f)                             \
  F(PFNGLUNIFORMMATRIX4FVPROC, UniformMatrix4fv)               \
  F(PFNGLUSEPROGRAMPROC, UseProgram)                           \
  F(PFNGLVERTEXATTRIBDIVISORPROC, VertexAttribDivisor)         \
  F(PFNGLVERTEXATTRIBPOINTERPROC, VertexAttribPointer)

namespace desktop {

struct Gl {
#define DESKTOP_GL_MEMBER(type, name) type name = nullptr;
  DESKTOP_GL_FUNCTIONS(DESKTOP_GL_MEMBER)
#undef DESKTOP_GL_MEMBER
  // The name of the first that the driver lacks; null: all are there.
  const char* Load() {
#define DESKTOP_GL_LOAD(type, name)                                 \
  name = reinterpret_cast<type>(SDL_GL_GetProcAddress("gl" #name)); \
  if ((name) == nullptr) return "gl" #name;
    DESKTOP_GL_FUNCTIONS(DESKTOP_GL_LOAD)
#undef DESKTOP_GL_LOAD
    return nullptr;
  }
};

}  // namespace desktop
