#include "format/base/digest.h"

#include <fmt/format.h>
#include <xxhash.h>

namespace selvedge {

Digest::Digest() : state_(XXH3_createState(), XXH3_freeState) { XXH3_128bits_reset(state_.get()); }

void Digest::update(const void* data, std::size_t bytes) { XXH3_128bits_update(state_.get(), data, bytes); }

std::string Digest::hex() const {
  const XXH128_hash_t hash = XXH3_128bits_digest(state_.get());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

std::string digest_of(const std::string& text) {
  Digest digest;
  digest.update(text.data(), text.size());
  return digest.hex();
}

}  // namespace selvedge
