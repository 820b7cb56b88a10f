// Light of yarn in other colours, from that in the old ones.
#pragma once

#include <span>

#include "format/fabric/yarns.h"

namespace selvedge {

/// Gives yarn in new colours, with the light of `last`, which is the same in its old ones, about the light
/// that it has: few lines between whole yarns tell by how much each station sends on more or less. `through`:
/// YarnCell's. Precondition: `last` has light.
void recolour_light(YarnData& data, const Yarns& last, std::span<const V3f> through);

}  // namespace selvedge
