// Texels by which a point is moved off its surface before it is looked up in a shadow map, so that the surface does not
// shadow itself: along the normal, times the sine between normal and light; and towards the light. A plane clears all taps
// that count: the farthest lies less than 2 sqrt(2) texels away. C++ includes this file, too.
const float shadow_normal_offset = 3.0;
const float shadow_light_offset = 0.5;
