#include "converter/dress/choose_materials.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <set>
#include <string_view>

#include "format/base/guard.h"
#include "format/gltf/access.h"
#include "format/gltf/material_uses.h"

namespace selvedge {
namespace {

/// Words that name no cloth, in the singular.
constexpr std::array<std::string_view, 17> no_cloth{
    "button",  "zip",   "zipper", "sole",   "skin",  "hair",   "eye",        "eyelash", "eyebrow",
    "eyeball", "tooth", "teeth",  "buckle", "rivet", "eyelet", "fingernail", "backing"};

/// The first word of a name that says that it is no cloth; empty if none does. Words end where letters do,
/// and before a capital letter after a small one.
std::string no_cloth_word(const std::string& name) {
  std::string word;
  for (std::size_t i = 0; i <= name.size(); ++i) {
    const auto letter = static_cast<unsigned char>(i < name.size() ? name[i] : ' ');
    const bool starts =
        i > 0 && std::isupper(letter) != 0 && std::islower(static_cast<unsigned char>(name[i - 1])) != 0;
    if (std::isalpha(letter) == 0 || starts) {
      for (const std::string_view plural : {"", "s", "es"}) {
        if (!word.ends_with(plural)) continue;
        const std::string_view singular = std::string_view(word).substr(0, word.size() - plural.size());
        if (std::ranges::find(no_cloth, singular) != no_cloth.end()) return word;
      }
      word.clear();
    }
    if (std::isalpha(letter) != 0) word += static_cast<char>(std::tolower(letter));
  }
  return "";
}

class Chooser {
 public:
  explicit Chooser(GltfDocument& document) : document_(document) {}

  ChosenMaterials choose(const MaterialChoice& choice) {
    if (choice.all) add_missing_material();
    std::set<int> chosen;
    ChosenMaterials result;
    const Uses uses = uses_of(document_.json);
    for (int i = 0; choice.all && i < count(); ++i) {
      const std::string word = no_cloth_word_of(i, uses);
      if (word.empty())
        chosen.insert(i);
      else
        result.left_alone.push_back(
            fmt::format("material #{} \"{}\" was left alone: a \"{}\" is no cloth; --material dresses it", i,
                        name_of(i), word));
    }
    for (const std::string& selector : choice.materials) chosen.merge(find(selector));
    for (const std::string& selector : choice.except) {
      for (const int material : find(selector)) chosen.erase(material);
    }
    if (chosen.empty()) {
      const bool any = !result.left_alone.empty() || !choice.except.empty();
      throw Failure{Error{Code::material_missing, document_.file, "/materials",
                          any          ? "all materials are left alone"
                          : choice.all ? "there are no triangles to dress"
                                       : "no material is named"}};
    }
    result.materials.assign(chosen.begin(), chosen.end());
    return result;
  }

 private:
  const Json& materials() const { return array_of(document_.json, "materials"); }
  int count() const { return static_cast<int>(materials().size()); }
  std::string name_of(int material) const { return string_of(member(materials()[material], "name")); }

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

  std::string no_cloth_word_of(int material, const Uses& uses) const {
    std::string word = no_cloth_word(name_of(material));
    const auto places = uses.find(material);
    if (!word.empty() || places == uses.end()) return word;
    for (const Place& place : places->second) {
      word = no_cloth_word(string_of(member(document_.json["meshes"][place.first], "name")));
      if (word.empty()) break;
    }
    return word;
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
