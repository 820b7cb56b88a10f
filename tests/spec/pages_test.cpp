// What holds for all pages: links, names, and the page that is made from the code.
#include <doctest/doctest.h>

#include <filesystem>
#include <regex>

#include "converter/stitch/library.h"
#include "tests/spec/issues_markdown.h"
#include "tests/spec/spec_text.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

const std::vector<std::string> pages{"README.md", "bake.md",    "brdf.md",   "fabric.md", "issues.md",
                                     "plan.md",   "samples.md", "stitch.md", "usd.md",    "wif.md"};

std::vector<std::string> matches(const std::string& text, const std::regex& pattern) {
  std::vector<std::string> found;
  for (auto i = std::sregex_iterator(text.begin(), text.end(), pattern); i != std::sregex_iterator(); ++i) {
    found.push_back((*i)[1]);
  }
  return found;
}

}  // namespace

TEST_CASE("the page of issues is the table of codes") { CHECK(page("issues.md") == issues_markdown()); }

TEST_CASE("the index leads to every page") {
  const std::string index = page("README.md");
  for (const auto& entry : std::filesystem::directory_iterator(std::string(SELVEDGE_SOURCE_DIR) + "/spec")) {
    const std::string name = entry.path().filename().string();
    if (name == "README.md") continue;
    CHECK_MESSAGE(index.find("](" + name) != std::string::npos, name);
  }
}

TEST_CASE("links within the specification lead somewhere") {
  for (const std::string& name : pages) {
    for (const std::string& link : matches(page(name), std::regex("\\]\\(([^)#]+)\\)"))) {
      if (link.starts_with("https://")) continue;
      CHECK_MESSAGE(std::filesystem::exists(std::string(SELVEDGE_SOURCE_DIR) + "/spec/" + link), name, ": ",
                    link);
    }
  }
}

TEST_CASE("every name that a file holds is in the specification") {
  const std::string text = page("fabric.md") + page("samples.md");
  const auto constants = matches(source_text("format/fabric/names.h"), std::regex("\"([^\"\\n]*)\""));
  REQUIRE(constants.size() > 30);
  // A member may be named with the way to it.
  for (const std::string& name : constants) {
    CHECK_MESSAGE((test::names(text, name) || text.find("/" + name + "`") != std::string::npos), name);
  }
}

TEST_CASE("codes that the pages speak of exist") {
  const std::string table = page("issues.md");
  for (const std::string& name : pages) {
    for (const std::string& code : matches(page(name), std::regex("`([A-Z]+_[A-Z_]+)`"))) {
      const bool of_openexr = code == "INCREASING_Y" || code == "ROUND_DOWN" || code == "MIPMAP_LEVELS";
      CHECK_MESSAGE((of_openexr || test::names(table, code)), name, ": ", code);
    }
  }
}

TEST_CASE("the page of stitches has every built-in stitch with its picture, and every parameter") {
  const std::string text = page("stitch.md");
  for (const StitchInfo& info : built_in_stitches()) {
    CAPTURE(info.name);
    CHECK(text.find("| `" + info.name + "` |") != std::string::npos);
    const std::string picture = "samples/pictures/stitches/" + info.name + ".png";
    CHECK(text.find("](../" + picture + ")") != std::string::npos);
    CHECK(std::filesystem::file_size(std::string(SELVEDGE_SOURCE_DIR) + "/" + picture) <= 60 * 1024);
    for (const StitchParameter& parameter : info.parameters) {
      std::string name = parameter.name;
      for (const std::string prefix : {"second_", "warp_", "weft_"}) {
        if (name.starts_with(prefix) && text.find("`" + name + "`") == std::string::npos)
          name.erase(0, prefix.size());
      }
      CHECK_MESSAGE(text.find("`" + name + "`") != std::string::npos, parameter.name);
    }
  }
}
