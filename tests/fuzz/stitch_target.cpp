// Bytes -> read_stitch; what it accepts is the same after it was written and read again.

#include "converter/stitch/pattern_json.h"
#include "tests/fuzz/target.h"

using namespace selvedge;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Result<StitchPattern> pattern = read_stitch({reinterpret_cast<const char*>(data), size}, "input");
  if (!pattern) return 0;
  const std::string text = to_json(*pattern);
  const Result<StitchPattern> again = read_stitch(text, "again");
  fuzz::require(again.has_value(), "a stitch that was written can be read");
  fuzz::require(to_json(*again) == text, "a stitch comes back as it was written");
  return 0;
}
