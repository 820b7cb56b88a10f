// design: a page that makes cloth, and shows the sample garment in it.
#include <filesystem>

#include "apps/selvedge-view/commands.h"
#include "apps/selvedge-view/page.h"
#include "apps/selvedge-view/workbench.h"
#include "apps/selvedge/make.h"
#include "converter/dress/dress.h"
#include "format/base/atomic_file.h"
#include "format/fabric/file.h"

namespace selvedge {
namespace {

constexpr const char* default_stitch = "plain-knit";

struct DesignCommand : PageCommand {
  std::string input = default_stitch;
};

void declare(Options& options, DesignCommand& command) {
  options
      .text(
          "stitch", command.input, "STITCH|FABRIC|GARMENT",
          "Shown first: a built-in stitch, a chart (.txt), draft (.wif) or description (.json) [plain-knit]; "
          "a fabric (.exr) with its recipe; or a garment (.glb)")
      .reads();
  add_page_output(options, command);
}

/// The recipe (spec/fabric.md) of a stitch or in a fabric. Throws Failure.
Json recipe_of(const std::string& input) {
  if (input.ends_with(".exr")) {
    Json recipe = Json::parse(value_or_throw(read_fabric(input)).recipe, nullptr, false);
    if (!recipe.value("stitch", Json()).is_string() || !recipe.value("text", Json("")).is_string())
      throw Failure{{Code::fabric_member, input, "/recipe", "has no stitch: the fabric cannot be edited"}};
    return recipe;
  }
  Json recipe = {{"stitch", std::filesystem::path(input).filename().string()}};
  if (std::filesystem::path(input).has_extension()) recipe["text"] = value_or_throw(read_file(input));
  return recipe;
}

Result<int> run(const DesignCommand& command) {
  TemporaryFolder bench;
  const bool is_garment = command.input.ends_with(".glb");
  const std::string made_of = is_garment ? default_stitch : command.input;
  std::string fabric = made_of;
  if (!fabric.ends_with(".exr")) {
    fabric = bench.next_path(".exr");
    MakeCommand make = value_or_throw(make_command_of({made_of, "-o", fabric}, "", ""));
    make.common = command.common;
    make_file(make);
  }
  Json recipes = stitches_for_pages();
  recipes["first"] = recipe_of(made_of);
  PageCommand page = command;
  page.inputs = {bench.next_path(".glb")};
  value_or_throw(dress(is_garment ? command.input : shared_file("sweater.glb"), fabric, page.inputs.front(),
                       {.all_cloth = true, .embed = true}));
  // No string of JSON ends the element.
  std::string text = recipes.dump(-1, ' ', false, Json::error_handler_t::replace);
  for (std::size_t at = 0; (at = text.find("</", at)) != std::string::npos;) text.insert(++at, "\\");
  return write_page("design", page,
                    "<script type=\"application/json\" id=\"recipes\">" + text + "</script>\n");
}

}  // namespace

void add_design_verb(Program& program) {
  program.add<DesignCommand>(
      {"design", "Make a web page that makes cloth: to choose stitch, yarn and colour, and look",
       "selvedge-view design -o design.html\n"
       "selvedge-view design aran.txt -o design.html",
       "The page opens from the file, without a server or a network, in a browser with WebGL 2. What it "
       "saves is\n"
       "what selvedge make makes.\n"},
      declare, run);
}

}  // namespace selvedge
