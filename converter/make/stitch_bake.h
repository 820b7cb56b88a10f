// Options of a bake that its stitch decides, and the data sheet of its fabric.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "converter/bake/bake.h"
#include "converter/stitch/library.h"

namespace selvedge {

/// Sets as many texels for each repeat as `asked` has for one, and no fewer than the stitch demands; refuses
/// fewer that are `given`. `name` is for the message.
Result<void> set_texels(const V2i& min_texels, int repeats, bool given, const std::string& name,
                        const BakeOptions& asked, BakeOptions& options);

/// Takes fewer rays of a pair for each of a chart's or draft's many texels: their errors average out.
void share_rays(BakeOptions& options);

/// The data sheet of a stitch (spec/fabric.md), to four digits. Refuses yarn that no fabric file can hold.
Result<nlohmann::ordered_json> sheet_of(const FoundStitch& stitch, const YarnData& yarns, const V2d& period);

}  // namespace selvedge
