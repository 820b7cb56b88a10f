#include "format/fabric/json_parts.h"

#include <fmt/format.h>

#include "format/base/json_text.h"

namespace selvedge {

using nlohmann::json;

json provenance_json(const std::string& provenance) {
  json parsed = parse_json(provenance);
  return parsed.is_object() ? parsed : json::object();
}

json short_number(double value, const char* form) {
  return parse_json(fmt::format(fmt::runtime(form), value));
}

}  // namespace selvedge
