#include "format/atomic_file.h"

#include <doctest/doctest.h>

#include "files.h"

using namespace selvedge;
using test::Folder;

TEST_CASE("a file appears with commit and not before") {
  const Folder folder;
  {
    auto file = AtomicFile::create(folder / "a");
    REQUIRE(file);
    CHECK_FALSE(std::filesystem::exists(folder / "a"));
    test::write_bytes(file->temporary(), "whole");
    REQUIRE(file->commit());
  }
  CHECK(test::bytes_of(folder / "a") == "whole");
  CHECK(folder.files() == 1);
}

TEST_CASE("a file that is given up leaves what was there before") {
  const Folder folder;
  REQUIRE(write_file(folder / "a", std::string("before")));
  {
    auto file = AtomicFile::create(folder / "a");
    REQUIRE(file);
    test::write_bytes(file->temporary(), "half");
  }
  CHECK(test::bytes_of(folder / "a") == "before");
  CHECK(folder.files() == 1);
}

TEST_CASE("a place that cannot be written to is named") {
  const Folder folder;
  const auto file = AtomicFile::create(folder / "absent/a");
  REQUIRE_FALSE(file);
  CHECK(file.error().code == Code::file_unwritable);
  CHECK(file.error().file == folder / "absent/a");
}
