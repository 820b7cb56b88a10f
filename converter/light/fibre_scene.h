// Traces rays through an endlessly repeated cell of explicit fibres with Embree: round lines, as RayScene
// (ray_scene.h) traces triangles. Only outsides of fibres are met: a ray that begins within one, as where
// fibres run through each other, leaves it unseen.
#pragma once

#include <memory>

#include "converter/light/hair_bsdf.h"
#include "converter/stitch/fibre_layout.h"

namespace selvedge {

/// Where a ray meets a fibre.
struct FibrePoint {
  V3d axis;           ///< the place on the fibre's axis, mm, in the cell
  V3d along;          ///< unit
  double radius = 0;  ///< mm
  double offset = 0;  ///< HairBsdf's
  V3d view;           ///< unit, towards the ray's origin
  int yarn = 0;       ///< index into Fibres::yarns
};

struct FibreSceneState;

class FibreScene {
 public:
  /// Refuses (mesh_invalid) what the ray tracer has no memory for; `name` is for the message.
  static Result<FibreScene> create(const Fibres& fibres, const std::string& name);
  FibreScene(FibreScene&&) noexcept;
  FibreScene& operator=(FibreScene&&) noexcept;
  ~FibreScene();

  V2d period() const;
  /// Lowest and highest z of the fibres, mm.
  double low() const;
  double high() const;

  /// Finds the first fibre along the ray from `origin` (anywhere, mm) in unit `direction`; false if there is
  /// none.
  bool trace(const V3d& origin, const V3d& direction, FibrePoint& point) const;
  bool occluded(const V3d& origin, const V3d& direction) const;
  /// The origin of a ray that leaves a fibre: on the side that `direction` leads to.
  static V3d leave(const FibrePoint& point, const V3d& direction);

 private:
  explicit FibreScene(std::unique_ptr<FibreSceneState> state);
  std::unique_ptr<FibreSceneState> state_;
};

/// Light in the frame of a fibre's scattering, and back.
HairDirection hair_direction(const FibrePoint& point, const V3d& light);
V3d direction_of(const FibrePoint& point, const HairDirection& light);

}  // namespace selvedge
