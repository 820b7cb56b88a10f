// evaluate: the reflectance of a fabric at one point, for one light and one view.
#include <fmt/format.h>

#include "apps/common/shared_options.h"
#include "apps/selvedge/commands.h"
#include "apps/selvedge/fabric_query.h"

namespace selvedge {
namespace {

struct EvaluateCommand {
  CommonOptions common;
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
  options.text("fabric", command.fabric, "FILE", "The fabric file").required();
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
  options.check([&command] {
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

Json list_of(const V3f& v) { return {v.x, v.y, v.z}; }

/// The level must exist, also with texture coordinates: another number is a mistake.
Result<Shading> shading_at(const EvaluateCommand& command, const FabricQuery& query) {
  auto fabric = must(QueriedFabric::open(command.fabric));
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

Result<int> run(const EvaluateCommand& command) {
  const FabricQuery query{command.level,      command.texel,     command.uv,
                          V3f(command.light), V3f(command.view), command.behind};
  const auto shading = must(shading_at(command, query));
  Json json = {{"level", command.level}};
  if (command.texel) json["texel"] = {command.texel->x, command.texel->y};
  if (command.uv) json["uv"] = {command.uv->x, command.uv->y};
  json["light"] = list_of(query.light);
  json["view"] = list_of(query.view);
  if (query.behind) json["behind"] = true;
  json["rgb"] = list_of(shading.radiance);
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
