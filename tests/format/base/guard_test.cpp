#include "format/base/guard.h"

#include <doctest/doctest.h>

#include <limits>
#include <vector>

#include "tests/require.h"

using namespace selvedge;

namespace {

template <class F>
Error error_of_throwing(const F& thrower) {
  return test::error_of(catch_exceptions("a.glb", [&]() -> Result<int> {
    thrower();
    return 0;
  }));
}

}  // namespace

TEST_CASE("guard: whatever is thrown is an error of the file, with a code, and a result stays as it is") {
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
  CHECK(catch_exceptions("", [] { return Result<int>(3); }) == 3);
  CHECK(test::error_of(catch_exceptions("", [] {
          return Result<int>(fail(Code::gltf_alpha, "b", "", ""));
        })).file == "b");
}

TEST_CASE("guard: value_or_throw() ends work with the error of a step") {
  const auto half = [](int number) -> Result<int> {
    if (number % 2 != 0) return fail(Code::json_malformed, "b", "", "odd");
    return number / 2;
  };
  CHECK(catch_exceptions(
            "a", [&] { return Result<int>(value_or_throw(half(value_or_throw(half(12)))) + 1); }) == 4);
  const auto renamed = [](Error error) {
    error.file = "c";
    return error;
  };
  const auto fails = [&]() -> Result<int> {
    return map_failure([&] { return value_or_throw(half(value_or_throw(half(10)))); }, renamed);
  };
  CHECK(to_line(test::error_of(catch_exceptions("a", fails))) == "c: odd [JSON_MALFORMED]");
}
