// All options of a make, from a cell to a fabric file, and its knobs: those options that sweeps vary and that
// presets choose, with their names and values as JSON and as options of `selvedge make`.
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

/// Same cell and options: same bytes of the fabric. The defaults are those of `bake` and `fit`: the paper's
/// model at the paper's scale.
struct MakeOptions {
  BakeOptions bake;
  FitOptions fit;
  FabricWriteOptions write;
  /// Bytes of the file, for which the layers of every level are chosen (fitter/budget/candidates.h).
  std::optional<std::uint64_t> budget;
  int budget_texels = 0;  ///< the budget is for so many at level 0 and grows with what is more; 0: fixed

  /// The budget for so many texels at level 0. Precondition: there is one.
  double budget_for(int texels) const;
};

// Knobs are "texels" (along both sides), "views", "lights", "directions" (both), "samples", "bounces" (a
// number or "unlimited"), "lobes", "layers" ("paper": lobes and a table over views; "no-table";
// "light-table"; "products" and "slabs", chosen by level within the budget), "budget" (bytes) and "storage"
// ("mixed", "half", "float").

/// Gives the options the values of a JSON object of knobs; a budget counts with "products" and "slabs" alone,
/// which the object names. OPTION_OUT_OF_RANGE names the knob: `file`, and `place` as the JSON pointer to the
/// object.
Result<void> set_knobs(const nlohmann::json& knobs, const std::string& file, const std::string& place,
                       MakeOptions& options);

/// The same of a text that is known to be good.
MakeOptions with_knobs(std::string_view knobs, MakeOptions options = {});

/// All knobs but "directions", and "budget" only where there is one.
nlohmann::ordered_json knobs_of(const MakeOptions& options);

/// As options of `selvedge make --quality paper`, each behind a space: knobs that are not at their defaults.
std::string options_text(const MakeOptions& options);

/// The knobs as a name that is fit for a file.
std::string settings_name(const MakeOptions& options);
/// The part of it that the samples depend on: options with the same name share a bake.
std::string bake_name(const MakeOptions& options);

/// Points of a sweep. `text` is a JSON object with any of
///   "centre": knobs; those left out have their defaults
///   "vary":   knob -> array; each value by itself, in the centre's place
///   "points": array of objects of knobs; those left out are the centre's
/// The centre is always the first point; "vary" may repeat its values, no other point may be there twice.
/// `name` is the file. OPTION_OUT_OF_RANGE names the knob, also one that contradicts another or counts for
/// nothing. At most 1000 points; the texels of each are the largest of all halved some times.
Result<std::vector<MakeOptions>> read_grid(const std::string& text, const std::string& name);

}  // namespace selvedge
