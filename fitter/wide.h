// One body, compiled for several processors; no fused operations in any, so that the bits agree.
#pragma once

// Clang and the thread sanitizer do not know what GCC does here; they get the plain body.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define SELVEDGE_WIDE __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define SELVEDGE_WIDE
#endif
