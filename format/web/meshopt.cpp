// Meshoptimizer's decoders and order of triangles by the host, whose filters come with the stream that they
// are applied to.
#include <meshoptimizer.h>

#include <algorithm>
#include <span>

#include "format/base/guard.h"
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
[[noreturn]] std::size_t refuse() {
  throw selvedge::Failure{{selvedge::Code::gltf_unsupported,
                           {},
                           {},
                           "the native program alone compresses new data by EXT_meshopt_compression"}};
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

size_t meshopt_encodeVertexBufferBound(size_t, size_t) { refuse(); }
size_t meshopt_encodeVertexBuffer(unsigned char*, size_t, const void*, size_t, size_t) { refuse(); }
void meshopt_encodeIndexVersion(int) { refuse(); }
size_t meshopt_encodeIndexBufferBound(size_t, size_t) { refuse(); }
size_t meshopt_encodeIndexBuffer(unsigned char*, size_t, const unsigned int*, size_t) { refuse(); }
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
