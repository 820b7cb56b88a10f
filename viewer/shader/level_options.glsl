// The options of format/fabric/level_options.h as uniforms, for fabric_surface.glsl.
layout(location = 6) uniform int forced_level;  // -1: none
layout(location = 7) uniform int blend_levels;
layout(location = 8) uniform float level_bias;
layout(location = 9) uniform int by_area;
#ifdef YARN
layout(location = 11) uniform int points;  // along either side of a pixel that shows yarn
#endif
