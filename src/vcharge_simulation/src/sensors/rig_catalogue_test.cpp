#include "vcharge_simulation/sensors/rig_catalogue.h"

#include <cmath>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "scenes/catalogue_cases.h"
#include "vcharge_simulation/sensors/camera_view.h"
#include "vcharge_simulation/sensors/golf_rig.h"

namespace vcharge {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180.0;
constexpr uint64_t kNumSeeds = 50;

TEST(RigCatalogueTest, GolfIsTheRigOfTheGolf) {
  const CameraRig rig = makeRig("golf", 3, 0.5);
  const CameraRig golf = makeGolfRig(3, 0.5);
  ASSERT_EQ(rig.cameras.size(), golf.cameras.size());
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    EXPECT_EQ(rig.cameras[i].model.parameters(), golf.cameras[i].model.parameters());
    EXPECT_EQ(rig.cameras[i].vehicle_from_camera->matrix(), golf.cameras[i].vehicle_from_camera->matrix());
  }
}

TEST(RigCatalogueTest, UnknownRigsAndScalesAreNamed) {
  try {
    makeRig("tractor", 1, 1.0);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("golf, recessed, random, eight"), std::string::npos)
        << error.what();
    EXPECT_NE(std::string(error.what()).find("tractor"), std::string::npos);
  }
  EXPECT_THROW(makeRig("random", 1, 1.5), std::invalid_argument);
}

TEST(RandomRigTest, SameSeedGivesTheSameRigAndAnotherSeedAnother) {
  const auto first_camera = [](uint64_t seed) { return makeRig("random", seed, 1.0).cameras[0]; };
  EXPECT_EQ(first_camera(4).model.parameters(), first_camera(4).model.parameters());
  EXPECT_EQ(first_camera(4).vehicle_from_camera->matrix(), first_camera(4).vehicle_from_camera->matrix());
  EXPECT_NE(first_camera(4).vehicle_from_camera->matrix(), first_camera(5).vehicle_from_camera->matrix());
}

TEST(RandomRigTest, CamerasAreMountedWithinTenCentimetresAndTenDegreesOfTheGolfs) {
  double largest_shift_m = 0.0;
  double largest_turn_rad = 0.0;
  for (uint64_t seed = 0; seed < kNumSeeds; ++seed) {
    const CameraRig rig = makeRig("random", seed, 1.0);
    const CameraRig golf = makeGolfRig(seed, 1.0);
    ASSERT_EQ(rig.cameras.size(), golf.cameras.size());
    for (size_t i = 0; i < rig.cameras.size(); ++i) {
      EXPECT_EQ(rig.cameras[i].name, golf.cameras[i].name);
      const RigidTransform golf_from_random =
          golf.cameras[i].vehicle_from_camera->inverse() * *rig.cameras[i].vehicle_from_camera;
      largest_shift_m = std::max(largest_shift_m, golf_from_random.translation().norm());
      largest_turn_rad = std::max(largest_turn_rad, angleOfRotation(golf_from_random.rotation()));
    }
  }
  EXPECT_LE(largest_shift_m, 0.1);
  EXPECT_LE(largest_turn_rad, 10.0 * kDegree);
  // The whole range is used.
  EXPECT_GT(largest_shift_m, 0.09);
  EXPECT_GT(largest_turn_rad, 9.0 * kDegree);
}

TEST(RandomRigTest, LensesAreOfBothModelsAndOfTheirWholeRange) {
  int num_kannala_brandt = 0;
  double smallest_xi = 9.0;
  double largest_xi = 0.0;
  for (uint64_t seed = 0; seed < kNumSeeds; ++seed) {
    for (const RigCamera& camera : makeRig("random", seed, 1.0).cameras) {
      if (camera.model.name() == KannalaBrandtCamera::kName) {
        ++num_kannala_brandt;
        EXPECT_NEAR(camera.field_of_view_rad, 190.0 * kDegree, 1e-12);
      } else {
        const double xi = camera.model.parameters()[0];
        smallest_xi = std::min(smallest_xi, xi);
        largest_xi = std::max(largest_xi, xi);
      }
    }
  }
  EXPECT_GT(num_kannala_brandt, 70);
  EXPECT_LT(num_kannala_brandt, 130);
  EXPECT_GE(smallest_xi, 0.9);
  EXPECT_LT(smallest_xi, 1.0);
  EXPECT_LE(largest_xi, 1.6);
  EXPECT_GT(largest_xi, 1.5);
}

TEST(RandomRigTest, EveryDirectionOfTheFieldOfViewHasOneImageWithinTheWidth) {
  for (const double scale : {1.0, 0.1}) {
    for (uint64_t seed = 0; seed < kNumSeeds; ++seed) {
      for (const RigCamera& camera : makeRig("random", seed, scale).cameras) {
        for (double around = 0.0; around < 2.0 * kPi; around += kPi / 8.0) {
          double last_radius_px = 0.0;
          for (double fraction = 0.02; fraction <= 1.0; fraction += 0.02) {
            const double angle = 0.5 * fraction * camera.field_of_view_rad;
            const Eigen::Vector3d ray(std::sin(angle) * std::cos(around), std::sin(angle) * std::sin(around),
                                      std::cos(angle));
            Eigen::Vector2d pixel, centre;
            ASSERT_TRUE(camera.model.project(ray, &pixel)) << camera.name << " " << angle / kDegree;
            ASSERT_TRUE(camera.model.project(Eigen::Vector3d::UnitZ(), &centre));
            EXPECT_GE(pixel.x(), -0.5);
            EXPECT_LE(pixel.x(), camera.image_size_px.width - 0.5);
            EXPECT_GT((pixel - centre).norm(), last_radius_px);
            last_radius_px = (pixel - centre).norm();
            Eigen::Vector3d back;
            ASSERT_TRUE(camera.model.unproject(pixel, &back));
            EXPECT_LT((back - ray).norm(), 1e-7);
          }
          // As with real lenses of this kind, the circle nearly fills the width and is cut off at top and
          // bottom.
          EXPECT_GT(last_radius_px, 0.45 * camera.image_size_px.width);
        }
      }
    }
  }
}

TEST(RandomRigTest, TheOwnCarHidesLittleOfTheView) {
  const auto body = makeGolfBody();
  for (uint64_t seed = 0; seed < kNumSeeds; ++seed) {
    for (const RigCamera& camera : makeRig("random", seed, 0.05).cameras) {
      const CameraView view(camera, body);
      const double visible = static_cast<double>(cv::countNonZero(view.mask())) / view.size().area();
      EXPECT_GT(visible, 0.5) << camera.name << " of seed " << seed;
    }
  }
}

TEST(EightRigTest, HasCamerasOfAllModelsThatSeeBesidesTheOwnCar) {
  const auto body = makeGolfBody();
  std::set<std::string> models;
  for (uint64_t seed = 0; seed < 5; ++seed) {
    const CameraRig rig = makeRig("eight", seed, 0.05);
    ASSERT_EQ(rig.cameras.size(), 8u);
    for (const RigCamera& camera : rig.cameras) {
      models.insert(camera.model.name());
      const CameraView view(camera, body);
      const double visible = static_cast<double>(cv::countNonZero(view.mask())) / view.size().area();
      EXPECT_GT(visible, 0.5) << camera.name << " of seed " << seed;
    }
  }
  EXPECT_EQ(models, (std::set<std::string>{"kannala_brandt", "mei", "pinhole"}));
  EXPECT_NE(makeRig("eight", 1, 1.0).cameras[7].vehicle_from_camera->matrix(),
            makeRig("eight", 2, 1.0).cameras[7].vehicle_from_camera->matrix());
  EXPECT_THROW(makeRig("eight", 1, 1.5), std::invalid_argument);
}

TEST(EightRigTest, EveryPixelOfANarrowCameraHasARayWithinTheFieldOfView) {
  for (const RigCamera& camera : makeRig("eight", 3, 0.05).cameras) {
    if (camera.model.name() == PinholeCamera::kName) {
      for (int y = 0; y < camera.image_size_px.height; ++y) {
        for (int x = 0; x < camera.image_size_px.width; ++x) {
          Eigen::Vector3d ray;
          ASSERT_TRUE(camera.model.unproject(Eigen::Vector2d(x, y), &ray)) << camera.name;
          EXPECT_GT(ray.z(), std::cos(0.5 * camera.field_of_view_rad)) << camera.name;
        }
      }
    }
  }
}

TEST(RandomRigTest, RangeOfThePlaneFollowsTheFormulaThroughItsLenses) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    for (const RigCamera& camera : makeRig("random", seed, 0.1).cameras) {
      expectRangesOfPlane(CameraView(camera, nullptr), RigidTransform());
    }
  }
}

}  // namespace
}  // namespace vcharge
