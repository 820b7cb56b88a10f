#include "converter/bake/journal.h"

#include <Imath/half.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "format/base/digest.h"

namespace selvedge {
namespace {

constexpr const char* magic = "SELVEDGE-BAKE-2";
constexpr std::size_t digest_size = 32;

tl::unexpected<Error> unwritable(const std::string& path) {
  return fail(Code::file_unwritable, path, {}, std::strerror(errno));
}

tl::unexpected<Error> malformed(const std::string& path, std::string message) {
  return fail(Code::samples_malformed, path, "journal", std::move(message));
}

std::string head_of(const SamplesHeader& header, const BakeShard& shard) {
  const std::string text = samples_header_to_json(header);
  return fmt::format("{} {} {} {} {}\n{}", magic, shard.index, shard.count, digest_of(text), text.size(),
                     text);
}

bool is_in(const BakeShard& shard, std::size_t unit) {
  return static_cast<int>(unit % shard.count) == shard.index;
}

/// Reads exactly `count` bytes; nothing if there are fewer.
std::optional<std::string> read_bytes(std::FILE* file, std::size_t count) {
  // A header may declare records of any size: asked of the file before there is room for one.
  struct stat status {};
  const off_t at = ftello(file);
  if (fstat(fileno(file), &status) != 0 || at < 0 || at > status.st_size ||
      count > static_cast<std::size_t>(status.st_size - at))
    return std::nullopt;
  std::string bytes(count, '\0');
  if (std::fread(bytes.data(), 1, count, file) != count) return std::nullopt;
  return bytes;
}

struct Head {
  SamplesHeader header;
  BakeShard shard;
};

Result<Head> read_head(std::FILE* file, const std::string& path) {
  // The samples file has the text in its header.
  constexpr std::size_t max_text = ExrLimits{}.header_bytes;
  std::string line(256, '\0');
  if (std::fgets(line.data(), static_cast<int>(line.size()), file) == nullptr) line.clear();
  std::istringstream words(line);
  std::string first;
  std::string digest;
  std::size_t length = 0;
  Head head;
  if (!(words >> first >> head.shard.index >> head.shard.count >> digest >> length) || first != magic) {
    return malformed(path, "is not a journal of a bake");
  }
  const auto text = length > max_text ? std::nullopt : read_bytes(file, length);
  const bool sound = head.shard.count > 0 && head.shard.index >= 0 && head.shard.index < head.shard.count;
  if (!text || digest_of(*text) != digest || !sound) return malformed(path, "its header is damaged");
  auto header = samples_header_from_json(*text, path);
  if (!header) return tl::unexpected(header.error());
  head.header = std::move(*header);
  return head;
}

}  // namespace

/// Null for pipes, folders and devices: opening a pipe would block.
BakeJournal::File BakeJournal::open_file(const std::string& path, const char* mode) {
  std::error_code ignored;
  return File(std::filesystem::is_regular_file(path, ignored) ? std::fopen(path.c_str(), mode) : nullptr);
}

BakeJournal::BakeJournal(std::string path, SamplesHeader header, const BakeShard& shard, File file)
    : path_(std::move(path)), header_(std::move(header)), file_(std::move(file)) {
  auto place = static_cast<long>(head_of(header_, shard).size());
  const std::vector<BakeUnit> units = units_of(header_);
  units_.resize(units.size());
  for (std::size_t u = 0; u < units.size(); ++u) {
    if (!is_in(shard, u)) continue;
    // Yarn is geometry, which half precision would bend.
    const bool whole = units[u].kind == BakeUnit::Kind::yarns;
    const std::size_t bytes = value_count(header_, units[u]) * (whole ? sizeof(float) : sizeof(Imath::half));
    units_[u] = {place, bytes + sizeof(NoiseSum) + digest_size, whole, {}};
    place += static_cast<long>(units_[u].bytes);
  }
}

std::optional<std::string> BakeJournal::read_record(const Unit& unit) {
  if (std::fseek(file_.get(), unit.begin, SEEK_SET) != 0) return std::nullopt;
  auto record = read_bytes(file_.get(), unit.bytes);
  if (!record) return std::nullopt;
  const std::string digest = record->substr(record->size() - digest_size);
  record->resize(record->size() - digest_size);
  return digest_of(*record) == digest ? record : std::nullopt;
}

void BakeJournal::read_units() {
  for (Unit& unit : units_) {
    const auto record = unit.bytes > 0 ? read_record(unit) : std::nullopt;
    if (!record) continue;
    unit.noise.emplace();
    std::memcpy(&*unit.noise, record->data() + record->size() - sizeof(NoiseSum), sizeof(NoiseSum));
  }
}

Result<BakeJournal> BakeJournal::open(const std::string& path, const SamplesHeader& header,
                                      const BakeShard& shard, bool lasting) {
  const std::string head = head_of(header, shard);
  if (lasting) {
    File file = open_file(path, "r+b");
    if (file && flock(fileno(file.get()), LOCK_EX | LOCK_NB) != 0) {
      return fail(Code::file_unwritable, path, {}, "another bake is writing it");
    }
    if (file && read_bytes(file.get(), head.size()) == head) {
      BakeJournal journal(path, header, shard, std::move(file));
      journal.read_units();
      return journal;
    }
  }
  auto unnamed = AtomicFile::create(path);
  if (!unnamed) return tl::unexpected(unnamed.error());
  // Duplicated descriptors share the lock of the unnamed file.
  File file(fdopen(fcntl(unnamed->descriptor(), F_DUPFD_CLOEXEC, 0), "w+b"));
  if (!file || std::fwrite(head.data(), 1, head.size(), file.get()) != head.size()) return unwritable(path);
  BakeJournal journal(path, header, shard, std::move(file));
  journal.unnamed_ = std::move(*unnamed);
  journal.lasting_ = lasting;
  return journal;
}

Result<BakeJournal> BakeJournal::read(const std::string& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return fail(Code::file_missing, path, {}, "no such file");
  File file = open_file(path, "rb");
  if (!file) return fail(Code::file_unreadable, path, {}, "cannot be opened as a file");
  const auto head = read_head(file.get(), path);
  if (!head) return tl::unexpected(head.error());
  BakeJournal journal(path, head->header, head->shard, std::move(file));
  journal.read_units();
  for (std::size_t u = 0; u < journal.units_.size(); ++u) {
    if (is_in(head->shard, u) && !journal.has(u))
      return malformed(path, fmt::format("unit {} is damaged", u));
  }
  return journal;
}

Result<void> BakeJournal::write(std::size_t unit, const Planes& planes, const NoiseSum& noise) {
  std::string record(units_[unit].bytes - digest_size - sizeof noise, '\0');
  char* at = record.data();
  for (const auto& plane : planes) {
    for (const float value : plane) {
      const Imath::half half(value);
      const std::size_t size = units_[unit].whole ? sizeof value : sizeof half;
      std::memcpy(at, units_[unit].whole ? static_cast<const void*>(&value) : &half, size);
      at += size;
    }
  }
  record.append(reinterpret_cast<const char*>(&noise), sizeof noise);
  record += digest_of(record);
  // Flushed at once: a unit that the kernel has survives if the program is killed.
  if (std::fseek(file_.get(), units_[unit].begin, SEEK_SET) != 0 ||
      std::fwrite(record.data(), 1, record.size(), file_.get()) != record.size() ||
      std::fflush(file_.get()) != 0) {
    return unwritable(path_);
  }
  units_[unit].noise = noise;
  return lasting_ ? give_name() : Result<void>();
}

Result<void> BakeJournal::read(std::size_t unit, const Planes& planes) {
  const auto record = read_record(units_[unit]);
  if (!record) return fail(Code::file_unreadable, path_, {}, "a unit can no longer be read");
  const char* at = record->data();
  for (const auto& plane : planes) {
    for (float& value : plane) {
      Imath::half half;
      const std::size_t size = units_[unit].whole ? sizeof value : sizeof half;
      std::memcpy(units_[unit].whole ? static_cast<void*>(&value) : &half, at, size);
      at += size;
      if (!units_[unit].whole) value = half;
    }
  }
  return {};
}

Result<void> BakeJournal::give_name() {
  if (!unnamed_) return {};
  // Another bake may have given its journal this name since this one began.
  const File other = lasting_ ? open_file(path_, "r+b") : nullptr;
  if (other && flock(fileno(other.get()), LOCK_EX | LOCK_NB) != 0)
    return fail(Code::file_unwritable, path_, {}, "another bake is writing it");
  if (auto ok = unnamed_->commit(); !ok) return ok;
  unnamed_.reset();
  return {};
}

Result<void> BakeJournal::rename(const std::string& name) {
  if (auto ok = give_name(); !ok) return ok;
  if (std::rename(path_.c_str(), name.c_str()) != 0) return unwritable(name);
  path_ = name;
  return {};
}

void BakeJournal::remove() {
  if (!unnamed_) std::remove(path_.c_str());
  unnamed_.reset();
}

}  // namespace selvedge
