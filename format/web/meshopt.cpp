// Meshoptimizer's codecs and order of triangles by the host, whose filters come with their stream.
#include <meshoptimizer.h>

#include <algorithm>
#include <span>

#include "format/web/host.h"

namespace {

std::span<const unsigned char> stream;  ///< the last one

int decode(int mode, void* out, std::size_t count, std::size_t stride, const unsigned char* bytes,
           std::size_t size) {
  stream = {bytes, size};
  return selvedge::host_unpack_meshopt(mode, 0, count, stride, bytes, size, out);
}
void decode_again(int filter, void* out, std::size_t count, std::size_t stride) {
  selvedge::host_unpack_meshopt(0, filter, count, stride, stream.data(), stream.size(), out);
}

}  // namespace

int meshopt_decodeVertexBuffer(void* out, size_t count, size_t stride, const unsigned char* bytes,
                               size_t size) {
  return decode(0, out, count, stride, bytes, size);
}
int meshopt_decodeIndexBuffer(void* out, size_t count, size_t stride, const unsigned char* bytes,
                              size_t size) {
  return decode(1, out, count, stride, bytes, size);
}
int meshopt_decodeIndexSequence(void* out, size_t count, size_t stride, const unsigned char* bytes,
                                size_t size) {
  return decode(2, out, count, stride, bytes, size);
}
void meshopt_decodeFilterOct(void* out, size_t count, size_t stride) { decode_again(1, out, count, stride); }
void meshopt_decodeFilterQuat(void* out, size_t count, size_t stride) { decode_again(2, out, count, stride); }
void meshopt_decodeFilterExp(void* out, size_t count, size_t stride) { decode_again(3, out, count, stride); }

size_t meshopt_encodeVertexBufferBound(size_t count, size_t stride) { return 2 * count * stride + 1024; }
size_t meshopt_encodeVertexBuffer(unsigned char* out, size_t, const void* rows, size_t count, size_t stride) {
  return selvedge::host_pack_meshopt(0, rows, count, stride, out);
}
void meshopt_encodeIndexVersion(int) {}  // the host's is the extension's
size_t meshopt_encodeIndexBufferBound(size_t count, size_t) { return 8 * count + 1024; }
size_t meshopt_encodeIndexBuffer(unsigned char* out, size_t, const unsigned int* indices, size_t count) {
  return selvedge::host_pack_meshopt(1, indices, count, sizeof(*indices), out);
}
void meshopt_optimizeVertexCacheStrip(unsigned int* out, const unsigned int* indices, size_t count, size_t) {
  selvedge::host_order_triangles(indices, count, out);
}
size_t meshopt_optimizeVertexFetchRemap(unsigned int* numbers, const unsigned int* indices, size_t count,
                                        size_t vertices) {
  std::fill_n(numbers, vertices, ~0U);
  unsigned int next = 0;
  for (size_t i = 0; i < count; ++i)
    if (numbers[indices[i]] == ~0U) numbers[indices[i]] = next++;
  return next;
}
void meshopt_remapIndexBuffer(unsigned int* out, const unsigned int* indices, size_t count,
                              const unsigned int* numbers) {
  for (size_t i = 0; i < count; ++i) out[i] = numbers[indices[i]];
}
