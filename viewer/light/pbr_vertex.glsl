// For vertex shaders: pass_pbr() passes on the coordinates and colours of a material. MAPPINGS is the
// number of its texture mappings, at least 1; VERTEX_COLOURS is defined if the mesh has vertex colours.
#if MAPPINGS > 1
layout(location = 2) in vec2 more_uv[MAPPINGS - 1];
out vec2 surface_more_uv[MAPPINGS - 1];
#endif
#ifdef VERTEX_COLOURS
layout(location = 15) in vec4 vertex_colour;
out vec4 surface_colour;
#endif
void pass_pbr() {
#if MAPPINGS > 1
  surface_more_uv = more_uv;
#endif
#ifdef VERTEX_COLOURS
  surface_colour = vertex_colour;
#endif
}
