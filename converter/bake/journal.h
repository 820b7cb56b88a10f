// What a bake has finished, in a file that survives the program: one record per unit (a view, a pair or the
// heights), each with a digest, in the order in which they were baked. A finished journal of a part of the
// units is a shard.
//
// Little-endian. "SELVEDGE-BAKE-1\n"; the length (8 bytes) and the text of the samples file's header without
// the noise; the shard's index and count (4 bytes each); the digest of all that (XXH3-128, 32 hexadecimal
// digits). Then the records: unit (8 bytes), bytes of values (8), error2 and signal2 of its noise (8 each,
// double), the digest of these and of the values, the values as half floats.
#pragma once

#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "converter/bake/bake.h"
#include "converter/bake/texels.h"

namespace selvedge {

class BakeJournal {
 public:
  /// For writing. A journal at `path` of the same header and shard is gone on with, up to its last whole
  /// record; any other file there is replaced. With `lasting`, the file is there from its first record on;
  /// else it goes with the object. Refuses (file_unwritable) a journal that another program writes.
  static Result<BakeJournal> open(const std::string& path, const SamplesHeader& header,
                                  const BakeShard& shard, bool lasting);
  /// The header of a journal at `path`, where there is one.
  static std::optional<SamplesHeader> read_header(const std::string& path);
  /// For reading; every record must be whole.
  static Result<BakeJournal> read(const std::string& path);
  BakeJournal(BakeJournal&&) noexcept;
  BakeJournal& operator=(BakeJournal&&) noexcept;
  ~BakeJournal();

  const std::string& path() const;
  const SamplesHeader& header() const;
  const BakeShard& shard() const;
  bool has(std::size_t unit) const;
  NoiseSum noise(std::size_t unit) const;

  Result<void> append(std::size_t unit, const ViewSamples& samples, const NoiseSum& noise);
  Result<void> append(std::size_t unit, const PairSamples& samples, const NoiseSum& noise);
  Result<void> append(std::size_t unit, const HeightLayer& heights);
  /// Precondition: has(unit). What was appended, in half precision.
  Result<ViewSamples> read_view(std::size_t unit);
  Result<PairSamples> read_pair(std::size_t unit, const DirectionPair& pair);
  Result<HeightLayer> read_heights(std::size_t unit);

  /// Gives the finished file its name, which must be in the same folder.
  Result<void> rename(const std::string& name);
  /// Takes the file away.
  void remove();

 private:
  struct State;
  explicit BakeJournal(std::unique_ptr<State> state);
  Result<void> append_values(std::size_t unit, const std::vector<float>& values, const NoiseSum& noise);
  Result<std::vector<float>> read_values(std::size_t unit);
  std::unique_ptr<State> state_;
};

}  // namespace selvedge
