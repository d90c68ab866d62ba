#include <functional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "rendering/reprojection.h"
#include "scenes/catalogue_cases.h"
#include "vcharge_simulation/sensors/rig_catalogue.h"

namespace vcharge {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;
constexpr double kImageScale = 0.4;
constexpr LensOptions kLensWithoutVeil{0.35, 0.8, 0.0};

// Limits in gray levels, for means over 3x3 pixels and for single pixels.
constexpr double kMaxDifference = 2.0;
constexpr double kMaxPixelDifference = 3.0;
// Consecutive frames see a surface at nearly the same angle; two cameras see it at different angles, on few
// pixels.
constexpr double kMaxShiftOfFrames_px = 0.05;
constexpr double kMaxShiftOfCameras_px = 0.1;
// Number of 3x3 means needed for a comparison.
constexpr int kMinOfFrames = 20000;
constexpr int kMinOfCameras = 100;
constexpr int kMinForShift = 500;

std::vector<Picture> takePictures(const SceneCase& scene_case, const std::vector<CameraView>& views,
                                  int later_frames) {
  const Moment moment = momentOf(scene_case, later_frames);
  std::vector<Picture> pictures;
  for (const CameraView& view : views) {
    pictures.push_back(
        takePicture(rendererOf(scene_case.scene), view, moment.world_from_vehicle, moment.time_s));
  }
  return pictures;
}

std::vector<CameraView> viewsOf(const CameraRig& rig) {
  std::vector<CameraView> views;
  for (const RigCamera& camera : rig.cameras) {
    views.emplace_back(camera, nullptr, kLensWithoutVeil);
  }
  return views;
}

// Seed 0 is the Golf's rig, others are random rigs.
CameraRig rigOf(uint64_t seed) {
  return seed == 0 ? makeRig("golf", 1, kImageScale) : makeRig("random", seed, kImageScale);
}

class ConsistencyTest : public testing::TestWithParam<std::tuple<SceneCase, uint64_t>> {};

std::string labelOf(const testing::TestParamInfo<std::tuple<SceneCase, uint64_t>>& info) {
  const uint64_t seed = std::get<1>(info.param);
  return std::string(std::get<0>(info.param).scene) + (seed == 0 ? "_golf" : "_rig" + std::to_string(seed));
}
INSTANTIATE_TEST_SUITE_P(Catalogue, ConsistencyTest,
                         testing::Combine(testing::ValuesIn(kSceneCases), testing::Range<uint64_t>(0, 5)),
                         labelOf);

TEST_P(ConsistencyTest, ExactRangeReproducesTheNextFrameAndTheNeighbouringCamera) {
  const auto& [scene_case, seed] = GetParam();
  const Renderer& renderer = rendererOf(scene_case.scene);
  const CameraRig rig = rigOf(seed);
  const std::vector<CameraView> views = viewsOf(rig);
  const std::vector<Picture> pictures = takePictures(scene_case, views, 0);
  const std::vector<Picture> next = takePictures(scene_case, views, 1);
  const size_t num_cameras = rig.cameras.size();
  for (size_t i = 0; i < num_cameras; ++i) {
    const Reprojection result = reproject(renderer, pictures[i], next[i]);
    RecordProperty("frames_" + rig.cameras[i].name, toString(result));
    EXPECT_GE(result.count, kMinOfFrames) << rig.cameras[i].name;
    EXPECT_LE(result.mean_pixel_difference, kMaxPixelDifference) << rig.cameras[i].name;
    EXPECT_LE(result.mean_difference, kMaxDifference) << rig.cameras[i].name;
    EXPECT_LE(result.shift_px.norm(), kMaxShiftOfFrames_px) << rig.cameras[i].name;
  }
  for (size_t i = 0; i < num_cameras; ++i) {
    // Neighbouring cameras around the car. Pixels are compared only where the second view is not coarser, so
    // both orders are needed.
    const size_t j = (i + 1) % num_cameras;
    bool compared = false;
    for (const auto& [from, to] : {std::pair(i, j), std::pair(j, i)}) {
      const std::string pair = rig.cameras[from].name + "_" + rig.cameras[to].name;
      const Reprojection result = reproject(renderer, pictures[from], pictures[to], Surfaces::kNoCars);
      if (result.count < kMinOfCameras) {
        continue;
      }
      compared = true;
      RecordProperty(pair, toString(result));
      EXPECT_LE(result.mean_difference, kMaxDifference) << pair;
      if (result.count >= kMinForShift) {
        EXPECT_LE(result.shift_px.norm(), kMaxShiftOfCameras_px) << pair;
      }
    }
    EXPECT_TRUE(compared) << rig.cameras[i].name << " and " << rig.cameras[j].name;
  }
}

TEST(RandomRigsOfTheConsistencyTest, HaveLensesOfBothModels) {
  std::set<std::string> models;
  for (uint64_t seed = 1; seed < 5; ++seed) {
    for (const RigCamera& camera : rigOf(seed).cameras) {
      models.insert(camera.model.name());
    }
  }
  EXPECT_EQ(models.size(), 2U);
}

// Defects that the comparison must detect: a shifted image, a wrong pose, a wrong lens.
class DefectTest : public testing::TestWithParam<uint64_t> {
 protected:
  DefectTest() : pictures_(takePictures(scene_case_, viewsOf(rigOf(GetParam())), 0)) {}

  // Uses the two camera pairs that see most of the walls.
  void expectFound(const std::string& defect, const std::function<void(Picture*)>& disturb) const {
    for (const auto& [from, to] : {std::pair<size_t, size_t>(3, 0), std::pair<size_t, size_t>(3, 2)}) {
      Picture disturbed = pictures_[to];
      disturb(&disturbed);
      const Reprojection result =
          reproject(rendererOf(scene_case_.scene), pictures_[from], disturbed, Surfaces::kNoCars);
      EXPECT_GE(result.count, kMinForShift);
      EXPECT_TRUE(result.shift_px.norm() > kMaxShiftOfCameras_px || result.mean_difference > kMaxDifference)
          << defect << " of camera " << to << " seen from camera " << from << ": " << toString(result);
    }
  }

  void expectWrongLensFound(const std::string& defect,
                            const std::function<void(bool is_mei, Eigen::VectorXd*)>& disturb) const {
    expectFound(defect, [&](Picture* picture) {
      Eigen::VectorXd parameters = picture->camera.parameters();
      disturb(picture->camera.name() == MeiCamera::kName, &parameters);
      picture->camera = CameraModel::create(picture->camera.name(), parameters);
    });
  }

 private:
  const SceneCase scene_case_{"two_levels", "up_and_down", 100};
  std::vector<Picture> pictures_;
};
INSTANTIATE_TEST_SUITE_P(Rigs, DefectTest, testing::Values(0, 2));

TEST_P(DefectTest, ShiftOfThreeTenthsOfAPixelIsFound) {
  for (const double shift_px : {-0.3, 0.3}) {
    expectWrongLensFound("shift along the rows",
                         [&](bool is_mei, Eigen::VectorXd* lens) { (*lens)[is_mei ? 3 : 2] += shift_px; });
    expectWrongLensFound("shift along the columns",
                         [&](bool is_mei, Eigen::VectorXd* lens) { (*lens)[is_mei ? 4 : 3] += shift_px; });
  }
}

TEST_P(DefectTest, WrongPoseIsFound) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      const Eigen::Vector3d step = sign * Eigen::Vector3d::Unit(axis);
      expectFound("turn about axis " + std::to_string(axis), [&](Picture* picture) {
        picture->world_from_camera =
            RigidTransform(picture->world_from_camera.rotation() * rotationFromVector(0.2 * kDegree * step),
                           picture->world_from_camera.translation());
      });
    }
  }
}

TEST_P(DefectTest, WrongLensIsFound) {
  expectWrongLensFound("focal length",
                       [](bool is_mei, Eigen::VectorXd* lens) { lens->segment<2>(is_mei ? 1 : 0) *= 1.003; });
  expectWrongLensFound("form", [](bool is_mei, Eigen::VectorXd* lens) {
    (*lens)[is_mei ? 0 : 4] += is_mei ? 0.02 : 0.005;  // xi; k1
  });
}

}  // namespace
}  // namespace vcharge
