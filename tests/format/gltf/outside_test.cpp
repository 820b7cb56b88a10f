#include <doctest/doctest.h>

#include <filesystem>

#include "format/check/gltf.h"
#include "format/gltf/access.h"
#include "format/gltf/read_scene.h"
#include "format/gltf/uri.h"
#include "tests/format/gltf_square.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;
using test::Square;
namespace fs = std::filesystem;

namespace {

constexpr SceneLimits anywhere{.document = {.external_files = ExternalFiles::anywhere}};

/// A folder "in" with a document, a file that the document is not to see beside it, and links to that.
struct Yard {
  Folder folder;
  std::string document = folder / "in/case.gltf";

  Yard() {
    fs::create_directories(folder / "in/deep");
    test::write_bytes(folder / "secret", "abc");
    test::write_bytes(folder / "in/own", "abc");
    fs::create_symlink(folder / "secret", folder / "in/link");
    fs::create_directory_symlink(folder.path(), folder / "in/up");
    fs::create_symlink("own", folder / "in/near");
  }

  /// Every URI that leads to the secret.
  std::vector<std::string> ways_out() const {
    return {"../secret", "..%2Fsecret", "%2e%2e/secret", "deep/../../secret", folder / "secret",
            "link",      "up/secret",   "../in/link",    "../none",           "../in-not/secret"};
  }

  /// Writes a document with one URI at each place that may hold one.
  void write(const std::string& place, const std::string& uri) const {
    Square square;
    square.dress();
    square.json["buffers"].push_back({{"byteLength", 3}, {"uri", "own"}});
    square.json["images"].push_back({{"uri", "own"}});
    square.root_fabrics()[0]["uri"] = "own";
    square.at(place.c_str()) = uri;
    test::write_bytes(document, test::glb(square.json.dump(), square.bytes));
  }
};

}  // namespace

TEST_CASE("gltf: no buffer, picture or fabric leads out of the document's folder, unless allowed") {
  const Yard yard;
  for (const std::string place :
       {"/buffers/1/uri", "/images/1/uri", "/extensions/SELVEDGE_materials_fabric/fabrics/0/uri"}) {
    CAPTURE(place);
    for (const std::string& uri : yard.ways_out()) {
      CAPTURE(uri);
      yard.write(place, uri);
      const Error error = test::error_of(read_scene(yard.document));
      CHECK(error.code == Code::gltf_reference);
      CHECK(error.place == place);
      CHECK(error.message.find("--allow-outside") != std::string::npos);
      const Issues issues = check_gltf(yard.document);
      REQUIRE(issues.size() == 1);
      CHECK(issues[0].place == place);
      CHECK(has_error(issues));
      const auto allowed = load_gltf(yard.document, anywhere.document);
      CHECK((allowed || allowed.error().code == Code::file_missing));
    }
    for (const char* uri : {"own", "./own", "deep/../own", "near", "../in/own", "n%65ar"}) {
      CAPTURE(uri);
      yard.write(place, uri);
      CHECK(read_scene(yard.document).has_value());
    }
  }
}

TEST_CASE("gltf: the folder of a document follows from its name, also without one and as a link") {
  const Yard yard;
  CHECK(*is_inside(yard.folder / "in/none/of/these", yard.folder / "in"));
  CHECK(*is_inside(yard.folder / "in/near", yard.folder / "in"));
  CHECK(*is_inside(yard.folder / "in/own", yard.folder / "in/up/in"));
  CHECK_FALSE(*is_inside(yard.folder / "in2", yard.folder / "in"));
  CHECK_FALSE(*is_inside(yard.folder / "in/up", yard.folder / "in"));
  CHECK(*is_inside("a", ""));
  CHECK_FALSE(*is_inside("../a", ""));
  fs::create_symlink("circle", yard.folder / "in/circle");
  CHECK(test::error_of(is_inside(yard.folder / "in/circle/a", yard.folder / "in")).code ==
        Code::file_unreadable);
}

TEST_CASE("gltf: a file is found by a name of another system, with a remark, but not outside") {
  const Yard yard;
  test::write_bytes(yard.folder / "in/deep/Blue Print.png", "\x89PNG");
  const std::string found = "deep/Blue%20Print.png";
  for (const auto& [uri, wanted] : {std::pair("deep\\Blue Print.png", found.c_str()),
                                    {"deep%5Cblue%20print.PNG", found.c_str()},
                                    {"Deep/Blue%20Print.png", found.c_str()},
                                    {"C:\\art\\OWN", "own"},
                                    {"tex/own", "own"},
                                    {"..\\secret", "..\\secret"},
                                    {"deep\\..\\..\\secret", "deep\\..\\..\\secret"},
                                    {"LINK", "LINK"},
                                    {"http://x.org/own", "http://x.org/own"},
                                    {"nowhere.png", "nowhere.png"}}) {
    CAPTURE(uri);
    yard.write("/images/1/uri", uri);
    const GltfDocument document = test::need(load_gltf(yard.document));
    CHECK(document.json["images"][1]["uri"] == wanted);
    CHECK(document.remarks.size() == (std::string(uri) == wanted ? 0 : 1));
  }
  // A missing file is missing after the document has moved, too.
  GltfDocument document = test::need(load_gltf(yard.document));
  fs::create_directories(yard.folder / "out");
  rebase_uris(document, yard.folder / "out");
  CHECK(test::error_of(read_image_bytes(document, 1)).message == "nowhere.png: no such file");
}

TEST_CASE("gltf: a name with a zero byte names no file") {
  const Yard yard;
  yard.write("/buffers/1/uri", "own%00/../../secret");
  CHECK(test::error_of(read_scene(yard.document)).code == Code::gltf_malformed);
}

TEST_CASE("gltf: a document that moves is still held to the folder that it came from") {
  const Yard yard;
  yard.write("/images/1/uri", "own");
  fs::create_directories(yard.folder / "out");
  GltfDocument document = test::need(load_gltf(yard.document));
  rebase_uris(document, yard.folder / "out");
  CHECK(document.json["images"][1]["uri"] == "../in/own");
  CHECK(resolve_uri(document, "../in/own", ""));
  CHECK(test::error_of(resolve_uri(document, "own", "")).code == Code::gltf_reference);
  IssueSink issues("");
  find_outside_uris(document, issues);
  CHECK(issues.error_count() == 3);  // for others, who find it in its new folder
}

TEST_CASE("gltf: only bytes that are a picture are embedded, however short they are") {
  const Folder folder;
  const std::string webp("RIFF\4\0\0\0WEBP", 12);
  const std::vector<std::pair<std::string, std::string>> files{
      {"\x89PNG", "image/png"},
      {"\xFF\xD8\xFF", "image/jpeg"},
      {webp, "image/webp"},
      {std::string("\0\0\0\x20", 4) + "ftypavif", "image/avif"},
      {"\xABKTX 20\xBB\r\n\x1A\n", "image/ktx2"},
      {"root:x:0:0:root", ""},
      {"", ""}};
  for (const auto& file : files) {
    const std::string& bytes = file.first;
    const std::string& type = file.second;
    for (std::size_t size = 0; size <= bytes.size(); ++size) {
      CAPTURE(type);
      CAPTURE(size);
      const std::string cut = bytes.substr(0, size);
      test::write_bytes(folder / "file", cut);
      test::write_bytes(folder / "a.gltf",
                        R"({"asset":{"version":"2.0"},"images":[{"uri":"file"}],)"
                        R"("textures":[{"source":0}],"materials":[{"emissiveTexture":{"index":0}}]})");
      const bool is_read = !type.ends_with("avif") && !type.ends_with("ktx2");
      if (size == bytes.size() && !type.empty())
        CHECK(test::need(read_scene(folder / "a.gltf")).remarks.empty() == is_read);
      REQUIRE(save_gltf(test::need(load_gltf(folder / "a.gltf")), folder / "b.glb"));
      const Json image = test::need(load_gltf(folder / "b.glb")).json["images"][0];
      const bool embedded = image.contains("bufferView");
      CHECK(embedded == (size == bytes.size() && !type.empty()));
      if (embedded) CHECK(image["mimeType"] == type);
      // The checker decodes these three.
      const bool cut_short = type == "image/png" || type == "image/jpeg" || type == "image/webp";
      CHECK(has_error(check_gltf(folder / "a.gltf")) == (!embedded || cut_short));
      CHECK((embedded || test::bytes_of(folder / "b.glb").find("root:") == std::string::npos));
    }
  }
}

TEST_CASE("gltf: a picture whose uri is empty or no string is told as that") {
  const Folder folder;
  for (const char* uri : {R"("")", "7", "null"}) {
    test::write_bytes(folder / "a.gltf", std::string(R"({"asset":{"version":"2.0"},"images":[{"uri":)") +
                                             uri +
                                             R"(}],"textures":[{"source":0}],"materials":[)"
                                             R"({"emissiveTexture":{"index":0}}]})");
    const Issues issues = check_gltf(folder / "a.gltf");
    REQUIRE(issues.size() == 1);
    CHECK(issues[0].code == Code::image_unreadable);
    CHECK(issues[0].message == "its uri is empty or no string");
    CHECK(test::need(read_scene(folder / "a.gltf")).remarks.size() == 1);
    CHECK(save_gltf(test::need(load_gltf(folder / "a.gltf")), folder / "b.glb").has_value());
  }
}
