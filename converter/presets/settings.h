// The points of a sweep over speed and accuracy: which settings of the road from stitch to fabric are tried.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "converter/bake/bake.h"
#include "fitter/fit.h"
#include "format/fabric/file.h"

namespace selvedge {

/// Which layers a fabric has.
enum class LayerChoice {
  paper,        ///< lobes and a table over views
  no_table,     ///< lobes alone
  light_table,  ///< the paper's and a table over lights
  products,     ///< chosen by level within a budget, without slabs
  slabs         ///< the same from a bake with slabs
};

/// In which precision values are stored.
enum class Storage { mixed, half, whole };

/// One setting of every knob. The defaults are those of `selvedge make`.
struct TradePoint {
  int texels = 32;  ///< along both sides
  int views = 64;   ///< of the bake, and entries of the table
  int lights = 64;
  int samples = 8;
  int bounces = 2;  ///< or unlimited_bounces
  int lobes = 2;
  LayerChoice layers = LayerChoice::paper;
  std::uint64_t budget = 0;  ///< bytes; counts with products and slabs alone
  Storage storage = Storage::mixed;
  bool operator==(const TradePoint&) const = default;
};

/// Whether its layers are chosen within its budget.
bool has_budget(const TradePoint& point);

/// What tells it from others, fit for a file's name.
std::string name_of(const TradePoint& point);
/// The part of it that the samples depend on: points with the same name share a bake.
std::string bake_name_of(const TradePoint& point);

/// As options of `selvedge make`: those that differ from its defaults.
std::string options_text(const TradePoint& point);

/// As JSON: an object with all knobs.
std::string knobs_json(const TradePoint& point);

BakeOptions bake_options_of(const TradePoint& point, std::uint64_t seed);

/// The options of the fit and of the file; the budget is the point's own.
struct TradeFit {
  FitOptions fit;
  FabricWriteOptions write;
};
TradeFit fit_options_of(const TradePoint& point);

/// One knob at a time around what `make` does by default, and chosen settings that are cheap or good in
/// several at once.
std::vector<TradePoint> default_grid();

/// A grid file: an object with any of
///   "centre": knobs; those left out are the defaults
///   "vary":   knob -> array; each value by itself, in the centre's place
///   "points": array of knobs; those left out are the centre's
/// The centre is always a point; "vary" may repeat its values, no other point may be there twice. Knobs are
/// "texels", "views", "lights", "directions" (both), "samples", "bounces" (a number or "unlimited"), "lobes",
/// "layers" ("paper", "no-table", "light-table", "products", "slabs"), "budget" (bytes) and "storage"
/// ("mixed", "half", "float"). `name` is the file. OPTION_OUT_OF_RANGE names the knob, also one that
/// contradicts another or counts for nothing; at most 1000 points, whose texels are the largest's halved.
Result<std::vector<TradePoint>> read_grid(const std::string& text, const std::string& name);

}  // namespace selvedge
