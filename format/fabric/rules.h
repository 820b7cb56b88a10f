// The rules on headers and pixels of a fabric file, shared by the reader, which stops at the first error, and
// by the checker, which reports all.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "format/base/issue_sink.h"
#include "format/exr/exr.h"
#include "format/fabric/header.h"

namespace selvedge {

/// The header digest, over the attribute text and the names of all parts and channels, so that exchanged
/// names are detected.
std::string header_digest(const std::string& text, const std::vector<ExrPart>& parts);

/// The attributes that repeat members of the attribute text for people and other tools.
std::map<std::string, ExrValue> mirrors_of(const FabricHeader& header);

/// The attribute text as stored; null if part 0 has none.
const std::string* fabric_text(const std::vector<ExrPart>& parts);

/// Checks attribute text, version, header digest and members. Nothing if they do not define a layout.
std::optional<FabricHeader> check_header(const ExrReader& file, const FabricLimits& limits, IssueSink& sink);

/// The rules on every part, including the preview: data window and display window are the texels.
void check_windows(const ExrPart& part, const FabricHeader& header, IssueSink& sink);

/// The rules on every part but the preview, known or not: check_windows(), tiles, line order, no lossy
/// compression.
void check_data_part(const ExrPart& part, const FabricHeader& header, IssueSink& sink);

/// Checks the part of a layer of the header. Whether its levels can be decoded.
bool check_layer_part(const ExrReader& file, const FabricHeader& header, LayerKind kind, IssueSink& sink);

/// Those of the file that has the fabric.
ExrLimits exr_limits(const FabricLimits& limits);

/// Bytes of a level's pixels.
std::uint64_t pixel_memory(const ExrPart& part, int level);

/// Bytes that these layers of levels [first, last] take at most, with what reading them takes, but for the
/// cells of yarn (memory_of()). Parts that are missing take nothing.
std::uint64_t memory_of_levels(const ExrReader& file, const FabricHeader& header, int first, int last,
                               const LayerSet& layers);

/// Sets a layer of the level from its pixels; checks digest and values. Preconditions: check_layer_part() was
/// true, and the header lists the level.
void decode_layer(const ExrPart& part, const ExrPixels& pixels, const FabricHeader& header, LayerKind kind,
                  int level_index, FabricLevel& level, IssueSink& sink);

}  // namespace selvedge
