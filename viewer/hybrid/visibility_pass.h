// The geometry pass (paper section 6, without its limits): OpenGL writes the number of the visible triangle
// per pixel and its depth, of the first round the number of surfaces, and of materials without fabric colour
// and PbrPixel. Front and back of the cloth are drawn separately, which gives two layers of
// depth at the price of one; further rounds peel the layers behind them.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "format/picture/frame.h"
#include "viewer/frame/options.h"
#include "viewer/gl/objects.h"
#include "viewer/scene/materials.h"
#include "viewer/scene/mesh.h"

namespace selvedge {

// Bands of rows, in which a frame is drawn to bound its memory and to shade one band while the next is drawn.

/// The supersampled frame, in pixels.
struct FrameBands {
  int width = 1;
  int height = 1;
  int rows = 1;  ///< of a band; the last one may have fewer
  int supersample = 1;
  int band_row_count(int first_row) const { return first_row + rows < height ? rows : height - first_row; }
  bool operator==(const FrameBands&) const = default;
};

/// Bands with a multiple of `supersample` rows, and an even number, so that OpenGL's quads of 2 x 2 pixels
/// are aligned in every band.
FrameBands bands_of(const FrameSize& size);

/// The output pixels of a band: radiance times opacity, and opacity. Row y of a picture, counted from the
/// band's bottom, begins at bottoms[picture] + y * stride.
struct BandPixels {
  int first_row = 0;  ///< of the frame, counted from its bottom
  int width = 1;
  int rows = 1;
  std::vector<V4f*> bottoms{};  ///< of pictures that differ by their tints
  std::ptrdiff_t stride = 0;
  int supersample = 1;
  V4f& at(int x, int y, std::size_t picture = 0) const { return bottoms[picture][y * stride + x]; }
};

/// The pixels of the band that begins at `first_row`: pixels of the frames, or with supersampling pixels of
/// `large`, which box_filter() averages.
BandPixels pixels_of(const FrameBands& bands, int first_row, std::span<Frame> frames,
                     std::vector<std::vector<V4f>>& large);

/// One side of the cloth in a band of rows, bottom row first (as OpenGL has it); pixel (x, y) at
/// y * width + x.
struct DrawnSide {
  std::vector<std::uint32_t> triangle_list;  ///< the triangles that are drawn
  std::vector<std::uint32_t> triangles;      ///< index into the list; undefined in empty pixels
  std::vector<float> depth;                  ///< OpenGL's, smaller is nearer; 1: empty pixel
  /// Number of surfaces behind each other, at most 255; of the first round only.
  std::vector<std::uint8_t> counts;
  /// Parts of PbrPixel; empty if no surface of the scene needs them.
  std::vector<V4f> colours;
  std::vector<std::array<std::uint32_t, 4>> pbr;
  /// The surface at a pixel that is not empty; `side`: 0 of the front, 1 of the back.
  TriangleSide surface_at(std::size_t i, std::size_t side) const {
    return static_cast<TriangleSide>(2 * triangle_list[triangles[i]] + side);
  }
  PbrPixel pbr_at(std::size_t i) const { return colours.empty() ? PbrPixel{} : PbrPixel{colours[i], pbr[i]}; }
};

/// Throws GRAPHICS_UNAVAILABLE where OpenGL fails.
class VisibilityPass {
 public:
  /// Uploads what `materials` of the surfaces of `mesh` need but their textures; MaterialPicture::texture may
  /// change later. Both must outlive the object. The context of `gl` must be current whenever a function of
  /// this class is called, the destructor included.
  VisibilityPass(const GlFunctions& gl, const MergedSurfaces& mesh, const Materials& materials,
                 const FrameBands& bands);

  /// Changes the size of frames; discards their contents.
  void resize(const FrameBands& bands);

  /// Sets the vertex positions of the following draws.
  void set_vertices(const ProjectedVertices& projected) {
    gl_.NamedBufferSubData(clip_, 0, static_cast<GLsizeiptr>(projected.clip.size() * sizeof(V4f)),
                           projected.clip.data());
  }

  /// Draws one side (0: front, 1: back) of the band that begins at `first_row` of the frame, counted from its
  /// bottom. Round 0 shows the nearest of the listed triangles, round n those behind round n - 1 of the same
  /// side, which must have been drawn just before.
  void draw(int side, int round, int first_row, std::span<const std::uint32_t> triangles);

  /// Whether DrawnSide::pbr is filled.
  bool has_pbr() const { return has_pbr_; }

  /// Waits until everything is drawn.
  void finish() const { gl_.Finish(); }

  /// Reads the first `rows` rows of the last draw of a side; the rest of `to` is undefined. Pixels with depth
  /// 1 are empty.
  void read(int side, int round, int rows, DrawnSide& to) const;

 private:
  /// Render targets: triangle numbers, depth and, if needed, PbrPixels.
  struct Target {
    GLuint framebuffer = 0;
    GLuint depth = 0;
  };

  /// Sets uniforms and textures of the current program for a surface.
  void bind_surface(std::size_t surface) const;

  const GlFunctions& gl_;
  const MergedSurfaces& mesh_;
  const Materials& materials_;
  bool has_pbr_ = materials_.needs_pbr();
  GlObjects objects_{gl_};
  GlObjects target_objects_{gl_};
  FrameBands bands_{0, 0, 0};
  std::array<GLuint, 2> programs_{};   ///< of round 0, of the others
  std::array<GLuint, 18> samplers_{};  ///< three wrap modes along u, three along v, nearest or linear
  GLuint array_ = objects_.vertex_array();
  GLuint clip_ = 0;
  GLuint indices_ = 0;
  std::array<std::array<Target, 2>, 2> targets_{};  ///< [side][round % 2]
  std::vector<std::uint32_t> corners_;
};

}  // namespace selvedge
