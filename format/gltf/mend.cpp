#include "format/gltf/mend.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <set>
#include <string_view>

#include "format/base/guard.h"
#include "format/base/json_text.h"
#include "format/gltf/access.h"
#include "format/gltf/references.h"

namespace selvedge {
namespace {

/// "TEXCOORD" and 2 of "TEXCOORD_2"; nothing of other names.
std::optional<std::pair<std::string, int>> numbered(const std::string& semantic) {
  for (const std::string_view set : {"TEXCOORD", "COLOR", "JOINTS", "WEIGHTS"}) {
    if (!semantic.starts_with(set) || semantic.size() < set.size() + 2 || semantic[set.size()] != '_')
      continue;
    const std::string digits = semantic.substr(set.size() + 1);
    int number = -1;
    const char* end = digits.data() + digits.size();
    if (std::from_chars(digits.data(), end, number).ptr != end || std::to_string(number) != digits) continue;
    return std::pair(std::string(set), number);
  }
  return std::nullopt;
}

class Mender {
 public:
  explicit Mender(GltfDocument& document) : document_(document), root_(document.json) {}

  std::vector<std::string> mend() {
    need_views();
    mend_meshes();
    const Json& skins = array_of(root_, "skins");
    for (std::size_t i = 0; i < skins.size(); ++i)
      need_items(skins[i], "joints", fmt::format("/skins/{}", i));
    if (root_.contains("animations") && root_["animations"].is_array()) drop_still_animations();
    clean(root_, "");
    if (!root_.contains("scenes")) root_.erase("scene");
    need_references();
    std::vector<std::string> lines;
    for (const auto& [kind, found] : left_out_) {
      lines.push_back(
          fmt::format("left out: {}, which {}{}", found.first, kind,
                      found.second > 1 ? fmt::format(", and {} more like it", found.second - 1) : ""));
    }
    return lines;
  }

 private:
  void leave_out(const char* kind, const std::string& place) {
    auto& [first, count] = left_out_[kind];
    if (count++ == 0) first = place;
  }

  /// Those that nothing uses as well: what is written has to hold the bytes of all.
  void need_views() const {
    GltfReader reader(document_);
    for (std::size_t i = 0; i < array_of(root_, "bufferViews").size(); ++i)
      reader.bytes(static_cast<int>(i), fmt::format("/bufferViews/{}", i));
    if (reader.fault) throw Failure{*reader.fault};
  }

  void need_references() const {
    IssueSink issues(document_.file);
    check_references(document_, issues);
    if (issues.has_error()) throw Failure{issues.first_error()};
  }

  void need_items(const Json& owner, const char* list, const std::string& place) const {
    const Json& items = member(owner, list);
    if (items.is_array() && !items.empty()) return;
    throw Failure{Error{Code::gltf_malformed, document_.file, place + "/" + list,
                        items.is_array() ? "is empty" : "is no list"}};
  }

  void mend_meshes() {
    for (std::size_t m = 0; m < array_of(root_, "meshes").size(); ++m) {
      Json& mesh = root_["meshes"][m];
      need_items(mesh, "primitives", fmt::format("/meshes/{}", m));
      for (std::size_t p = 0; p < array_of(mesh, "primitives").size(); ++p) {
        Json& primitive = mesh["primitives"][p];
        const std::string place = fmt::format("/meshes/{}/primitives/{}", m, p);
        if (member(primitive, "attributes").is_object())
          need_no_gap(mend_attributes(primitive["attributes"], place + "/attributes"), place + "/attributes");
        for (std::size_t t = 0; t < array_of(primitive, "targets").size(); ++t) {
          if (primitive["targets"][t].is_object())
            mend_attributes(primitive["targets"][t], fmt::format("{}/targets/{}", place, t));
        }
      }
    }
  }

  using Sets = std::map<std::string, std::set<int>>;  ///< numbers by names such as "TEXCOORD"

  /// Returns what is left of the numbered ones.
  Sets mend_attributes(Json& attributes, const std::string& place) {
    constexpr std::array<std::string_view, 3> plain{"POSITION", "NORMAL", "TANGENT"};
    Sets sets;
    for (auto it = attributes.begin(); it != attributes.end();) {
      if (it->is_null()) {  // gone before gaps are looked for, which it would hide
        leave_out("is null", pointer_to(place, it.key()));
        it = attributes.erase(it);
        continue;
      }
      const auto semantic = numbered(it.key());
      if (semantic) sets[semantic->first].insert(semantic->second);
      const bool known = semantic || it.key().starts_with('_') ||
                         std::find(plain.begin(), plain.end(), it.key()) != plain.end();
      if (!known) leave_out("is no attribute of glTF", pointer_to(place, it.key()));
      it = known ? std::next(it) : attributes.erase(it);
    }
    return sets;
  }

  void need_no_gap(const Sets& sets, const std::string& place) const {
    for (const auto& [set, numbers] : sets) {
      int next = 0;
      for (const int number : numbers) {
        if (number != next++) {
          throw Failure{Error{Code::gltf_malformed, document_.file, place,
                              fmt::format("{}_{} without {}_{}", set, number, set, number - 1)}};
        }
      }
    }
  }

  void drop_still_animations() {
    Json moving = Json::array();
    for (std::size_t i = 0; i < root_["animations"].size(); ++i) {
      Json& animation = root_["animations"][i];
      const auto is_still = [&](const char* list) {
        return member(animation, list).is_array() && animation[list].empty();
      };
      if (is_still("channels") || is_still("samplers"))
        leave_out("moves nothing", fmt::format("/animations/{}", i));
      else
        moving.push_back(std::move(animation));
    }
    root_["animations"] = std::move(moving);
  }

  /// What is wrong with a member that can be left out; null where nothing is.
  static const char* fault_of(const std::string& key, const Json& value) {
    const bool is_text = key == "name" || key == "generator" || key == "copyright";
    return value.is_null()                     ? "is null"
           : value.is_array() && value.empty() ? "has no items"
           : is_text && !value.is_string()     ? "is no string"
                                               : nullptr;
  }

  void clean(Json& json, const std::string& place) {
    if (json.is_array()) {
      for (std::size_t i = 0; i < json.size(); ++i) {
        if (json[i].is_structured()) clean(json[i], fmt::format("{}/{}", place, i));
      }
    }
    if (!json.is_object()) return;
    for (auto it = json.begin(); it != json.end();) {
      if (it.key() == "extras" || it.key() == "extensions") {
        ++it;
        continue;
      }
      const char* fault = fault_of(it.key(), *it);
      if (fault != nullptr) leave_out(fault, pointer_to(place, it.key()));
      if (fault == nullptr && it->is_structured()) clean(*it, pointer_to(place, it.key()));
      it = fault == nullptr ? std::next(it) : json.erase(it);
    }
  }

  GltfDocument& document_;
  Json& root_;
  std::map<std::string, std::pair<std::string, int>> left_out_;  ///< by kind: the first place, and how many
};

}  // namespace

Result<std::vector<std::string>> mend(GltfDocument& document) {
  try {
    return Mender(document).mend();
  } catch (const Failure& failure) {
    return tl::unexpected(failure.error);
  }
}

}  // namespace selvedge
