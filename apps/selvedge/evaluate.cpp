// evaluate: the reflectance of a fabric at one point, for one light and one view.
#include <fmt/format.h>

#include "apps/common/shared_options.h"
#include "apps/selvedge/commands.h"
#include "format/base/guard.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"

namespace selvedge {
namespace {

struct EvaluateCommand {
  CommonOptions common;
  std::string fabric;
  double level = 0;
  std::optional<V2i> texel;
  std::optional<V2d> uv;  ///< exactly one of texel and uv is set
  V3d light{0, 0, 1};
  V3d view{0, 0, 1};
  bool behind = false;
};

void declare(Options& options, EvaluateCommand& command) {
  options.text("fabric", command.fabric, "FILE", "The fabric file").required();
  options.number("--level", command.level, "K",
                 "Mip level; with --uv a fraction blends two, and -1 is the yarn itself");
  const Option texel = options.text("--texel", "X,Y", "Texel of the level, 0,0 at the top left",
                                    [&command](const std::string& t) {
                                      const auto n = parse_integer_list("--texel", t, ',', 2, 2, "3,4");
                                      command.texel = V2i(n[0], n[1]);
                                    });
  options.vector("--uv", command.uv, "U,V", "Texture coordinates; they repeat").excludes(texel);
  options.vector("--light", command.light, "X,Y,Z",
                 "Towards the light, in the fabric's frame; normalised (default 0,0,1)");
  options.vector("--view", command.view, "X,Y,Z", "Towards the viewer (default 0,0,1)");
  options.flag("--behind", command.behind,
               "The cloth is seen from behind: z of light and view points out of its back");
  options.add_check([&command] {
    if (!command.texel && !command.uv) refuse("evaluate", "--texel or --uv is required");
    const auto unit = [](const char* option, const V3d& v) {
      const std::optional<V3d> direction = unit_vector(v);
      if (!direction) refuse(option, "has no length");
      return *direction;
    };
    command.light = unit("--light", command.light);
    command.view = unit("--view", command.view);
  });
}

/// The level must exist, also with texture coordinates: another number is a mistake.
Result<Shading> shading_at(const EvaluateCommand& command) {
  Fabric fabric = arranged(value_or_throw(read_fabric(command.fabric)));
  if (command.behind && fabric.find_side(Side::back) != nullptr) fabric = turned_over(fabric);
  const auto refused = [&](const char* option, std::string message) {
    return fail(Code::option_out_of_range, command.fabric, option, std::move(message));
  };
  const V3f light(command.light);
  const V3f view(command.view);
  const int first = command.uv && fabric.levels.front().yarns() ? -1 : 0;
  const int last = static_cast<int>(fabric.levels.size()) - 1;
  if (!(command.level >= first && command.level <= last))
    return refused("--level", fmt::format("{} is outside of {} to {}", command.level, first, last));
  if (command.uv) return evaluate(fabric, command.level, *command.uv, light, view);
  const int level = static_cast<int>(command.level);
  if (level != command.level) return refused("--level", "a texel is of one whole level");
  const auto [x, y] = std::pair(command.texel->x, command.texel->y);
  const FabricLevel& texels = fabric.levels[level];
  if (x < 0 || y < 0 || x >= texels.width || y >= texels.height)
    return refused("--texel", fmt::format("level {} has {}x{} texels", level, texels.width, texels.height));
  return evaluate(fabric, level, x, y, light, view);
}

Result<int> run(const EvaluateCommand& command) {
  const auto shading = value_or_throw(shading_at(command));
  Json json = {{"level", command.level}};
  if (command.texel) json["texel"] = *command.texel;
  if (command.uv) json["uv"] = *command.uv;
  json["light"] = V3f(command.light);
  json["view"] = V3f(command.view);
  if (command.behind) json["behind"] = true;
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
