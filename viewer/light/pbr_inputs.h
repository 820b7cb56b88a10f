// Inputs of OpenGL's geometry passes for materials without fabric: pictures, texture coordinates, vertex
// colours, and uniforms per surface.
#pragma once

#include "viewer/gl/objects.h"
#include "viewer/scene/materials.h"
#include "viewer/scene/mesh.h"

namespace selvedge {

/// Render targets of a geometry pass: triangle numbers and, if needed, PbrPixels.
struct TriangleTarget {
  GLuint framebuffer = 0;
  GLuint triangles = 0;
  GLuint colours = 0;
  GLuint pbr = 0;
  GLuint depth = 0;
};

class PbrInputs {
 public:
  /// Uploads what `materials` need but their textures: nothing if all surfaces have a fabric and no emission.
  /// The context of `gl` must be current whenever a function of this class is called, the destructor
  /// included. `materials` must outlive the object; MaterialPicture::texture may change meanwhile.
  PbrInputs(const GlFunctions& gl, const MergedSurfaces& mesh, const Materials& materials);
  ~PbrInputs() { gl_.DeleteSamplers(static_cast<GLsizei>(samplers), samplers_.data()); }
  PbrInputs& operator=(PbrInputs&&) = delete;

  /// Whether some surface needs a PbrPixel.
  bool needs_pbr() const { return needed_; }
  /// The program of triangle_vertex.glsl and triangle_fragment.glsl.
  GLuint triangle_program(GlObjects& objects, bool later) const;
  TriangleTarget make_target(GlObjects& objects, int width, int height) const;
  /// Adds the vertices' attributes to a vertex array, at the locations of pbr_vertex.glsl.
  void add_attributes(GLuint array) const;
  /// Sets uniforms and textures of the current program for a surface.
  void bind_surface(std::size_t surface) const;

 private:
  static constexpr std::size_t samplers = 18;  ///< three wrap modes along u, three along v, nearest or linear

  const GlFunctions& gl_;
  const Materials& materials_;
  bool needed_ = false;
  GlObjects objects_;
  std::size_t more_uvs_ = 0;   ///< mappings after the first
  GLuint uvs_ = 0;             ///< [vertex][more_uvs_]
  GLuint vertex_colours_ = 0;  ///< 0: no surface has vertex colours
  std::array<GLuint, samplers> samplers_{};
};

}  // namespace selvedge
