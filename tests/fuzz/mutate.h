// Shared by the custom mutators: a source of choices, and a mutation of JSON by its structure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>

namespace selvedge::fuzz {

/// Choices of one mutation, by libFuzzer's seed.
class Choice {
 public:
  explicit Choice(unsigned seed) : engine_(seed) {}
  /// A number below `count`, which is not 0.
  std::size_t below(std::size_t count) { return engine_() % count; }
  bool one_in(std::size_t count) { return below(count) == 0; }

 private:
  std::mt19937 engine_;
};

/// libFuzzer's own mutation of some bytes, which may grow by `growth`.
std::string mutate_bytes(std::string bytes, std::size_t growth);

/// Changes one to three values of a JSON text: numbers, strings, members, elements; anything may be replaced
/// by anything. A text that cannot be parsed is mutated as bytes.
std::string mutate_json(const std::string& text, Choice& choice);

/// Copies `bytes` to libFuzzer's buffer if they fit; what was there stays otherwise. Gives back the size.
std::size_t give(const std::string& bytes, std::uint8_t* data, std::size_t size, std::size_t max_size);

}  // namespace selvedge::fuzz
