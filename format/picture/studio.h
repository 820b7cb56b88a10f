// Default environment: a procedural studio.
#pragma once

#include "format/picture/environment.h"

namespace selvedge {

/// A grey room with two square softboxes above the height of the eye: the key in front on the left (towards
/// +z and -x) and a weaker one behind on the right, so that no side of a garment is dark. 256 x 128 pixels.
/// White that faces the key shows a radiance of about 1.
Environment studio_environment(const EnvironmentOptions& options = {});

/// The studio by that name, or a picture: read_environment().
Result<Environment> load_environment(const std::string& name, const EnvironmentOptions& options = {},
                                     std::uint64_t memory = default_memory_limit);

}  // namespace selvedge
