// XXH3-128 digests (xxHash 0.8) as 32 lower-case hexadecimal digits.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

namespace selvedge {

/// Digest of bytes that are given in pieces.
class Digest {
 public:
  Digest();
  Digest(Digest&&) noexcept;
  ~Digest();
  void update(const void* data, std::size_t bytes);
  std::string hex() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

std::string digest_of(const std::string& text);

}  // namespace selvedge
