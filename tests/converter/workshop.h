// A folder with a garment and a fabric, to dress the one in the other.
#pragma once

#include <doctest/doctest.h>

#include <string>

#include "converter/dress.h"
#include "format/fabric_exr.h"
#include "format/gltf.h"
#include "format/gltf_writer.h"
#include "tests/converter/fabrics.h"
#include "tests/format/gltf_fixtures.h"

namespace selvedge::test {

/// A square of one metre with one unit of UV.
inline Garment square(int primitives = 1) {
  Garment garment;
  garment.name = "square";
  for (int i = 0; i < primitives; ++i) {
    garment.materials.push_back(GarmentMaterial{.name = "cloth " + std::to_string(i)});
    GarmentPrimitive primitive;
    primitive.material = i;
    primitive.positions = {V3f(0, 0, 0), V3f(1, 0, 0), V3f(1, 1, 0), V3f(0, 1, 0)};
    primitive.normals.assign(4, V3f(0, 0, 1));
    primitive.tex_coords = {V2f(0, 1), V2f(1, 1), V2f(1, 0), V2f(0, 0)};
    primitive.indices = {0, 1, 2, 0, 2, 3};
    garment.primitives.push_back(primitive);
  }
  return garment;
}

struct Workshop {
  Folder folder{"dress_test"};
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
    Result<GltfDocument> document = load_gltf(garment);
    REQUIRE(document);
    change(document->json);
    REQUIRE(save_gltf(*document, garment));
  }

  Result<DressReport> dress(const DressOptions& options) const {
    return selvedge::dress(garment, fabric, output, options);
  }
};

}  // namespace selvedge::test
