#include "format/samples/samples.h"

#include <doctest/doctest.h>

#include <cmath>

#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

namespace {

SamplesHeader small_header() {
  SamplesHeader header;
  header.width = 3;
  header.height = 2;
  header.views = {2, 2};
  header.lights = {1, 3};
  header.pairs[1] = random_pairs(2, 0.15, 1);
  header.provenance = R"({"stitch":"none"})";
  return header;
}

ViewSamples view_samples(const SamplesHeader& h, int view) {
  const auto texels = static_cast<std::size_t>(h.texels());
  const auto lights = static_cast<std::size_t>(h.lights.count());
  ViewSamples s;
  for (std::size_t t = 0; t < texels; ++t) {
    s.alpha.push_back(0.25F * static_cast<float>(view + 1));
    s.normal.emplace_back(0.0F, 0.5F, static_cast<float>(t));
  }
  for (std::size_t i = 0; i < texels * lights; ++i) {
    // Whole numbers below 2048 are exact in half precision.
    s.radiance.emplace_back(static_cast<float>(i), static_cast<float>(view), 1.0F);
  }
  return s;
}

Result<void> write(const std::string& path, const SamplesHeader& header, float last_value = 1) {
  auto writer = SamplesWriter::create(path, header);
  if (!writer) return tl::unexpected(writer.error());
  for (int v = 0; v < header.views.count(); ++v) {
    ViewSamples samples = view_samples(header, v);
    samples.radiance.back().z = last_value;
    if (auto ok = writer->write_view(samples); !ok) return ok;
  }
  PairSamples pairs;
  pairs.pairs = header.pairs[1];
  const std::size_t count = 2 * static_cast<std::size_t>(header.texels());
  for (std::size_t i = 0; i < count; ++i) {
    pairs.alpha.push_back(0.5F);
    pairs.alpha_noise.push_back(-0.25F);
    pairs.radiance.emplace_back(static_cast<float>(i), 2.0F, 3.0F);
    pairs.noise.emplace_back(0.5F, -0.5F, static_cast<float>(i));
  }
  if (auto ok = writer->write_pairs(PairKind::held_out, pairs); !ok) return ok;
  return writer->commit();
}

}  // namespace

TEST_CASE("samples come back from their file in the texel's order") {
  const Folder folder;
  const SamplesHeader header = small_header();
  test::need(write(folder / "s.exr", header));
  auto reader = test::need(SamplesReader::open(folder / "s.exr"));
  CHECK(reader.header().width == 3);
  CHECK(reader.header().lights == header.lights);
  CHECK(reader.header().pairs[1][1].light == header.pairs[1][1].light);
  const auto level = test::need(reader.read_level());
  for (std::size_t t = 0; t < 6; ++t) {
    CHECK(level.normal[t] == V3f(0, 2, 4 * static_cast<float>(t)));
    for (std::size_t v = 0; v < 4; ++v) {
      CHECK(level.alpha[t * 4 + v] == 0.25F * static_cast<float>(v + 1));
      for (std::size_t l = 0; l < 3; ++l) {
        const V3f& r = level.radiance[(t * 4 + v) * 3 + l];
        CHECK(r == V3f(static_cast<float>(l * 6 + t), static_cast<float>(v), 1));
      }
    }
  }
  const auto pairs = test::need(reader.read_pairs(PairKind::held_out));
  CHECK(pairs.radiance[7] == V3f(7, 2, 3));
  CHECK(pairs.noise[7] == V3f(0.5F, -0.5F, 7));
  CHECK(reader.read_pairs(PairKind::rim)->pairs.empty());
}

TEST_CASE("negative samples are refused with their place") {
  const Folder folder;
  REQUIRE(write(folder / "s.exr", small_header(), -1));
  auto reader = test::need(SamplesReader::open(folder / "s.exr"));
  const Error error = test::error_of(reader.read_level());
  CHECK(error.code == Code::samples_not_finite);
  CHECK(error.place == "radiance/pixel 8,1");
}

TEST_CASE("a count that does not fit into an int is refused") {
  const std::string file =
      std::string(SELVEDGE_SOURCE_DIR) + "/tests/fuzz/regressions/samples/direction-count-beyond-an-int.exr";
  const std::string bytes = test::bytes_of(file);
  const Error error = test::error_of(
      SamplesReader::open({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, "memory"));
  CHECK(error.code == Code::samples_malformed);
  CHECK(error.message.find("whole number") != std::string::npos);
  CHECK(error.file == "memory");
}

TEST_CASE("samples of another version are refused, with both versions") {
  std::string text = samples_header_to_json(SamplesHeader());
  REQUIRE(samples_header_from_json(text, "s.exr"));
  const std::size_t at = text.find("\"version\":2");
  REQUIRE(at != std::string::npos);
  text.replace(at, 11, "\"version\":1");
  const Error error = test::error_of(samples_header_from_json(text, "s.exr"));
  CHECK(error.code == Code::samples_malformed);
  CHECK(error.message == "version 1 is not understood; this program reads version 2");
}

TEST_CASE("radiance that half precision loses is a warning of whoever writes it") {
  const Folder folder;
  SamplesHeader header = small_header();
  header.pairs[1].clear();
  const auto warnings_at = [&](float factor) {
    auto writer = test::need(SamplesWriter::create(folder / "s.exr", header));
    for (int v = 0; v < header.views.count(); ++v) {
      ViewSamples samples = view_samples(header, v);
      for (V3f& r : samples.radiance) r *= factor;
      REQUIRE(writer.write_view(samples));
    }
    REQUIRE(writer.commit());
    return writer.warnings();
  };
  // Samples go up to 17; the smallest step of half precision is 6e-8, and of it half is lost at most.
  for (const float factor : {0.0F, 1e-7F, 1.0F, 1e3F}) CHECK(warnings_at(factor).empty());
  const Issues warnings = warnings_at(1e-9F);
  REQUIRE(warnings.size() == 1);
  CHECK(warnings[0].code == Code::fabric_precision);
  CHECK(warnings[0].place == "radiance");
}

TEST_CASE("NaN is not written, and nothing is left") {
  const Folder folder;
  CHECK_FALSE(write(folder / "s.exr", small_header(), std::nanf("")));
  CHECK(folder.files() == 0);
}
