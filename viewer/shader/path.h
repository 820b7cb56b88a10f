// A frame made wholly by OpenGL: triangle numbers, round by round from front to back, each round turned into
// light by a shader that evaluates the fabrics. The same numbers and the same formulas as the hybrid path's,
// on the graphics processor.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "format/scene/lights.h"
#include "viewer/gl/functions.h"
#include "viewer/hybrid/index_pass.h"
#include "viewer/light/pbr_inputs.h"
#include "viewer/light/shadow_pass.h"

namespace selvedge {

struct ShaderFrame {
  int width = 1;
  int height = 1;
  int layers = 8;  ///< surfaces behind each other that a pixel can show
  LevelOptions levels;
  float ambient = 0;                    ///< ShadingScene::ambient
  const ShadowPass* shadows = nullptr;  ///< with maps of the lights; null: none
};

/// Nanoseconds on the graphics processor, where it has a clock for them, else 0.
struct ShaderTimes {
  std::uint64_t geometry = 0;
  std::uint64_t shading = 0;
  int rounds = 0;
};

class ShaderPath {
 public:
  /// Loads mesh, pictures and fabrics. `materials` are those of the surfaces of `mesh`, and must outlive the
  /// object. The context of `gl` must be current whenever a function of this class is called, the destructor
  /// included. OPTION_OUT_OF_RANGE where
  /// the fabrics are larger than a shader's buffer may be; GRAPHICS_UNAVAILABLE.
  static Result<std::unique_ptr<ShaderPath>> create(const GlFunctions& gl, const MergedSurfaces& mesh,
                                                    const Materials& materials,
                                                    std::span<const Fabric> fabrics);
  ~ShaderPath();
  ShaderPath(const ShaderPath&) = delete;
  ShaderPath& operator=(const ShaderPath&) = delete;

  /// `origin` is that of the mesh's coordinates. What is drawn stays in a texture until the next frame.
  Result<void> draw(const Camera& camera, const V3d& origin, std::span<const Light> lights,
                    const ShaderFrame& frame, ShaderTimes* times = nullptr);

  /// Radiance times opacity, and opacity; bottom row first. Precondition: something was drawn.
  void read(std::vector<V4f>& pixels) const;

  /// Framebuffer of the last frame, for a window that shows it.
  GLuint framebuffer() const { return result_.framebuffer; }

 private:
  struct Round {
    GLuint framebuffer = 0;
    GLuint triangles = 0;
    GLuint colours = 0;
    GLuint pbr = 0;
    GLuint depth = 0;
  };
  struct Target {
    GLuint framebuffer = 0;
    GLuint colour = 0;
  };
  /// Triangles of a surface.
  struct Span {
    std::uint32_t surface = 0;
    std::size_t first = 0;
    std::size_t end = 0;
  };

  ShaderPath(const GlFunctions& gl, const MergedSurfaces& mesh, const Materials& materials)
      : gl_(gl), materials_(materials), core_(gl, mesh, materials) {}
  Result<void> load(const MergedSurfaces& mesh, std::span<const Fabric> fabrics);
  Result<GLuint> shading_program(bool shadows);
  Result<void> resize(int width, int height);
  void release_targets();
  void draw_triangles(const Round& to, const Round& before, int round, const std::array<GLfloat, 16>& clip);

  const GlFunctions& gl_;
  const Materials& materials_;
  PbrInputs core_;
  std::vector<Span> spans_;
  std::array<GLuint, 2> triangle_programs_{};  ///< of round 0, of the others
  std::array<GLuint, 2> shading_programs_{};   ///< without and with shadows, which is made when it is needed
  GLuint array_ = 0;
  GLuint empty_array_ = 0;
  GLuint indices_ = 0;
  GLuint fabrics_ = 0;
  GLuint vertices_ = 0;
  GLuint triangles_ = 0;
  GLuint surfaces_ = 0;
  GLuint lights_ = 0;
  std::size_t light_room_ = 0;
  GLuint any_ = 0;                  ///< query: did a round show anything
  std::array<GLuint, 2> clocks_{};  ///< queries
  int width_ = 0;
  int height_ = 0;
  std::array<Round, 2> rounds_{};
  Target result_;
};

}  // namespace selvedge
