// Fabrics as words (word_layout.glsl) in a texture of whole rows, for WebGL 2, which has no buffers for shaders.
uniform highp usampler2D fabric_words;
const uint words_per_row = 2048u;
uint word(uint at) { return texelFetch(fabric_words, ivec2(int(at % words_per_row), int(at / words_per_row)), 0).r; }
