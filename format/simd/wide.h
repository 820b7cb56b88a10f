// One body, compiled for several processors; no fused operations in any, so that the bits agree.
#pragma once

// Clang and the thread sanitizer do not know what GCC does here; they get the plain body.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define SELVEDGE_WIDE __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define SELVEDGE_WIDE
#endif

/// For functions that are written once and compiled into several such bodies.
#define SELVEDGE_INLINE inline __attribute__((always_inline))

/// Makes of a template `name<N>` with these parameters three functions, whose vectors have the width of a
/// kind of processor each, and name##_for_this_processor(), which gives the one to call. Nothing is resolved
/// before main: the thread sanitizer bears it.
// NOLINTBEGIN(bugprone-macro-parentheses): parameters of functions, not expressions
#if defined(__x86_64__) && defined(__GNUC__)
#define SELVEDGE_THREE_BODIES(name, parameters, arguments)                                             \
  void name##_plain parameters { name<4> arguments; }                                                  \
  __attribute__((target("avx2,fma"))) void name##_avx2 parameters { name<8> arguments; }               \
  __attribute__((target("avx512f"))) void name##_avx512 parameters { name<16> arguments; }             \
  auto name##_for_this_processor()->void(*) parameters {                                               \
    if (__builtin_cpu_supports("avx512f") != 0) return name##_avx512;                                  \
    if (__builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0) return name##_avx2; \
    return name##_plain;                                                                               \
  }
#else
#define SELVEDGE_THREE_BODIES(name, parameters, arguments) \
  void name##_plain parameters { name<4> arguments; }      \
  auto name##_for_this_processor()->void(*) parameters { return name##_plain; }
#endif
// NOLINTEND(bugprone-macro-parentheses)
