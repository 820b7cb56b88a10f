#include "converter/bake/journal.h"

#include <Imath/half.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <optional>

#include "format/base/atomic_file.h"
#include "format/base/digest.h"
#include "format/exr/exr.h"

namespace selvedge {
namespace {

constexpr std::string_view magic = "SELVEDGE-BAKE-1\n";
constexpr std::size_t digest_size = 32;
constexpr std::uint64_t longest_text = std::uint64_t{1} << 28;

struct FileCloser {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, FileCloser>;

/// Null for what is no plain file: a pipe would be waited for.
File open_plain(const std::string& path, const char* mode) {
  std::error_code ignored;
  return File(std::filesystem::is_regular_file(path, ignored) ? std::fopen(path.c_str(), mode) : nullptr);
}

template <class T>
void put(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class T>
T take(const std::string& bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

/// Exactly so many bytes, or nothing.
std::optional<std::string> read_bytes(std::FILE* file, std::uint64_t count) {
  std::string bytes(count, '\0');
  if (std::fread(bytes.data(), 1, count, file) != count) return std::nullopt;
  return bytes;
}

struct Record {
  long values = 0;  // where they begin in the file
  std::uint64_t bytes = 0;
  NoiseSum noise;
};
constexpr std::size_t record_head = 32;

std::size_t units_in(const SamplesHeader& h) {
  auto units = static_cast<std::size_t>(h.views.count());
  for (const PairKind kind : all_pair_kinds) units += h.pairs[index_of(kind)].size();
  return units + (h.slabs ? 1 : 0);
}

/// Bytes of a unit's values.
std::uint64_t size_of(const SamplesHeader& h, std::size_t unit) {
  const auto texels = static_cast<std::uint64_t>(h.texels());
  if (h.slabs && unit + 1 == units_in(h)) {
    return texels * 2 * static_cast<std::uint64_t>(h.slabs->entries()) * sizeof(Imath::half);
  }
  const bool is_view = unit < static_cast<std::size_t>(h.views.count());
  return texels * (is_view ? 4 + 3 * static_cast<std::uint64_t>(h.lights.count()) : 8) * sizeof(Imath::half);
}

std::string reason() { return std::strerror(errno); }

}  // namespace

struct BakeJournal::State {
  std::string path;
  SamplesHeader header;
  BakeShard shard;
  std::map<std::size_t, Record> records;
  long end = 0;
  bool lasting = true;
  std::optional<AtomicFile> unnamed;  // until the first record is there
  File file;
};

BakeJournal::BakeJournal(std::unique_ptr<State> state) : state_(std::move(state)) {}
BakeJournal::BakeJournal(BakeJournal&&) noexcept = default;
BakeJournal& BakeJournal::operator=(BakeJournal&&) noexcept = default;
BakeJournal::~BakeJournal() = default;
const std::string& BakeJournal::path() const { return state_->path; }
const SamplesHeader& BakeJournal::header() const { return state_->header; }
const BakeShard& BakeJournal::shard() const { return state_->shard; }
bool BakeJournal::has(std::size_t unit) const { return state_->records.contains(unit); }
NoiseSum BakeJournal::noise(std::size_t unit) const { return state_->records.at(unit).noise; }

namespace {

tl::unexpected<Error> malformed(const std::string& path, std::string message) {
  return fail(Code::samples_malformed, path, "journal", std::move(message));
}

/// Text and shard, up to where the records begin.
Result<std::pair<std::string, BakeShard>> read_head(std::FILE* file, const std::string& path) {
  const auto begin = read_bytes(file, magic.size() + 8);
  if (!begin || begin->substr(0, magic.size()) != magic) return malformed(path, "is not a journal of a bake");
  const auto length = take<std::uint64_t>(*begin, magic.size());
  if (length > longest_text) return malformed(path, "its header is too long");
  const auto rest = read_bytes(file, length + 8 + digest_size);
  if (!rest) return malformed(path, "its header is cut short");
  const std::string head = *begin + rest->substr(0, length + 8);
  if (digest_of(head) != rest->substr(length + 8)) return malformed(path, "its header is damaged");
  return std::pair{rest->substr(0, length),
                   BakeShard{take<std::int32_t>(*rest, length), take<std::int32_t>(*rest, length + 4)}};
}

/// The next record, if it is whole.
std::optional<std::size_t> read_record(std::FILE* file, const SamplesHeader& header, Record& record) {
  const auto head = read_bytes(file, record_head + digest_size);
  if (!head) return std::nullopt;
  const auto unit = take<std::uint64_t>(*head, 0);
  record.bytes = take<std::uint64_t>(*head, 8);
  record.noise = {take<double>(*head, 16), take<double>(*head, 24)};
  if (unit >= units_in(header) || record.bytes != size_of(header, unit)) return std::nullopt;
  record.values = std::ftell(file);
  const auto values = read_bytes(file, record.bytes);
  if (!values || digest_of(head->substr(0, record_head) + *values) != head->substr(record_head)) {
    return std::nullopt;
  }
  return unit;
}

}  // namespace

Result<BakeJournal> BakeJournal::open(const std::string& path, const SamplesHeader& header,
                                      const BakeShard& shard, bool lasting) {
  auto state = std::make_unique<State>();
  state->path = path;
  state->header = header;
  state->shard = shard;
  state->lasting = lasting;
  const std::string text = text_of(header);
  const auto lock = [&]() -> Result<void> {
    if (flock(fileno(state->file.get()), LOCK_EX | LOCK_NB) == 0) return {};
    return fail(Code::file_unwritable, path, {}, "another bake is writing it");
  };
  if (lasting) {
    state->file = open_plain(path, "r+b");
    if (state->file) {
      if (auto ok = lock(); !ok) return tl::unexpected(ok.error());
      const auto head = read_head(state->file.get(), path);
      if (head && head->first == text && head->second.index == shard.index &&
          head->second.count == shard.count) {
        Record record;
        state->end = std::ftell(state->file.get());
        while (const auto unit = read_record(state->file.get(), header, record)) {
          state->records[*unit] = record;
          state->end = std::ftell(state->file.get());
        }
        // What follows was cut off when the program ended.
        if (ftruncate(fileno(state->file.get()), state->end) != 0) {
          return fail(Code::file_unwritable, path, {}, reason());
        }
        return BakeJournal(std::move(state));
      }
    }
  }
  auto unnamed = AtomicFile::create(path);
  if (!unnamed) return tl::unexpected(unnamed.error());
  state->unnamed = std::move(*unnamed);
  // The lock is the file's, whoever holds it open.
  state->file.reset(fdopen(fcntl(state->unnamed->descriptor(), F_DUPFD_CLOEXEC, 0), "w+b"));
  if (!state->file) return fail(Code::file_unwritable, path, {}, reason());
  std::string head(magic);
  put(head, static_cast<std::uint64_t>(text.size()));
  head += text;
  put(head, static_cast<std::int32_t>(shard.index));
  put(head, static_cast<std::int32_t>(shard.count));
  head += digest_of(head);
  if (std::fwrite(head.data(), 1, head.size(), state->file.get()) != head.size() ||
      std::fflush(state->file.get()) != 0) {
    return fail(Code::file_unwritable, path, {}, reason());
  }
  state->end = static_cast<long>(head.size());
  return BakeJournal(std::move(state));
}

std::optional<SamplesHeader> BakeJournal::read_header(const std::string& path) {
  const File file = open_plain(path, "rb");
  if (!file) return std::nullopt;
  const auto head = read_head(file.get(), path);
  if (!head) return std::nullopt;
  const auto header = samples_header_of(head->first, path);
  return header ? std::optional(*header) : std::nullopt;
}

Result<BakeJournal> BakeJournal::read(const std::string& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return fail(Code::file_missing, path, {}, "no such file");
  auto state = std::make_unique<State>();
  state->path = path;
  state->file = open_plain(path, "rb");
  if (!state->file) return fail(Code::file_unreadable, path, {}, "cannot be opened as a file");
  auto head = read_head(state->file.get(), path);
  if (!head) return tl::unexpected(head.error());
  auto header = samples_header_of(head->first, path);
  if (!header) return tl::unexpected(header.error());
  state->header = std::move(*header);
  state->shard = head->second;
  const auto size = static_cast<long>(std::filesystem::file_size(path, ignored));
  while (std::ftell(state->file.get()) < size) {
    Record record;
    const auto unit = read_record(state->file.get(), state->header, record);
    if (!unit) return malformed(path, fmt::format("record {} is damaged", state->records.size()));
    state->records[*unit] = record;
  }
  return BakeJournal(std::move(state));
}

Result<void> BakeJournal::append_values(std::size_t unit, const std::vector<float>& values,
                                        const NoiseSum& noise) {
  std::string bytes(values.size() * sizeof(Imath::half), '\0');
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Imath::half h(values[i]);
    std::memcpy(bytes.data() + i * sizeof h, &h, sizeof h);
  }
  std::string head;
  put(head, static_cast<std::uint64_t>(unit));
  put(head, static_cast<std::uint64_t>(bytes.size()));
  put(head, noise.error2);
  put(head, noise.signal2);
  head += digest_of(head + bytes);
  std::FILE* file = state_->file.get();
  // Out of the program at once: what is in the system's hands survives the program's end.
  if (std::fseek(file, state_->end, SEEK_SET) != 0 ||
      std::fwrite(head.data(), 1, head.size(), file) != head.size() ||
      std::fwrite(bytes.data(), 1, bytes.size(), file) != bytes.size() || std::fflush(file) != 0) {
    return fail(Code::file_unwritable, state_->path, {}, reason());
  }
  const long begin = state_->end + static_cast<long>(head.size());
  state_->records[unit] = {begin, bytes.size(), noise};
  state_->end = begin + static_cast<long>(bytes.size());
  if (state_->lasting && state_->unnamed) {
    if (auto ok = state_->unnamed->commit(); !ok) return ok;
    state_->unnamed.reset();
  }
  return {};
}

Result<std::vector<float>> BakeJournal::read_values(std::size_t unit) {
  const Record& record = state_->records.at(unit);
  std::FILE* file = state_->file.get();
  const bool placed = std::fseek(file, record.values, SEEK_SET) == 0;
  const auto bytes = placed ? read_bytes(file, record.bytes) : std::nullopt;
  if (!bytes) return fail(Code::file_unreadable, state_->path, {}, "a record can no longer be read");
  std::vector<float> values(bytes->size() / sizeof(Imath::half));
  for (std::size_t i = 0; i < values.size(); ++i) {
    Imath::half h;
    std::memcpy(&h, bytes->data() + i * sizeof h, sizeof h);
    values[i] = h;
  }
  return values;
}

namespace {

void put_vectors(std::vector<float>& values, const std::vector<V3f>& vectors) {
  for (const V3f& v : vectors) values.insert(values.end(), {v.x, v.y, v.z});
}

std::vector<V3f> vectors_of(const std::vector<float>& values, std::size_t first, std::size_t count) {
  std::vector<V3f> vectors;
  vectors.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const float* v = &values[first + 3 * i];
    vectors.emplace_back(v[0], v[1], v[2]);
  }
  return vectors;
}

std::vector<float> floats_of(const std::vector<float>& values, std::size_t first, std::size_t count) {
  const auto begin = values.begin() + static_cast<std::ptrdiff_t>(first);
  return {begin, begin + static_cast<std::ptrdiff_t>(count)};
}

}  // namespace

Result<void> BakeJournal::append(std::size_t unit, const ViewSamples& samples, const NoiseSum& noise) {
  std::vector<float> values = samples.alpha;
  values.reserve(samples.alpha.size() * 4 + samples.radiance.size() * 3);
  put_vectors(values, samples.normal);
  put_vectors(values, samples.radiance);
  return append_values(unit, values, noise);
}

Result<void> BakeJournal::append(std::size_t unit, const PairSamples& samples, const NoiseSum& noise) {
  std::vector<float> values = samples.alpha;
  values.insert(values.end(), samples.alpha_noise.begin(), samples.alpha_noise.end());
  put_vectors(values, samples.radiance);
  put_vectors(values, samples.noise);
  return append_values(unit, values, noise);
}

Result<ViewSamples> BakeJournal::read_view(std::size_t unit) {
  const auto values = read_values(unit);
  if (!values) return tl::unexpected(values.error());
  const auto n = static_cast<std::size_t>(state_->header.texels());
  const auto lights = static_cast<std::size_t>(state_->header.lights.count());
  return ViewSamples{floats_of(*values, 0, n), vectors_of(*values, n, n),
                     vectors_of(*values, 4 * n, n * lights)};
}

Result<PairSamples> BakeJournal::read_pair(std::size_t unit, const DirectionPair& pair) {
  const auto values = read_values(unit);
  if (!values) return tl::unexpected(values.error());
  const auto n = static_cast<std::size_t>(state_->header.texels());
  PairSamples samples;
  samples.width = state_->header.width;
  samples.height = state_->header.height;
  samples.pairs = {pair};
  samples.alpha = floats_of(*values, 0, n);
  samples.alpha_noise = floats_of(*values, n, n);
  samples.radiance = vectors_of(*values, 2 * n, n);
  samples.noise = vectors_of(*values, 5 * n, n);
  return samples;
}

Result<void> BakeJournal::append(std::size_t unit, const HeightLayer& heights) {
  std::vector<float> values = heights.top();
  values.insert(values.end(), heights.bottom().begin(), heights.bottom().end());
  return append_values(unit, values, {});
}

Result<HeightLayer> BakeJournal::read_heights(std::size_t unit) {
  const auto values = read_values(unit);
  if (!values) return tl::unexpected(values.error());
  const std::size_t half = values->size() / 2;
  return HeightLayer(*state_->header.slabs, floats_of(*values, 0, half), floats_of(*values, half, half));
}

Result<void> BakeJournal::rename(const std::string& name) {
  if (state_->unnamed) {
    if (auto ok = state_->unnamed->commit(); !ok) return ok;
    state_->unnamed.reset();
  }
  if (std::rename(state_->path.c_str(), name.c_str()) != 0) {
    return fail(Code::file_unwritable, name, {}, reason());
  }
  state_->path = name;
  return {};
}

void BakeJournal::remove() {
  if (!state_->unnamed) std::remove(state_->path.c_str());
  state_->unnamed.reset();
}

}  // namespace selvedge
