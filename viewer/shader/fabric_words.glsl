// Fabrics in one buffer of words (word_layout.glsl).
layout(std430, binding = 0) readonly buffer Fabrics { uint words[]; };
uint word(uint at) { return words[at]; }
