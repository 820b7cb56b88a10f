#include "converter/dress/usd_material.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "format/gltf/access.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/names.h"

namespace selvedge {
namespace {

/// Writes the shaders of one material on demand.
class Network {
 public:
  Network(const GltfDocument& document, std::string path, UsdAssets& assets)
      : document_(document), path_(std::move(path)), assets_(assets) {}

  /// The output with transformed texture coordinates; equal transforms share a shader.
  std::string coordinates(int tex_coord, const UvTransform& transform) {
    const std::string reader = fmt::format("primvar_{}", usd_primvar(tex_coord));
    add(reader, fmt::format("                uniform token info:id = \"UsdPrimvarReader_float2\"\n"
                            "                string inputs:varname = \"{}\"\n"
                            "                float2 outputs:result\n",
                            usd_primvar(tex_coord)));
    const UsdTransform2d t = usd_transform(transform);
    if (t.scale == V2d(1, 1) && t.rotation == 0 && t.translation == V2d(0, 0))
      return output(reader, "result");
    const std::string body = fmt::format(
        "                uniform token info:id = \"UsdTransform2d\"\n"
        "                float2 inputs:in.connect = {}\n"
        "                float inputs:rotation = {}\n"
        "                float2 inputs:scale = ({}, {})\n"
        "                float2 inputs:translation = ({}, {})\n"
        "                float2 outputs:result\n",
        output(reader, "result"), t.rotation, t.scale.x, t.scale.y, t.translation.x, t.translation.y);
    for (const auto& [name, present] : shaders_) {
      if (present == body) return output(name, "result");
    }
    const std::string name = fmt::format("transform_{}", transforms_++);
    add(name, body);
    return output(name, "result");
  }

  /// A texture as the shader `name`; false without a texture or its picture.
  bool texture(const char* name, const Json& info, const std::string& more) {
    if (!info.is_object()) return false;
    const Json& json = entry_of(document_, "textures", index_of(member(info, names::gltf::index)));
    if (json.is_null()) return false;
    const std::string file = assets_.image(index_of(member(json, "source")));
    if (file.empty()) return false;
    int set = std::max(0, index_of(member(info, names::gltf::tex_coord)));
    const UvTransform transform = read_uv_transform(info, set);
    const std::string st = coordinates(set, transform);
    add(name, fmt::format("                uniform token info:id = \"UsdUVTexture\"\n"
                          "                asset inputs:file = {}\n"
                          "{}"
                          "                float2 inputs:st.connect = {}\n"
                          "                token inputs:wrapS = \"{}\"\n"
                          "                token inputs:wrapT = \"{}\"\n"
                          "                float outputs:a\n"
                          "                float3 outputs:rgb\n",
                          usd_asset(file), more, st, wrap(json, "wrapS"), wrap(json, "wrapT")));
    return true;
  }

  std::string output(const std::string& shader, const char* name) const {
    return fmt::format("<{}/{}.outputs:{}>", path_, shader, name);
  }

  void add(const std::string& name, const std::string& body) {
    for (const auto& shader : shaders_) {
      if (shader.first == name) return;
    }
    shaders_.emplace_back(name, body);
  }

  std::string text() const {
    std::string text;
    for (const auto& [name, body] : shaders_) {
      text += fmt::format("\n            def Shader \"{}\"\n            {{\n{}            }}\n", name, body);
    }
    return text;
  }

 private:
  const char* wrap(const Json& texture, const char* key) const {
    const Json& sampler = entry_of(document_, "samplers", index_of(member(texture, "sampler")));
    const int mode = index_of(member(sampler, key));
    return mode == 33071 ? "clamp" : mode == 33648 ? "mirror" : "repeat";
  }

  const GltfDocument& document_;
  std::string path_;
  UsdAssets& assets_;
  std::vector<std::pair<std::string, std::string>> shaders_;
  int transforms_ = 0;
};

/// The inputs of the UsdPreviewSurface, and the textures behind them.
std::string surface(Network& network, const Json& json, const SceneMaterial& material) {
  const Json& core = member(json, "pbrMetallicRoughness");
  const V4f& color = material.base_color;
  const std::string scale = color == V4f(1, 1, 1, 1)
                                ? ""
                                : fmt::format("                float4 inputs:scale = ({}, {}, {}, {})\n",
                                              color.x, color.y, color.z, color.w);
  const bool textured = network.texture("base_color", member(core, names::gltf::base_color_texture),
                                        scale + "                token inputs:sourceColorSpace = \"sRGB\"\n");
  std::string text = "                uniform token info:id = \"UsdPreviewSurface\"\n";
  if (textured) {
    text += fmt::format("                color3f inputs:diffuseColor.connect = {}\n",
                        network.output("base_color", "rgb"));
  } else {
    text += fmt::format("                color3f inputs:diffuseColor = ({}, {}, {})\n", color.x, color.y,
                        color.z);
  }
  if (const Json& glow = member(json, "emissiveFactor"); glow.is_array() && glow.size() == 3) {
    text += fmt::format("                color3f inputs:emissiveColor = ({}, {}, {})\n",
                        number_of(glow[0], 0), number_of(glow[1], 0), number_of(glow[2], 0));
  }
  text += fmt::format("                float inputs:metallic = {}\n",
                      number_of(member(core, "metallicFactor"), 1));
  const Json& normal = member(json, "normalTexture");
  const double bumps = number_of(member(normal, "scale"), 1);
  const std::string decoding = fmt::format(
      "                float4 inputs:bias = ({}, {}, -1, 0)\n"
      "                float4 inputs:scale = ({}, {}, 2, 1)\n"
      "                token inputs:sourceColorSpace = \"raw\"\n",
      -bumps, -bumps, 2 * bumps, 2 * bumps);
  if (network.texture("normal", normal, decoding)) {
    text +=
        fmt::format("                normal3f inputs:normal.connect = {}\n", network.output("normal", "rgb"));
  }
  if (material.alpha_mode != AlphaMode::opaque) {
    text += textured ? fmt::format("                float inputs:opacity.connect = {}\n",
                                   network.output("base_color", "a"))
                     : fmt::format("                float inputs:opacity = {}\n", color.w);
  }
  if (material.alpha_mode == AlphaMode::mask) {
    text += fmt::format("                float inputs:opacityThreshold = {}\n", material.alpha_cutoff);
  }
  text += fmt::format("                float inputs:roughness = {}\n",
                      number_of(member(core, "roughnessFactor"), 1));
  return text + "                token outputs:surface\n";
}

}  // namespace

// With t = 1 - v, and the rotation of UvTransform::apply_linear.
UsdTransform2d usd_transform(const UvTransform& transform) {
  const double c = std::cos(transform.rotation);
  const double s = std::sin(transform.rotation);
  UsdTransform2d result;
  result.scale = transform.scale;
  result.rotation = transform.rotation * 180.0 / std::numbers::pi;
  result.translation =
      V2d(transform.offset.x + s * transform.scale.y, 1.0 - transform.offset.y - c * transform.scale.y);
  return result;
}

std::string usd_primvar(int tex_coord) { return tex_coord == 0 ? "st" : fmt::format("st{}", tex_coord); }

std::string usd_asset(const std::string& path) {
  const char* quotes = path.find('@') == std::string::npos ? "@" : "@@@";
  return fmt::format("{}{}{}", quotes, path, quotes);
}

std::string usd_material(const GltfDocument& document, const Json& json, const SceneMaterial& material,
                         const std::string& name, const std::string& path, UsdAssets& assets) {
  Network network(document, path, assets);
  const std::string inputs = surface(network, json, material);
  std::string text = fmt::format("        def Material \"{}\"\n        {{\n", name);
  if (material.fabric) {
    if (const std::string file = assets.fabric(material.fabric->fabric); !file.empty()) {
      const FabricReference& reference = *material.fabric;
      text += fmt::format(
          "            custom asset selvedge:fabric:file = {}\n"
          "            custom float2 selvedge:fabric:st.connect = {}\n",
          usd_asset(file), network.coordinates(reference.tex_coord, reference.transform));
    }
  }
  network.add("surface", inputs);
  text +=
      fmt::format("            token outputs:surface.connect = {}\n", network.output("surface", "surface"));
  return text + network.text() + "        }\n";
}

}  // namespace selvedge
