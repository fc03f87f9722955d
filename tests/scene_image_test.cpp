// SPDX-License-Identifier: Apache-2.0
//
// Pictures, cameras and the rays that go with them.
#include "scene/image.hpp"

#include <cmath>
#include <limits>

#include "scene/camera.hpp"
#include "scene_files.hpp"

namespace zkd::test {
namespace {

using glm::vec3;

class ImageTest : public SceneFiles {
 protected:
  void SetUp() override {
    SceneFiles::SetUp();
    if (!scene::can_write_png()) GTEST_SKIP() << "built without OpenImageIO, which writes PNG";
  }
};

TEST_F(ImageTest, WritesAPng) {
  const auto file = folder_ / "new" / "a.png";
  const float nan = std::numeric_limits<float>::quiet_NaN();
  scene::write_png(file, 3, 2,
                   std::vector<vec3>{{0, 0, 0}, {1, 1, 1}, {2, -1, nan}, {1, 0, 0}, {0, 1, 0}, {}});
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  ASSERT_GT(bytes.size(), 33U);
  EXPECT_EQ(bytes.substr(1, 3), "PNG");
  EXPECT_EQ(bytes.substr(16, 8), big_endian(std::uint32_t{3}) + big_endian(std::uint32_t{2}));
  EXPECT_EQ(bytes[24], 8);  // bits a channel
  EXPECT_EQ(bytes[25], 2);  // RGB
}

TEST_F(ImageTest, Errors) {
  const std::vector<vec3> pixels(6);
  EXPECT_THROW(scene::write_png(folder_ / "a.png", 3, 3, pixels), std::invalid_argument);
  EXPECT_THROW(scene::write_png(folder_ / "a.png", 0, 6, pixels), std::invalid_argument);
  write("file", "x");
  try {
    scene::write_png(folder_ / "file" / "a.png", 3, 2, pixels);
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()).find((folder_ / "file" / "a.png").string() + ": "), 0U);
  }
  EXPECT_THROW(scene::write_png(folder_, 3, 2, pixels), std::runtime_error);
}

TEST(Heat, GetsSteadilyLighter) {
  const auto lightness = [](float x) {
    const vec3 c = scene::heat(x);
    const float y = 0.2126F * c.x + 0.7152F * c.y + 0.0722F * c.z;
    return y > 0.008856F ? 116.0F * std::cbrt(y) - 16.0F : 903.3F * y;
  };
  EXPECT_LT(lightness(0.0F), 2.0F);
  EXPECT_GT(lightness(1.0F), 94.0F);
  constexpr int steps = 60;
  for (int i = 0; i < steps; ++i) {
    const float rise =
        lightness(static_cast<float>(i + 1) / steps) - lightness(static_cast<float>(i) / steps);
    EXPECT_GT(rise, 0.6F) << i;
    EXPECT_LT(rise, 2.6F) << i;
  }
  EXPECT_EQ(scene::heat(-1.0F), scene::heat(0.0F));
  EXPECT_EQ(scene::heat(7.0F), scene::heat(1.0F));
  EXPECT_EQ(scene::heat(std::numeric_limits<float>::quiet_NaN()), scene::heat(0.0F));
}

TEST(Camera, RaysRowByRowFromTheTop) {
  const scene::Camera camera{{0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 90.0F};
  const std::vector<Ray> rays = scene::primary_rays(camera, 4);
  ASSERT_EQ(rays.size(), 16U);
  // A field of view of 90 degrees: the centres of 4 pixels are at -3/4, -1/4, 1/4, 3/4.
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      const Ray& ray = rays[static_cast<std::size_t>(4 * row + column)];
      EXPECT_EQ(ray.origin, camera.eye);
      EXPECT_EQ(ray.t_min, 0.0F);
      EXPECT_EQ(ray.t_max, std::numeric_limits<float>::infinity());
      EXPECT_FLOAT_EQ(ray.direction.x / -ray.direction.z, static_cast<float>(2 * column - 3) / 4);
      EXPECT_FLOAT_EQ(ray.direction.y / -ray.direction.z, static_cast<float>(3 - 2 * row) / 4);
      const vec3 d = ray.direction;
      EXPECT_NEAR(d.x * d.x + d.y * d.y + d.z * d.z, 1.0F, 3e-7F);
    }
  }
}

TEST(Camera, OddSizesLookStraightInTheMiddle) {
  const std::vector<Ray> rays = scene::primary_rays({{2, 3, 4}, {2, 3, 1}, {0, 1, 0}, 30.0F}, 7);
  EXPECT_EQ(rays[24].direction, vec3(0, 0, -1));
  EXPECT_TRUE(scene::primary_rays({}, 0).empty());
}

TEST(Camera, FitSeesTheWholeBox) {
  for (const Box& box :
       {Box{{-1, -2, -3}, {4, 5, 6}}, Box{{0, 0, 0}, {1e-3F, 10, 1e-3F}},
        Box{{1e6F, 1e6F, 1e6F}, {1.1e6F, 1.2e6F, 1.0001e6F}}, Box{{0, 0, 0}, {0, 1, 1}}}) {
    const scene::Camera camera = scene::fit_camera(box);
    const float tangent = std::tan(camera.vfov_deg * 3.14159265F / 360.0F);
    const vec3 middle = scene::primary_rays(camera, 1)[0].direction;
    for (unsigned corner = 0; corner < 8; ++corner) {
      float along = 0.0F;
      float square = 0.0F;
      for (int a = 0; a < 3; ++a) {
        const float to = ((corner >> a) & 1u) != 0 ? box.hi[a] : box.lo[a];
        const float d = to - camera.eye[a];
        along += d * middle[a];
        square += d * d;
      }
      ASSERT_GT(along, 0.0F);
      EXPECT_LT(std::sqrt(std::max(square - along * along, 0.0F)), tangent * along * 1.001F);
    }
  }
}

TEST(Camera, FitOfNothingAndOfAPoint) {
  EXPECT_EQ(scene::primary_rays(scene::fit_camera(Box{}), 2).size(), 4U);
  EXPECT_EQ(scene::primary_rays(scene::fit_camera(Box{{5, 5, 5}, {5, 5, 5}}), 2).size(), 4U);
}

TEST(Camera, Errors) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const scene::Camera& camera : {
           scene::Camera{{1, 1, 1}, {1, 1, 1}, {0, 1, 0}, 40.0F},
           scene::Camera{{0, 0, 0}, {0, 1, 0}, {0, 2, 0}, 40.0F},
           scene::Camera{{0, 0, 0}, {0, 1, 0}, {0, 0, 0}, 40.0F},
           scene::Camera{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0.0F},
           scene::Camera{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 180.0F},
           scene::Camera{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, nan},
           scene::Camera{{nan, 0, 0}, {1, 0, 0}, {0, 1, 0}, 40.0F},
       }) {
    EXPECT_THROW((void)scene::primary_rays(camera, 2), std::invalid_argument);
  }
}

}  // namespace
}  // namespace zkd::test
