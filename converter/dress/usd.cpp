#include "converter/dress/usd.h"

#include <Imath/ImathBox.h>
#include <fmt/format.h>

#include <cctype>
#include <filesystem>
#include <iterator>
#include <map>
#include <set>

#include "converter/dress/usd_material.h"
#include "format/base/option_text.h"
#include "format/gltf/access.h"
#include "format/gltf/read_scene.h"
#include "format/gltf/uri.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;

/// Makes identifiers of USD: letters, digits and underscores, unique among their siblings.
class Identifiers {
 public:
  std::string make(const std::string& name, const char* otherwise) {
    std::string identifier;
    for (const char c : name) {
      identifier +=
          std::isalnum(static_cast<unsigned char>(c)) != 0 && static_cast<unsigned char>(c) < 128 ? c : '_';
    }
    if (identifier.empty()) identifier = otherwise;
    if (std::isdigit(static_cast<unsigned char>(identifier[0])) != 0) identifier = "_" + identifier;
    std::string unique = identifier;
    for (int i = 1; !taken_.insert(unique).second; ++i) unique = fmt::format("{}_{}", identifier, i);
    return unique;
  }

 private:
  std::set<std::string> taken_;
};

/// Asset paths: external pictures and fabrics keep their places, embedded ones are written beside the layer.
class Assets : public UsdAssets {
 public:
  Assets(const GltfDocument& document, const Scene& scene, const std::string& layer)
      : document_(document), scene_(scene), layer_(layer) {}

  std::string image(int index) override {
    return remember(images_, index, [&] { return find_image(index); });
  }
  std::string fabric(int index) override {
    return remember(fabrics_, index, [&] { return find_fabric(index); });
  }

  UsdFiles take() { return std::move(result_); }

 private:
  template <class F>
  static std::string remember(std::map<int, std::string>& known, int index, const F& find) {
    const auto [entry, fresh] = known.try_emplace(index);
    if (fresh) entry->second = find();
    return entry->second;
  }

  std::string find_image(int index) {
    const auto leave_out = [&](std::string remark) {
      result_.remarks.push_back(std::move(remark));
      return std::string();
    };
    const Json& images = array_of(document_.json, "images");
    if (index < 0 || static_cast<std::size_t>(index) >= images.size()) return {};
    const std::string place = fmt::format("/images/{}", index);
    const std::string uri = string_of(member(images[index], "uri"));
    if (!uri.empty() && !uri.starts_with("data:")) {
      const Result<std::string> path = resolve_uri(document_, uri, place);
      return path ? reference(*path) : leave_out(to_line(path.error()));
    }
    Result<std::vector<std::uint8_t>> bytes = read_image_bytes(document_, index);
    if (!bytes) return leave_out(to_line(bytes.error()));
    const bool png = bytes->size() > 4 && (*bytes)[0] == 0x89 && (*bytes)[1] == 'P';
    const bool jpeg = bytes->size() > 4 && (*bytes)[0] == 0xFF && (*bytes)[1] == 0xD8;
    if (!png && !jpeg) {
      return leave_out(
          fmt::format("{}: {}: neither PNG nor JPEG; left out of the USD", document_.file, place));
    }
    return add(fmt::format("image{}.{}", index, png ? "png" : "jpg"), std::move(*bytes));
  }

  std::string find_fabric(int index) {
    const SceneFabric& fabric = scene_.fabrics[index];
    if (!fabric.path.empty()) return reference(fabric.path);
    return add(fmt::format("fabric{}.exr", index), fabric.bytes);
  }

  std::string reference(const std::string& target) const {
    std::error_code ignored;
    const fs::path folder = fs::weakly_canonical(fs::absolute(layer_), ignored).parent_path();
    const std::string path =
        fs::weakly_canonical(fs::absolute(target), ignored).lexically_relative(folder).generic_string();
    return path.starts_with("../") ? path : "./" + path;
  }

  std::string add(const std::string& ending, std::vector<std::uint8_t> bytes) {
    const fs::path layer(layer_);
    const fs::path path = layer.parent_path() / fmt::format("{}-{}", layer.stem().string(), ending);
    result_.files.push_back({path.string(), std::move(bytes)});
    return reference(path.string());
  }

  const GltfDocument& document_;
  const Scene& scene_;
  std::string layer_;
  std::map<int, std::string> images_;
  std::map<int, std::string> fabrics_;
  UsdFiles result_;
};

template <class T, class F>
std::string list(const std::vector<T>& values, const F& text_of) {
  std::string text;
  for (const T& value : values) text += (text.empty() ? "" : ", ") + text_of(value);
  return "[" + text + "]";
}

std::string text_of(const V3f& v) { return fmt::format("({}, {}, {})", v.x, v.y, v.z); }

std::string matrix_of(const M44d& m) {
  std::string text = "( ";
  for (int row = 0; row < 4; ++row) {
    text +=
        fmt::format("({}, {}, {}, {}){}", m[row][0], m[row][1], m[row][2], m[row][3], row < 3 ? ", " : " )");
  }
  return text;
}

std::string extent_of(const std::vector<V3f>& positions) {
  Imath::Box3f box;
  for (const V3f& p : positions) box.extendBy(p);
  return fmt::format("[{}, {}]", text_of(box.min), text_of(box.max));
}

/// One instance of a primitive. `binding` is the path of its material, or empty.
std::string mesh(const ScenePrimitive& primitive, const M44d& world, const std::string& name,
                 const std::string& binding, bool double_sided) {
  std::string text = fmt::format("    def Mesh \"{}\"", name);
  if (!binding.empty()) text += " (\n        prepend apiSchemas = [\"MaterialBindingAPI\"]\n    )";
  text += "\n    {\n";
  const auto line = [&](const std::string& declaration, const std::string& value) {
    text += "        " + declaration + " = " + value + "\n";
  };
  const auto per_vertex = [&](const std::string& declaration, const std::string& value) {
    line(declaration, value + " (\n            interpolation = \"vertex\"\n        )");
  };
  line("uniform bool doubleSided", double_sided ? "1" : "0");
  line("float3[] extent", extent_of(primitive.positions));
  line("int[] faceVertexCounts", list(std::vector<int>(primitive.indices.size() / 3, 3),
                                      [](int count) { return fmt::format("{}", count); }));
  line("int[] faceVertexIndices",
       list(primitive.indices, [](std::uint32_t index) { return fmt::format("{}", index); }));
  if (!binding.empty()) line("rel material:binding", "<" + binding + ">");
  if (!primitive.normals.empty()) per_vertex("normal3f[] normals", list(primitive.normals, text_of));
  line("point3f[] points", list(primitive.positions, text_of));
  for (std::size_t set = 0; set < primitive.tex_coords.size(); ++set) {
    if (primitive.tex_coords[set].empty()) continue;
    per_vertex("texCoord2f[] primvars:" + usd_primvar(static_cast<int>(set)),
               list(primitive.tex_coords[set], [](const V2d& uv) {
                 return fmt::format("({}, {})", static_cast<float>(uv.x), static_cast<float>(1.0 - uv.y));
               }));
  }
  line("uniform token subdivisionScheme", "\"none\"");
  if (world != M44d()) {
    line("matrix4d xformOp:transform", matrix_of(world));
    line("uniform token[] xformOpOrder", "[\"xformOp:transform\"]");
  }
  return text + "    }\n\n";
}

/// Refuses to overwrite a picture of the garment.
Result<void> check_names(const GltfDocument& document, const UsdFiles& files) {
  for (const Json& image : array_of(document.json, "images")) {
    const std::string uri = string_of(member(image, "uri"));
    if (uri.empty()) continue;
    const Result<std::string> path = resolve_uri(document, uri, "");
    std::error_code ignored;
    for (const UsdFile& file : files.files) {
      if (path && fs::equivalent(*path, file.path, ignored)) {
        return fail(Code::file_unwritable, file.path, "", "is a picture of the garment");
      }
    }
  }
  return {};
}

}  // namespace

Result<UsdFiles> usd_of(const GltfDocument& document, const std::string& path, const SceneLimits& limits) {
  if (!has_ending(path, ".usda")) {
    return fail(Code::option_out_of_range, path, "", "the name of a USD layer has to end in .usda");
  }
  const Result<Scene> scene = read_scene(document, limits);
  if (!scene) return tl::unexpected<Error>(scene.error());
  Assets assets(document, *scene, path);
  Identifiers names;
  const std::string materials_name = names.make("Materials", "");
  Identifiers material_names;
  std::map<int, std::string> bindings;
  std::string meshes;
  std::string materials;
  for (const SceneInstance& instance : scene->instances) {
    const ScenePrimitive& primitive = scene->primitives[instance.primitive];
    if (primitive.positions.empty()) continue;
    const SceneMaterial* material = primitive.material < 0 ? nullptr : &scene->materials[primitive.material];
    std::string binding;
    if (material != nullptr) {
      const auto [entry, fresh] = bindings.try_emplace(primitive.material);
      if (fresh) {
        const std::string name = material_names.make(material->name, "material");
        entry->second = fmt::format("/Garment/{}/{}", materials_name, name);
        if (!materials.empty()) materials += "\n";
        materials += usd_material(document, document.json["materials"][primitive.material], *material, name,
                                  entry->second, assets);
      }
      binding = entry->second;
    }
    meshes += mesh(primitive, instance.world, names.make(primitive.name, "mesh"), binding,
                   material != nullptr && material->double_sided);
  }
  const std::string text = fmt::format(
      "#usda 1.0\n(\n    defaultPrim = \"Garment\"\n    metersPerUnit = 1\n    upAxis = \"Y\"\n)\n\n"
      "def Xform \"Garment\"\n{{\n{}    def Scope \"{}\"\n    {{\n{}    }}\n}}\n",
      meshes, materials_name, materials);
  UsdFiles result = assets.take();
  if (Result<void> good = check_names(document, result); !good) {
    return tl::unexpected<Error>(std::move(good.error()));
  }
  result.files.push_back({path, std::vector<std::uint8_t>(text.begin(), text.end())});
  return result;
}

Result<std::vector<AtomicFile>> stage(const UsdFiles& files) {
  std::vector<AtomicFile> staged;
  for (const UsdFile& file : files.files) {
    Result<AtomicFile> one = stage_file(file.path, file.bytes);
    if (!one) return tl::unexpected<Error>(std::move(one.error()));
    staged.push_back(std::move(*one));
  }
  return staged;
}

}  // namespace selvedge
