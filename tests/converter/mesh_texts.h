// Texts of mesh files that are read, or refused. Shared by the tests of meshes.
#pragma once

#include <doctest/doctest.h>

#include <filesystem>
#include <string>

#include "converter/mesh/file.h"
#include "format/base/atomic_file.h"

namespace selvedge::testing {

/// A file that is gone after the test.
class Temporary {
 public:
  Temporary(const std::string& name, const std::string& content)
      : path_((std::filesystem::temp_directory_path() / ("selvedge_" + name)).string()) {
    REQUIRE(write_file(path_, content));
  }
  ~Temporary() { std::filesystem::remove(path_); }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

inline const MeshImportOptions two_by_two{.period = V2d(2, 2), .up_axis = UpAxis::z};

inline CellMesh read_text(const std::string& name, const std::string& content,
                          const MeshImportOptions& options = two_by_two) {
  const Temporary file(name, content);
  auto mesh = read_mesh(file.path(), options);
  INFO((mesh ? std::string("read") : to_line(mesh.error())));
  REQUIRE(mesh);
  return *mesh;
}

inline Error refusal(const std::string& name, const std::string& content,
                     const MeshImportOptions& options = two_by_two) {
  const Temporary file(name, content);
  const auto mesh = read_mesh(file.path(), options);
  CAPTURE(content);
  REQUIRE_FALSE(mesh);
  CHECK(mesh.error().file == file.path());
  CHECK(to_line(mesh.error()).find('\n') == std::string::npos);
  return mesh.error();
}

}  // namespace selvedge::testing
