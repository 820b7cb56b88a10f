#include "format/base/atomic_file.h"

#include <doctest/doctest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <vector>

#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

TEST_CASE("a file appears with commit and not before") {
  const Folder folder;
  {
    auto file = test::need(AtomicFile::create(folder / "a"));
    CHECK_FALSE(std::filesystem::exists(folder / "a"));
    test::write_bytes(file.temporary_path(), "whole");
    REQUIRE(file.commit());
  }
  CHECK(test::bytes_of(folder / "a") == "whole");
  CHECK(folder.files() == 1);
}

TEST_CASE("a file that is given up leaves what was there before") {
  const Folder folder;
  REQUIRE(write_file(folder / "a", std::string("before")));
  {
    auto file = test::need(AtomicFile::create(folder / "a"));
    test::write_bytes(file.temporary_path(), "half");
  }
  CHECK(test::bytes_of(folder / "a") == "before");
  CHECK(folder.files() == 1);
}

TEST_CASE("files of a set appear one after the other, and what does not leaves nothing behind") {
  const Folder folder;
  REQUIRE(write_file(folder / "old", std::string("before")));
  std::vector<AtomicFile> files;
  const std::vector<std::uint8_t> bytes{'n', 'e', 'w'};
  for (const char* name : {"old", "folder", "fresh"})
    files.push_back(test::need(stage_file(folder / name, bytes)));
  // A folder that appears in the place of a file meanwhile.
  std::filesystem::create_directory(folder / "folder");
  CHECK(test::error_of(commit_all(std::move(files))).code == Code::file_unwritable);
  CHECK(test::bytes_of(folder / "old") == "new");
  CHECK_FALSE(std::filesystem::exists(folder / "fresh"));
  std::filesystem::remove(folder / "folder");
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
  CHECK(test::error_of(write_file(folder / "pipe", std::string("text"))).code == Code::file_unwritable);
  CHECK(std::filesystem::is_fifo(folder / "pipe"));
}

TEST_CASE("a file that is overwritten keeps its mode, before and after it is complete") {
  namespace fs = std::filesystem;
  const Folder folder;
  const auto mode_of = [](const std::string& path) {
    return static_cast<int>(fs::status(path).permissions());
  };
  for (const int mode : {0600, 0640, 0444, 0755}) {
    CAPTURE(mode);
    REQUIRE(write_file(folder / "a", std::string("before")));
    fs::permissions(folder / "a", static_cast<fs::perms>(mode));
    auto file = test::need(AtomicFile::create(folder / "a"));
    CHECK(mode_of(file.temporary_path()) == 0600);
    test::write_bytes(file.temporary_path() + "x", "");  // of a new file, as the user's mask has it
    const int plain = mode_of(file.temporary_path() + "x");
    fs::remove(file.temporary_path() + "x");
    REQUIRE(file.commit());
    CHECK(mode_of(folder / "a") == mode);
    REQUIRE(write_file(folder / "new", std::string("new")));
    CHECK(mode_of(folder / "new") == plain);
    fs::remove(folder / "new");
    fs::remove(folder / "a");
  }
}

TEST_CASE("a link to a file that is not there is no output") {
  const Folder folder;
  std::filesystem::create_symlink(folder / "none", folder / "link");
  CHECK(test::error_of(write_file(folder / "link", std::string("text"))).code == Code::file_unwritable);
  CHECK_FALSE(std::filesystem::exists(folder / "none"));
  std::filesystem::create_symlink("circle", folder / "circle");
  CHECK(test::error_of(write_file(folder / "circle", std::string("text"))).code == Code::file_unwritable);
}

TEST_CASE("a file or a link in the place of the temporary one is left as it is") {
  const Folder folder;
  // The name of the next temporary file, from this one's.
  const auto first = test::need(AtomicFile::create(folder / "a"));
  const std::string name = first.temporary_path();
  const std::size_t dash = name.rfind('-');
  const std::string next = name.substr(0, dash + 1) + std::to_string(std::stoi(name.substr(dash + 1)) + 1);
  test::write_bytes(folder / "other", "untouched");
  std::filesystem::create_symlink(folder / "other", next);
  auto second = test::need(AtomicFile::create(folder / "a"));
  CHECK(second.temporary_path() != next);
  test::write_bytes(second.temporary_path(), "whole");
  REQUIRE(second.commit());
  CHECK(test::bytes_of(folder / "other") == "untouched");
  CHECK(std::filesystem::is_symlink(next));
  CHECK(test::bytes_of(folder / "a") == "whole");
}

TEST_CASE("a signal removes every unfinished file, however many there are") {
  const Folder folder;
  const pid_t child = fork();
  if (child == 0) {
    remove_unfinished_files_on_signal();
    std::vector<AtomicFile> files;
    for (int i = 0; i < 200; ++i) {
      auto file = AtomicFile::create(folder / std::to_string(i));
      if (!file) _exit(3);
      files.push_back(std::move(*file));
    }
    test::write_bytes(folder / "count", std::to_string(folder.files()));
    raise(SIGTERM);
    _exit(4);
  }
  REQUIRE(child > 0);
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(WIFSIGNALED(status));
  CHECK(test::bytes_of(folder / "count") == "200");
  CHECK(folder.files() == 1);
}
