#include "converter/dress/choose_materials.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <map>
#include <set>
#include <span>
#include <string_view>

#include "format/base/guard.h"
#include "format/gltf/access.h"
#include "format/gltf/material_uses.h"

namespace selvedge {
namespace {

using Words = std::span<const std::string_view>;

// Words in the singular.
/// Things that are no cloth.
constexpr std::array<std::string_view, 36> things{
    "button", "zip",    "zipper",  "sole",   "buckle",     "rivet",   "eyelet", "hook",    "snap",
    "lens",   "mirror", "backing", "chain",  "wall",       "floor",   "window", "door",    "skin",
    "hair",   "eye",    "eyelash", "cornea", "eyebrow",    "eyeball", "tooth",  "teeth",   "tongue",
    "lash",   "brow",   "mouth",   "nail",   "fingernail", "toenail", "jewel",  "diamond", "iris"};
/// Substances that are no cloth: but cloth may be golden.
constexpr std::array<std::string_view, 23> substances{
    "glass", "metal",  "steel",     "iron",     "chrome", "brass",   "gold",   "silver",
    "pearl", "copper", "aluminium", "aluminum", "wood",   "wooden",  "oak",    "walnut",
    "stone", "marble", "brick",     "concrete", "rubber", "plastic", "crystal"};
constexpr std::array<std::string_view, 12> cloths{"fabric", "cloth", "textile", "cotton",
                                                  "denim",  "silk",  "satin",   "velvet",
                                                  "wool",   "linen", "canvas",  "jersey"};
/// Parts of a body, beside a word of people: alone, a body may be a bodice.
constexpr std::array<std::string_view, 8> body{"body", "head", "face", "hand", "arm", "leg", "foot", "feet"};
constexpr std::array<std::string_view, 8> people{"skin",    "hair",  "eye",   "eyelash",
                                                 "eyebrow", "tooth", "teeth", "eyeball"};
/// Parts of furniture, beside a word of cloth.
constexpr std::array<std::string_view, 4> furniture{"leg", "foot", "feet", "frame"};

/// The first word of a name that is one of `words`; empty without. Words end where letters do, and before a
/// capital letter after a small one.
std::string word_in(const std::string& name, Words words) {
  std::string word;
  for (std::size_t i = 0; i <= name.size(); ++i) {
    const auto letter = static_cast<unsigned char>(i < name.size() ? name[i] : ' ');
    const bool starts =
        i > 0 && std::isupper(letter) != 0 && std::islower(static_cast<unsigned char>(name[i - 1])) != 0;
    if (std::isalpha(letter) == 0 || starts) {
      for (const std::string_view plural : {"", "s", "es"}) {
        if (!word.ends_with(plural)) continue;
        const std::string_view singular = std::string_view(word).substr(0, word.size() - plural.size());
        if (std::ranges::find(words, singular) != words.end()) return word;
      }
      word.clear();
    }
    if (std::isalpha(letter) != 0) word += static_cast<char>(std::tolower(letter));
  }
  return "";
}

/// Why the factors of a material are not cloth's; empty where they may be. A metallic factor beside a
/// texture, or without a roughness that polishes it, says nothing: programs forget to write 0.
std::string no_cloth_factors(const Json& material) {
  if (number_of(
          member(member(member(material, "extensions"), "KHR_materials_transmission"), "transmissionFactor"),
          0) > 0.5)
    return "light passes through it as through glass";
  const Json& core = member(material, "pbrMetallicRoughness");
  if (member(core, "metallicRoughnessTexture").is_null() &&
      number_of(member(core, "metallicFactor"), 0) > 0.5 &&
      number_of(member(core, "roughnessFactor"), 1) < 0.5)
    return "it is polished metal";
  return "";
}

class Chooser {
 public:
  explicit Chooser(GltfDocument& document) : document_(document) {}

  ChosenMaterials choose(const MaterialChoice& choice) {
    std::set<int> chosen;
    ChosenMaterials result;
    if (choice.all) chosen = find_cloth(result.left_alone);
    for (const std::string& selector : choice.materials) chosen.merge(find(selector));
    for (const std::string& selector : choice.except) {
      for (const int material : find(selector)) chosen.erase(material);
    }
    if (chosen.empty()) {
      throw Failure{Error{Code::material_missing, document_.file, "/materials",
                          !result.left_alone.empty() ? fmt::format("{}", fmt::join(result.left_alone, "; "))
                          : !choice.except.empty()   ? "all materials are left alone"
                          : choice.all               ? "there are no triangles to dress"
                                                     : "no material is named"}};
    }
    result.materials.assign(chosen.begin(), chosen.end());
    return result;
  }

 private:
  const Json& materials() const { return array_of(document_.json, "materials"); }
  int count() const { return static_cast<int>(materials().size()); }
  std::string name_of(int material) const { return string_of(member(materials()[material], "name")); }

  /// The materials that may be cloth, and a line for each that is not.
  std::set<int> find_cloth(std::vector<std::string>& left_alone) {
    add_missing_material();
    const Uses uses = uses_of(document_.json);
    std::set<int> worn;
    bool has_people = false;
    bool has_cloth = false;
    for (int i = 0; i < count(); ++i) {
      if (uses.contains(i)) worn.insert(i);
      has_people |= !word_in(name_of(i), people).empty();
      has_cloth |= !word_in(name_of(i), cloths).empty();
    }
    const auto word_of = [&](const std::string& name) {
      std::string word = word_in(name, things);
      if (word.empty() && word_in(name, cloths).empty()) word = word_in(name, substances);
      if (word.empty() && has_people) word = word_in(name, body);
      if (word.empty() && has_cloth) word = word_in(name, furniture);
      return word;
    };
    std::map<int, std::string> reasons;
    std::set<int> by_mesh;
    for (int i = 0; i < count(); ++i) {
      if (worn == std::set<int>{i}) continue;
      std::string word = word_of(name_of(i));
      std::string reason = word.empty() ? no_cloth_factors(materials()[i]) : "";
      if (word.empty() && reason.empty() && worn.contains(i)) {
        for (const Place& place : uses.at(i)) {
          word = word_of(string_of(member(document_.json["meshes"][place.first], "name")));
          if (word.empty()) break;
        }
        if (!word.empty()) by_mesh.insert(i);
      }
      if (!word.empty()) reason = fmt::format("a \"{}\" is no cloth", word);
      if (!reason.empty()) reasons[i] = reason;
    }
    if (std::ranges::all_of(worn, [&](int i) { return reasons.contains(i); })) {
      for (const int i : by_mesh) reasons.erase(i);
    }
    std::set<int> cloth;
    for (int i = 0; i < count(); ++i) {
      if (const auto reason = reasons.find(i); reason == reasons.end())
        cloth.insert(i);
      else
        left_alone.push_back(
            fmt::format("material #{} \"{}\" was left alone: {}; --material '#{}' dresses it", i, name_of(i),
                        reason->second, i));
    }
    return cloth;
  }

  /// Triangles without a material get a new one.
  void add_missing_material() {
    const Uses uses = uses_of(document_.json);
    const auto bare = uses.find(-1);
    if (bare == uses.end()) return;
    const auto primitive_at = [&](const Place& place) -> Json& {
      return document_.json["meshes"][place.first]["primitives"][place.second];
    };
    std::vector<Place> places(bare->second.begin(), bare->second.end());
    std::erase_if(places, [&](const Place& place) {
      return !member(primitive_at(place), "material").is_null();  // present, but not an index
    });
    if (places.empty()) return;
    document_.json["materials"].push_back(Json{{"name", "fabric"}});
    for (const Place& place : places)
      primitive_at(place)["material"] = document_.json["materials"].size() - 1;
  }

  std::set<int> find(const std::string& selector) const {
    int number = -1;
    if (selector.starts_with('#')) {
      const char* end = selector.data() + selector.size();
      if (std::from_chars(selector.data() + 1, end, number).ptr != end) number = -1;
    }
    std::set<int> found;
    if (number >= 0 && number < count()) found.insert(number);
    std::vector<std::string> names;
    for (int i = 0; i < count(); ++i) {
      if (name_of(i) == selector) found.insert(i);
      names.push_back(fmt::format("#{} \"{}\"", i, name_of(i)));
    }
    if (!found.empty()) return found;
    throw Failure{Error{Code::material_missing, document_.file, "/materials",
                        fmt::format("no material \"{}\"; there are: {}", selector,
                                    names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")))}};
  }

  GltfDocument& document_;
};

}  // namespace

Result<ChosenMaterials> choose_materials(GltfDocument& document, const MaterialChoice& choice) {
  return result_of([&] { return Chooser(document).choose(choice); });
}

}  // namespace selvedge
