// The functions that a host gives to a WebAssembly module; apps/npm/run.js has them. Bytes go by
// address and count.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>

#define SELVEDGE_HOST(name) extern "C" [[clang::import_module("host"), clang::import_name(#name)]]

namespace selvedge {

/// Bytes of a file; host_missing, host_folder, or host_other: a device or a pipe.
SELVEDGE_HOST(size) double host_size(const char* path, std::size_t count);
inline constexpr double host_missing = -1;
inline constexpr double host_folder = -2;
/// Whether the bytes of a file from `offset` on fill `out`.
SELVEDGE_HOST(read)
bool host_read(const char* path, std::size_t count, double offset, std::uint8_t* out, std::size_t size);
/// The value of errno with which the file cannot be written; 0: it can.
SELVEDGE_HOST(refusal) int host_refusal(const char* path, std::size_t count);
/// Keeps a whole file for host_commit(), with which it is one; it appears when the program has ended.
SELVEDGE_HOST(stage)
void host_stage(const char* path, std::size_t count, const std::uint8_t* bytes, std::size_t size);
SELVEDGE_HOST(commit) void host_commit(const char* path, std::size_t count);
/// Drops what was written into a folder.
SELVEDGE_HOST(drop) void host_drop(const char* folder, std::size_t count);
/// Has a file opened by the user's browser when the program has ended.
SELVEDGE_HOST(open) void host_open(const char* path, std::size_t count);
/// Writes the names in a folder, each with '\0' behind it, to host_input().
SELVEDGE_HOST(list) void host_list(const char* path, std::size_t count);
SELVEDGE_HOST(progress) void host_progress(const char* label, std::size_t count, double fraction);
/// Packs bytes as zlib 1.2.13 does at this level, or unpacks them (level -1), to `out`, which has room for
/// `room`; returns how many, or -1 for damage or without room.
SELVEDGE_HOST(pack)
int host_pack(int level, const std::uint8_t* bytes, std::size_t count, std::uint8_t* out, std::size_t room);

/// Decodes a stream of EXT_meshopt_compression: mode and filter by their numbers in meshopt.cpp's tables; 0:
/// done.
SELVEDGE_HOST(unpack_meshopt)
int host_unpack_meshopt(int mode, int filter, std::size_t count, std::size_t stride,
                        const std::uint8_t* bytes, std::size_t size, void* out);
/// Encodes to `out`, which has room for twice as many bytes and 1024; returns how many.
SELVEDGE_HOST(pack_meshopt)
std::size_t host_pack_meshopt(int mode, const void* rows, std::size_t count, std::size_t stride, void* out);
/// Orders triangles as meshopt_optimizeVertexCacheStrip().
SELVEDGE_HOST(order_triangles)
void host_order_triangles(const unsigned int* indices, std::size_t count, unsigned int* out);
/// Decodes a mesh of Draco, the one that the others are about: its points, and in host_input() three indices
/// a face; or -1, and there Draco's message.
SELVEDGE_HOST(unpack_draco) double host_unpack_draco(const std::uint8_t* bytes, std::size_t count);
/// Components of an attribute; 0: there is no such attribute, or it is boolean.
SELVEDGE_HOST(draco_components) int host_draco_components(int id);
/// Writes the values of all points to host_input(); false if one does not fit.
SELVEDGE_HOST(draco_values) bool host_draco_values(int id, int component_type);

/// Bytes from the host, which asks for room by the exported function `input`.
std::string& host_input();

}  // namespace selvedge
