// The shader path, wholly in OpenGL: triangle numbers, round by round from front to back, each round shaded
// by a shader that evaluates the fabrics. Inputs and formulas as in the hybrid path.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "viewer/frame/bands.h"
#include "viewer/frame/frame_path.h"
#include "viewer/light/pbr_inputs.h"

namespace selvedge {

class ShaderPath final : public FramePath {
 public:
  /// Loads mesh, pictures and fabrics. `gl` and `scene` must outlive the object. OPTION_OUT_OF_RANGE if the
  /// fabrics exceed the largest buffer of a shader; GRAPHICS_UNAVAILABLE.
  static Result<std::unique_ptr<ShaderPath>> create(const GlFunctions& gl, const PreparedScene& scene,
                                                    std::span<const Fabric> fabrics, const FrameSize& size);

  Result<void> resize(const FrameSize& size) override;
  Result<void> draw(const FrameView& view, Frame& frame, RenderStats& stats) override;

 private:
  /// A storage buffer that is replaced by a larger one when its data have no room.
  struct GrowingBuffer {
    GLuint name = 0;
    std::size_t room = 0;  ///< bytes
  };

  ShaderPath(const GlFunctions& gl, const PreparedScene& scene)
      : gl_(gl), scene_(scene), pbr_(gl, scene.mesh, scene.materials), objects_(gl), targets_(gl) {}
  // These throw Failure.
  void load(std::span<const Fabric> fabrics);
  GLuint shading_program(bool shadows, bool around);
  template <class T>
  void load(const std::vector<T>& values, GrowingBuffer& buffer);
  void set_lights(const FrameView& view);
  void set_around(const FrameView& view);
  void set_reflections(const FrameView& view);
  void draw_rounds(const FrameView& view, RenderStats& stats);  ///< throws Failure
  void draw_round(int round, const std::array<GLfloat, 16>& clip);
  void shade_round(int round, const FrameView& view, GLuint program, const std::array<GLfloat, 16>& clip);

  const GlFunctions& gl_;
  const PreparedScene& scene_;
  PbrInputs pbr_;
  GlObjects objects_;
  GlObjects targets_;  ///< of the frame's size
  FrameSize size_{0, 0, 1, 1};
  int width_ = 0;  ///< of the supersampled frame
  int height_ = 0;
  bool shows_yarn_ = false;  ///< some fabric has yarn
  std::vector<TriangleSpan> spans_;
  std::array<GLuint, 2> triangle_programs_{};  ///< of round 0, of the others
  /// Without and with shadows, then the same with light from all around; created when needed.
  std::array<GLuint, 4> shading_programs_{};
  GLuint array_ = 0;
  GLuint empty_array_ = 0;
  std::array<GLuint, 4> buffers_{};  ///< in the order of their bindings
  GrowingBuffer lights_;
  GLint skies_ = 0;       ///< place of the fabrics' sky words
  GrowingBuffer around_;  ///< smooth light of the scene, then of its vertices
  std::vector<SmoothLight> around_loaded_;
  GrowingBuffer reflections_;
  std::shared_ptr<const Reflections> reflections_loaded_;
  GLuint any_ = 0;  ///< query: whether a round drew any pixel
  std::array<TriangleTarget, 2> rounds_{};
  GLuint result_ = 0;         ///< framebuffer of the accumulated light
  GLuint result_colour_ = 0;  ///< its texture
  std::vector<V4f> large_;
};

}  // namespace selvedge
