// The geometry passes (paper section 6): the scene is drawn with OpenGL into buffers that say, per pixel,
// which texels of which fabric are seen, in which frame. Nothing is lit here. Several layers are peeled off
// one behind the other, since cloth has holes.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "format/fabric.h"
#include "format/image.h"
#include "viewer/geometry.h"
#include "viewer/gl_functions.h"

namespace selvedge {

/// What the passes have to know of a material.
struct SurfaceLook {
  int fabric = -1;  ///< index into the fabrics; -1: `base_color`
  V4f base_color{1, 1, 1, 1};
  int image = -1;              ///< index into the images, a factor on `base_color`; -1: none
  float opaque_from = 0;       ///< where the opacity of the base colour is less, nothing is drawn
  bool keeps_opacity = false;  ///< else base colour or fabric count as opaque
  bool culls_back = false;
};

/// One layer of a band of rows, bottom row first (as OpenGL has it); pixel (x, y) is at y * width + x.
struct PixelLayer {
  int width = 0;
  int rows = 0;
  std::vector<V4f> normal;  ///< xyz: interpolated, not normalised; w: weight of the second level
  /// Fabric: xyz tangent, w handedness (geometry.h). Else: linear base colour and opacity.
  std::vector<V4f> surface;
  /// x, y in the first level; x, y in the second.
  std::vector<std::array<std::uint16_t, 4>> texels;
  /// 1 + surface (0: empty), first level, second level, 1 on the back.
  std::vector<std::array<std::uint16_t, 4>> marks;
};

struct IndexPassOptions {
  int width = 1;
  int height = 1;     ///< of the whole frame
  int band_rows = 1;  ///< rows that are drawn and read back at a time
  bool blend_levels = true;
  int forced_level = -1;  ///< not -1: this level everywhere, clamped to those that a fabric has
};

/// The largest width and height of a frame.
inline constexpr int index_pass_side_limit = 16384;

class IndexPass {
 public:
  /// `looks[i]` belongs to `surfaces[i]`. Everything is copied into OpenGL. The context of `gl` must be
  /// current whenever a function of this class is called, the destructor included.
  /// Preconditions: at most 65,534 surfaces; indices in range; sizes within index_pass_side_limit.
  static Result<std::unique_ptr<IndexPass>> create(const GlFunctions& gl, std::span<const Surface> surfaces,
                                                   std::span<const SurfaceLook> looks,
                                                   std::span<const Fabric> fabrics,
                                                   std::span<const Image> images,
                                                   const IndexPassOptions& options);
  ~IndexPass();
  IndexPass(const IndexPass&) = delete;
  IndexPass& operator=(const IndexPass&) = delete;

  /// Draws rows first_row ... first_row + band_rows - 1 of the frame, counted from its bottom; row 0 of the
  /// band is first_row. `clip`: world -> clip (camera.h). Layer 0 is the nearest surface, layer n what lies
  /// behind layer n - 1, which must have been drawn just before. From layer 1 on, pixels with
  /// finished[y * width + x] != 0 stay empty. Gives whether anything was drawn.
  Result<bool> draw(const M44d& clip, int first_row, int layer, std::span<const std::uint8_t> finished);

  /// Reads the layer that was drawn last. Empty pixels have marks[0] = 0 and nothing else of meaning.
  void read(PixelLayer& layer) const;

 private:
  struct Mesh {
    GLuint array = 0;
    GLsizei count = 0;
    SurfaceLook look;
  };
  struct FabricTextures {
    GLuint index = 0;
    GLuint level = 0;
    int last_level = 0;
  };

  IndexPass(const GlFunctions& gl, const IndexPassOptions& options) : gl_(gl), options_(options) {}
  void upload(const Surface& surface, const SurfaceLook& look);
  Result<void> make_targets();
  void draw_mesh(std::size_t i);

  const GlFunctions& gl_;
  IndexPassOptions options_;
  GLuint program_ = 0;
  GLuint query_ = 0;
  std::vector<Mesh> meshes_;
  std::vector<GLuint> buffers_;
  std::vector<FabricTextures> fabrics_;
  std::vector<GLuint> images_;
  std::array<GLuint, 4> colours_{};
  std::array<GLuint, 2> depths_{};  ///< of even and odd layers
  std::array<GLuint, 2> framebuffers_{};
  GLuint finished_ = 0;
  std::size_t drawn_into_ = 0;
};

}  // namespace selvedge
