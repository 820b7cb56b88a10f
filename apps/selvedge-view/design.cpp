// design: a page that makes cloth, and shows the sample garment in it.
#include <filesystem>

#include "apps/selvedge-view/commands.h"
#include "apps/selvedge-view/garment_writer.h"
#include "apps/selvedge-view/page.h"
#include "apps/selvedge-view/workbench.h"
#include "apps/selvedge/make.h"
#include "format/base/atomic_file.h"

namespace selvedge {
namespace {

constexpr const char* default_stitch = "plain-knit";

struct DesignCommand {
  CommonOptions common;
  std::string input = default_stitch;
  std::string output;
};

void declare(Options& options, DesignCommand& command) {
  options
      .text(
          "stitch", command.input, "STITCH|GARMENT",
          "Shown first: a built-in stitch, a chart (.txt), draft (.wif) or description (.json) [plain-knit]; "
          "or a garment (.glb)")
      .reads();
  options.output(command.output, "The page", {".html"}).required();
}

/// All stitches, and the first recipe (converter/web/make.mjs) with its parameters. Throws Failure.
Json recipes_with(const std::string& stitch) {
  StitchInfo info = value_or_throw(describe_stitch(stitch));
  const bool is_file = std::filesystem::path(stitch).has_extension();
  info.name = std::filesystem::path(stitch).filename().string();
  Json recipes = stitches_for_pages();
  recipes["described"] = to_json(info);
  recipes["first"] = {{"stitch", info.name}};
  if (is_file) recipes["first"]["text"] = value_or_throw(read_file(stitch));
  return recipes;
}

/// JSON in an element: no string ends that.
std::string element_of(const Json& recipes) {
  std::string text = recipes.dump(-1, ' ', false, Json::error_handler_t::replace);
  for (std::size_t at = 0; (at = text.find("</", at)) != std::string::npos;) text.insert(++at, "\\");
  return "<script type=\"application/json\" id=\"recipes\">" + text + "</script>\n";
}

Result<int> run(const DesignCommand& command) {
  const bool is_garment = command.input.ends_with(".glb");
  const std::string stitch = is_garment ? default_stitch : command.input;
  const Json recipes = recipes_with(stitch);
  Workbench bench;
  MakeCommand make = value_or_throw(make_command_of({stitch, "-o", bench.next(".exr")}, "", ""));
  make.common = command.common;
  make_file(make);
  PageCommand page;
  page.common = command.common;
  page.output = command.output;
  const GarmentWriter writer = make_garment_writer({});
  page.inputs = {writer.dress(is_garment ? command.input : shared_file("sweater.glb"), make.output)};
  return write_page("design", page, element_of(recipes));
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
