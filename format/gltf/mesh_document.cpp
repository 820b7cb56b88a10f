#include "format/gltf/mesh_document.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <unordered_map>

#include "format/base/guard.h"
#include "format/base/option_text.h"
#include "format/base/printable.h"
#include "format/base/srgb.h"
#include "format/gltf/edit.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/memory.h"
#include "format/gltf/names.h"
#include "format/gltf/uri.h"
#include "format/mesh/mesh_file.h"
#include "format/picture/image.h"

namespace selvedge {
namespace {

/// Bytes of a corner in the maps and buffers that are made of it.
constexpr std::uint64_t corner_price = 128;
/// JSON values of a primitive with its accessors, views and material.
constexpr std::uint64_t values_of_part = 128;

/// The triangles of a primitive.
struct Part {
  int material = 0;  ///< of the file; -1: of PLY
  bool has_uvs = false;
  std::vector<MeshCorner> corners;  ///< three a triangle
};

struct MeshCornerHash {
  std::size_t operator()(const MeshCorner& c) const {
    const auto word = [](int i) { return static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)); };
    return (word(c.position) << 32 ^ word(c.uv) << 12 ^ word(c.normal)) * 0x9E3779B97F4A7C15U;
  }
};

class MeshDocument {
 public:
  MeshDocument(const std::string& path, const GltfLimits& limits) : limits_(limits), account_(limits.memory) {
    document_.file = path;
    document_.folder = std::filesystem::path(path).parent_path().string();
    document_.external_files = limits.external_files;
    document_.json = Json::parse(R"({"asset": {"version": "2.0", "generator": "selvedge"}, "scene": 0,
      "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": [{"primitives": []}]})");
  }

  GltfDocument read(std::string_view bytes) {
    const bool is_obj = has_ending(document_.file, ".obj");
    take(bytes.size(), is_obj ? obj_memory_factor : ply_memory_factor, "its text");
    if (is_obj) {
      mesh_ = value_or_throw(read_obj(bytes, document_.file));
      for (const std::string& names : mesh_.material_files) read_materials(names);
      const std::string own = std::filesystem::path(document_.file).stem().string() + ".mtl";
      if (materials_.empty() && !find_similar_file(document_, own).empty()) {
        document_.remarks.push_back(fmt::format("{} is read", own));
        read_materials(own);
      }
    } else {
      const PlyFile ply = value_or_throw(read_ply(bytes, document_.file));
      mesh_ = value_or_throw(ply_to_mesh(ply, document_.file));
      constexpr std::string_view key = " TextureFile ";  // MeshLab's
      std::string& picture = materials_[""].diffuse_map.file;
      for (const std::string& comment : ply.comments)
        if (comment.starts_with(key) && picture.empty()) picture = comment.substr(key.size());
    }
    decode_colours();
    make_primitives();
    if (!unknown_.empty())
      document_.remarks.push_back(fmt::format("no material file has \"{}\": left without colour and picture",
                                              fmt::join(unknown_, "\", \"")));
    document_.memory_used = limits_.memory - account_.unspent_bytes();
    return std::move(document_);
  }

 private:
  void take(std::uint64_t count, std::uint64_t price, const char* what) {
    if (!account_.try_spend(count, price))
      throw Failure{memory_limit_error(document_.file, "", what, limits_.memory)};
  }

  /// The path of a file that the text names; other systems' separators and roots are understood, and so are
  /// similar names (find_similar_file), with a remark. Empty, with a remark, without such a file, and if
  /// other files are not to be opened.
  std::string path_of(std::string name, const char* place) {
    std::ranges::replace(name, '\\', '/');
    if (name.starts_with('/') || name.find(':') != std::string::npos) name = name.substr(name.rfind('/') + 1);
    if (name.empty() || document_.external_files == ExternalFiles::none) return {};
    std::string path = (std::filesystem::path(document_.folder) / name).string();
    path = value_or_throw(resolve_uri(document_, relative_uri(path, document_.folder), place));
    std::error_code ignored;
    if (std::filesystem::is_regular_file(path, ignored)) return path;
    std::string similar = find_similar_file(document_, name);
    document_.remarks.push_back(similar.empty()
                                    ? fmt::format("{}: {}: no such file", place, name)
                                    : fmt::format("{}: there is no \"{}\"; \"{}\" is read", place, name,
                                                  std::filesystem::path(similar).filename().string()));
    return similar;
  }

  /// Reads the material files of a line: one, whose name may have blanks, or several.
  void read_materials(const std::string& line) {
    const std::size_t end = line.find(".mtl ") + 4;
    if (end > 4 && end < line.size() && find_similar_file(document_, line).empty()) {
      read_materials(line.substr(0, end));
      return read_materials(line.substr(line.find_first_not_of(' ', end)));
    }
    const auto text = read_file(path_of(line, "mtllib"), std::min(limits_.file_bytes, limits_.memory));
    if (!text) return;
    take(text->size(), obj_memory_factor, "its materials");
    read_mtl(*text, materials_);
  }

  /// Makes colours of vertices linear: as in Blender and three.js they are sRGB, from 0 to 1 or to 255. White
  /// is no colour.
  void decode_colours() {
    std::vector<V3f>& colours = mesh_.colours.values;
    float largest = 0;
    for (const V3f& c : colours) largest = std::max({largest, c.x, c.y, c.z});
    const float full = largest > 1.5F ? 255 : 1;
    for (V3f& colour : colours)
      for (int c = 0; c < 3; ++c)
        colour[c] = colour[c] >= 0 ? srgb_to_linear(std::min(colour[c] / full, 1.0F)) : 1;
    if (std::ranges::all_of(colours, [](const V3f& colour) { return colour == V3f(1); })) colours.clear();
    if (!mesh_.face_colours.values.empty())
      document_.remarks.emplace_back("colours of faces are left out; vertex colours are read");
  }

  /// The triangles of each material, with and without texture coordinates, by the materials' names.
  std::vector<Part> parts() {
    std::map<std::pair<std::string, bool>, Part> parts;
    for (std::size_t f = 0; f < mesh_.face_ends.size(); ++f) {
      const auto face = mesh_.face(f);
      if (face.size() < 3) continue;
      take(3 * face.size(), corner_price, "its faces");
      const std::string name = mesh_.materials.empty() ? "" : mesh_.materials[mesh_.face_materials[f]];
      const bool has_uvs = std::ranges::all_of(face, [](const MeshCorner& c) { return c.uv >= 0; });
      const auto [entry, is_new] = parts.try_emplace({name, has_uvs});
      if (is_new) {
        take(values_of_part, bytes_per_json_value, "its materials");
        entry->second = {material_of(name), has_uvs, {}};
      }
      for (std::size_t k = 2; k < face.size(); ++k) {
        for (MeshCorner corner : {face[0], face[k - 1], face[k]}) {
          if (!has_uvs) corner.uv = -1;
          entry->second.corners.push_back(corner);
        }
      }
    }
    std::vector<Part> list;
    for (auto& [key, part] : parts) list.push_back(std::move(part));
    return list;
  }

  void make_primitives() {
    const std::vector<Part> all = parts();
    if (all.empty()) {
      const std::string why = mesh_.positions.empty() ? "has no faces"
                                                      : fmt::format(
                                                            "has {} vertices and no faces: make a surface of "
                                                            "the point cloud, in MeshLab for instance",
                                                            mesh_.positions.size());
      throw Failure{{Code::gltf_malformed, document_.file, "", why}};
    }
    std::vector<V3d> sums(mesh_.positions.size(), V3d(0, 0, 0));  // of normals by area
    for (const Part& part : all) {
      for (std::size_t t = 0; t < part.corners.size(); t += 3) {
        const auto position = [&](std::size_t k) { return mesh_.positions[part.corners[t + k].position]; };
        const V3d normal = (position(1) - position(0)).cross(position(2) - position(0));
        for (std::size_t k = 0; k < 3; ++k) sums[part.corners[t + k].position] += normal;
      }
    }
    for (const Part& part : all) {
      Json primitive = primitive_of(part, sums);  // first: new members of the root move the others
      document_.json["meshes"][0]["primitives"].push_back(std::move(primitive));
    }
  }

  Json primitive_of(const Part& part, const std::vector<V3d>& sums) {
    std::unordered_map<MeshCorner, std::uint32_t, MeshCornerHash> index_of_corner;
    std::vector<float> positions;
    std::vector<float> normals;
    std::vector<float> uvs;
    std::vector<V3f> colours;
    std::vector<std::uint32_t> indices;
    for (const MeshCorner& corner : part.corners) {
      const auto [entry, is_new] =
          index_of_corner.try_emplace(corner, static_cast<std::uint32_t>(index_of_corner.size()));
      indices.push_back(entry->second);
      if (!is_new) continue;
      const V3f position(mesh_.positions[corner.position]);
      const V3d& given = corner.normal >= 0 ? mesh_.normals[corner.normal] : sums[corner.position];
      const bool sound = std::isfinite(given.length2()) && given.length2() > 0;
      const V3f normal = sound ? V3f(given.normalized()) : V3f(0, 0, 1);
      positions.insert(positions.end(), {position.x, position.y, position.z});
      normals.insert(normals.end(), {normal.x, normal.y, normal.z});
      if (part.has_uvs) uvs.insert(uvs.end(), {mesh_.uvs[corner.uv].x, mesh_.uvs[corner.uv].y});
      if (!mesh_.colours.values.empty()) colours.push_back(mesh_.colours.values[corner.position]);
    }
    Json attributes{{"POSITION", append_float_accessor(document_, positions, 3, true)},
                    {"NORMAL", append_float_accessor(document_, normals, 3, false)}};
    if (part.has_uvs) attributes["TEXCOORD_0"] = append_float_accessor(document_, uvs, 2, false);
    if (!colours.empty())
      attributes["COLOR_0"] = append_float_accessor(document_, floats_of(colours), 3, false);
    return {{"attributes", attributes},
            {"indices", append_index_accessor(document_, indices)},
            {"material", part.material}};
  }

  /// The document's material of this name, made at its first use.
  int material_of(const std::string& name) {
    const auto [entry, is_new] = used_.try_emplace(name, static_cast<int>(used_.size()));
    if (!is_new) return entry->second;
    if (!name.empty() && !materials_.contains(name)) unknown_.push_back(name);
    const MtlMaterial& given = materials_[name];
    Json material{{"name", name.empty() ? "cloth" : escape_invalid_utf8(name)},  // JSON strings are UTF-8
                  {"doubleSided", true},
                  {"pbrMetallicRoughness", {{"metallicFactor", 0}}}};
    Json& base = material["pbrMetallicRoughness"];
    const auto factor = [](const V3d& v) {
      return Json::array({std::min(v.x, 1.0), std::min(v.y, 1.0), std::min(v.z, 1.0)});
    };
    if (given.diffuse) {
      base["baseColorFactor"] = factor(*given.diffuse);
      base["baseColorFactor"].push_back(1);
    }
    if (given.emission) material["emissiveFactor"] = factor(*given.emission);
    set_picture(given.diffuse_map, base, "baseColorTexture", given.mask_file);
    // A texture alone shows nothing, as the factor of glTF is 0 by default.
    if (set_picture(given.emission_map, material, "emissiveTexture") && !given.emission)
      material["emissiveFactor"] = Json::array({1, 1, 1});
    set_picture(given.normal_map, material, "normalTexture");
    if (!given.mask_file.empty()) material["alphaMode"] = "MASK";
    document_.json["materials"].push_back(std::move(material));
    return entry->second;
  }

  /// A picture in the document with the colours of one file, else white, and the opacity of another: its
  /// alpha, or where that is 1 everywhere its brightness.
  Json masked(const std::string& colours, const std::string& mask) {
    const auto read = [&](const std::string& path) {
      const auto image = path.empty() ? Image{1, 1, 4, {1, 1, 1, 1}}
                                      : read_image(path, Transfer::keep, account_.unspent_bytes());
      if (!image) document_.remarks.push_back(to_line(image.error()));
      return image.value_or(Image{1, 1, 4, {1, 1, 1, 1}});
    };
    const Image colour = read(colours);
    const Image opacity = read(mask);
    Image image{std::max(colour.width, opacity.width), std::max(colour.height, opacity.height), 4, {}};
    take(std::uint64_t{1} * image.width * image.height, 8 * sizeof(float), "the picture of map_d");
    const auto is_transparent = [](const Image& i) {
      for (std::size_t k = 3; k < i.pixels.size(); k += 4)
        if (i.pixels[k] < 1) return true;
      return false;
    };
    const bool by_alpha = is_transparent(opacity);
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        const auto pixel = [&](const Image& i) {
          const std::int64_t row = std::int64_t{y} * i.height / image.height;
          return &i.pixels[4 * (row * i.width + std::int64_t{x} * i.width / image.width)];
        };
        const float* c = pixel(colour);
        const float* o = pixel(opacity);
        image.pixels.insert(image.pixels.end(),
                            {c[0], c[1], c[2], by_alpha ? o[3] : (o[0] + o[1] + o[2]) / 3});
      }
    }
    return {{"bufferView", append_view(document_, value_or_throw(encode_png(image, Transfer::keep)))},
            {"mimeType", "image/png"}};
  }

  /// Whether the picture, or the one of `mask` where that is another, exists; owner[key] then names it.
  bool set_picture(const TextureMap& map, Json& owner, const char* key, const std::string& mask = "") {
    const std::string path = path_of(map.file, "materials");
    const std::string mask_path = mask == map.file ? "" : path_of(mask, "map_d");
    if (path.empty() && mask_path.empty()) return false;
    const std::string uri = path.empty() ? "" : relative_uri(path, document_.folder);
    const auto [entry, is_new] = pictures_.try_emplace({uri, mask_path}, static_cast<int>(pictures_.size()));
    if (is_new) {
      Json image = mask_path.empty() ? Json{{"uri", uri}} : masked(path, mask_path);
      document_.json["images"].push_back(std::move(image));
      document_.json["textures"].push_back(Json::object({{"source", entry->second}}));
    }
    // MTL's v grows upwards.
    const UvTransform transform{V2d(map.offset.x, 1 - map.scale.y - map.offset.y), 0, map.scale};
    owner[key] = texture_info(entry->second, 0, transform);
    if (owner[key].contains("extensions")) list_extension(document_.json, names::gltf::texture_transform);
    return true;
  }

  const GltfLimits& limits_;
  MemoryBudget account_;
  GltfDocument document_;
  MeshFile mesh_;
  std::map<std::string, MtlMaterial> materials_;
  std::vector<std::string> unknown_;                             ///< names of materials without an entry
  std::map<std::string, int> used_;                              ///< numbers in the document
  std::map<std::pair<std::string, std::string>, int> pictures_;  ///< by URI and path of the mask
};

}  // namespace

bool is_mesh_file(std::string_view bytes, const std::string& path) {
  return has_ending(path, ".obj") || bytes.starts_with("ply\n") || bytes.starts_with("ply\r\n");
}

Result<GltfDocument> load_mesh_document(std::string_view bytes, const std::string& path,
                                        const GltfLimits& limits) {
  try {
    return MeshDocument(path, limits).read(bytes);
  } catch (Failure& failure) {
    failure.error.file = path;
    return tl::unexpected(failure.error);
  }
}

}  // namespace selvedge
