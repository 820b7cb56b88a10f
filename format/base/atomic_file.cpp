#include "format/base/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <utility>

namespace selvedge {

namespace {

// Signal handlers need a list without locks: entries are never freed, but reused; a path is freed after it
// was removed from its entry.
struct Entry {
  std::atomic<char*> path{nullptr};
  Entry* next = nullptr;
};

std::atomic<Entry*> unfinished_files{nullptr};

Entry* enlist(const std::string& path) {
  char* copy = strdup(path.c_str());
  for (Entry* entry = unfinished_files.load(); entry != nullptr; entry = entry->next) {
    char* expected = nullptr;
    if (entry->path.compare_exchange_strong(expected, copy)) return entry;
  }
  auto* entry = new Entry{copy, unfinished_files.load()};
  while (!unfinished_files.compare_exchange_weak(entry->next, entry)) {
  }
  return entry;
}

extern "C" void on_signal(int number) {
  for (const Entry* entry = unfinished_files.load(); entry != nullptr; entry = entry->next)
    if (const char* path = entry->path.load()) unlink(path);
  std::signal(number, SIG_DFL);
  std::raise(number);
}

std::string reason() { return std::strerror(errno); }

/// The permissions of a file that is there.
std::optional<mode_t> mode_of(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return std::nullopt;
  return status.st_mode & 0777;
}

}  // namespace

/// A temporary file; the destructor removes it unless `temporary` is empty.
struct AtomicFile::Unfinished {
  explicit Unfinished(std::string path) : temporary(std::move(path)), entry(enlist(temporary)) {}
  Unfinished& operator=(Unfinished&&) = delete;
  ~Unfinished() {
    if (exists && !temporary.empty()) unlink(temporary.c_str());
    std::free(entry->path.exchange(nullptr));
  }

  std::string temporary;
  Entry* entry;
  bool exists = false;
};

void remove_unfinished_files_on_signal() {
  // A limit on the size of files then makes a write fail with a reason instead of ending the process.
  std::signal(SIGXFSZ, SIG_IGN);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    // Signals that the caller ignores (nohup) stay ignored.
    if (std::signal(number, on_signal) == SIG_IGN) std::signal(number, SIG_IGN);
  }
}

Result<AtomicFile> AtomicFile::create(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (path.empty()) return fail(Code::file_unwritable, path, {}, "the output has no name");
  if (fs::is_directory(path, ignored)) return fail(Code::file_unwritable, path, {}, "is a folder");
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored))
    return fail(Code::file_unwritable, path, {}, "is a device or a pipe, not a plain file");
  if (fs::is_symlink(path, ignored) && !fs::exists(path, ignored)) {
    // The target belongs to whoever made the symlink.
    return fail(Code::file_unwritable, path, {}, "is a link to a file that is not there");
  }
  // A link stays a link: the file that it points to is replaced.
  const fs::path resolved =
      fs::is_symlink(path, ignored) ? fs::weakly_canonical(fs::absolute(path), ignored) : fs::path();
  const std::string target = resolved.empty() ? path : resolved.string();
  static std::atomic<int> counter{0};
  // An existing file or link belongs to another process: the next name is tried.
  for (int attempt = 0;; ++attempt) {
    const std::string temporary = fmt::format("{}.part-{}-{}", target, getpid(), counter++);
    auto unfinished = std::make_shared<Unfinished>(temporary);
    // The replacement of a private file is private before it is complete, too.
    const int file =
        open(temporary.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, mode_of(target) ? 0600 : 0666);
    constexpr int max_attempts = 100;
    if (file < 0 && (errno != EEXIST || attempt == max_attempts))
      return fail(Code::file_unwritable, path, {}, reason());
    if (file < 0) continue;
    close(file);
    unfinished->exists = true;
    return AtomicFile(target, std::move(unfinished));
  }
}

const std::string& AtomicFile::temporary_path() const { return unfinished_->temporary; }

Result<void> AtomicFile::commit() {
  const auto unfinished = std::move(unfinished_);
  const std::optional<mode_t> mode = mode_of(path_);
  // By name, for others may have written it anew. Where this fails, files have no modes of their own.
  if (mode) static_cast<void>(chmod(unfinished->temporary.c_str(), *mode));
  if (std::rename(unfinished->temporary.c_str(), path_.c_str()) != 0)
    return fail(Code::file_unwritable, path_, {}, reason());
  unfinished->temporary.clear();
  return {};
}

Result<AtomicFile> stage_file(const std::string& path, std::span<const std::uint8_t> bytes) {
  auto file = AtomicFile::create(path);
  if (!file) return file;
  std::FILE* out = std::fopen(file->temporary_path().c_str(), "wb");
  const bool opened = out != nullptr;
  const bool written = opened && std::fwrite(bytes.data(), 1, bytes.size(), out) == bytes.size();
  const bool closed = opened && std::fclose(out) == 0;
  if (!written || !closed) return fail(Code::file_unwritable, path, {}, reason());
  return file;
}

}  // namespace selvedge
