// The cell images under the pixels of a frame: which are in sight, and what pixels show of them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "viewer/cells/cell_store.h"
#include "viewer/frame/frame_path.h"

namespace selvedge {

/// Surfaces at sixteen pixels, from the frame's middle.
struct CellPixels {
  std::array<TriangleSide, lane_count> surface{};
  alignas(64) LaneFloats x{}, y{};
};

/// Cell images at sixteen pixels: radiance times opacity, and opacity.
struct CellShading {
  std::array<Group, lane_count> pixels;
  V4f at(std::size_t lane) const {
    const Group& p = pixels[lane];
    return {p[0], p[1], p[2], p[3]};
  }
  /// Lanes whose holes show the yarn that surrounds them: values are still to be divided by their opacity.
  std::uint32_t hole_filling_lanes = 0;
};

class CellPass {
 public:
  /// `scene` must outlive the object.
  explicit CellPass(const PreparedScene& scene);
  /// Takes another shape of the scene's mesh (MergedSurfaces::differs_by_shape()).
  void update_shape();

  /// Begins a frame. The arguments must outlive it. `shows`: whether it shows cell images.
  void begin(const FrameView& view, bool shows, int supersample, const ProjectedVertices& projected);
  /// Whether a triangle has cell images in this frame.
  bool shows(TriangleSide surface) const { return active_ && kinds_[surface / 2] != Kind::none; }
  /// Whether shows() holds, and neither the material nor a nearby light modifies the images.
  bool is_unmodified(TriangleSide surface) const {
    return active_ && kinds_[surface / 2] == Kind::plain && !has_uneven_light(surface);
  }
  /// Whether light varies over a triangle in ways that its corners do not show.
  bool has_uneven_light(TriangleSide surface) const { return uneven_[surface / 2]; }
  /// How much brighter a point of a triangle is than its corners imply: with another normal, and of light
  /// from all around; with these factors on lamps of an environment.
  float brightness_gain(TriangleSide surface, int x, int y, const V3f& normal, const V3f& point,
                        const SmoothLight* around, float environment_gain) const;
  /// In place of a surface: sample() gives 0 there.
  TriangleSide empty_triangle_side() const {
    return 2 * static_cast<TriangleSide>(scene_.mesh.triangles.size());
  }
  /// Whether mark_visible() must visit all pixels of a triangle.
  bool needs_all_pixels(TriangleSide surface) const { return has_parts_ || extents_[surface / 2].is_large(); }
  /// Notes that a pixel shows a triangle of which shows() holds. From any thread.
  void mark_visible(TriangleSide surface, int x, int y);
  /// Makes images of what was marked since the last call.
  void render(bool behind = false);
  /// Ends a frame.
  CellMemory end() { return active_ ? store_.end() : CellMemory{}; }
  /// Place of a pixel from the frame's middle.
  V2f offset_from_centre(int x, int y) const {
    return {static_cast<float>(x) - middle_x_, static_cast<float>(y) - middle_y_};
  }
  /// Precondition: shows() holds for all, and render() was called after all were marked. From any thread.
  /// `marked`: the pixels that were, if `pixels` are places beside them, whose images they show.
  void sample(const CellPixels& pixels, CellShading& shading, const CellPixels* marked = nullptr) const;

 private:
  /// Perspective planes over the frame, a x + b y + c of pixels from its middle, whose quotients by the first
  /// are interpolated: 1, u and v without whole repeats of the first corner, brightness, and the slope of
  /// rays along x and y of the fabric (splat.h); then those whole repeats.
  struct alignas(32) Planes {
    std::array<Group, 5> coefficients{};
    Patches::Place place;
    bool at_outline = false;  ///< rays may leave the yarn again that they entered
  };
  enum class Kind : std::uint8_t { none, changed, plain };
  void light_vertices();
  V3f to_viewer(const V3f& point) const;
  struct Edge {
    V3f along, turn;
    V2f yarn;
  };
  Edge edge(std::size_t triangle, std::size_t from, std::size_t to) const;
  float outline_rise(std::size_t triangle) const;
  /// At a pixel, from the frame's middle.
  float outline_depth(std::uint32_t triangle, float x, float y) const;
  bool is_lit_unevenly(std::size_t triangle) const;
  void add_inner_visibility(const ShadowMap& map, std::size_t triangle);
  /// Repeats at a pixel, from the frame's middle, without the whole ones of the triangle's first corner.
  V2f place_at(std::uint32_t triangle, const V2f& pixel) const;
  std::uint32_t patch_at(std::uint32_t triangle, const V2f& place) const;
  void mark_parts(TriangleSide surface, const V2f& place);
  void set_planes(std::size_t triangle);
  void collect(bool behind, int coarsening);
  PatchNeed& request(PatchSide patch, bool behind, int coarsening);
  /// The view of a surface in a repeat, counted from its triangle's first corner, at a place within it.
  const CellLook* look_at(TriangleSide surface, std::int32_t repeat_u, std::int32_t repeat_v, float u,
                          float v) const;
  struct Surface {
    V3f point, normal;
  };
  /// At a pixel, so far from the frame's middle.
  Surface surface_at(std::uint32_t triangle, float x, float y) const;
  /// Lights of which the corners of a triangle have some fraction, and lack some.
  struct LitBy {
    std::uint32_t lit = 0, unlit = 0;
  };
  /// At a pixel of a triangle, so far from the frame's middle.
  float visibility_of(std::size_t light, std::uint32_t triangle, float x, float y) const;

  const PreparedScene& scene_;
  CellStore store_;
  bool active_ = false;
  bool nearest_ = false;  ///< a forced level shows its texels as they are
  CellLights lights_;
  std::uint32_t mapped_ = 0;                      ///< lights with a shadow map
  std::vector<Kind> kinds_;                       ///< of triangles
  std::vector<Patches::Extent> extents_;          ///< of triangles
  std::vector<float> transmitted_;                ///< of vertices: CellLights::brightness()
  std::vector<std::array<float, 2>> brightness_;  ///< of vertices, front and back
  /// Slopes at vertices, of rays along the tangent and the normal x tangent, cosine between normal and ray.
  std::vector<V3f> slopes_;
  std::vector<float> thickness_;      ///< of fabrics: of yarn below its plane, mm
  std::vector<float> outline_rises_;  ///< of triangles
  std::vector<std::uint8_t> uneven_;  ///< of triangles
  std::vector<LitBy> lit_by_;         ///< of triangles, of lights with a shadow map
  std::vector<Light> known_lights_;   ///< of brightness_ and lit_by_
  std::vector<ShadowView> known_views_;
  std::vector<SmoothLight> known_around_;
  std::vector<Planes> planes_;              ///< of triangles
  std::vector<std::uint8_t> seen_;          ///< of triangles: 1 front, 2 back
  std::vector<std::uint8_t> seen_patches_;  ///< by patch and side, of large triangles
  bool has_parts_ = false;                  ///< only parts of images are looked up
  std::vector<RepeatParts> seen_parts_;     ///< by patch and side
  std::vector<std::uint32_t> numbers_;      ///< of patches and sides in `needs_`, by `calls_`
  std::vector<std::uint32_t> calls_;
  std::uint32_t call_ = 0;
  std::vector<PatchNeed> needs_;
  std::vector<std::array<PatchSide, 2>> shared_;  ///< patches that look like others
  const ProjectedVertices* projected_ = nullptr;
  const Camera* camera_ = nullptr;
  float middle_x_ = 0, middle_y_ = 0;
};

}  // namespace selvedge
