// answer: queries on standard input, one answer per line (spec/conformance, the query protocol).
#include <iostream>
#include <map>

#include "apps/selvedge/commands.h"
#include "apps/selvedge/file_kind.h"
#include "apps/selvedge/query_json.h"
#include "format/base/guard.h"
#include "format/base/json_text.h"
#include "format/base/option_text.h"

namespace selvedge {
namespace {

/// Cache of open files and the levels read so far.
class Answerer {
 public:
  Result<Json> answer(const std::string& line) {
    const nlohmann::json query = parse_json(line);
    if (!query.is_object()) return malformed("", "is not a JSON object");
    const auto op = query.find("op");
    const auto file = query.find("file");
    if (file == query.end() || !file->is_string()) return malformed("file", "is missing or not a string");
    if (op != query.end() && *op == "evaluate") return shade(file->get<std::string>(), query_from(query));
    if (op != query.end() && *op == "environment")
      return shade(file->get<std::string>(), environment_query_from(query));
    if (op != query.end() && *op == "check") return check(file->get<std::string>());
    return malformed("op", "is none of evaluate, environment and check");
  }

 private:
  /// Of either kind of query.
  template <class Query>
  Result<Json> shade(const std::string& file, const Result<Query>& query) {
    if (!query) return tl::unexpected(query.error());
    const auto fabric = fabric_named(file);
    if (!fabric) return tl::unexpected(fabric.error());
    const auto shading = shade(**fabric, *query);
    if (!shading) return tl::unexpected(shading.error());
    const V3f& rgb = shading->radiance;
    return Json{{"rgb", {rgb.x, rgb.y, rgb.z}}, {"alpha", shading->alpha}};
  }
  static Result<Shading> shade(QueriedFabric& fabric, const FabricQuery& query) {
    return fabric.shade(query);
  }
  static Result<Shading> shade(QueriedFabric& fabric, const EnvironmentQuery& query) {
    return shown(fabric, query);
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
    // Limited, since each entry holds a whole fabric.
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
