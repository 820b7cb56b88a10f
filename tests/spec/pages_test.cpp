// Properties of all pages: links, names, and the page that is made from the code.
#include <doctest/doctest.h>

#include <filesystem>

#include "converter/stitch/library.h"
#include "tests/spec/issues_markdown.h"
#include "tests/spec/spec_text.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

namespace fs = std::filesystem;
const fs::path root = SELVEDGE_SOURCE_DIR;

/// All pages of the project, from its root: of spec/, of docs/, and of the root itself.
std::vector<std::string> all_pages() {
  std::vector<std::string> found{"README.md", "CONTRIBUTING.md", "CHANGELOG.md"};
  for (const char* folder : {"spec", "docs"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      if (entry.path().extension() == ".md" &&
          entry.path().string().find("node_modules") == std::string::npos)
        found.push_back(fs::relative(entry.path(), root).string());
    }
  }
  return found;
}

}  // namespace

TEST_CASE("the page of issues is the table of codes") { CHECK(page("issues.md") == issues_markdown()); }

TEST_CASE("each index leads to every page of its folder") {
  for (const std::string folder : {"spec", "docs"}) {
    const std::string index = source_text(folder + "/README.md");
    for (const auto& entry : fs::directory_iterator(root / folder)) {
      const std::string name = entry.path().filename().string();
      if (name == "README.md" || name == "Doxyfile") continue;
      CHECK_MESSAGE(index.find("](" + name) != std::string::npos, name);
    }
  }
}

TEST_CASE("links within the pages lead somewhere") {
  for (const std::string& name : all_pages()) {
    for (const auto& match : matches(source_text(name), "\\]\\(([^)#]+)(?:#[^)]*)?\\)")) {
      const std::string& link = match[0];
      if (link.starts_with("https://")) continue;
      CHECK_MESSAGE(fs::exists((root / name).parent_path() / link), name, ": ", link);
    }
  }
}

TEST_CASE("every name that a file holds is in the specification") {
  const std::string text = page("fabric.md") + page("samples.md");
  const auto constants = matches(source_text("format/fabric/names.h"), "\"([^\"\\n]*)\"");
  REQUIRE(constants.size() > 30);
  // A member may be named with the way to it, a channel with its part.
  for (const auto& match : constants) {
    const std::string& name = match[0];
    CHECK_MESSAGE((test::names(text, name) || text.find("/" + name + "`") != std::string::npos ||
                   text.find("." + name + "`") != std::string::npos),
                  name);
  }
}

TEST_CASE("codes that the pages speak of exist") {
  const std::string table = page("issues.md");
  for (const std::string& name : all_pages()) {
    for (const auto& match : matches(source_text(name), "`([A-Z]+_[A-Z_]+)`")) {
      const std::string& code = match[0];
      // Constants of OpenEXR, OpenGL, glTF-Transform and Kubernetes, and the tests' own variable.
      const bool of_others = code == "INCREASING_Y" || code == "ROUND_DOWN" || code == "MIPMAP_LEVELS" ||
                             code == "ALL_EXTENSIONS" || code == "CHROMIUM_GRAPHICS" ||
                             code.starts_with("GL_") || code.starts_with("JOB_");
      CHECK_MESSAGE((of_others || test::names(table, code)), name, ": ", code);
    }
  }
}

TEST_CASE("the page of stitches has every built-in stitch with its picture, and every parameter") {
  const std::string text = page("stitch.md");
  const std::string tiles = source_text("apps/web/design/tiles.json");
  for (const StitchInfo& info : built_in_stitches()) {
    CAPTURE(info.name);
    const auto rows = rows_of(text, "`" + info.name + "`", 6);
    REQUIRE(rows.size() == 1);
    CHECK(std::stod(rows[0][5]) == info.cover_fraction);
    CHECK_MESSAGE(tiles.find('"' + info.name + '"') != std::string::npos, "samples/pictures/rebuild-tiles");
    const std::string picture = "samples/pictures/stitches/" + info.name + ".png";
    CHECK(text.find("](../" + picture + ")") != std::string::npos);
    CHECK(std::filesystem::file_size(std::string(SELVEDGE_SOURCE_DIR) + "/" + picture) <= 60 * 1024);
    for (const StitchParameter& parameter : info.parameters) {
      std::string name = parameter.name;
      for (const std::string prefix : {"second_", "warp_", "weft_"})
        if (name.starts_with(prefix) && text.find("`" + name + "`") == std::string::npos)
          name.erase(0, prefix.size());
      CHECK_MESSAGE(text.find("`" + name + "`") != std::string::npos, parameter.name);
    }
  }
}
