#include "format/picture/environment.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <doctest/doctest.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "format/base/random.h"
#include "format/picture/chromaticities.h"
#include "format/picture/image.h"
#include "tests/format/files.h"
#include "tests/format/lamps.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::test;

namespace {

/// An environment of a closed form.
template <class Radiance>
Environment made(int width, const Radiance& radiance) {
  Environment e{width, width / 2, {}, {}};
  for (int y = 0; y < e.height; ++y)
    for (int x = 0; x < e.width; ++x) e.radiance.push_back(radiance(e.direction(x, y)));
  return e;
}

}  // namespace

TEST_CASE("an environment's pixels cover the sphere, and directions find them again") {
  Environment e = made(64, [](const V3d& d) { return V3f(V3d(2) + d); });
  double sum = 0;
  for (int y = 0; y < e.height; ++y) sum += e.solid_angle(y) * e.width;
  CHECK(sum == doctest::Approx(4 * std::numbers::pi));
  // glTF's layout: the middle is seen along -z, what is right of it along +x.
  CHECK(e.direction(31, 15).z < -0.99);
  CHECK(e.direction(47, 15).x > 0.99);
  CHECK(e.direction(0, 0).y > 0.99);
  Random random(3);
  for (const double turn : {0.0, 90.0, -200.0}) {
    e.options.turn_degrees = turn;
    const Environment turned_one = e;
    for (int i = 0; i < 200; ++i) {
      const int x = static_cast<int>(random.uniform() * 64);
      const int y = static_cast<int>(random.uniform() * 32);
      const V3f seen = turned_one.radiance_at(turned_one.direction(x, y));
      CHECK((seen - e.radiance[y * 64 + x]).length() < 1e-4F);
    }
  }
  // A turn by a quarter moves what was seen along -z to -x.
  e.options.turn_degrees = 90;
  CHECK((e.radiance_at({-1, 0, 0}) - V3f(2, 2, 1)).length() < 0.01F);
}

TEST_CASE("a sun becomes a lamp of its direction and irradiance, a second one another") {
  const V3d sun = V3d(0.3, 0.8, 0.5).normalized();
  const V3d second = V3d(-0.8, 0.2, -0.1).normalized();
  const double half_angle = 2 * std::numbers::pi / 180;
  const auto sky = [&](const V3d& d) {
    if (d.dot(sun) > std::cos(half_angle)) return V3f(2000, 1500, 1000);
    if (d.dot(second) > std::cos(half_angle)) return V3f(400, 500, 600);
    return V3f(0.5F, 0.6F, 0.7F);
  };
  const EnvironmentLight light = split_light(made(512, sky));
  REQUIRE(light.lamps.size() == 2);
  const double cap = 2 * std::numbers::pi * (1 - std::cos(half_angle));
  CHECK(light.lamps[0].direction.dot(sun) > 0.9999);
  CHECK(light.lamps[1].direction.dot(second) > 0.9999);
  CHECK(light.lamps[0].irradiance.x == doctest::Approx(2000 * cap).epsilon(0.05));
  CHECK(light.lamps[1].irradiance.z == doctest::Approx(600 * cap).epsilon(0.05));
  // Nothing is lost: all light, whichever its part.
  V3d whole(0, 0, 0);
  for (const Light& lamp : light.lamps) whole += V3d(lamp.irradiance);
  whole += V3d(light.smooth_light.coefficients[0]) * (4 * std::numbers::pi);
  const V3d all = V3d(0.5, 0.6, 0.7) * (4 * std::numbers::pi - 2 * cap) + V3d(2400, 2000, 1600) * cap;
  CHECK((whole - all).length() < 0.05 * all.length());
}

TEST_CASE("turned light is the turned environment's") {
  const Environment plain = studio_environment();
  for (const EnvironmentOptions options : {EnvironmentOptions{30, 2}, {-170, 0.5}}) {
    const EnvironmentLight light = with_options(split_light(plain), options);
    const EnvironmentLight expected = split_light(studio_environment(options));
    REQUIRE(light.lamps.size() == expected.lamps.size());
    for (std::size_t i = 0; i < light.lamps.size(); ++i) {
      CHECK((light.lamps[i].direction - expected.lamps[i].direction).length() < 1e-9);
      CHECK((light.lamps[i].irradiance - expected.lamps[i].irradiance).length() < 1e-6);
    }
    for (int k = 0; k < smooth_function_count; ++k)
      CHECK((light.smooth_light.coefficients[k] - expected.smooth_light.coefficients[k]).length() < 1e-5);
  }
}

TEST_CASE("the studio lights a white cloth from two sides, and leaves none dark") {
  const Environment room = studio_environment();
  CHECK(split_light(room).lamps.size() == 2);
  const std::vector<Light> pixels = lamps_of(room);
  const auto white_facing = [&](const V3d& normal) {
    double irradiance = 0;
    for (const Light& pixel : pixels) {
      CHECK(pixel.irradiance.x == pixel.irradiance.y);
      irradiance += std::max(0.0, pixel.direction.dot(normal)) * static_cast<double>(pixel.irradiance.x);
    }
    return irradiance / std::numbers::pi;
  };
  CHECK(white_facing(split_light(room).lamps[0].direction) == doctest::Approx(1.75).epsilon(0.1));
  for (const V3d& normal : {V3d(0, 0, 1), V3d(0, 0, -1), V3d(1, 0, 0), V3d(-1, 0, 0), V3d(0, 1, 0)})
    CHECK(white_facing(normal) > 0.3);
}

TEST_CASE("environments are read from files, and other pictures are refused") {
  const Folder folder;
  Image image{8, 4, 3, std::vector<float>(8 * 4 * 3, 1.0F)};
  image.pixels[3] = -1;
  need(write_exr(folder / "e.exr", image));
  const Environment e = need(read_environment(folder / "e.exr"));
  CHECK(e.width == 8);
  CHECK(e.radiance[1] == V3f(0, 1, 1));
  CHECK(e.radiance[2] == V3f(1, 1, 1));
  for (const auto& [width, height, remarks] :
       {std::tuple(4, 4, -1), {28, 16, -1}, {36, 16, -1}, {34, 16, 1}, {30, 16, 1}, {32, 16, 0}}) {
    CAPTURE(width);
    Image grey{width, height, 1, {}};  // as bright as its column
    for (int i = 0; i < width * height; ++i) grey.pixels.push_back(static_cast<float>(i % width));
    need(write_exr(folder / "g.exr", grey));
    const auto read = read_environment(folder / "g.exr");
    if (remarks < 0) CHECK(error_of(read).message.find("2 : 1; convert other layouts") != std::string::npos);
    if (remarks < 0) continue;
    REQUIRE(need(read).radiance.size() == 512);
    CHECK(read->remarks.size() == remarks);
    for (int x = 1; x < 31; ++x) CHECK(read->radiance[x].x == doctest::Approx((x + 0.5) * width / 32 - 0.5));
  }
}

TEST_CASE("colours of other primaries are converted to Rec. 709, white to white") {
  // ACES2065-1 to linear Rec. 709 by Bradford, as OpenColorIO's built-in transform has it.
  const Chromaticities ap0{0.7347, 0.2653, 0, 1, 0.0001, -0.077, 0.32168, 0.33767};
  std::vector<float> pixels{1, 0, 0, 1, 0, 1, 0, 0.5F, 0, 0, 1, 0, 1, 1, 1, 1};
  convert_to_rec709(ap0, pixels);
  const std::vector<float> expected{2.521686F,  -0.276480F, -0.015378F, 1,          -1.134131F, 1.372719F,
                                    -0.152975F, 0.5F,       -0.387555F, -0.096239F, 1.168353F,  0,
                                    1,          1,          1,          1};
  for (std::size_t i = 0; i < pixels.size(); ++i)
    CHECK(pixels[i] == doctest::Approx(expected[i]).epsilon(1e-4));
}

namespace {

/// Pixel (x, y) of the pictures below, 16 x 8: what rows and columns are told by.
V3f shown_at(int x, int y) {
  return V3f(static_cast<float>(1 + x % 2), static_cast<float>(y < 4 ? 1 : 2),
             static_cast<float>(x < 8 ? 1 : 2));
}

/// A Radiance file of these pixels, flat.
std::string hdr(const std::string& header) {
  std::string bytes = "#?RADIANCE\n" + header + "\n-Y 8 +X 16\n";
  for (int i = 0; i < 128; ++i) {
    const V3f c = shown_at(i % 16, i / 16) * 64.0F;
    for (int k = 0; k < 3; ++k) bytes += static_cast<char>(static_cast<int>(c[k]));
    bytes += static_cast<char>(130);
  }
  return bytes;
}

struct Part {
  std::string name;
  std::vector<std::string> channels;  ///< R, red ... show the picture, others 7
  float factor = 1;                   ///< on the red of pixel (0, 0)
  bool half = false;
  std::string shown{};  ///< a part of the names of layers that show the picture; others are black
  Imath::Box2i display{V2i(0, 0), V2i(15, 7)};
};

void write_parts(const std::string& path, const std::vector<Part>& parts) {
  std::vector<Imf::Header> headers;
  for (const Part& part : parts) {
    Imf::Header header(part.display, Imath::Box2i(V2i(0, 0), V2i(15, 7)));
    header.setName(part.name);
    header.setType(Imf::SCANLINEIMAGE);
    for (const std::string& name : part.channels)
      header.channels().insert(name, Imf::Channel(part.half ? Imf::HALF : Imf::FLOAT));
    headers.push_back(header);
  }
  Imf::MultiPartOutputFile file(path.c_str(), headers.data(), static_cast<int>(headers.size()));
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const Part& part = parts[p];
    Imf::FrameBuffer buffer;
    std::vector<std::vector<float>> planes;
    std::vector<std::vector<half>> halves;
    planes.reserve(part.channels.size());
    halves.reserve(part.channels.size());
    for (const std::string& name : part.channels) {
      const std::string last = name.substr(name.rfind('.') + 1);
      const std::size_t c = std::string("RGBrgb").find(last[0]) % 3;
      std::vector<float>& plane = planes.emplace_back();
      const bool is_shown = (part.name + "." + name).find(part.shown) != std::string::npos;
      for (int i = 0; i < 128; ++i)
        plane.push_back(std::string("RGBrgb").find(last[0]) != std::string::npos
                            ? (is_shown ? shown_at(i % 16, i / 16)[static_cast<int>(c)] : 0)
                        : last == "Y" ? 2
                                      : 7);
      if (c == 0 && part.factor != 1) plane[0] *= part.factor;
      halves.emplace_back(plane.begin(), plane.end());
      const std::size_t size = part.half ? sizeof(half) : sizeof(float);
      char* base =
          part.half ? reinterpret_cast<char*>(halves.back().data()) : reinterpret_cast<char*>(plane.data());
      buffer.insert(name, Imf::Slice(part.half ? Imf::HALF : Imf::FLOAT, base, size, size * 16));
    }
    Imf::OutputPart out(file, static_cast<int>(p));
    out.setFrameBuffer(buffer);
    out.writePixels(8);
  }
}

}  // namespace

TEST_CASE("environments are read as their headers and the names of their channels say") {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  const Folder folder;
  const std::string rgbe = "FORMAT=32-bit_rle_rgbe\n";
  const std::string pixel = "\x80\x80\x80\x82";
  for (const auto& [header, factor] :
       {std::pair(rgbe, V3f(1)),
        {"# a\nEXPOSURE=2\n" + rgbe + "EXPOSURE= 4.0e0\nEXPOSURE=0\n", V3f(0.125F)},
        {"COLORCORR=2 1 0.5\nCOLORCORR= 2  2\t2\nEXPOSURE=2\nCOLORCORR=0 1 x\n" + rgbe,
         V3f(0.125F, 0.25F, 0.5F)},
        {"PRIMARIES=0 0 0 0 0 0 0 0\n" + rgbe, V3f(1)},
        {"PRIMARIES=.64 .33 .3 .6 .15 .06 .3127 .329\n" + rgbe, V3f(1)},
        {std::string(100'000, 'x') + "\nSOFTWARE=x=y\n", V3f(1)}}) {
    CAPTURE(header.substr(0, 100));
    write_bytes(folder / "e.hdr", hdr(header));
    const Environment e = need(read_environment(folder / "e.hdr"));
    REQUIRE(e.radiance.size() == 128);
    for (int i = 0; i < 128; ++i) CHECK(e.radiance[i] == shown_at(i % 16, i / 16) * factor);
    CHECK(e.remarks.empty());
  }
  // Runs of components.
  std::string lines;
  for (int y = 0; y < 152; ++y)
    lines +=
        std::string("\2\2\1\x30", 4) +
        "\xff\x80\xff\x80\xb2\x80\xff\x80\xff\x80\xb2\x80\xff\x80\xff\x80\xb2\x80\xff\x82\xff\x82\xb2\x82";
  write_bytes(folder / "e.hdr", "#?RADIANCE\n" + rgbe + "\n-Y 152 +X 304\n" + lines);
  const Environment runs = need(read_environment(folder / "e.hdr"));
  for (const int x : {0, 303}) CHECK(runs.radiance[304 + x] == V3f(2));
  for (const std::string& bytes : std::vector<std::string>{
           "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 2\n" + pixel + pixel, "#?RADIANCE\n" + rgbe,
           "#?RADIANCE\n" + rgbe + "\n-Y 0 +X 0\n", "#?RADIANCE\n\n-Y -1 +X -2\n",
           "#?RADIANCE\n\n+Y 1 +X 2\n" + pixel + pixel, "#?RADIANCE\n\n-Y 1 +X 2\n" + pixel,
           "#?RADIANCE\n\n-Y 152 +X 304\n" + lines.substr(0, lines.size() - 1)}) {
    write_bytes(folder / "e.hdr", bytes);
    CHECK(error_of(read_environment(folder / "e.hdr")).code == Code::image_unreadable);
  }

  const std::vector<std::string> rgb{"R", "G", "B"};
  struct ExrCase {
    std::vector<Part> parts;
    std::string remark;
    V3f last{2, 2, 2};  ///< of the pixel at the lower right
    V3f first{1, 1, 1};
  };
  for (const ExrCase& c : {
           ExrCase{{{"a", rgb}}, ""},
           {{{"a", {"R", "G", "B", "A", "Z"}}}, ""},
           {{{"a",
              {"A.depth.Z", "L.DiffCol.X", "L.DiffCol.Y", "L.DiffCol.Z", "L.Combined.R", "L.Combined.G",
               "L.Combined.B"}}},
            ""},
           {{{"a", {"diffuse.V", "diffuse.U", "diffuse.W", "R", "G", "B"}}}, ""},
           {{{"a", {"right.R", "right.G", "right.B", "r", "g", "b"}}}, ""},
           {{{"a", {"Y"}}}, "", V3f(2), V3f(2)},
           {{{"a", {"Z"}}}, "its layer \"Z\" is read", V3f(7), V3f(7)},
           {{{"a", {"N.x", "N.y", "N.z"}}}, "its layer \"N.x\" is read", V3f(7), V3f(7)},
           {{{"a",
              {"albedo.R", "albedo.G", "albedo.B", "Beauty.R", "Beauty.G", "Beauty.B"},
              1,
              false,
              "Beauty"}},
            ""},
           {{{"a",
              {"V.AO.R", "V.AO.G", "V.AO.B", "V.Combined.R", "V.Combined.G", "V.Combined.B"},
              1,
              false,
              "Comb"}},
            ""},
           {{{"a", {"S.R", "S.G", "S.B", "rgba.r", "rgba.g", "rgba.b", "rgba.a"}, 1, false, "rgba"}}, ""},
           {{{"a", {"left.R", "left.G", "left.B", "right.R", "right.G", "right.B"}, 1, false, "left"}},
            "\"left\""},
           {{{"a", {"left.R", "left.G", "left.B", "right.R", "right.G", "right.B"}, 1, false, "right"}},
            "\"right\""},
           {{{"a", {"C.left.R", "C.left.G", "C.left.B", "C.all.right.R"}, 1, false, "left"}}, "\"C.left\""},
           {{{"depth", {"Z"}}, {"RGBA", rgb}}, ""},
           {{{"diffuse", rgb, 1, false, "none"}, {"rgba.right", rgb, 1, false, "none"}, {"rgba.left", rgb}},
            ""},
           {{{"diffuse", rgb, 1, false, "none"}, {"light", rgb}}, "\"light\""},
           {{{"a", rgb, infinity, true}}, "1 infinite values become 65504", V3f(2), V3f(65504, 1, 1)},
           {{{"a", rgb, 3e38F}}, "infinite", V3f(2), V3f(65504, 1, 1)},
           {{{"a", rgb, std::nanf("")}}, "no numbers", V3f(2), V3f(0, 1, 1)},
           {{{"a", rgb, -1}}, "negative", V3f(2), V3f(0, 1, 1)},
       }) {
    CAPTURE(c.remark);
    CAPTURE(c.parts.back().channels.front());
    write_parts(folder / "e.exr", c.parts);
    const Environment e = need(read_environment(folder / "e.exr"));
    REQUIRE(e.radiance.size() == 128);
    CHECK((e.radiance.back() - c.last).length() < 1e-3F);
    CHECK((e.radiance.front() - c.first).length() < 1e-3F);
    CHECK(e.remarks.empty() == c.remark.empty());
    CHECK(fmt::format("{}", fmt::join(e.remarks, "; ")).find(c.remark) != std::string::npos);
  }
}

TEST_CASE("a part of a panorama lies where its display window has it") {
  const Folder folder;
  struct Case {
    Imath::Box2i display;
    int width;
    V2i first;  ///< where the first pixel of the file lies
  };
  for (const Case& c : {Case{{V2i(-8, -4), V2i(23, 11)}, 32, {8, 4}},
                        {{V2i(0, -8), V2i(31, 7)}, 32, {0, 8}},
                        {{V2i(-3, 0), V2i(12, 7)}, 16, {0, 0}},
                        {{V2i(0, 0), V2i(63, 63)}, 16, {0, 0}},
                        {{V2i(100, 0), V2i(131, 15)}, 16, {0, 0}},
                        {{V2i(4, 2), V2i(11, 5)}, 8, {-4, -2}}}) {
    CAPTURE(c.display.min.x);
    write_parts(folder / "e.exr", {{"a", {"R", "G", "B"}, 1, false, "", c.display}});
    const Environment e = need(read_environment(folder / "e.exr"));
    REQUIRE(e.width == c.width);
    for (int i = 0; i < e.width * e.width / 2; ++i) {
      const V2i place = V2i(i % e.width, i / e.width) - c.first;
      const bool inside = place.x >= 0 && place.y >= 0 && place.x < 16 && place.y < 8;
      CHECK(e.radiance[i] == (inside ? shown_at(place.x, place.y) : V3f(0)));
    }
    CHECK(e.remarks.size() == (e.width == 16 ? 0 : 1));
  }
}
