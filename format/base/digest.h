// XXH3-128 digests (xxHash 0.8) as 32 lower-case hexadecimal digits.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

struct XXH3_state_s;  // NOLINT(readability-identifier-naming): the name is xxHash's

namespace selvedge {

/// Digest of bytes that are given in pieces.
class Digest {
 public:
  Digest();
  void update(const void* data, std::size_t bytes);
  std::string hex() const;

 private:
  std::shared_ptr<XXH3_state_s> state_;
};

std::string digest_of(const std::string& text);

}  // namespace selvedge
