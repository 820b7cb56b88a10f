#include "apps/selvedge-view/commands.h"

int main(int argc, char** argv) {
  selvedge::Program program("selvedge-view", "Shows garments dressed in Selvedge fabrics",
                            "Example:\n  selvedge-view render sweater.glb -o sweater.png --size 1280x960");
  selvedge::add_render_verb(program);
  selvedge::add_page_verb(program);
  selvedge::add_design_verb(program);
  selvedge::add_show_verb(program);
  selvedge::add_trade_verb(program);
  return program.run(argc, argv);
}
