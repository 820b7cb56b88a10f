// All options of a make, from a cell to a fabric file, and its knobs: the options that sweeps vary and
// presets set, with names and values as JSON and as options of `selvedge make`.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "converter/bake/bake.h"
#include "fitter/fit.h"
#include "format/fabric/file.h"

namespace selvedge {

/// The same cell and options give the same bytes of the fabric. The defaults are
/// the paper's model at the paper's scale.
struct MakeOptions {
  BakeOptions bake;
  FitOptions fit;
  FabricWriteOptions write;
  /// Bytes of the file without its yarn, within which the layers of every level are chosen
  /// (fitter/budget/candidates.h).
  std::optional<std::uint64_t> budget;
  int budget_texels = 0;         ///< level-0 texels of `budget`, which grows with more texels; 0: it is fixed
  bool budget_has_yarn = false;  ///< the yarn counts as part of it

  /// The budget for `texels` at level 0. Precondition: there is a budget.
  double budget_for(int texels) const;
};

// Knobs are "texels" (along both sides), "views", "lights", "directions" (both), "samples", "bounces" (a
// number or "unlimited"), "lobes", "layers" ("paper": lobes and a table over views; "no-table";
// "products", chosen by level within the budget), "budget" (bytes) and "storage"
// ("mixed", "half", "float"), "yarns" (true or false).

/// Sets options from a JSON object of knobs; a budget is accepted only beside "products" in the
/// same object. OPTION_OUT_OF_RANGE names the knob: `file`, and `place` as the JSON pointer to the object.
Result<void> set_knobs(const nlohmann::json& knobs, const std::string& file, const std::string& place,
                       MakeOptions& options);

/// The same for a text that is known to be valid.
MakeOptions with_knobs(std::string_view knobs, MakeOptions options = {});

/// All knobs but "directions"; "budget" only if there is one.
nlohmann::ordered_json knobs_of(const MakeOptions& options);

/// Knobs that differ from their defaults, as options of `selvedge make --quality paper`, each after a space.
std::string options_text(const MakeOptions& options);

/// A file name made of the knobs.
std::string settings_name(const MakeOptions& options);
/// The part of it that the samples depend on: options with the same name share a bake.
std::string bake_name(const MakeOptions& options);

/// Points of a sweep. `text` is a JSON object with any of
///   "centre": knobs; those left out have their defaults
///   "vary":   knob -> array; each value by itself, in the centre's place
///   "points": array of objects of knobs; those left out are the centre's
/// The centre is always the first point; "vary" may repeat its values, no other point may be there twice.
/// `name` is the file. OPTION_OUT_OF_RANGE names the knob, also one that contradicts another or has no
/// effect. Limits: 1000 points; texels are the largest of the grid divided by a power of two.
Result<std::vector<MakeOptions>> read_grid(const std::string& text, const std::string& name);

}  // namespace selvedge
