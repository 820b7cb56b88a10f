#include "format/base/guard.h"

#include <doctest/doctest.h>

#include <limits>
#include <stdexcept>
#include <vector>

#include "tests/require.h"

using namespace selvedge;

namespace {

template <class F>
Error error_of_throwing(const F& thrower) {
  return test::error_of(guarded("a.glb", [&]() -> Result<int> {
    thrower();
    return 0;
  }));
}

}  // namespace

TEST_CASE("guard: whatever is thrown is an error of the file, with a code; a result stays as it is") {
  const Error memory = error_of_throwing([] { throw std::bad_alloc(); });
  CHECK(to_line(memory) == "a.glb: needs more memory than there is [FILE_TOO_LARGE]");
  const Error length = error_of_throwing([] {
    std::vector<double> all;
    all.reserve(std::numeric_limits<std::size_t>::max());
  });
  CHECK(length.code == Code::file_too_large);
  const Error range = error_of_throwing([] { (void)std::string("RIFF").substr(8); });
  CHECK(range.code == Code::file_unreadable);
  CHECK(range.file == "a.glb");
  CHECK(error_of_throwing([] { throw 7; }).message == "cannot be read");
  CHECK(guarded("", [] { return Result<int>(3); }) == 3);
  CHECK(test::error_of(guarded("", [] { return Result<int>(fail(Code::gltf_alpha, "b", "", "")); })).file ==
        "b");
}
