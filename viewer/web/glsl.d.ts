/** The texts of viewer/shader and format/fabric/word_layout.glsl, in the order in which a shader includes them. */
export const word_layout: string;
export const fabric_words: string;
export const around: string;
export const evaluate: string;
export const yarn: string;
export const footprint: string;
export const fabric_surface: string;
