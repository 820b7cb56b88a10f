#include "apps/selvedge-view/environment_options.h"

namespace selvedge {

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
