// evaluate: the reflectance of a fabric at one point, for one light and one view; or answers to queries on
// standard input, one a line (spec/conformance, the query protocol).
#include <fmt/format.h>

#include <iostream>
#include <map>

#include "apps/common/shared_options.h"
#include "apps/selvedge/commands.h"
#include "apps/selvedge/file_kind.h"
#include "apps/selvedge/query.h"
#include "format/base/guard.h"
#include "format/base/json_text.h"
#include "format/base/option_text.h"

namespace selvedge {
namespace {

struct EvaluateCommand {
  CommonOptions common;
  bool queries = false;
  std::string fabric;
  double level = 0;
  std::optional<V2i> texel;
  std::optional<V2d> uv;
  V3d light{0, 0, 1};
  V3d view{0, 0, 1};
  bool behind = false;
};

void declare(Options& options, EvaluateCommand& command) {
  options.common(command.common);
  options.text("fabric", command.fabric, "FILE", "The fabric file");
  options.flag("--queries", command.queries,
               "Answer queries on standard input, one JSON object a line, as spec/conformance has them");
  options.number("--level", command.level, "K",
                 "Mip level; with --uv a fraction blends two, and -1 is the yarn itself");
  const Option texel = options.text("--texel", "X,Y", "Texel of the level, 0,0 at the top left",
                                    [&command](const std::string& t) {
                                      const auto n = whole_numbers_from("--texel", t, ',', 2, 2, "3,4");
                                      command.texel = V2i(n[0], n[1]);
                                    });
  options.vector("--uv", command.uv, "U,V", "Texture coordinates; they repeat").excludes(texel);
  options.vector("--light", command.light, "X,Y,Z",
                 "Towards the light, in the fabric's frame; normalised (default 0,0,1)");
  options.vector("--view", command.view, "X,Y,Z", "Towards the viewer (default 0,0,1)");
  options.flag("--behind", command.behind,
               "The cloth is seen from behind: z of light and view points out of its back");
  options.check([&options, &command] {
    if (command.queries) {
      options.refuse_if(true, "has no effect with --queries",
                        {"fabric", "--level", "--texel", "--uv", "--light", "--view", "--behind", "--json"});
      return;
    }
    if (command.fabric.empty()) refuse("evaluate", "a fabric file is required");
    if (!command.texel && !command.uv) refuse("evaluate", "--texel or --uv is required");
    const auto unit = [](const char* option, const V3d& v) {
      const std::optional<V3d> direction = direction_of(v);
      if (!direction) refuse(option, "has no length");
      return *direction;
    };
    command.light = unit("--light", command.light);
    command.view = unit("--view", command.view);
  });
}

/// The level must exist, also with texture coordinates: another number is a mistake.
Result<Shading> shading_at(const EvaluateCommand& command, const FabricQuery& query) {
  auto fabric = value_or_throw(QueriedFabric::open(command.fabric));
  const int first = query.uv ? fabric.first_level() : 0;
  const int last = fabric.levels() - 1;
  if (!(query.level >= first && query.level <= last)) {
    return fail(Code::option_out_of_range, command.fabric, "--level",
                fmt::format("{} is outside of {} to {}", query.level, first, last));
  }
  auto shading = fabric.shade(query);
  if (!shading && shading.error().code == Code::option_out_of_range) {
    shading.error().place.insert(0, "--");
  }
  return shading;
}

/// Answers queries of spec/conformance; keeps the files that it has read. Throws Failure.
class Answerer {
 public:
  Json answer(const std::string& line) {
    const nlohmann::json query = parse_json(line);
    if (!query.is_object()) malformed("", "is not a JSON object");
    const auto op = query.find("op");
    const auto file = query.find("file");
    if (file == query.end() || !file->is_string()) malformed("file", "is missing or not a string");
    const auto name = file->get<std::string>();
    if (op != query.end() && *op == "check") return check(name);
    if (op != query.end() && *op == "evaluate") {
      const FabricQuery asked = query_from(query);
      return answer_of(value_or_throw(fabric_named(name).shade(asked)));
    }
    if (op != query.end() && *op == "environment") {
      const EnvironmentQuery asked = environment_query_from(query);
      return answer_of(shown(fabric_named(name), asked));
    }
    malformed("op", "is not evaluate, environment or check");
  }

 private:
  static Json answer_of(const Shading& shading) {
    return {{"rgb", shading.radiance}, {"alpha", shading.alpha}};
  }

  static Json check(const std::string& file) {
    // Unrecognisable content: the name decides.
    const bool named_gltf = has_ending(file, ".gltf") || has_ending(file, ".glb");
    const FileKind kind = kind_of(file).value_or(named_gltf ? FileKind::gltf : FileKind::fabric);
    Json issues = Json::array();
    for (const Error& issue : check_file(file, kind)) {
      issues.push_back(to_json(issue));
      issues.back().erase("file");
    }
    return {{"issues", issues}};
  }

  QueriedFabric& fabric_named(const std::string& file) {
    if (const auto found = open_.find(file); found != open_.end()) return found->second;
    QueriedFabric fabric = value_or_throw(QueriedFabric::open(file));
    // Limited, since each entry holds a whole fabric.
    constexpr std::size_t max_open = 16;
    if (open_.size() >= max_open) open_.clear();
    return open_.emplace(file, std::move(fabric)).first->second;
  }

  std::map<std::string, QueriedFabric> open_;
};

Result<int> answer_queries() {
  Answerer answerer;
  for (std::string line; std::getline(std::cin, line);) {
    const auto answer = guarded("", [&]() -> Result<Json> { return answerer.answer(line); });
    const Json said = answer ? *answer
                             : Json{{"error", name_of(answer.error().code)},
                                    {"place", answer.error().place},
                                    {"message", answer.error().message}};
    std::cout << said.dump(-1, ' ', false, Json::error_handler_t::replace) << std::endl;
  }
  return 0;
}

Result<int> run(const EvaluateCommand& command) {
  if (command.queries) return answer_queries();
  const FabricQuery query{command.level,      command.texel,     command.uv,
                          V3f(command.light), V3f(command.view), command.behind};
  const auto shading = value_or_throw(shading_at(command, query));
  Json json = {{"level", command.level}};
  if (command.texel) json["texel"] = *command.texel;
  if (command.uv) json["uv"] = *command.uv;
  json["light"] = query.light;
  json["view"] = query.view;
  if (query.behind) json["behind"] = true;
  json["rgb"] = shading.radiance;
  json["alpha"] = shading.alpha;
  // The answer is always JSON; --json adds the frame of all reports.
  report(command.common, "evaluate", json, json.dump() + "\n");
  return 0;
}

}  // namespace

void add_evaluate_verb(Program& program) {
  program.add<EvaluateCommand>({"evaluate", "Reflectance and opacity at a texel, as JSON",
                                "selvedge evaluate k.fabric.exr --texel 3,4 --light 0,0.6,0.8 --view 0,0,1"},
                               declare, run);
}

}  // namespace selvedge
