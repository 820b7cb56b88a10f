// What OpenGL's geometry passes need beside triangles when a scene has materials without fabric: their
// pictures, coordinates and colours, and the values that change from surface to surface. The same for both
// paths.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "viewer/gl_functions.h"
#include "viewer/materials.h"
#include "viewer/merged_surfaces.h"

namespace selvedge {

class CoreInputs {
 public:
  /// Loads what `looks` need, which is nothing where all surfaces have a fabric that does not shine by
  /// itself. The context of `gl` must be current whenever a function of this class is called, the destructor
  /// included. `looks` must outlive the object.
  CoreInputs(const GlFunctions& gl, const MergedSurfaces& mesh, const Looks& looks);
  ~CoreInputs();
  CoreInputs(const CoreInputs&) = delete;
  CoreInputs& operator=(const CoreInputs&) = delete;

  /// Whether some surface needs a CorePixel.
  bool needed() const { return needed_; }
  /// For shader texts: CORE where needed, MAPPINGS and VERTEX_COLOURS (core_glsl.h).
  std::string definitions() const;
  /// Adds the vertices' attributes to a vertex array, at the locations of core_vertex_glsl.
  void attach(GLuint array) const;
  /// Sets uniforms and textures of the program in use for a surface.
  void use(std::size_t surface) const;

 private:
  static constexpr std::size_t samplers = 18;  ///< three ways along u, three along v, nearest or not
  void bind(GLuint unit, const TextureLook& texture) const;

  const GlFunctions& gl_;
  const Looks& looks_;
  bool needed_ = false;
  std::size_t more_uvs_ = 0;  ///< mappings beside the first
  bool colours_ = false;
  GLuint uvs_ = 0;  ///< [vertex][more_uvs_]
  GLuint vertex_colours_ = 0;
  std::vector<GLuint> images_;
  std::array<GLuint, samplers> samplers_{};
};

}  // namespace selvedge
