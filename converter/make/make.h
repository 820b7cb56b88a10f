// From the samples of a cell to its fabric, with all options that the file depends on.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "converter/bake/bake.h"
#include "converter/stitch/library.h"
#include "fitter/fit.h"
#include "format/fabric/file.h"
#include "format/quality/compare.h"

namespace selvedge {

/// The same cell and options give the same bytes of the fabric. The defaults are the paper's model at the
/// paper's scale.
struct MakeOptions {
  BakeOptions bake;
  FitOptions fit;
  FabricWriteOptions write;
  /// Chooses the layers of every level within a budget (fitter/budget/candidates.h) of 22 KiB beside the
  /// yarn, more for more than 64 texels. Else every level has the paper's layers.
  bool chooses_layers = false;
  std::optional<std::uint64_t> file_bytes;  ///< of the whole file, in place of the budget
  bool requires_yarn = false;               ///< refuses bytes that have no room for it
};

/// Names of --quality.
inline constexpr std::array<std::string_view, 3> quality_names{"draft", "standard", "paper"};
inline constexpr std::string_view default_quality = "standard";
/// Precondition: it is one of the names.
MakeOptions quality_named(std::string_view name);

struct FitOutcome {
  Fabric fabric;  ///< in the precision of its file; the record is in its provenance
  FitRecord record;
  std::vector<std::string> remarks;  ///< what the bytes had no room for
  double seconds = 0;
};

/// Fits all sides of the samples, and measures their errors on the held-out pairs. The options of the bake
/// are ignored. OPTION_OUT_OF_RANGE for a budget that is too small for any fabric.
Result<FitOutcome> fit_fabric(Samples samples, const MakeOptions& options, const Progress& progress = {});

/// Sets as many texels for each repeat as `asked` has for one, and no fewer than the stitch demands; refuses
/// fewer that are `given`. `name` is for the message.
Result<void> set_texels(const V2i& min_texels, int repeats, bool given, const std::string& name,
                        const BakeOptions& asked, BakeOptions& options);

/// Refuses a chart or draft of more yarn than a fabric holds (yarn_curves_of()), before any work.
Result<void> check_room(const StitchSize& size, const std::string& name);

/// Takes fewer rays of a pair for each of a chart's or draft's many texels: their errors average out.
void reduce_pair_samples(BakeOptions& options);

/// The member `recipe` of a fabric (spec/fabric.md): `options` are those given, by their names.
nlohmann::ordered_json recipe_of(const std::string& name, const FoundStitch& stitch,
                                 nlohmann::ordered_json options);
/// The text of an option in a recipe: a number where it is one.
nlohmann::ordered_json recipe_value(const std::string& text);

/// The data sheet of a stitch (spec/fabric.md), to four digits. Refuses yarn that no fabric file can hold.
Result<nlohmann::ordered_json> sheet_of(const FoundStitch& stitch, const YarnData& yarns, const V2d& period);

}  // namespace selvedge
