// The surface at one pixel: its triangle there, interpolated, the garment's frame, and light that arrives
// (paper section 6). For pixels that show more than cell images.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "format/scene/camera.h"
#include "viewer/cells/cell_pass.h"
#include "viewer/frame/frame_path.h"

namespace selvedge {

/// A frame in progress.
struct FrameScene {
  const PreparedScene& prepared;
  const FrameView& view;
  const ProjectedVertices& projected;
  const CellPass& cells;
  bool is_paper = false;  ///< as published: texels with colours of 8 bits in place of cell images
};

struct GarmentPoint {
  std::uint32_t surface = 0;
  std::uint32_t triangle = 0;  ///< index into MergedSurfaces::triangles
  bool is_back = false;
  std::array<float, 3> barycentrics{};  ///< of the corners
  V3f position{0, 0, 0};                ///< m, from the mesh's origin
  V3f normal{0, 0, 0};                  ///< of the front; interpolated, not normalised
  V3f tangent{0, 0, 0};                 ///< the same
  V3f to_viewer{0, 0, 1};               ///< unit
  V2f uv{0, 0};                         ///< without whole repeats; 0 where they overflow
  V2f duv_dx{0, 0};                     ///< change per pixel
  V2f duv_dy{0, 0};
};
/// Homogeneous coordinates: correct in perspective and for corners behind the viewer (after Olano and Greer
/// 1997). (x, y): from the lower left.
GarmentPoint garment_point(const FrameScene& scene, TriangleSide seen, int x, int y);

/// The garment's frame at a point. On both sides `tangent` points along growing u and `up` along falling v;
/// `normal` points out of the visible side. So the back of a cloth is the front mirrored in the cloth's
/// plane; the frame is left-handed where the texture appears mirrored.
struct GarmentFrame {
  V3f tangent, up, normal;
  V3f to_frame(const V3f& world) const { return {world.dot(tangent), world.dot(up), world.dot(normal)}; }
  V3f to_world(const V3f& d) const { return tangent * d.x + up * d.y + normal * d.z; }
};
/// A normal that faces away from the viewer is bent until the view just clears the horizon. The paper's fixed
/// axis replaces a missing tangent. `slope`: of a normal texture. `side`: 1 front, -1 back.
GarmentFrame garment_frame(const V3f& normal, const V3f& tangent, float handedness, float side,
                           const V3f& to_viewer, const V2f& slope = {0, 0});
GarmentFrame garment_frame(const FrameScene& scene, const GarmentPoint& point, const V2f& slope = {0, 0});

/// A light at a point, in the axes of its frame.
struct ArrivingLight {
  V3f direction{0, 0, 1};
  V3f irradiance{0, 0, 0};
  bool is_environment_part = false;  ///< Light::is_environment_part
};
/// The lights at a point, without their shadows' fraction. `through`: light from behind comes through.
std::vector<ArrivingLight> lights_at(const FrameScene& scene, const GarmentPoint& point,
                                     const GarmentFrame& frame, bool through);
/// Light from all around at a point, world axes. Precondition: the options have such light.
SmoothLight smooth_light_at(const FrameScene& scene, const GarmentPoint& point);

/// The fraction of light from all around that the scene leaves a point, as white cloth that faces along
/// `normal` (world) reflects it; 1 where nothing is known.
float smooth_light_visibility(const FrameScene& scene, const SmoothLight& at_point, const V3f& normal);

/// PbrPixel::packed_values, decoded.
struct PbrValues {
  V2f slope{0, 0};  ///< of the normal, in the garment's frame of the front side
  float metallic = 0;
  float roughness = 0;
  V3f emission{0, 0, 0};
  float occlusion = 1;
};
PbrValues pbr_values(const PbrPixel& pixel);

}  // namespace selvedge
