// answer: queries on standard input, one answer per line (spec/conformance, the query protocol).
#include <cmath>
#include <iostream>
#include <map>

#include "apps/selvedge/commands.h"
#include "apps/selvedge/fabric_query.h"
#include "apps/selvedge/file_kind.h"
#include "format/base/guard.h"
#include "format/base/json_text.h"
#include "format/base/option_text.h"

namespace selvedge {
namespace {

tl::unexpected<Error> malformed(const char* place, const char* message) {
  return fail(Code::json_malformed, {}, place, message);
}

/// A list of `Vector::dimensions()` numbers.
template <class Vector>
Result<Vector> vector_from(const nlohmann::json& query, const char* name) {
  const auto list = query.find(name);
  if (list == query.end() || !list->is_array() || list->size() != Vector::dimensions()) {
    return malformed(name, "is missing or of another length");
  }
  Vector result;
  for (unsigned i = 0; i < Vector::dimensions(); ++i) {
    const nlohmann::json& item = (*list)[i];
    constexpr bool whole = std::is_integral_v<typename Vector::BaseType>;
    if (whole ? !item.is_number_integer() : !item.is_number())
      return malformed(name, "does not hold numbers");
    if (whole && !(item >= -1 && item <= 1 << 30)) return malformed(name, "is out of range");
    result[static_cast<int>(i)] = item.get<typename Vector::BaseType>();
  }
  return result;
}

/// A direction is not normalised, so it has to be a unit vector to the precision of its digits.
Result<V3f> direction_from(const nlohmann::json& query, const char* name) {
  const auto direction = vector_from<V3d>(query, name);
  if (!direction) return tl::unexpected(direction.error());
  if (!(std::abs(direction->length() - 1) < 0.01)) return malformed(name, "is not a unit vector");
  return V3f(*direction);
}

Result<FabricQuery> query_from(const nlohmann::json& line) {
  FabricQuery query;
  const auto level = line.find("level");
  if (level == line.end() || !level->is_number()) return malformed("level", "is missing or not a number");
  query.level = level->get<double>();
  if (line.contains("texel") == line.contains("uv")) return malformed("", "has not one of texel and uv");
  if (line.contains("texel")) {
    const auto texel = vector_from<V2i>(line, "texel");
    if (!texel) return tl::unexpected(texel.error());
    query.texel = *texel;
  } else {
    const auto uv = vector_from<V2d>(line, "uv");
    if (!uv) return tl::unexpected(uv.error());
    query.uv = *uv;
  }
  const auto light = direction_from(line, "light");
  if (!light) return tl::unexpected(light.error());
  const auto view = direction_from(line, "view");
  if (!view) return tl::unexpected(view.error());
  query.light = *light;
  query.view = *view;
  return query;
}

/// Cache of open files and the levels read so far.
class Answerer {
 public:
  Result<Json> answer(const std::string& line) {
    const nlohmann::json query = parse_json(line);
    if (!query.is_object()) return malformed("", "is not a JSON object");
    const auto op = query.find("op");
    const auto file = query.find("file");
    if (file == query.end() || !file->is_string()) return malformed("file", "is missing or not a string");
    if (op != query.end() && *op == "evaluate") return evaluate(file->get<std::string>(), query);
    if (op != query.end() && *op == "check") return check(file->get<std::string>());
    return malformed("op", "is neither evaluate nor check");
  }

 private:
  Result<Json> evaluate(const std::string& file, const nlohmann::json& line) {
    const auto query = query_from(line);
    if (!query) return tl::unexpected(query.error());
    const auto fabric = fabric_named(file);
    if (!fabric) return tl::unexpected(fabric.error());
    const auto shading = (*fabric)->shade(*query);
    if (!shading) return tl::unexpected(shading.error());
    const V3f& rgb = shading->radiance;
    return Json{{"rgb", {rgb.x, rgb.y, rgb.z}}, {"alpha", shading->alpha}};
  }

  static Result<Json> check(const std::string& file) {
    // Unrecognisable content: the name decides.
    const bool named_gltf = has_ending(file, ".gltf") || has_ending(file, ".glb");
    const FileKind kind = kind_of(file).value_or(named_gltf ? FileKind::gltf : FileKind::fabric);
    Json issues = Json::array();
    for (const Error& issue : check_file(file, kind)) {
      issues.push_back(to_json(issue));
      issues.back().erase("file");
    }
    return Json{{"issues", issues}};
  }

  Result<QueriedFabric*> fabric_named(const std::string& file) {
    const auto found = open_.find(file);
    if (found != open_.end()) return &found->second;
    auto fabric = QueriedFabric::open(file);
    if (!fabric) return tl::unexpected(fabric.error());
    // Limited, since each entry holds a file and its levels.
    constexpr std::size_t max_open = 16;
    if (open_.size() >= max_open) open_.clear();
    return &open_.emplace(file, std::move(*fabric)).first->second;
  }

  std::map<std::string, QueriedFabric> open_;
};

struct AnswerCommand {
  CommonOptions common;  ///< answers are always JSON
};

void declare(Options& options, AnswerCommand& command) { options.common(command.common); }

Result<int> run(const AnswerCommand& /*command*/) {
  Answerer answerer;
  for (std::string line; std::getline(std::cin, line);) {
    const auto answer = guarded("", [&] { return answerer.answer(line); });
    const Json said = answer ? *answer
                             : Json{{"error", name_of(answer.error().code)},
                                    {"place", answer.error().place},
                                    {"message", answer.error().message}};
    std::cout << said.dump(-1, ' ', false, Json::error_handler_t::replace) << std::endl;
  }
  return 0;
}

}  // namespace

void add_answer_verb(Program& program) {
  program.add<AnswerCommand>({"answer", "Answer queries on standard input, one JSON object per line",
                              "selvedge answer < queries.jsonl"},
                             declare, run);
}

}  // namespace selvedge
