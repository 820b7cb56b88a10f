// Names in glTF files (spec/SELVEDGE_materials_fabric), one constant each.
#pragma once

namespace selvedge::names::gltf {

inline constexpr const char* fabric_extension = "SELVEDGE_materials_fabric";
inline constexpr const char* fabrics = "fabrics";  ///< root array of fabric files
inline constexpr const char* fabric = "fabric";    ///< a material's reference, shaped like a textureInfo
inline constexpr const char* mask_texture = "maskTexture";  ///< these, to tintTexture: beside `fabric`
inline constexpr const char* mask_cutoff = "maskCutoff";
inline constexpr const char* normal_texture = "normalTexture";  ///< core glTF's name, too
inline constexpr const char* tint_factor = "tintFactor";
inline constexpr const char* tint_texture = "tintTexture";
inline constexpr const char* name = "name";
inline constexpr const char* mime_type = "mimeType";
inline constexpr const char* uri = "uri";
inline constexpr const char* buffer_view = "bufferView";
inline constexpr const char* index = "index";
inline constexpr const char* tex_coord = "texCoord";
inline constexpr const char* base_color_texture = "baseColorTexture";  ///< core glTF
inline constexpr const char* fabric_mime_type = "image/x-exr";

inline constexpr const char* texture_transform = "KHR_texture_transform";
inline constexpr const char* offset = "offset";
inline constexpr const char* rotation = "rotation";
inline constexpr const char* scale = "scale";

inline constexpr const char* texture_webp = "EXT_texture_webp";
inline constexpr const char* specular_glossiness = "KHR_materials_pbrSpecularGlossiness";
inline constexpr const char* variants = "KHR_materials_variants";
inline constexpr const char* draco = "KHR_draco_mesh_compression";
inline constexpr const char* meshopt = "EXT_meshopt_compression";
inline constexpr const char* khr_meshopt = "KHR_meshopt_compression";
inline constexpr const char* gpu_instancing = "EXT_mesh_gpu_instancing";
inline constexpr const char* lights_punctual = "KHR_lights_punctual";
inline constexpr const char* node_visibility = "KHR_node_visibility";

}  // namespace selvedge::names::gltf
