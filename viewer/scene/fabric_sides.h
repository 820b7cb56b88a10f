// A fabric as it is seen from either side.
#pragma once

#include <memory>

#include "format/fabric/fabric.h"
#include "format/fabric/header.h"

namespace selvedge {

struct FabricSides {
  /// `fabric` must outlive the object. Precondition: validate() holds.
  explicit FabricSides(const Fabric& fabric) : front(&fabric) {
    if (fabric.find_side(Side::back) != nullptr)
      back_fabric = std::make_shared<const Fabric>(turned_over(fabric));
  }
  const Fabric* front;
  std::shared_ptr<const Fabric> back_fabric;  ///< as seen from behind; null: as from in front

  const Fabric& seen_from(bool back) const { return back && back_fabric ? *back_fabric : *front; }
  bool lets_light_through() const { return front->find_side(Side::through) != nullptr; }
};

/// Bytes that the fabric of a file takes once more, turned over: its own of all but the front.
inline std::uint64_t turned_over_bytes(const FabricHeader& header) {
  if (header.find_side(Side::back) == nullptr) return 0;
  std::uint64_t floats = 0;
  for_each_side(header, [&](const FabricHeader& side) {
    if (side.side == Side::front) return;
    for (int k = 0; k < header.levels; ++k) {
      const int texels = level_size(header.width, k) * level_size(header.height, k);
      for (const LayerKind kind : all_layers)
        if (side.has(kind, side.texel_level(k)))
          floats += std::uint64_t{1} * texels * channel_count(kind, side.shape);
    }
  });
  return floats * sizeof(float);
}

}  // namespace selvedge
