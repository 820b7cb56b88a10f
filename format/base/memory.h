// Memory that a file which is not trusted may take, reckoned by arithmetic before any of it is allocated.
#pragma once

#include <cstdint>

#include "format/base/error.h"

namespace selvedge {

/// Bytes that reading and drawing a file may take.
inline constexpr std::uint64_t default_memory_limit = std::uint64_t{1} << 32;

/// Bytes that may be spent, up to a limit.
class MemoryBudget {
 public:
  explicit MemoryBudget(std::uint64_t limit) : limit_(limit), left_(limit) {}

  /// Spends `count` times `bytes_each`; false, with nothing left from then on, if that is more than there is.
  bool try_spend(std::uint64_t count, std::uint64_t bytes_each) {
    const bool enough = bytes_each == 0 || count <= left_ / bytes_each;
    left_ = enough ? left_ - count * bytes_each : 0;
    return enough;
  }
  std::uint64_t unspent_bytes() const { return left_; }
  std::uint64_t limit() const { return limit_; }

 private:
  std::uint64_t limit_;
  std::uint64_t left_;
};

/// FILE_TOO_LARGE of `place`: `what` of it do not fit into the memory that is allowed.
Error memory_limit_error(const std::string& file, const std::string& place, const std::string& what,
                         std::uint64_t limit);

}  // namespace selvedge
