#include "converter/dress/usd.h"

#include <Imath/ImathMatrixAlgo.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cctype>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <optional>
#include <set>

#include "format/base/guard.h"
#include "format/base/option_text.h"
#include "format/gltf/access.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/names.h"
#include "format/gltf/read_scene.h"
#include "format/gltf/uri.h"
#include "format/picture/picture_type.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;

/// Makes identifiers of USD: letters, digits and underscores, unique among their siblings.
class Identifiers {
 public:
  std::string make(const std::string& name, const char* otherwise) {
    std::string identifier = name.empty() ? otherwise : name;
    for (char& c : identifier)
      if (std::isalnum(static_cast<unsigned char>(c)) == 0 || static_cast<unsigned char>(c) >= 128) c = '_';
    if (std::isdigit(static_cast<unsigned char>(identifier[0])) != 0) identifier = "_" + identifier;
    std::string unique = identifier;
    for (int i = 1; !taken_.insert(unique).second; ++i) unique = fmt::format("{}_{}", identifier, i);
    return unique;
  }

 private:
  std::set<std::string> taken_;
};

/// Asset paths: external pictures and fabrics keep their places, embedded ones are written beside the layer.
class Assets {
 public:
  Assets(const GltfDocument& document, const Scene& scene, const std::string& layer)
      : document_(document), scene_(scene), layer_(layer) {}

  std::string image(int index) {
    const auto [known, fresh] = images_.try_emplace(index);
    if (fresh) known->second = find_image(index);
    return known->second;
  }

  std::string fabric(int index) {
    const SceneFabric& fabric = scene_.fabrics[index];
    if (!fabric.path.empty()) return reference(fabric.path);
    const auto [known, fresh] = fabrics_.try_emplace(index);
    if (fresh) known->second = add(fmt::format("fabric{}.exr", index), fabric.bytes);
    return known->second;
  }

  UsdFiles take() { return std::move(result_); }

 private:
  std::string find_image(int index) {
    const Json& json = root_entry(document_, "images", index);
    if (json.is_null()) return {};
    const std::string place = fmt::format("/images/{}", index);
    const std::string uri = string_of(member(json, "uri"));
    if (!uri.empty() && !uri.starts_with("data:")) {
      const Result<std::string> path = resolve_uri(document_, uri, place);
      if (path) return reference(*path);
      result_.remarks.push_back(to_line(path.error()));
      return {};
    }
    Result<std::vector<std::uint8_t>> bytes = read_image_bytes(document_, index);
    if (!bytes) {
      result_.remarks.push_back(to_line(bytes.error()));
      return {};
    }
    const std::string_view type = picture_type(*bytes);
    if (type == "image/png" || type == "image/jpeg")
      return add(fmt::format("image{}.{}", index, type == "image/png" ? "png" : "jpg"), std::move(*bytes));
    result_.remarks.push_back(
        fmt::format("{}: {}: neither PNG nor JPEG; left out of the USD", document_.file, place));
    return {};
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

std::string text_of(const V3f& v) { return fmt::format("({}, {}, {})", v.x, v.y, v.z); }

template <class T, class F>
std::string list(const std::vector<T>& values, const F& value_of) {
  std::vector<decltype(value_of(values[0]))> texts;
  for (const T& value : values) texts.push_back(value_of(value));
  return fmt::format("[{}]", fmt::join(texts, ", "));
}
template <class T>
std::string list(const std::vector<T>& values) {
  return fmt::format("[{}]", fmt::join(values, ", "));
}

std::string extent_of(const std::vector<V3f>& positions) {
  Imath::Box3f box;
  for (const V3f& p : positions) box.extendBy(p);
  return fmt::format("[{}, {}]", text_of(box.min), text_of(box.max));
}

/// The primvar of a set of texture coordinates.
std::string primvar(int tex_coord) { return tex_coord == 0 ? "st" : fmt::format("st{}", tex_coord); }

/// "@./file@"
std::string asset(const std::string& path) {
  const char* quotes = path.find('@') == std::string::npos ? "@" : "@@@";
  return fmt::format("{}{}{}", quotes, path, quotes);
}

/// The text of one Material prim: its shaders, written on demand.
class MaterialPrim {
 public:
  MaterialPrim(const GltfDocument& document, std::string path, Assets& assets)
      : document_(document), path_(std::move(path)), assets_(assets) {}

  /// `json` is the glTF material of which `material` was read.
  std::string write(const std::string& name, const Json& json, const SceneMaterial& material) {
    const std::string surface = surface_of(json, material);
    std::string text = fmt::format("        def Material \"{}\"\n        {{\n", name);
    const std::string file = material.fabric ? assets_.fabric(material.fabric->fabric) : "";
    if (!file.empty())
      text += fmt::format(
          "            custom asset selvedge:fabric:file = {}\n"
          "            custom float2 selvedge:fabric:st.connect = {}\n",
          asset(file), coordinates(material.fabric->tex_coord, material.fabric->transform));
    add("surface", surface);
    text += fmt::format("            token outputs:surface.connect = {}\n", output("surface", "surface"));
    for (const auto& [shader, body] : shaders_)
      text +=
          fmt::format("\n            def Shader \"{}\"\n            {{\n{}            }}\n", shader, body);
    return text + "        }\n";
  }

 private:
  template <class Value>
  static std::string line(const char* declaration, const Value& value) {
    return fmt::format("                {} = {}\n", declaration, value);
  }

  std::string output(const std::string& shader, const char* name) const {
    return fmt::format("<{}/{}.outputs:{}>", path_, shader, name);
  }

  void add(const std::string& name, const std::string& body) {
    const bool known =
        std::ranges::any_of(shaders_, [&](const auto& shader) { return shader.first == name; });
    if (!known) shaders_.emplace_back(name, body);
  }

  /// The output with transformed texture coordinates; equal transforms share a shader.
  std::string coordinates(int tex_coord, const UvTransform& transform) {
    const std::string reader = "primvar_" + primvar(tex_coord);
    add(reader, line("uniform token info:id", "\"UsdPrimvarReader_float2\"") +
                    line("string inputs:varname", fmt::format("\"{}\"", primvar(tex_coord))) +
                    "                float2 outputs:result\n");
    const UsdTransform2d t = usd_transform(transform);
    if (t.scale == V2d(1, 1) && t.rotation == 0 && t.translation == V2d(0, 0))
      return output(reader, "result");
    const std::string body =
        line("uniform token info:id", "\"UsdTransform2d\"") +
        line("float2 inputs:in.connect", output(reader, "result")) +
        line("float inputs:rotation", t.rotation) +
        line("float2 inputs:scale", fmt::format("({}, {})", t.scale.x, t.scale.y)) +
        line("float2 inputs:translation", fmt::format("({}, {})", t.translation.x, t.translation.y)) +
        "                float2 outputs:result\n";
    for (const auto& [name, present] : shaders_)
      if (present == body) return output(name, "result");
    const std::string name = fmt::format("transform_{}", transforms_++);
    add(name, body);
    return output(name, "result");
  }

  std::string wrap(const Json& texture, const char* key) const {
    const Json& sampler = root_entry(document_, "samplers", index_of(member(texture, "sampler")));
    const int mode = index_of(member(sampler, key));
    return mode == 33071 ? "\"clamp\"" : mode == 33648 ? "\"mirror\"" : "\"repeat\"";
  }

  /// A texture as the shader `name`; false without a texture or its picture.
  bool texture(const char* name, const Json& info, const std::string& more) {
    const Json& json = root_entry(document_, "textures", index_of(member(info, names::gltf::index)));
    const std::string file = json.is_null() ? "" : assets_.image(index_of(member(json, "source")));
    if (file.empty()) return false;
    const auto [set, transform] = read_texture_mapping(info);
    const std::string st = coordinates(set, transform);
    add(name, line("uniform token info:id", "\"UsdUVTexture\"") + line("asset inputs:file", asset(file)) +
                  more + line("float2 inputs:st.connect", st) +
                  line("token inputs:wrapS", wrap(json, "wrapS")) +
                  line("token inputs:wrapT", wrap(json, "wrapT")) +
                  "                float outputs:a\n                float3 outputs:rgb\n");
    return true;
  }

  /// The inputs of the UsdPreviewSurface, and the textures behind them.
  std::string surface_of(const Json& json, const SceneMaterial& material) {
    const Json& core = member(json, "pbrMetallicRoughness");
    const V4f& color = material.base_color;
    std::string scale;
    if (color != V4f(1, 1, 1, 1))
      scale =
          line("float4 inputs:scale", fmt::format("({}, {}, {}, {})", color.x, color.y, color.z, color.w));
    const bool textured = texture("base_color", member(core, names::gltf::base_color_texture),
                                  scale + line("token inputs:sourceColorSpace", "\"sRGB\""));
    std::string text = line("uniform token info:id", "\"UsdPreviewSurface\"");
    text += textured ? line("color3f inputs:diffuseColor.connect", output("base_color", "rgb"))
                     : line("color3f inputs:diffuseColor", text_of(V3f(color.x, color.y, color.z)));
    if (const Json& glow = member(json, "emissiveFactor"); glow.is_array() && glow.size() == 3)
      text += line("color3f inputs:emissiveColor", fmt::format("({}, {}, {})", number_or(glow[0], 0),
                                                               number_or(glow[1], 0), number_or(glow[2], 0)));
    text += line("float inputs:metallic", number_or(member(core, "metallicFactor"), 1));
    const Json& normal = member(json, "normalTexture");
    const double bumps = number_or(member(normal, "scale"), 1);
    const std::string decoding =
        line("float4 inputs:bias", fmt::format("({}, {}, -1, 0)", -bumps, -bumps)) +
        line("float4 inputs:scale", fmt::format("({}, {}, 2, 1)", 2 * bumps, 2 * bumps)) +
        line("token inputs:sourceColorSpace", "\"raw\"");
    if (texture("normal", normal, decoding))
      text += line("normal3f inputs:normal.connect", output("normal", "rgb"));
    if (material.alpha_mode != AlphaMode::opaque)
      text += textured ? line("float inputs:opacity.connect", output("base_color", "a"))
                       : line("float inputs:opacity", color.w);
    if (material.alpha_mode == AlphaMode::mask)
      text += line("float inputs:opacityThreshold", material.alpha_cutoff);
    text += line("float inputs:roughness", number_or(member(core, "roughnessFactor"), 1));
    return text + "                token outputs:surface\n";
  }

  const GltfDocument& document_;
  std::string path_;
  Assets& assets_;
  std::vector<std::pair<std::string, std::string>> shaders_;
  int transforms_ = 0;
};

std::string transform_of(const M44d& m) {
  if (m == M44d()) return {};
  const auto row = [&](int i) { return fmt::format("({}, {}, {}, {})", m[i][0], m[i][1], m[i][2], m[i][3]); };
  return fmt::format(
      "        matrix4d xformOp:transform = ( {}, {}, {}, {} )\n"
      "        uniform token[] xformOpOrder = [\"xformOp:transform\"]\n",
      row(0), row(1), row(2), row(3));
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
  line("int[] faceVertexCounts", list(std::vector<int>(primitive.indices.size() / 3, 3)));
  line("int[] faceVertexIndices", list(primitive.indices));
  if (!binding.empty()) line("rel material:binding", "<" + binding + ">");
  if (!primitive.normals.empty()) per_vertex("normal3f[] normals", list(primitive.normals, text_of));
  line("point3f[] points", list(primitive.positions, text_of));
  for (std::size_t set = 0; set < primitive.tex_coords.size(); ++set) {
    if (primitive.tex_coords[set].empty()) continue;
    per_vertex("texCoord2f[] primvars:" + primvar(static_cast<int>(set)),
               list(primitive.tex_coords[set], [](const V2d& uv) {
                 return fmt::format("({}, {})", static_cast<float>(uv.x), static_cast<float>(1.0 - uv.y));
               }));
  }
  line("uniform token subdivisionScheme", "\"none\"");
  return text + transform_of(world) + "    }\n\n";
}

/// Many instances of a mesh, of its text; nothing if one has no position, rotation and scale.
std::optional<std::string> point_instancer(const std::vector<M44d>& worlds, const std::string& name,
                                           const std::string& prototype) {
  std::vector<std::string> positions, orientations, scales;
  Imath::Box3d box;
  for (const M44d& world : worlds) box.extendBy(world.translation());
  const V3d origin = origin_of(box);
  for (const M44d& world : worlds) {
    V3d scale, shear, translation;
    Imath::Quatd turn;
    M44d rest = world;
    constexpr double min_shear = 5e-3;  // of quaternions in steps, which are not quite unit
    if (world.determinant() <= 0 || !Imath::extractAndRemoveScalingAndShear(rest, scale, shear, false) ||
        shear.length() > min_shear)
      return {};
    turn = Imath::extractQuat(rest);
    positions.push_back(text_of(V3f(world.translation() - origin)));
    orientations.push_back(
        fmt::format("({:.4f}, {:.4f}, {:.4f}, {:.4f})", turn.r, turn.v.x, turn.v.y, turn.v.z));
    scales.push_back(text_of(V3f(scale)));
  }
  return fmt::format(
      "    def PointInstancer \"{}\"\n    {{\n"
      "        point3f[] positions = {}\n        quath[] orientations = {}\n        float3[] scales = {}\n"
      "        int[] protoIndices = {}\n        rel prototypes = </Garment/{}/prototype>\n{}\n{}    }}\n\n",
      name, list(positions), list(orientations), list(scales), list(std::vector<int>(worlds.size())), name,
      transform_of(M44d().setTranslation(origin)), prototype);
}

std::string basis_curves(const UsdCurves& curves, const std::string& name) {
  std::vector<V3f> points;
  for (const std::vector<V3f>& one : curves.points) points.insert(points.end(), one.begin(), one.end());
  const auto count_of = [](const std::vector<V3f>& one) { return one.size(); };
  const char* constant = " (\n            interpolation = \"constant\"\n        )\n";
  return fmt::format(
      "    def BasisCurves \"{}\"\n    {{\n"
      "        uniform token basis = \"catmullRom\"\n        int[] curveVertexCounts = {}\n"
      "        float3[] extent = {}\n        point3f[] points = {}\n"
      "        color3f[] primvars:displayColor = [{}]{}        uniform token type = \"cubic\"\n"
      "        float[] widths = [{}]{}        uniform token wrap = \"pinned\"\n{}    }}\n\n",
      name, list(curves.points, count_of), extent_of(points), list(points, text_of), text_of(curves.color),
      constant, curves.width, constant, transform_of(M44d().setTranslation(curves.origin)));
}

/// Refuses to overwrite a picture of the garment.
Result<void> check_names(const GltfDocument& document, const UsdFiles& files) {
  for (const Json& image : array_member(document.json, "images")) {
    const std::string uri = string_of(member(image, "uri"));
    if (uri.empty()) continue;
    const Result<std::string> path = resolve_uri(document, uri, "");
    std::error_code ignored;
    for (const UsdFile& file : files.files)
      if (path && fs::equivalent(*path, file.path, ignored))
        return fail(Code::file_unwritable, file.path, "", "is a picture of the garment");
  }
  return {};
}

}  // namespace

V3d origin_of(const Imath::Box3d& box) {
  return box.isEmpty() || box.center().length() <= box.size().length() ? V3d(0, 0, 0) : box.center();
}

Result<UsdFiles> usd_of(const GltfDocument& document, const std::string& path, const SceneLimits& limits,
                        const std::vector<UsdCurves>& curves) {
  if (!has_ending(path, ".usda"))
    return fail(Code::option_out_of_range, path, "", "the name of a USD layer has to end in .usda");
  const Result<Scene> scene = read_scene(document, limits);
  if (!scene) return tl::unexpected<Error>(scene.error());
  Assets assets(document, *scene, path);
  Identifiers names;
  const std::string materials_name = names.make("Materials", "");
  Identifiers material_names;
  std::map<int, std::string> bindings;
  std::string meshes;
  std::string materials;
  std::map<int, std::vector<M44d>> worlds;  // of each primitive
  for (const SceneInstance& instance : scene->instances) worlds[instance.primitive].push_back(instance.world);
  for (const SceneInstance& instance : scene->instances) {
    const ScenePrimitive& primitive = scene->primitives[instance.primitive];
    if (primitive.positions.empty()) continue;
    std::vector<M44d>& own = worlds[instance.primitive];
    if (own.empty()) continue;
    const SceneMaterial* material = primitive.material < 0 ? nullptr : &scene->materials[primitive.material];
    std::string binding;
    if (material != nullptr) {
      const auto [entry, fresh] = bindings.try_emplace(primitive.material);
      if (fresh) {
        const std::string name = material_names.make(material->name, "material");
        entry->second = fmt::format("/Garment/{}/{}", materials_name, name);
        if (!materials.empty()) materials += "\n";
        materials += MaterialPrim(document, entry->second, assets)
                         .write(name, document.json["materials"][primitive.material], *material);
      }
      binding = entry->second;
    }
    const bool two_sided = material != nullptr && material->double_sided;
    const std::string name = names.make(primitive.name, "mesh");
    constexpr std::size_t many = 8;
    if (own.size() >= many) {
      if (const auto text =
              point_instancer(own, name, mesh(primitive, {}, "prototype", binding, two_sided))) {
        meshes += *text;
        own.clear();
        continue;
      }
    }
    meshes += mesh(primitive, instance.world, name, binding, two_sided);
  }
  for (const UsdCurves& one : curves) meshes += basis_curves(one, names.make(one.name, "curves"));
  const std::string text = fmt::format(
      "#usda 1.0\n(\n    defaultPrim = \"Garment\"\n    metersPerUnit = 1\n    upAxis = \"Y\"\n)\n\n"
      "def Xform \"Garment\"\n{{\n{}    def Scope \"{}\"\n    {{\n{}    }}\n}}\n",
      meshes, materials_name, materials);
  UsdFiles result = assets.take();
  if (std::ranges::any_of(scene->primitives, [](const ScenePrimitive& p) { return !p.colors.empty(); }))
    result.remarks.emplace_back("vertex colours are left out of the USD layer");
  if (Result<void> good = check_names(document, result); !good)
    return tl::unexpected<Error>(std::move(good.error()));
  result.files.push_back({path, std::vector<std::uint8_t>(text.begin(), text.end())});
  return result;
}

std::vector<AtomicFile> stage_files(const UsdFiles& files) {
  std::vector<AtomicFile> result;
  for (const UsdFile& file : files.files) result.push_back(value_or_throw(stage_file(file.path, file.bytes)));
  return result;
}

// With t = 1 - v, and the rotation of UvTransform::apply_linear.
UsdTransform2d usd_transform(const UvTransform& transform) {
  const double c = std::cos(transform.rotation);
  const double s = std::sin(transform.rotation);
  return {.scale = transform.scale,
          .rotation = transform.rotation * 180.0 / std::numbers::pi,
          .translation = V2d(transform.offset.x + s * transform.scale.y,
                             1.0 - transform.offset.y - c * transform.scale.y)};
}

}  // namespace selvedge
