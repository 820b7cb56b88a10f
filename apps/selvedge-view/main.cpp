#include <spawn.h>
#include <unistd.h>

#include <filesystem>

#include "apps/selvedge-view/commands.h"
#include "apps/selvedge-view/page.h"

std::string selvedge::shared_file(const std::string& name) {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  return (program.parent_path().parent_path() / "share" / "selvedge" / name).string();
}

selvedge::Result<void> selvedge::open_in_browser(const std::string& page) {
  std::string program = "xdg-open";
  std::string path = std::filesystem::absolute(page).string();
  char* const words[] = {program.data(), path.data(), nullptr};
  pid_t process = 0;
  if (posix_spawnp(&process, words[0], nullptr, nullptr, words, environ) == 0) return {};
  return fail(Code::option_out_of_range, page, "--open", "no browser can be started");
}

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
