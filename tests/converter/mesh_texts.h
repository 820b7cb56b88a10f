// Texts of mesh files that are read, or refused. Shared by the tests of meshes.
#pragma once

#include <doctest/doctest.h>

#include <string>

#include "converter/mesh/file.h"
#include "tests/format/files.h"
#include "tests/require.h"

namespace selvedge::testing {

inline const MeshImportOptions two_by_two{.period = V2d(2, 2), .up_axis = UpAxis::z};

/// `materials`: what colours.mtl beside it holds.
inline CellMesh read_text(const std::string& name, const std::string& content,
                          const MeshImportOptions& options = two_by_two, const std::string& materials = "") {
  const test::Folder folder;
  test::write_bytes(folder / "colours.mtl", materials);
  test::write_bytes(folder / name, content);
  return test::need(read_mesh(folder / name, options));
}

inline Error refusal(const std::string& name, const std::string& content,
                     const MeshImportOptions& options = two_by_two) {
  const test::Folder folder;
  test::write_bytes(folder / name, content);
  const auto mesh = read_mesh(folder / name, options);
  CAPTURE(content);
  REQUIRE_FALSE(mesh);
  CHECK(mesh.error().file == folder / name);
  CHECK(to_line(mesh.error()).find('\n') == std::string::npos);
  return mesh.error();
}

}  // namespace selvedge::testing
