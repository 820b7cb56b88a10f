#include "converter/presets/presets.h"

#include <doctest/doctest.h>

#include <set>
#include <string>

using namespace selvedge;

namespace {

/// The row of the table that is the preset; null where there is none.
const MeasuredSetting* row_of(const Preset& preset) {
  for (const MeasuredSetting& row : measured_settings()) {
    if (settings_name(with_knobs(row.knobs)) == settings_name(*preset_named(preset.name))) return &row;
  }
  return nullptr;
}

// Runs of the same setting differ by so much: times by what else a machine does, pictures and bytes by what
// another seed makes of them. The same as in tests/bench/make_presets.mjs.
constexpr double noise_of_seconds = 0.1;
constexpr double noise_of_pictures = 0.05;
constexpr double noise_of_bytes = 0.01;

/// Whether `a` beats `b`: no worse in anything beyond the noise, and better in something beyond it.
bool beats(const MeasuredSetting& a, const MeasuredSetting& b) {
  const bool no_worse =
      a.bytes <= b.bytes * (1 + noise_of_bytes) && a.seconds <= b.seconds * (1 + noise_of_seconds) &&
      a.held_out >= b.held_out - noise_of_pictures && a.pictures >= b.pictures - noise_of_pictures;
  const bool better =
      a.bytes < b.bytes * (1 - noise_of_bytes) || a.seconds < b.seconds * (1 - noise_of_seconds) ||
      a.held_out > b.held_out + noise_of_pictures || a.pictures > b.pictures + noise_of_pictures;
  return no_worse && better;
}

}  // namespace

TEST_CASE("every preset is a point of the measured grid, each better and dearer than the one before") {
  const MeasuredSetting* before = nullptr;
  for (const Preset& named : presets) {
    CAPTURE(named.name);
    const MeasuredSetting* row = row_of(named);
    REQUIRE(row != nullptr);
    if (before != nullptr) {
      // Close by all of them show the yarn: they differ in their levels.
      CHECK(row->held_out > before->held_out + noise_of_pictures);
      CHECK(row->seconds > before->seconds);
    }
    before = row;
  }
  CHECK_FALSE(preset_named("best"));
  CHECK(settings_name(*preset_named("paper")) == settings_name(MakeOptions()));
}

TEST_CASE("no preset is beaten by any point of the measured grid beyond the noise") {
  REQUIRE(measured_settings().size() > 10);
  for (const Preset& named : presets) {
    const MeasuredSetting* preset = row_of(named);
    REQUIRE(preset != nullptr);
    for (const MeasuredSetting& row : measured_settings()) {
      CHECK_MESSAGE(!beats(row, *preset), named.name, " by ", row.knobs);
    }
  }
}

TEST_CASE("the measured table begins with the paper's settings, and has each setting once") {
  CHECK(settings_name(with_knobs(measured_settings().front().knobs)) == settings_name(MakeOptions()));
  std::set<std::string> names;
  std::set<std::string> options;
  for (const MeasuredSetting& row : measured_settings()) {
    names.insert(settings_name(with_knobs(row.knobs)));
    options.insert(options_text(with_knobs(row.knobs)));
  }
  CHECK(names.size() == measured_settings().size());
  CHECK(options.size() == measured_settings().size());
}
