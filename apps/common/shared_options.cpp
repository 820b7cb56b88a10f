#include "apps/common/shared_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace selvedge {

void add_lights(Options& options, const char* name, LightKind kind, std::vector<Light>& lights,
                const std::string& help) {
  options.list(name, "X,Y,Z[,I]", help, [name, kind, &lights](const std::vector<std::string>& texts) {
    for (const std::string& text : texts) {
      const auto n = parse_number_list(name, text, ',', 3, 4, "0,0.6,0.8 or 0,0.6,0.8,2");
      const V3d place(n[0], n[1], n[2]);
      const std::optional<V3d> direction = kind == LightKind::directional ? unit_vector(place) : place;
      const double intensity = n.size() > 3 ? n[3] : 1;
      if (!direction || !(intensity >= 0 && intensity <= max_intensity))
        refuse(name, fmt::format("\"{}\" has no direction or no intensity in 0 to 1e12", text));
      Light light;
      light.kind = kind;
      (kind == LightKind::directional ? light.direction : light.position) = *direction;
      light.irradiance = V3f(static_cast<float>(intensity));
      lights.push_back(light);
    }
  });
}

void add_camera(Options& options, CameraOptions& camera) {
  options.number("--azimuth", camera.azimuth, "DEGREES", "0 faces the scene's front (+z), 90 its +x side");
  options.number("--elevation", camera.elevation, "DEGREES", "Above the horizon");
  options.number("--fov", camera.field_of_view, "DEGREES", "Vertical field of view");
  options.set_flag("--orthographic", camera.projection, Projection::parallel,
                   "Parallel instead of perspective projection");
  options.vector("--look-at", camera.look_at, "X,Y,Z",
                 "Point at the picture's centre, metres (default: the scene's centre)");
  options.number("--distance", camera.distance, "METRES", "Metres from that point");
  options.number("--zoom", camera.zoom, "FACTOR", "Narrow the frame by this factor");
  options.vector("--focus", camera.zoom_centre, "X,Y",
                 "Around this point of the frame; 0,0 is its top left, 1,1 its bottom right");
}

void add_scene_choice(Options& options, SceneChoice& choice) {
  options.text("--scene", choice.scene, "NAME|N", "A scene of the file (default: the one it names)");
  options.text("--variant", choice.variant, "NAME|N", "A variant of its materials (default: none)");
}

void add_limits(Options& options, SceneLimits& limits) {
  options.set_flag("--allow-outside", limits.document.external_files, ExternalFiles::anywhere,
                   "Open files outside of a garment's folder, too, if it names them");
  options.bytes("--max-memory", limits.document.memory,
                "Refuse a file that declares more than fits into this memory (K, M, G: KiB, MiB, GiB) "
                "[4G]");
}

std::optional<V3d> unit_vector(const V3d& v) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (!(largest > 0)) return std::nullopt;
  // By a power of two, which rounds nothing: squares of large numbers are infinite.
  const int exponent = -std::ilogb(largest);
  return V3d(std::scalbn(v.x, exponent), std::scalbn(v.y, exponent), std::scalbn(v.z, exponent)).normalized();
}

void add_fps(Options& options, double& fps) {
  options
      .number("--fps", fps, "N", "Frames a second while something moves: larger pixels where they take long")
      .in_range(1, 240);
}

void add_environment(Options& options, std::string& name, EnvironmentOptions& environment,
                     const std::string& otherwise) {
  options.begin_group("Environment");
  options
      .text("--environment", name, "FILE|studio|none",
            "Light from all around: an equirectangular picture of radiance (.hdr, .exr), or a room with two "
            "softboxes. " +
                otherwise)
      .reads();
  options.number("--environment-turn", environment.turn_degrees, "DEGREES", "Turns it about the upward axis")
      .in_range(-360, 360);
  options.number("--environment-strength", environment.strength, "FACTOR", "Factor on its radiance")
      .in_range(0, 1e6);
  options.add_check([&options, &name] {
    options.refuse_if(name == "none", "has no effect with --environment none",
                      {"--environment-turn", "--environment-strength"});
  });
}

}  // namespace selvedge
