#include "converter/dress/fallback.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "format/base/guard.h"
#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "format/gltf/edit.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/names.h"

namespace selvedge {

using namespace names::gltf;

namespace {

constexpr const char* sheen_lobe = "KHR_materials_sheen";
constexpr const char* transmission = "KHR_materials_diffuse_transmission";
constexpr const char* specular = "KHR_materials_specular";

/// Index of an equal entry of a root array; appends the entry if it is new.
int find_or_add(Json& root, const char* array, const Json& entry) {
  Json& entries = root[array];
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (entries[i] == entry) return static_cast<int>(i);
  }
  entries.push_back(entry);
  return static_cast<int>(entries.size()) - 1;
}

int find_or_add_image(GltfDocument& document, const std::vector<std::uint8_t>& bytes, const char* name) {
  const Json& images = member(document.json, "images");
  for (std::size_t i = 0; images.is_array() && i < images.size(); ++i) {
    const auto present =
        result_of([&] { return GltfReader(document).bytes(index_of(member(images[i], "bufferView")), ""); });
    if (present && std::equal(present->begin(), present->end(), bytes.begin(), bytes.end()))
      return static_cast<int>(i);
  }
  const int view = append_view(document, bytes);
  document.json["images"].push_back(Json{{"name", name}, {"mimeType", "image/png"}, {"bufferView", view}});
  return static_cast<int>(document.json["images"].size()) - 1;
}

bool occurs(const Json& json, const std::string& key) {
  if (json.is_object() && json.contains(key)) return true;
  return json.is_structured() &&
         std::ranges::any_of(json, [&](const Json& child) { return occurs(child, key); });
}

/// The fallback replaces every lobe; emission is not a lobe.
void drop_lobes(GltfDocument& document, Json& material) {
  if (!member(material, "extensions").is_object()) return;
  std::vector<std::string> dropped;
  for (const auto& [name, value] : material["extensions"].items()) {
    if (name.starts_with("KHR_materials_") && name != "KHR_materials_emissive_strength")
      dropped.push_back(name);
  }
  for (const std::string& name : dropped) material["extensions"].erase(name);
  if (material["extensions"].empty()) material.erase("extensions");
  for (const std::string& name : dropped) {
    if (!occurs(document.json, name)) drop_extension(document.json, name.c_str());
  }
}

constexpr int largest_side = 1024;
constexpr int yarn_side = 64;  ///< of the picture of a fabric with yarn, unless level 0 has more texels
constexpr int lights_of_integral = 256;

/// Weight of each light: equal parts of the hemisphere, corrected (by less than 1%) so that a Lambertian
/// texel gives exactly its albedo.
double weight_of(const std::vector<V3f>& lights) {
  double cosines = 0;
  for (const V3f& light : lights) cosines += light.z;
  return std::numbers::pi / cosines;
}

/// KHR_materials_sheen's lobe of colour 1 times the light's cosine: Charlie's distribution and Ashikhmin's
/// visibility term, as in the extension.
double charlie(const V3f& light, const V3f& view, double roughness) {
  const double inverse = 1.0 / (roughness * roughness);
  const double cosine = (light + view).normalized().z;
  const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  const double distribution = (2.0 + inverse) * std::pow(sine, inverse) / (2.0 * std::numbers::pi);
  const double l = light.z;
  const double v = view.z;
  return distribution / (4.0 * (l + v - l * v)) * l;
}

/// f(l, v) of a level, the mean over its texels by their opacity.
V3f mean_reflectance(const Fabric& fabric, int level, const V3f& light, const V3f& view) {
  const FabricLevel& source = fabric.levels[level];
  V3d sum(0, 0, 0);
  double weight = 0;
  for (int y = 0; y < source.height; ++y) {
    for (int x = 0; x < source.width; ++x) {
      const Shading shading = evaluate(fabric, level, x, y, light, view);
      sum += V3d(shading.radiance) * static_cast<double>(shading.alpha);
      weight += shading.alpha;
    }
  }
  return weight > 0 ? V3f(sum / weight) : V3f(0, 0, 0);
}

/// The normal equations of one channel: base colour and sheen against the fabric.
struct TwoLobes {
  double bb = 0, bs = 0, ss = 0, bf = 0, sf = 0;
  void add(double weight, double base, double sheen, double reflected) {
    bb += weight * base * base;
    bs += weight * base * sheen;
    ss += weight * sheen * sheen;
    bf += weight * base * reflected;
    sf += weight * sheen * reflected;
  }
  /// Base colour and sheen, neither below 0.
  std::array<double, 2> solve() const {
    const double sheen = (sf * bb - bf * bs) / std::max(ss * bb - bs * bs, 1e-30);
    if (!(sheen > 0)) return {std::max(bf / bb, 0.0), 0.0};
    return {std::max((bf - sheen * bs) / bb, 0.0), sheen};
  }
};

/// Fits base colour (which is returned) and sheen to the coarsest level over pairs of directions, by least
/// squares in radiance, weighted by the cosine of the view, as a pixel is. The sheen takes from the light
/// that the base gets, as the extension says, so that the fit is repeated.
V3f fit_lobes(const Fabric& fabric, Fallback& fallback) {
  const int coarsest = static_cast<int>(fabric.levels.size()) - 1;
  const std::vector<V3f> directions = directions_of(grid_of(36));
  const std::size_t count = directions.size();
  std::vector<V3f> reflected(count * count);
  std::vector<double> lobes(count * count);
  std::vector<double> of_sheen(count);  // directional albedo of a sheen of colour 1
  const double roughness = fallback.sheen_roughness;
  parallel_for(0, static_cast<int>(count), [&](int v) {
    double sum = 0;
    for (std::size_t l = 0; l < count; ++l) {
      reflected[v * count + l] = mean_reflectance(fabric, coarsest, directions[l], directions[v]);
      sum += lobes[v * count + l] = charlie(directions[l], directions[v], roughness);
    }
    of_sheen[v] = sum * weight_of(directions);
  });
  V3f base(0, 0, 0);
  const auto fit = [&](double largest) {
    std::array<TwoLobes, 3> channels;
    for (std::size_t v = 0; v < count; ++v) {
      for (std::size_t l = 0; l < count; ++l) {
        const double left = 1.0 - largest * std::max(of_sheen[v], of_sheen[l]);
        const double lambert = left * directions[l].z / std::numbers::pi;
        for (int c = 0; c < 3; ++c)
          channels[c].add(directions[v].z, lambert, lobes[v * count + l], reflected[v * count + l][c]);
      }
    }
    for (int c = 0; c < 3; ++c) {
      const auto [diffuse, sheen] = channels[c].solve();
      base[c] = static_cast<float>(std::min(diffuse, 1.0));
      fallback.sheen_color[c] = static_cast<float>(std::min(sheen, 1.0));
    }
    const V3f& color = fallback.sheen_color;
    return std::max({color.x, color.y, color.z});
  };
  float largest = 0;
  for (int round = 0; round < 4; ++round) largest = fit(largest);
  // Less than one step of an 8-bit colour is noise of the fit.
  if (largest < 1.0F / 255.0F) fallback.sheen_color = V3f(0, 0, 0);
  return base;
}

/// Fits diffuse transmission to light from behind, mean over all pairs of directions, weighted as a pixel is.
void fit_transmission(const Fabric& fabric, Fallback& fallback) {
  const Fabric* const through = fabric.side_of(Side::through);
  if (through == nullptr) return;
  const int coarsest = static_cast<int>(fabric.levels.size()) - 1;
  const std::vector<V3f> directions = directions_of(grid_of(36));
  V3d sum(0, 0, 0);
  double weight = 0;
  for (const V3f& view : directions) {
    for (const V3f& light : directions) {
      sum += V3d(mean_reflectance(*through, coarsest, light, view)) * static_cast<double>(view.z);
      weight += static_cast<double>(view.z * light.z) / std::numbers::pi;
    }
  }
  const V3f share(sum / weight);
  const float largest = std::min(1.0F, std::max({share.x, share.y, share.z}));
  // Less than one step of an 8-bit colour is noise of the fit.
  if (largest < 1.0F / 255.0F) return;
  fallback.transmission = largest;
  for (int c = 0; c < 3; ++c) fallback.transmission_color[c] = std::clamp(share[c] / largest, 0.0F, 1.0F);
}

/// Brings the mean colour of the picture to `mean`.
void scale_to(const V3f& mean, Image& image) {
  const V3f present = mean_color(image);
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    for (int c = 0; c < 3; ++c) {
      float& value = image.pixels[i + c];
      if (present[c] > 0) value = std::clamp(value * (mean[c] / present[c]), 0.0F, 1.0F);
    }
  }
}

/// Albedo along the normal and opacity of one repeat: of the yarn itself where the fabric has it, whose
/// levels are coarse, else of the texels of `level`.
Image base_picture(const Fabric& fabric, int level) {
  const FabricLevel& source = fabric.levels[level];
  const bool shows_yarn = level == 0 && source.yarns() != nullptr;
  const int longest = std::max(source.width, source.height);
  const int finer = shows_yarn ? std::max(1, yarn_side / longest) : 1;
  Image image{source.width * finer, source.height * finer, 4, {}};
  image.pixels.resize(4 * source.texels() * finer * finer);
  const std::vector<V3f> lights = directions_of(grid_of(lights_of_integral));
  const V3f up(0, 0, 1);
  parallel_for(0, image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const V2d uv((x + 0.5) / image.width, (y + 0.5) / image.height);
      const auto seen = [&](const V3f& light) {
        return evaluate(fabric, shows_yarn ? -1.0 : level, uv, light, up);
      };
      V3d sum(0, 0, 0);
      for (const V3f& light : lights) sum += V3d(seen(light).radiance);
      const V3f albedo(sum * weight_of(lights));
      float* pixel = image.pixels.data() + (y * image.width + x) * 4;
      for (int c = 0; c < 3; ++c) pixel[c] = albedo[c];
      pixel[3] = seen(up).alpha;
    }
  });
  return image;
}

void fill_holes(Image& image) {
  const V3f mean = mean_color(image);
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    if (image.pixels[i + 3] > 0) continue;
    for (int c = 0; c < 3; ++c) image.pixels[i + c] = mean[c];
  }
}

Image normals_of(const FabricLevel& level) {
  Image image{level.width, level.height, 3, {}};
  for (const TexelFrame& frame : level.frame()) {
    V3f normal = frame.normal;
    // glTF requires z > 0 in normal textures.
    normal.z = std::max(normal.z, 0.05F);
    normal.normalize();
    for (int c = 0; c < 3; ++c) image.pixels.push_back(normal[c] * 0.5F + 0.5F);
  }
  return image;
}

}  // namespace

V3f mean_color(const Image& image) {
  V3d sum(0, 0, 0);
  double weight = 0;
  const std::size_t channels = image.channels;
  for (std::size_t i = 0; i + channels <= image.pixels.size(); i += channels) {
    const double alpha = channels == 4 ? image.pixels[i + 3] : 1.0;
    sum += V3d(image.pixels[i], image.pixels[i + 1], image.pixels[i + 2]) * alpha;
    weight += alpha;
  }
  return weight > 0 ? V3f(sum / weight) : V3f(0, 0, 0);
}

Fallback bake_fallback(const Fabric& cloth) {
  int level = 0;
  while (level + 1 < static_cast<int>(cloth.levels.size()) &&
         std::max(cloth.levels[level].width, cloth.levels[level].height) > largest_side) {
    ++level;
  }
  const FabricLevel& source = cloth.levels[level];
  Fallback fallback;
  fallback.base_color = base_picture(cloth, level);
  fallback.albedo = mean_color(fallback.base_color);
  fallback.holes = has_holes(cloth, level);
  fit_transmission(cloth, fallback);
  // The extension takes the transmitted light from the base colour.
  const float left = std::max(1 - fallback.transmission, 1e-3F);
  scale_to(fit_lobes(cloth, fallback) / left, fallback.base_color);
  fill_holes(fallback.base_color);
  if (source.has(LayerKind::frame)) fallback.normal = normals_of(source);
  return fallback;
}

Result<FallbackTextures> add_fallback_textures(GltfDocument& document, const Fallback& fallback) {
  // Without holes alpha is only noise of the view table, and a picture without it is smaller.
  Image base = fallback.base_color;
  if (!fallback.holes) {
    base.channels = 3;
    std::size_t i = 0;
    std::erase_if(base.pixels, [&](float) { return i++ % 4 == 3; });
  }
  const int sampler =
      find_or_add(document.json, "samplers",
                  Json{{"magFilter", 9729}, {"minFilter", 9987}, {"wrapS", 10497}, {"wrapT", 10497}});
  const auto texture_of = [&](const std::vector<std::uint8_t>& png, const char* image_name) {
    const int source = find_or_add_image(document, png, image_name);
    return find_or_add(document.json, "textures", Json{{"sampler", sampler}, {"source", source}});
  };
  FallbackTextures textures;
  const auto color = encode_png(base, Transfer::srgb);
  if (!color) return tl::unexpected<Error>(color.error());
  textures.base_color = texture_of(*color, "fabric base colour");
  if (fallback.normal) {
    const auto normal = encode_png(*fallback.normal, Transfer::keep);
    if (!normal) return tl::unexpected<Error>(normal.error());
    textures.normal = texture_of(*normal, "fabric normals");
  }
  return textures;
}

void set_fallback(GltfDocument& document, int material, const Fallback& fallback,
                  const FallbackTextures& textures, const FabricReference& reference) {
  const auto part = [&](const char* member) -> const Json& { return part_of(document, material, member); };
  Json& json = document.json["materials"][material];
  drop_lobes(document, json);
  Json& core = json["pbrMetallicRoughness"];
  for (const char* key : {"baseColorFactor", "metallicRoughnessTexture"}) {
    if (core.contains(key)) core.erase(key);
  }
  V3f tint(1, 1, 1);
  for (std::size_t c = 0; c < 3 && part(tint_factor).is_array() && c < part(tint_factor).size(); ++c)
    tint[static_cast<int>(c)] = static_cast<float>(number_of(part(tint_factor)[c], 1));
  const bool masked = part(mask_texture).is_object();
  const char* const own = part(tint_texture).is_object() ? tint_texture : mask_texture;
  const bool has_own = part(own).is_object();
  const V3f factor = has_own ? mean_color(fallback.base_color) * tint : tint;
  const auto most_one = [](const V3f& x) {
    return Json::array({std::min(x.x, 1.0F), std::min(x.y, 1.0F), std::min(x.z, 1.0F)});
  };
  if (factor != V3f(1, 1, 1)) {
    core["baseColorFactor"] = most_one(factor);
    core["baseColorFactor"].push_back(1);
  }
  core["baseColorTexture"] =
      has_own ? part(own) : texture_info(textures.base_color, reference.tex_coord, reference.transform);
  core["metallicFactor"] = 0;
  core["roughnessFactor"] = 1;
  for (const char* key : {"normalTexture", "alphaMode", "alphaCutoff"}) {
    if (json.contains(key)) json.erase(key);
  }
  if (part(normal_texture).is_object()) {
    json["normalTexture"] = part(normal_texture);
  } else if (textures.normal >= 0) {
    json["normalTexture"] = texture_info(textures.normal, reference.tex_coord, reference.transform);
  }
  if (fallback.holes || masked) {
    json["alphaMode"] = "MASK";
    // The alpha of a tint does not belong to the cloth.
    json["alphaCutoff"] = masked ? number_of(part(mask_cutoff), 0.5) : has_own ? 0.0 : 0.5;
  }
  json["extensions"][specular] = {{"specularFactor", 0}};
  use_extension(document.json, specular);
  if (fallback.transmission > 0) {
    json["extensions"][transmission] = {
        {"diffuseTransmissionFactor", fallback.transmission},
        {"diffuseTransmissionColorFactor", most_one(fallback.transmission_color * tint)}};
    use_extension(document.json, transmission);
  }
  const V3f color = fallback.sheen_color * tint;
  if (color == V3f(0, 0, 0)) return;
  json["extensions"][sheen_lobe] = {{"sheenColorFactor", most_one(color)},
                                    {"sheenRoughnessFactor", fallback.sheen_roughness}};
  use_extension(document.json, sheen_lobe);
}

}  // namespace selvedge
