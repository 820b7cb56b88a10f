#include "format/base/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <utility>
#include <vector>

#include "format/base/input_file.h"

namespace selvedge {

// What a signal handler may touch: a list that only grows, of plain pointers to strings that live until they
// are taken out. As many entries as files were ever unfinished at once.
struct UnfinishedFile {
  std::atomic<char*> path{nullptr};
  UnfinishedFile* next = nullptr;
};

namespace {

std::atomic<UnfinishedFile*> unfinished{nullptr};

UnfinishedFile* enlist(const std::string& path) {
  char* copy = strdup(path.c_str());
  for (UnfinishedFile* entry = unfinished.load(); entry != nullptr; entry = entry->next) {
    char* expected = nullptr;
    if (entry->path.compare_exchange_strong(expected, copy)) return entry;
  }
  auto* entry = new UnfinishedFile;
  entry->path = copy;
  entry->next = unfinished.load();
  while (!unfinished.compare_exchange_weak(entry->next, entry)) {
  }
  return entry;
}

void delist(UnfinishedFile* entry) {
  if (entry != nullptr) std::free(entry->path.exchange(nullptr));
}

extern "C" void on_signal(int number) {
  for (const UnfinishedFile* entry = unfinished.load(); entry != nullptr; entry = entry->next) {
    if (const char* path = entry->path.load()) unlink(path);
  }
  std::signal(number, SIG_DFL);
  std::raise(number);
}

std::string reason() { return std::strerror(errno); }

/// The process that made a temporary file, from what its name has after the target's: ".part-PID-N", and what
/// lies beside that file as that of an output (".part-PID-N.journal"). 0: no such name.
long maker_of(std::string_view suffix) {
  constexpr std::string_view begin = ".part-";
  if (!suffix.starts_with(begin)) return 0;
  suffix.remove_prefix(begin.size());
  const auto number = [&] {
    long value = 0;
    const auto [end, error] = std::from_chars(suffix.data(), suffix.data() + suffix.size(), value);
    if (error != std::errc()) return -1L;
    suffix.remove_prefix(static_cast<std::size_t>(end - suffix.data()));
    return value;
  };
  const long process = number();
  if (process <= 0 || !suffix.starts_with('-')) return 0;
  suffix.remove_prefix(1);
  return number() >= 0 && (suffix.empty() || suffix.front() == '.') ? process : 0;
}

/// What programs that were killed have left of this target: the files of processes that are gone, here and,
/// by their locks, on other machines that share the folder.
void remove_leftovers(const std::filesystem::path& target) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const std::string name = target.filename().string();
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  std::vector<fs::path> left;
  for (fs::directory_iterator entry(folder, ignored), end; entry != end; entry.increment(ignored)) {
    const std::string found = entry->path().filename().string();
    if (!found.starts_with(name)) continue;
    const long maker = maker_of(std::string_view(found).substr(name.size()));
    if (maker == 0 || kill(static_cast<pid_t>(maker), 0) == 0 || errno != ESRCH) continue;
    left.push_back(entry->path());
  }
  for (const fs::path& path : left) {
    const int file = open(path.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (file < 0) continue;
    struct stat status {};
    const bool is_plain = fstat(file, &status) == 0 && S_ISREG(status.st_mode);
    if (is_plain && flock(file, LOCK_EX | LOCK_NB) == 0) unlink(path.c_str());
    close(file);
  }
}

/// Locks a new file, unless somebody has just taken it away as a leftover.
bool lock_new(int file, const std::string& path) {
  struct stat open_file {};
  struct stat named {};
  // Where the file system knows no locks, nobody takes files away either.
  if (flock(file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) return false;
  return fstat(file, &open_file) == 0 && stat(path.c_str(), &named) == 0 &&
         open_file.st_ino == named.st_ino && open_file.st_dev == named.st_dev;
}

}  // namespace

void remove_unfinished_files_on_signal() {
  // A limit on the size of files then is a failed write with its reason, not a sudden end.
  std::signal(SIGXFSZ, SIG_IGN);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    // What the caller ignores (nohup) stays ignored.
    if (std::signal(number, on_signal) == SIG_IGN) std::signal(number, SIG_IGN);
  }
}

Result<AtomicFile> AtomicFile::create(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (path.empty()) return fail(Code::file_unwritable, path, {}, "the output has no name");
  if (fs::is_directory(path, ignored)) return fail(Code::file_unwritable, path, {}, "is a folder");
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) {
    return fail(Code::file_unwritable, path, {}, "is a device or a pipe, not a plain file");
  }
  // A link stays a link: what it points to is replaced.
  const fs::path resolved =
      fs::is_symlink(path, ignored) ? fs::weakly_canonical(fs::absolute(path), ignored) : fs::path();
  const std::string target = resolved.empty() ? path : resolved.string();
  remove_leftovers(target);
  static std::atomic<int> counter{0};
  // What is there already, a link above all, was made by someone else: the next name is tried.
  for (int attempt = 0;; ++attempt) {
    const std::string temporary = fmt::format("{}.part-{}-{}", target, getpid(), counter++);
    UnfinishedFile* entry = enlist(temporary);
    const int file = open(temporary.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    int error = errno;
    if (file >= 0) {
      if (lock_new(file, temporary)) return AtomicFile(target, temporary, file, entry);
      close(file);
      error = EEXIST;
    }
    delist(entry);
    constexpr int max_attempts = 100;
    if (error != EEXIST || attempt == max_attempts) {
      return fail(Code::file_unwritable, path, {}, std::strerror(error));
    }
  }
}

AtomicFile::AtomicFile(std::string path, std::string temporary, int file, UnfinishedFile* entry)
    : path_(std::move(path)), temporary_(std::move(temporary)), file_(file), entry_(entry) {}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_(std::exchange(other.temporary_, {})),
      file_(std::exchange(other.file_, -1)),
      entry_(std::exchange(other.entry_, nullptr)) {}

AtomicFile& AtomicFile::operator=(AtomicFile&& other) noexcept {
  if (this != &other) {
    discard();
    path_ = std::move(other.path_);
    temporary_ = std::exchange(other.temporary_, {});
    file_ = std::exchange(other.file_, -1);
    entry_ = std::exchange(other.entry_, nullptr);
  }
  return *this;
}

AtomicFile::~AtomicFile() { discard(); }

void AtomicFile::discard() {
  if (!temporary_.empty()) unlink(temporary_.c_str());
  release();
}

void AtomicFile::release() {
  temporary_.clear();
  if (file_ >= 0) close(std::exchange(file_, -1));
  delist(std::exchange(entry_, nullptr));
}

Result<void> AtomicFile::commit() {
  if (std::rename(temporary_.c_str(), path_.c_str()) != 0) {
    const std::string why = reason();
    discard();
    return fail(Code::file_unwritable, path_, {}, why);
  }
  release();
  return {};
}

Result<void> write_file(const std::string& path, std::span<const std::uint8_t> bytes) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  std::FILE* out = std::fopen(file->temporary().c_str(), "wb");
  const bool opened = out != nullptr;
  const bool written = opened && std::fwrite(bytes.data(), 1, bytes.size(), out) == bytes.size();
  const bool closed = opened && std::fclose(out) == 0;
  if (!written || !closed) return fail(Code::file_unwritable, path, {}, reason());
  return file->commit();
}

Result<void> write_file(const std::string& path, const std::string& text) {
  return write_file(path, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

Result<std::string> read_file(const std::string& path, std::uintmax_t limit) {
  const Result<InputFile> file = InputFile::open(path);
  if (!file) return tl::unexpected(file.error());
  if (file->size() > limit) {
    return fail(Code::file_too_large, path, {}, fmt::format("larger than {} bytes", limit));
  }
  std::string text(file->size(), '\0');
  if (!file->read(0, {reinterpret_cast<std::uint8_t*>(text.data()), text.size()})) {
    return fail(Code::file_unreadable, path, {}, reason());
  }
  return text;
}

}  // namespace selvedge
