#include "format/atomic_file.h"

#include <doctest/doctest.h>
#include <sys/stat.h>

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

TEST_CASE("a link stays a link, and what is no plain file stays as it is") {
  const Folder folder;
  REQUIRE(write_file(folder / "a", std::string("before")));
  std::filesystem::create_symlink(folder / "a", folder / "link");
  REQUIRE(write_file(folder / "link", std::string("after")));
  CHECK(std::filesystem::is_symlink(folder / "link"));
  CHECK(test::bytes_of(folder / "a") == "after");
  REQUIRE(mkfifo((folder / "pipe").c_str(), 0600) == 0);
  const auto refused = write_file(folder / "pipe", std::string("text"));
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Code::file_unwritable);
  CHECK(std::filesystem::is_fifo(folder / "pipe"));
}

TEST_CASE("a place that cannot be written to is named") {
  const Folder folder;
  const auto file = AtomicFile::create(folder / "absent/a");
  REQUIRE_FALSE(file);
  CHECK(file.error().code == Code::file_unwritable);
  CHECK(file.error().file == folder / "absent/a");
}
