// The geometry pass (paper section 6) without its limits: OpenGL writes down, per pixel, the number of the
// triangle that is seen, and nothing else. Front and back of the cloth are drawn apart, which gives two
// layers of depth at the price of one; what lies behind them is peeled off in further rounds.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "viewer/frame/bands.h"
#include "viewer/light/pbr_inputs.h"
#include "viewer/scene/mesh.h"

namespace selvedge {

/// One side of the cloth in a band of rows, bottom row first (as OpenGL has it); pixel (x, y) at
/// y * width + x.
struct VisibleSide {
  std::vector<std::uint32_t> triangles;  ///< index into the list that was drawn, where something is seen
  std::vector<float> depth;              ///< OpenGL's, the nearer the smaller; 1: nothing is seen
  /// How many surfaces lie behind each other there, at most 255. Of the first round only.
  std::vector<std::uint8_t> counts;
  /// PbrPixel's parts; empty where no surface of the scene needs them.
  std::vector<V4f> colours;
  std::vector<std::array<std::uint32_t, 4>> pbr;
};

class VisibilityPass {
 public:
  /// `materials` are those of the surfaces of `mesh`; both must outlive the object. The context of `gl` must
  /// be current whenever a function of this class is called, the destructor included.
  static Result<std::unique_ptr<VisibilityPass>> create(const GlFunctions& gl, const MergedSurfaces& mesh,
                                                        const Materials& materials, const FrameBands& bands);

  /// Frames of another size; what was drawn is gone.
  Result<void> resize(const FrameBands& bands);

  /// Where the vertices are in the frames to come.
  void place(const ProjectedVertices& projected);

  /// Draws one side (0: front, 1: back) of the band that begins at `first_row` of the frame, counted from
  /// its bottom. Round 0 shows the nearest of the listed triangles, round n what lies behind round n - 1 of
  /// the same side, which must have been drawn just before.
  Result<void> draw(int side, int round, int first_row, std::span<const std::uint32_t> triangles);

  /// Whether VisibleSide::pbr is filled.
  bool has_pbr() const { return pbr_.needed(); }

  /// Waits until everything is drawn.
  void finish() const { gl_.Finish(); }

  /// Reads what was drawn last of a side: at least the tiles that `where` names, the rest of `to`
  /// having no meaning. Pixels at the depth 1 are empty.
  void read(int side, int round, const FrameTiles& where, VisibleSide& to) const;

 private:
  struct Rectangle {
    int x, y, width, rows;
  };
  VisibilityPass(const GlFunctions& gl, const MergedSurfaces& mesh, const Materials& materials)
      : gl_(gl), mesh_(mesh), pbr_(gl, mesh, materials), objects_(gl), target_objects_(gl) {}
  void upload();
  void read_pixels(int side, int round, const Rectangle& rectangle, VisibleSide& to) const;
  void draw_surface(std::uint32_t surface, std::size_t first, std::size_t end);

  const GlFunctions& gl_;
  const MergedSurfaces& mesh_;
  PbrInputs pbr_;
  GlObjects objects_;
  GlObjects target_objects_;
  FrameBands bands_{0, 0, 0};
  std::array<GLuint, 2> programs_{};  ///< of round 0, of the others
  GLuint array_ = 0;
  GLuint clip_ = 0;
  GLuint indices_ = 0;
  std::array<std::array<TriangleTarget, 2>, 2> targets_{};  ///< [side][round % 2]
  std::vector<std::uint32_t> corners_;
};

}  // namespace selvedge
