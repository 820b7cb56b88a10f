#include "converter/bake/pairs_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "format/base/atomic_file.h"
#include "format/samples/samples.h"

namespace selvedge {
namespace {

using nlohmann::json;

constexpr std::uintmax_t longest_file = std::uintmax_t{1} << 28;
constexpr std::size_t max_pairs = 65536;
constexpr double min_z = 1e-3;

Result<V3f> direction_at(const json& pair, const char* member, const std::string& path,
                         const std::string& place) {
  const std::string where = place + "/" + member;
  const auto refuse = [&](const char* why) { return fail(Code::json_malformed, path, where, why); };
  if (!pair.is_object() || !pair.contains(member)) return refuse("is missing");
  const json& list = pair[member];
  if (!list.is_array() || list.size() != 3) return refuse("is not three numbers");
  V3d d;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!list[i].is_number()) return refuse("is not three numbers");
    d[static_cast<unsigned>(i)] = list[i].get<double>();
  }
  const double length = d.length();
  if (!std::isfinite(length) || length == 0) return refuse("has no direction");
  if (d.z < min_z * length) return refuse("does not point above the cloth");
  return V3f(d / length);
}

}  // namespace

Result<std::array<std::vector<DirectionPair>, 3>> read_pairs(const std::string& path) {
  const auto text = read_file(path, longest_file);
  if (!text) return tl::unexpected(text.error());
  const json whole = json::parse(*text, nullptr, false);
  if (!whole.is_object()) return fail(Code::json_malformed, path, "", "is not a JSON object");
  std::array<std::vector<DirectionPair>, 3> sets;
  for (const auto& [member, list] : whole.items()) {
    const auto kind = std::find_if(all_pair_kinds.begin(), all_pair_kinds.end(),
                                   [&, &name = member](PairKind k) { return name == name_of(k); });
    if (member == "views" || member == "lights") {
      return fail(Code::json_malformed, path, "/" + member,
                  "the stored views and lights are grids; a file can give pairs only");
    }
    if (kind == all_pair_kinds.end())
      return fail(Code::json_malformed, path, "/" + member, "is not a set of pairs");
    if (!list.is_array()) return fail(Code::json_malformed, path, "/" + member, "is not a list");
    if (list.size() > max_pairs) {
      return fail(Code::json_malformed, path, "/" + member,
                  fmt::format("{} are too many pairs", list.size()));
    }
    for (std::size_t i = 0; i < list.size(); ++i) {
      const std::string place = fmt::format("/{}/{}", member, i);
      const auto light = direction_at(list[i], "light", path, place);
      if (!light) return tl::unexpected(light.error());
      const auto view = direction_at(list[i], "view", path, place);
      if (!view) return tl::unexpected(view.error());
      sets[static_cast<std::size_t>(*kind)].push_back({*light, *view});
    }
  }
  return sets;
}

}  // namespace selvedge
