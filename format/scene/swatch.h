// An infinite flat swatch, seen from one of four places. It is rendered from a fabric or ray traced from the
// stitch (converter/bake/truth_swatch.h), which is then the truth for the fabric.
//
// World: metres, the cloth is the plane z = 0, u grows along +x and v along -y from the origin by one unit
// per repeat. A cell of a stitch has its x and y in this plane and its reference plane at z = 0.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "format/scene/camera.h"
#include "format/scene/lights.h"
#include "format/scene/scene.h"

namespace selvedge {

enum class SwatchView { near, middle, far, grazing };

/// Names in options and files, in the order of the enumeration.
inline constexpr std::array<std::string_view, 4> swatch_view_names{"near", "middle", "far", "grazing"};
inline constexpr std::array<SwatchView, 4> all_swatch_views{SwatchView::near, SwatchView::middle,
                                                            SwatchView::far, SwatchView::grazing};
std::string_view name_of(SwatchView view);

/// Camera, size and lights of a picture of a swatch.
struct SwatchShot {
  Camera camera;
  int width = 1;
  int height = 1;
  std::vector<Light> lights;
};

/// The picture's height shows 2, 6 and 64 repeats (of the longer period) from 60, 45 and 72 degrees above the
/// cloth (near, middle, far); its width shows 6 repeats across the middle from 12 degrees (grazing). Azimuths
/// differ, so that no direction counts twice (docs/trade.md). The field of view is 10 degrees high. A key
/// light of irradiance 1 and a fill light of 0.3 are fixed in the world. Preconditions: both periods above 0
/// (mm), width and height at least 1, the picture at most 4 times as wide as high: then the cloth fills the
/// frame.
SwatchShot swatch_shot(SwatchView view, const V2d& period_mm, int width, int height);

/// A rectangle in the plane z = 0 with fabric 0: repeats [first, end) along u and v. Periods in mm.
Scene swatch_scene(const V2d& period_mm, const V2i& first, const V2i& end);

/// A rectangle that covers the part of the plane in the frame. Precondition: the rays through all four
/// corners of the frame meet the plane.
Scene swatch_scene(const V2d& period_mm, const SwatchShot& shot);

/// The intersection of a pixel's ray with the plane z = 0.
struct SwatchHit {
  V2d point_m{0, 0};    ///< m
  V3d view{0, 0, 1};    ///< unit, towards the viewer; z > 0
  double distance = 0;  ///< m, from the camera's position (perspective) or image plane (parallel)
};

/// The ray through the image point (s, t) in [-1, 1]^2 (Camera); nothing if it does not meet the plane, or
/// meets it from below.
std::optional<SwatchHit> find_swatch_hit(const Camera& camera, const V2d& image_point);

}  // namespace selvedge
