// The paper's geometry passes (Daubert et al. 2001, section 6): the cloth is drawn with normals as colours,
// then with index textures whose mip levels OpenGL selects. To blend levels, a second pass writes blue alone.
// Further rounds peel the layers behind.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "format/scene/camera.h"
#include "viewer/frame/bands.h"
#include "viewer/gl/objects.h"
#include "viewer/paper/coding.h"
#include "viewer/paper/limits.h"
#include "viewer/scene/mesh.h"

namespace selvedge {

/// A band of rows, bottom row first; pixel (x, y) at y * width + x. Empty pixels have a normal with alpha 0,
/// and all else is undefined.
struct PaperFrames {
  std::vector<Coded> normals;   ///< alpha: code_kind()
  std::vector<Coded> tangents;  ///< alpha: 255 where the texture is upright, 0 where it is mirrored
  /// Red and green: the texel in the level given by alpha. Blue: the level (decode_level()); with `blend` a
  /// fraction between that of alpha and the next.
  std::vector<Coded> texels;
};

class PaperPass {
 public:
  /// Uploads everything but `mesh` and `materials`, which must outlive the object. The context of `gl` must
  /// be current whenever a function of this class is called, the destructor included. `materials` are those
  /// of the surfaces. Precondition: the fabrics of `kinds` are within the paper's limits.
  static Result<std::unique_ptr<PaperPass>> create(const GlFunctions& gl, const MergedSurfaces& mesh,
                                                   std::span<const SurfaceMaterial> materials,
                                                   const PaperKinds& kinds, std::span<const Fabric> fabrics,
                                                   const FrameBands& bands);
  /// Changes the size of frames; discards their contents.
  Result<void> resize(const FrameBands& bands);

  /// Draws the band that begins at `first_row` of the frame, counted from its bottom. Round 0 shows the
  /// nearest surface, round n the one behind that of round n - 1, which must have been drawn just before.
  /// `clip`: world -> clip (camera.h). Only blend and forced of `levels` are used. Waits until everything is
  /// drawn; returns whether any pixel was.
  Result<bool> draw(const M44d& clip, int first_row, int round, const LevelOptions& levels);

  /// Reads the frames of the last draw().
  void read(PaperFrames& frames) const;

 private:
  enum Target : std::size_t { normals, tangents, texels };

  PaperPass(const GlFunctions& gl, const MergedSurfaces& mesh, std::span<const SurfaceMaterial> materials)
      : gl_(gl), mesh_(mesh), materials_(materials), objects_(gl), targets_(gl) {}
  Result<void> make_programs();
  GLuint make_index_texture(const Fabric& fabric);
  void upload();
  void draw_cloth(Target target, int round, float level_bias);

  const GlFunctions& gl_;
  const MergedSurfaces& mesh_;
  std::span<const SurfaceMaterial> materials_;
  GlObjects objects_;
  GlObjects targets_;
  FrameBands bands_{0, 0, 0};
  PaperKinds kinds_;
  std::vector<TriangleSpan> spans_;
  std::array<std::array<GLuint, 2>, 3> programs_{};  ///< [target][of round 0, of the others]
  std::vector<GLuint> index_textures_;               ///< of the fabrics; 0 if no surface has the fabric
  std::vector<int> level_counts_;
  std::vector<int> first_levels_;  ///< of the whole fabric
  GLuint array_ = 0;
  GLuint any_ = 0;
  std::array<GLuint, 3> colours_{};
  std::array<GLuint, 2> depths_{};        ///< of even and odd rounds
  std::array<GLuint, 2> framebuffers_{};  ///< of even and odd rounds
  std::size_t drawn_into_ = 0;
  std::array<GLfloat, 16> clip_{};
};

}  // namespace selvedge
