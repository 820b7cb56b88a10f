// Options that mean the same in verbs of both programs: cameras, scenes, lights, places of a swatch.
#pragma once

#include <functional>
#include <vector>

#include "apps/common/options.h"
#include "format/gltf/read_scene.h"
#include "format/scene/camera.h"
#include "format/scene/lights.h"
#include "format/scene/swatch.h"

namespace selvedge {

/// All of a camera but --distance, of which some verbs take two.
void add_camera(Options& options, CameraOptions& camera);

/// --scene and --variant.
void add_scene_choice(Options& options, SceneChoice& choice);

/// --light: directions with intensities, added to `lights`.
void add_lights(Options& options, std::vector<Light>& lights, const std::string& help);
/// --point-light: places with intensities.
void add_point_lights(Options& options, std::vector<Light>& lights);

/// --place: where a swatch is seen from.
void add_place(Options& options, const std::string& help, std::function<void(SwatchView)> read);

}  // namespace selvedge
