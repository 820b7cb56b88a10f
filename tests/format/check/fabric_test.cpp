// The checker is the reader, and finds the reader's error first. The conformance kit has the rules
// themselves, and its broken files run against `selvedge`.
#include "format/check/fabric.h"

#include <doctest/doctest.h>

#include "format/fabric/file.h"
#include "tests/format/damage.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

namespace {

/// The same verdict: both read it, or both name the same first error.
void check_alike(const std::string& bytes) {
  const auto read = read_fabric(test::as_bytes(bytes), "a.exr");
  const CheckedFabric checked = check_fabric(test::as_bytes(bytes), "a.exr");
  REQUIRE(read.has_value() == checked.fabric.has_value());
  REQUIRE(has_error(checked.issues) == !read.has_value());
  if (!read) REQUIRE(to_line(checked.issues.front()) == to_line(read.error()));
}

}  // namespace

TEST_CASE("a damaged or truncated fabric is judged alike by reader and checker") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "a.exr", test::random_fabric(2, 1, {1, 2}, 1, 3)));
  const std::string bytes = test::bytes_of(folder / "a.exr");
  for (std::size_t at = 0; at < bytes.size(); at += 1 + bytes.size() / 200) {
    CAPTURE(at);
    check_alike(bytes.substr(0, at));
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 1 << at % 8);
    check_alike(damaged);
  }
}

TEST_CASE("of a broken file all errors are listed") {
  const Folder folder;
  Fabric fabric = test::random_fabric(8, 8, {2, 2}, 1, 3);
  REQUIRE(write_fabric(folder / "a.exr", fabric));
  std::string bytes = test::bytes_of(folder / "a.exr");
  const std::size_t at = bytes.find("\"radianceScale\"");
  CHECK(at == std::string::npos);  // it is 1
  for (const char* member : {"\"thickness\"", "\"referenceHeight\""}) {
    const std::size_t where = bytes.find(member);
    REQUIRE(where != std::string::npos);
    bytes[where + 1] = 'x';
  }
  const CheckedFabric checked = check_fabric(test::as_bytes(bytes), "a.exr");
  REQUIRE(checked.issues.size() == 2);
  CHECK(checked.issues[0].place == "/referenceHeight");
  CHECK(checked.issues[1].place == "/thickness");
}
