// tinygltf's code, compiled once: it takes longer than any test.
#include <nlohmann/json.hpp>
#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#include <tiny_gltf.h>

#include "tests/converter/dress/tinygltf.h"

namespace selvedge::test {

std::string pass_through_tinygltf(const std::string& from, const std::string& to, bool binary) {
  tinygltf::TinyGLTF tiny;
  tiny.SetImageLoader(
      [](tinygltf::Image* image, const int, std::string*, std::string*, int, int, const unsigned char* bytes,
         int size, void*) {
        image->image.assign(bytes, bytes + size);
        image->as_is = true;
        return true;
      },
      nullptr);
  tinygltf::Model model;
  std::string errors;
  std::string warnings;
  const bool loaded = from.ends_with(".glb") ? tiny.LoadBinaryFromFile(&model, &errors, &warnings, from)
                                             : tiny.LoadASCIIFromFile(&model, &errors, &warnings, from);
  if (!loaded) return from + " is not read: " + errors;
  return tiny.WriteGltfSceneToFile(&model, to, !binary, !binary, true, binary) ? "" : to + " is not written";
}

}  // namespace selvedge::test
