// A folder with a garment and a fabric, to dress the one in the other.
#pragma once

#include <doctest/doctest.h>

#include <string>

#include "converter/dress/dress.h"
#include "format/fabric/file.h"
#include "format/gltf/document.h"
#include "tests/converter/fabrics.h"
#include "tests/format/garments.h"
#include "tests/format/gltf_fixtures.h"
#include "tests/require.h"

namespace selvedge::test {

struct Workshop {
  Folder folder;
  std::string fabric = folder / "net.exr";
  std::string garment = folder / "garment.glb";
  std::string output = folder / "dressed.glb";

  explicit Workshop(const Garment& worn = square()) {
    REQUIRE(write_fabric(fabric, net_fabric(V2d(5, 4))));
    REQUIRE(write_garment(garment, worn));
  }

  /// Writes the garment again after `edit` has changed its JSON.
  template <class F>
  void edit(const F& change) {
    GltfDocument document = need(load_gltf(garment));
    change(document.json);
    REQUIRE(save_gltf(document, garment));
  }

  Result<DressReport> dress(const DressOptions& options) const {
    return selvedge::dress(garment, fabric, output, options);
  }
};

}  // namespace selvedge::test
