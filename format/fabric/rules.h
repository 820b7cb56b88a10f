// The rules on a fabric file as far as its headers and the pixels of its layers tell: one code for the
// reader, which stops at the first error, and for the checker, which reports all.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "format/base/issue_sink.h"
#include "format/exr/exr.h"
#include "format/fabric/header.h"

namespace selvedge {

/// The header digest: over the attribute text and the names of all parts and channels, so that none can be
/// exchanged unseen.
std::string header_digest(const std::string& text, const std::vector<ExrPart>& parts);

/// What stands in attributes of its own for people and tools, beside the attribute text.
std::map<std::string, ExrValue> mirrors_of(const FabricHeader& header);

/// The attribute text as stored; null where part 0 has none.
const std::string* fabric_text(const std::vector<ExrPart>& parts);

/// Attribute text, version, header digest, members. Nothing where a layout cannot be had from them.
std::optional<FabricHeader> check_header(const ExrReader& file, const FabricLimits& limits, IssueSink& sink);

/// What holds for every part, the preview too: data window and display window are the texels.
void check_windows(const ExrPart& part, const FabricHeader& header, IssueSink& sink);

/// What holds for every other part, known or not: that, tiles, order, no lossy compression.
void check_data_part(const ExrPart& part, const FabricHeader& header, IssueSink& sink);

/// The part of a layer that the header has. Whether its levels can be read and understood.
bool check_layer_part(const ExrReader& file, const FabricHeader& header, LayerKind kind, IssueSink& sink);

/// Gives the level a layer from the pixels of a level that the header lists; digest and values are checked.
/// Precondition: check_layer_part held.
void decode_layer(const ExrPart& part, const ExrPixels& pixels, const FabricHeader& header, LayerKind kind,
                  int level_index, FabricLevel& level, IssueSink& sink);

}  // namespace selvedge
