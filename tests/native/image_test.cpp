#include "image.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfStringAttribute.h>
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "status.h"

using namespace sppm;

namespace {

// 2 x 2 texels: red 0 1 in the bottom row, 2 3 in the top row; alpha a tenth of it.
Image square_image() {
  static const float pixels[] = {0, 0, 0, 0, 1, 0, 0, 0.1f, 2, 0, 0, 0.2f, 3, 0, 0, 0.3f};
  SppmImageDesc d{};
  d.struct_size = sizeof d;
  d.width = d.height = 2, d.pixels = pixels;
  return Image(d);
}

float red(const Image& image, float u, float v, SppmInterpolation i, SppmExtension e) { return image.sample({u, v}, i, e).color.x; }

}  // namespace

TEST_CASE("texel centres give the texels, bottom row first") {
  const Image image = square_image();
  for (const auto filter : {SPPM_LINEAR_FILTER, SPPM_CLOSEST}) {
    CHECK(red(image, 0.25f, 0.25f, filter, SPPM_REPEAT) == 0);
    CHECK(red(image, 0.75f, 0.25f, filter, SPPM_REPEAT) == 1);
    CHECK(red(image, 0.25f, 0.75f, filter, SPPM_REPEAT) == 2);
    CHECK(red(image, 0.75f, 0.75f, filter, SPPM_REPEAT) == 3);
  }
  CHECK(image.sample({0.75f, 0.75f}, SPPM_CLOSEST, SPPM_REPEAT).alpha == doctest::Approx(0.3));
}

TEST_CASE("between centres bilinear lookup mixes") {
  const Image image = square_image();
  CHECK(red(image, 0.5f, 0.5f, SPPM_LINEAR_FILTER, SPPM_REPEAT) == doctest::Approx(1.5));
  CHECK(red(image, 0.375f, 0.25f, SPPM_LINEAR_FILTER, SPPM_REPEAT) == doctest::Approx(0.25));
  CHECK(red(image, 0.49f, 0.25f, SPPM_CLOSEST, SPPM_REPEAT) == 0);
  CHECK(image.sample({0.5f, 0.5f}, SPPM_LINEAR_FILTER, SPPM_REPEAT).alpha == doctest::Approx(0.15));
}

TEST_CASE("beyond the border each extension has its rule") {
  const Image image = square_image();
  CHECK(red(image, 1.25f, 0.25f, SPPM_CLOSEST, SPPM_REPEAT) == 0);
  CHECK(red(image, -0.25f, 0.25f, SPPM_CLOSEST, SPPM_REPEAT) == 1);
  CHECK(red(image, 1.25f, 0.25f, SPPM_CLOSEST, SPPM_EXTEND) == 1);
  CHECK(red(image, -5, 0.25f, SPPM_CLOSEST, SPPM_EXTEND) == 0);
  CHECK(red(image, 1.25f, 0.25f, SPPM_CLOSEST, SPPM_MIRROR) == 1);
  CHECK(red(image, 1.75f, 0.25f, SPPM_CLOSEST, SPPM_MIRROR) == 0);
  CHECK(red(image, -0.25f, 0.25f, SPPM_CLOSEST, SPPM_MIRROR) == 0);
  CHECK(red(image, 1.25f, 0.75f, SPPM_CLOSEST, SPPM_CLIP) == 0);
  CHECK(image.sample({1.25f, 0.75f}, SPPM_CLOSEST, SPPM_CLIP).alpha == 0);
  CHECK(red(image, 0, 0.25f, SPPM_LINEAR_FILTER, SPPM_REPEAT) == doctest::Approx(0.5));
  CHECK(red(image, 1, 0.75f, SPPM_LINEAR_FILTER, SPPM_CLIP) == doctest::Approx(1.5));
}

TEST_CASE("wild coordinates give some texel") {
  const Image image = square_image();
  for (const float x : {1e30f, -1e30f, kInfinity, std::numeric_limits<float>::quiet_NaN()})
    for (const auto e : {SPPM_REPEAT, SPPM_EXTEND, SPPM_CLIP, SPPM_MIRROR}) {
      CHECK(std::isfinite(red(image, x, x, SPPM_LINEAR_FILTER, e)));
      CHECK(std::isfinite(red(image, x, 0, SPPM_CLOSEST, e)));
    }
}

TEST_CASE("bytes are decoded with the sRGB curve, alpha is not") {
  const uint8_t bytes[] = {0, 128, 255, 128};
  SppmImageDesc d{};
  d.width = d.height = 1, d.pixels_u8 = bytes, d.encoding = SPPM_SRGB;
  const Rgba c = Image(d).texel(0, 0);
  CHECK(c.color.x == 0);
  CHECK(static_cast<double>(c.color.y) == doctest::Approx(0.21586).epsilon(1e-4));
  CHECK(c.color.z == doctest::Approx(1));
  CHECK(static_cast<double>(c.alpha) == doctest::Approx(128 / 255.0));
  d.encoding = SPPM_LINEAR;
  CHECK(static_cast<double>(Image(d).texel(0, 0).color.y) == doctest::Approx(128 / 255.0));
  const float floats[] = {0.5f, 0.01f, 1, 0.5f};
  d.pixels_u8 = nullptr, d.pixels = floats, d.encoding = SPPM_SRGB;
  CHECK(static_cast<double>(Image(d).texel(0, 0).color.x) == doctest::Approx(0.21404).epsilon(1e-4));
  CHECK(Image(d).texel(0, 0).alpha == 0.5f);
}

TEST_CASE("bad images are refused") {
  const float pixel[] = {1, 1, 1, std::numeric_limits<float>::infinity()};
  const uint8_t bytes[4] = {};
  SppmImageDesc d{};
  d.width = d.height = 1;
  CHECK_THROWS_AS(Image{d}, Error);
  d.pixels = pixel;
  CHECK_THROWS_AS(Image{d}, Error);
  d.pixels_u8 = bytes;
  CHECK_THROWS_AS(Image{d}, Error);
  d.pixels = nullptr, d.width = 0;
  CHECK_THROWS_AS(Image{d}, Error);
}

TEST_CASE("EXR files have their top row first, and their metadata") {
  const auto path = (std::filesystem::temp_directory_path() / "sppm_image_test.exr").string();
  const float pixels[] = {1, 10, 2, 20, 3, 30, 4, 40, 5, 50, 6, 60};  // 2 wide, 3 high, channels A and B, bottom row first
  write_exr(path, 2, 3, {{"A", pixels, 2}, {"B", pixels + 1, 2}}, {{"sppm:test", "value"}});
  CHECK_FALSE(std::filesystem::exists(path + ".part"));
  {
    Imf::InputFile file(path.c_str());
    float a[6], b[6];
    Imf::FrameBuffer frame;
    frame.insert("A", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(a), 4, 8));
    frame.insert("B", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(b), 4, 8));
    file.setFrameBuffer(frame);
    file.readPixels(0, 2);
    const float expected[] = {5, 6, 3, 4, 1, 2};
    for (int i = 0; i < 6; ++i) {
      CHECK(a[i] == expected[i]);
      CHECK(b[i] == 10 * expected[i]);
    }
    CHECK(file.header().typedAttribute<Imf::StringAttribute>("sppm:test").value() == "value");
    CHECK(file.header().channels().findChannel("A")->type == Imf::FLOAT);
  }
  std::filesystem::remove(path);
}

TEST_CASE("a path that cannot be written is an I/O error that names it") {
  const float pixel = 1;
  try {
    write_exr("/nonexistent/folder/x.exr", 1, 1, {{"R", &pixel, 1}}, {});
    FAIL("no error");
  } catch (const Error& e) {
    CHECK(e.status() == SPPM_IO_ERROR);
    CHECK(std::string(e.what()).find("/nonexistent/folder/x.exr") != std::string::npos);
  }
}

TEST_CASE("an sRGB image is filtered as stored and then decoded") {
  const float pixels[] = {0, 0, 0, 1, 1, 1, 1, 1};
  SppmImageDesc d{};
  d.struct_size = sizeof d;
  d.width = 2, d.height = 1, d.pixels = pixels, d.encoding = SPPM_SRGB;
  CHECK(red(Image(d), 0.5f, 0.5f, SPPM_LINEAR_FILTER, SPPM_EXTEND) == doctest::Approx(0.21404).epsilon(1e-4));
}

TEST_CASE("every sRGB value is decoded by the curve, beyond 0 and 1 as well") {
  double farthest = 0;
  for (int i = -200; i <= 20000; ++i) {
    const float s = static_cast<float>(i) / 15000;
    const float pixel[] = {s, s, s, 1};
    SppmImageDesc d{};
    d.struct_size = sizeof d;
    d.width = d.height = 1, d.pixels = pixel, d.encoding = SPPM_SRGB;
    const double x = static_cast<double>(s), exact = x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
    farthest = std::max(farthest, std::abs(static_cast<double>(Image(d).texel(0, 0).color.x) - exact) / std::max(std::abs(exact), 1e-6));
  }
  CHECK(farthest < 1e-4);  // at the bend of the curve; far below the steps of 8 bits
}
