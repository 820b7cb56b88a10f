// Fabrics as words (word_layout.glsl) in a texture of rows of 2^11, for WebGL 2, which has no buffers for shaders.
uniform highp usampler2D fabric_words;
uint word(uint at) { return texelFetch(fabric_words, ivec2(int(at & 0x7ffu), int(at >> 11u)), 0).r; }
