// design: a page that makes cloth, and shows the sample garment in it.
#include "apps/selvedge-view/commands.h"
#include "apps/selvedge-view/garment_writer.h"
#include "apps/selvedge-view/page.h"
#include "apps/selvedge-view/workbench.h"
#include "apps/selvedge/make.h"

namespace selvedge {
namespace {

struct DesignCommand {
  CommonOptions common;
  std::string stitch = "plain-knit";
  std::string output;
};

void declare(Options& options, DesignCommand& command) {
  options.text("stitch", command.stitch, "STITCH", "The built-in stitch that is shown first [plain-knit]");
  options.output(command.output, "The page", {".html"}).required();
}

Result<int> run(const DesignCommand& command) {
  const Json recipes = recipes_from(command.stitch);
  Workbench bench;
  MakeCommand make = value_or_throw(make_command_of({command.stitch, "-o", bench.next(".exr")}, "", ""));
  make.common = command.common;
  make_file(make);
  PageCommand page;
  page.common = command.common;
  page.output = command.output;
  const GarmentWriter writer = make_garment_writer({});
  page.inputs = {writer.dress(shared_file("sweater.glb"), make.output)};
  return write_page("design", page,
                    "<script type=\"application/json\" id=\"recipes\">" + recipes.dump() + "</script>\n");
}

}  // namespace

void add_design_verb(Program& program) {
  program.add<DesignCommand>(
      {"design", "Make a web page that makes cloth: to choose stitch, yarn and colour, and look",
       "selvedge-view design -o design.html\n"
       "selvedge-view design denim -o design.html",
       "The page opens from the file, without a server or a network, in a browser with WebGL 2. What it "
       "saves is\n"
       "what selvedge make makes.\n"},
      declare, run);
}

}  // namespace selvedge
