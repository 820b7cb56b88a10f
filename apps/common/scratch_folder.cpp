#include "apps/common/scratch_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>

namespace selvedge {
namespace {

namespace fs = std::filesystem;

/// A descriptor of the user's own folder with an exclusive lock, or -1.
int lock(const std::string& folder) {
  const int file = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (file < 0) return -1;
  struct stat opened {};
  struct stat named {};
  const bool locked = fstat(file, &opened) == 0 && opened.st_uid == geteuid() &&
                      flock(file, LOCK_EX | LOCK_NB) == 0 && stat(folder.c_str(), &named) == 0 &&
                      named.st_ino == opened.st_ino && named.st_dev == opened.st_dev;
  if (locked) return file;
  close(file);
  return -1;
}

void remove_leftovers(const fs::path& temporary, const std::string& prefix) {
  std::error_code ignored;
  for (fs::directory_iterator entry(temporary, ignored), end; entry != end; entry.increment(ignored)) {
    if (!entry->path().filename().string().starts_with(prefix)) continue;
    const int file = lock(entry->path().string());
    if (file < 0) continue;
    std::error_code unremoved;
    fs::remove_all(entry->path(), unremoved);
    close(file);
  }
}

}  // namespace

Result<ScratchFolder> ScratchFolder::create(const std::string& prefix) {
  std::error_code error;
  const fs::path temporary = fs::temp_directory_path(error);
  if (error) return fail(Code::file_unwritable, "", "", error.message());
  remove_leftovers(temporary, prefix);
  // Before it is locked, another run may take it for a leftover.
  constexpr int max_attempts = 100;
  for (int attempt = 0; attempt < max_attempts; ++attempt) {
    std::string path = (temporary / (prefix + "XXXXXX")).string();
    if (mkdtemp(path.data()) == nullptr) break;
    if (const int file = lock(path); file >= 0) return ScratchFolder(std::move(path), file);
  }
  return fail(Code::file_unwritable, temporary.string(), "", std::strerror(errno));
}

ScratchFolder::ScratchFolder(ScratchFolder&& other) noexcept
    : path_(std::exchange(other.path_, {})), lock_(std::exchange(other.lock_, -1)) {}

ScratchFolder::~ScratchFolder() {
  if (lock_ < 0) return;
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  close(lock_);
}

}  // namespace selvedge
