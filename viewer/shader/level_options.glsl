// The options of format/fabric/level_options.h as uniforms, for fabric_surface.glsl.
layout(location = 6) uniform int forced_level;  // -1: none
#ifdef YARN
layout(location = 11) uniform int points;  // along either side of a pixel that shows yarn
#endif
