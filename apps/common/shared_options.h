// Options that several verbs share: cameras, scenes, lights, environments, frames.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/common/options.h"
#include "format/gltf/read_scene.h"
#include "format/picture/environment.h"
#include "format/scene/camera.h"
#include "format/scene/lights.h"

namespace selvedge {

/// All options of a camera but --distance, which is a range in some verbs.
void add_camera(Options& options, CameraOptions& camera);

/// --scene and --variant.
void add_scene_choice(Options& options, SceneChoice& choice);

/// Limits for garments that are not trusted: --allow-outside, --max-memory.
void add_limits(Options& options, SceneLimits& limits);

/// The unit vector along `v`, however large or small its numbers are; nothing if all are 0.
/// Precondition: they are finite.
std::optional<V3d> unit_vector(const V3d& v);

/// Directions, or positions of points, with intensities, added to `lights`.
void add_lights(Options& options, const char* name, LightKind kind, std::vector<Light>& lights,
                const std::string& help);

/// --environment with its turn and strength; `otherwise` says what is taken without it.
void add_environment(Options& options, std::string& name, EnvironmentOptions& environment,
                     const std::string& otherwise);

/// --fps.
void add_fps(Options& options, double& fps);

}  // namespace selvedge
