// The functions of the module's host (make.mjs): zlib's work, and where answers go.
#pragma once

#include <cstddef>
#include <cstdint>

namespace selvedge {

enum class Told : std::int32_t { fabric, refusal, remark };

extern "C" {
/// Takes bytes. Does not return from a refusal.
[[clang::import_module("host"), clang::import_name("tell")]] void host_tell(Told what, const char* bytes,
                                                                            std::size_t count);
/// The stage that runs (yarns come to rest, bake, fit), and the fraction of it that is done.
[[clang::import_module("host"), clang::import_name("progress")]] void host_progress(std::int32_t stage,
                                                                                    double fraction);
/// Packs bytes by zlib at level 4 to `out`, which has room for as many; returns the packed size, or `count`
/// where they do not get smaller.
[[clang::import_module("host"), clang::import_name("deflate")]] std::size_t host_deflate(
    const std::uint8_t* bytes, std::size_t count, std::uint8_t* out);
}

}  // namespace selvedge
