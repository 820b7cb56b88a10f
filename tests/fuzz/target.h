// Shared by all fuzz targets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "format/exr/exr.h"

/// libFuzzer's entry: one reader over one input. Must not leave anything behind.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace selvedge::fuzz {

/// Small, so that an execution is short; the code of the checks is the same.
inline constexpr ExrLimits exr_limits{
    .pixels_per_part = 1 << 16, .bytes_per_read = 1 << 22, .parts = 8, .channels = 1 << 10};

/// A finding, in every build: what has to hold for any input does not.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", what);
  std::abort();
}

}  // namespace selvedge::fuzz
