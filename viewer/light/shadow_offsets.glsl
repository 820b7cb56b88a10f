// Offsets in texels, by which a point leaves its surface before the lookup of a shadow map, so that the surface does
// not shadow itself: along the normal, times the sine between normal and light; and towards the light. They suffice
// for planes: the farthest tap is less than 2 sqrt(2) texels away. C++ includes this file, too.
const float shadow_normal_offset = 3.0;
const float shadow_light_offset = 0.5;
