// The journal of a bake: a scratch file of its finished units. (The header of a samples file precedes its
// pixels and holds the noise of the whole bake, so units cannot be written there one by one.)
//
// Little-endian. One line of text: "SELVEDGE-BAKE-2", index and count of the shard, digest and length of the
// text that follows: the samples file's header without the noise. Then the shard's units in their order, each
// at a fixed offset: its values as half floats (floats if they are yarn), squared error and squared signal of
// its noise (doubles), and a digest of these (XXH3-128, 32 hexadecimal digits). A unit with a wrong digest
// counts as not written.
#pragma once

#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "converter/bake/unit_baker.h"
#include "format/base/atomic_file.h"

namespace selvedge {

class BakeJournal {
 public:
  /// Opens a journal for writing. With `lasting`, a journal of the same header and shard at `path` is
  /// continued, any other file there is replaced, and the file is named from the first unit on; otherwise it
  /// stays unnamed. Refuses (file_unwritable) a journal that another program is writing.
  static Result<BakeJournal> open(const std::string& path, const SamplesHeader& header,
                                  const BakeShard& shard, bool lasting);
  /// Opens a journal for reading. Refuses (samples_malformed) a journal that lacks a unit of its shard.
  static Result<BakeJournal> read(const std::string& path);

  const std::string& path() const { return path_; }
  const SamplesHeader& header() const { return header_; }
  bool has(std::size_t unit) const { return units_[unit].noise.has_value(); }
  /// Precondition: has(unit).
  const NoiseSum& noise(std::size_t unit) const { return *units_[unit].noise; }

  /// Precondition: the shard contains the unit, and the planes have the size of its samples.
  Result<void> write(std::size_t unit, const Planes& planes, const NoiseSum& noise);
  /// Fills the planes with the values written, which are rounded to half precision. Precondition: has(unit).
  Result<void> read(std::size_t unit, const Planes& planes);

  /// Gives the finished file its name, which must be in the same folder.
  Result<void> rename(const std::string& name);
  void remove();

 private:
  struct Unit {
    long begin = 0;  ///< in the file
    std::size_t bytes = 0;
    bool whole = false;             ///< single precision, not half
    std::optional<NoiseSum> noise;  ///< set once the unit is written
  };
  struct FileCloser {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  using File = std::unique_ptr<std::FILE, FileCloser>;

  BakeJournal(std::string path, SamplesHeader header, const BakeShard& shard, File file);
  static File open_file(const std::string& path, const char* mode);
  std::optional<std::string> read_record(const Unit& unit);
  /// Checks the digests of all units.
  void read_units();
  Result<void> give_name();

  std::string path_;
  SamplesHeader header_;
  std::vector<Unit> units_;  ///< of the whole bake; units of other shards have no bytes
  std::optional<AtomicFile> unnamed_;
  File file_;
  bool lasting_ = true;
};

}  // namespace selvedge
