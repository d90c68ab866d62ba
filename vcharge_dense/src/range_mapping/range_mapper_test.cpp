#include "vcharge_dense/range_mapper.h"

#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "reference/analytic_scene.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/files/content_hash.h"

namespace vcharge {
namespace {

constexpr int64_t kImagePeriod_ns = 80000000;

std::shared_ptr<const CameraRig> makeRig() {
  auto rig = std::make_shared<CameraRig>();
  const Eigen::Quaterniond forward(0.5, -0.5, 0.5, -0.5);
  for (const bool left : {true, false}) {
    RigCamera camera{left ? "left" : "front",
                     left ? "camera_left_optical" : "camera_front_optical",
                     cv::Size(128, 80),
                     MeiCamera(1.158, 90.0, 90.0, 64.0, 40.0),
                     3.0,
                     "",
                     cv::Mat(),
                     RigidTransform(),
                     std::nullopt};
    camera.vehicle_from_camera = left ? RigidTransform(rotationFromYawPitchRoll(1.5, 0.6, 0.0) * forward,
                                                       Eigen::Vector3d(1.9, 1.0, 0.9))
                                      : RigidTransform(rotationFromYawPitchRoll(0.0, 0.2, 0.0) * forward,
                                                       Eigen::Vector3d(3.6, 0.0, 0.7));
    rig->cameras.push_back(camera);
  }
  return rig;
}

/// A small image, for tests where only poses matter.
Image blankImage() {
  return Image{cv::Mat(80, 128, CV_8UC1, cv::Scalar(100)), nullptr};
}

Timestamp stampOf(int image, int64_t start_s = 100) {
  return Timestamp::fromNanoseconds(start_s * 1000000000 + image * kImagePeriod_ns);
}

VehicleOdometry odometryAt(Timestamp stamp, double x_m) {
  VehicleOdometry odometry;
  odometry.stamp = stamp;
  odometry.odom_from_vehicle = RigidTransform::planar(x_m, 0.0, 0.0);
  return odometry;
}

RangeMapperOptions smallOptions() {
  RangeMapperOptions options;
  options.working_camera.image_scale = 1.0;
  return options;
}

struct Recorder {
  std::vector<RangeTask> tasks;
  RangeMapper::TaskCallback callback() {
    return [this](RangeTask task) { tasks.push_back(std::move(task)); };
  }
};

/// Sends odometry and one image per camera every `step_m`.
void drive(RangeMapper* mapper, int images, double step_m, int64_t start_s = 100) {
  for (int i = 0; i < images; ++i) {
    mapper->addOdometry(odometryAt(stampOf(i, start_s), i * step_m));
    for (size_t camera = 0; camera < 2; ++camera) {
      mapper->addImage(camera, stampOf(i, start_s), blankImage());
    }
  }
}

double baseline(const RangeTask& task, size_t n) {
  return (task.neighbours[n].world_from_camera.translation() - task.reference.world_from_camera.translation())
      .norm();
}

TEST(RangeMapperTest, OnlineUsesEarlierImagesWithLongerBaselinesForwards) {
  Recorder recorder;
  RangeMapperOptions options = smallOptions();
  options.neighbours.max_forward_baseline_m = 2.0;
  RangeMapper mapper(makeRig(), options, recorder.callback());
  drive(&mapper, 20, 0.2);
  ASSERT_EQ(recorder.tasks.size(), 38u);  // each camera's first image has no neighbour
  for (const RangeTask& task : recorder.tasks) {
    for (size_t n = 0; n < task.neighbours.size(); ++n) {
      EXPECT_LT(task.neighbours[n].stamp, task.reference.stamp);
    }
  }
  const RangeTask& front = recorder.tasks.back();
  const RangeTask& left = recorder.tasks[recorder.tasks.size() - 2];
  ASSERT_EQ(front.camera_index, 1u);
  ASSERT_EQ(front.neighbours.size(), 4u);
  ASSERT_EQ(left.neighbours.size(), 4u);
  EXPECT_NEAR(baseline(front, 0), 2.0, 0.1001);
  EXPECT_LE(baseline(left, 0), 1.0);
  EXPECT_EQ(front.reference.stamp, stampOf(19));
}

TEST(RangeMapperTest, OfflineUsesBothSidesAndSweepsEveryImage) {
  Recorder recorder;
  RangeMapperOptions options = RangeMapperOptions::offline();
  options.working_camera.image_scale = 1.0;
  RangeMapper mapper(makeRig(), options, recorder.callback());
  drive(&mapper, 30, 0.2);
  mapper.finish();
  ASSERT_EQ(recorder.tasks.size(), 60u);
  int two_sided = 0;
  for (const RangeTask& task : recorder.tasks) {
    int before = 0, after = 0;
    for (const SweepImage& neighbour : task.neighbours) {
      (neighbour.stamp < task.reference.stamp ? before : after) += 1;
    }
    two_sided += before == 2 && after == 2 ? 1 : 0;
  }
  EXPECT_GE(two_sided, 48);
}

TEST(RangeMapperTest, AStandingCameraIsMatchedWithOthersAtItsStamp) {
  for (const InterCamera mode : {InterCamera::kOff, InterCamera::kStanding, InterCamera::kAlways}) {
    SCOPED_TRACE(enumNames<InterCamera>()[static_cast<size_t>(mode)]);
    Recorder recorder;
    RangeMapperOptions options = smallOptions();
    options.inter_camera = mode;
    RangeMapper mapper(makeRig(), options, recorder.callback());
    drive(&mapper, 10, 0.2);
    size_t with_instant = 0;
    for (const RangeTask& task : recorder.tasks) {
      with_instant += task.instant ? 1 : 0;
      EXPECT_EQ(task.instant != nullptr, mode == InterCamera::kAlways || task.neighbours.empty());
    }
    EXPECT_EQ(recorder.tasks.size(), mode == InterCamera::kOff ? 18u : 20u);
    EXPECT_EQ(mapper.status()[0].inter_camera, with_instant / 2);
    const size_t moving = recorder.tasks.size();
    for (int i = 10; i < 20; ++i) {
      mapper.addOdometry(odometryAt(stampOf(i), 9 * 0.2));
      mapper.addImage(0, stampOf(i), blankImage());
      if (i < 15) {
        mapper.addImage(1, stampOf(i), blankImage());
      }
    }
    mapper.finish();
    // Not before the vehicle has stood for 0.1 s, nor without the other camera's image.
    ASSERT_EQ(recorder.tasks.size() - moving, mode == InterCamera::kOff ? 0u : 8u);
    for (size_t i = moving; i < recorder.tasks.size(); ++i) {
      const RangeTask& task = recorder.tasks[i];
      EXPECT_TRUE(task.neighbours.empty());
      const RangeMap map = mapper.sweep(task);
      EXPECT_EQ(map.stamp, task.reference.stamp);
      EXPECT_EQ(map.camera_name, task.camera_index == 0 ? "left" : "front");
      EXPECT_EQ(cv::countNonZero(map.range_m == map.range_m), 0);  // images without texture
    }
    EXPECT_EQ(mapper.status()[0].state, RangeMapperState::kStanding);
  }
}

TEST(RangeMapperTest, ACameraThatMovedIsMatchedWithItselfAlone) {
  Recorder recorder;
  RangeMapperOptions options = smallOptions();
  options.inter_camera = InterCamera::kAlways;
  RangeMapper mapper(makeRig(), options, recorder.callback());
  RigCondition condition(2);
  condition[1] = {true, 0.01, 0.02};
  mapper.setCondition(condition);
  drive(&mapper, 10, 0.2);
  ASSERT_EQ(recorder.tasks.size(), 18u);
  for (const RangeTask& task : recorder.tasks) {
    EXPECT_EQ(task.instant, nullptr);
    for (size_t n = 0; n < task.neighbours.size(); ++n) {
      const double swing_m = (task.camera_index == 1 ? 0.02 : 0.0) * baseline(task, n);
      EXPECT_NEAR(task.neighbours[n].noise.more_translation_m2, swing_m * swing_m, 1e-12);
    }
  }
  EXPECT_FALSE(mapper.status()[0].has_moved);
  EXPECT_TRUE(mapper.status()[1].has_moved);
  mapper.setCondition(RigCondition(2));
  EXPECT_FALSE(mapper.status()[1].has_moved);
}

TEST(RangeMapperTest, MatchesNoOtherCamerasAloneWhileTheVehicleCreeps) {
  Recorder recorder;
  RangeMapperOptions options = smallOptions();
  options.inter_camera = InterCamera::kStanding;
  RangeMapper mapper(makeRig(), options, recorder.callback());
  drive(&mapper, 60, 0.01);  // most images are less than 0.03 m from the last one that is kept
  ASSERT_GT(recorder.tasks.size(), 20u);
  for (const RangeTask& task : recorder.tasks) {
    EXPECT_EQ(task.neighbours.empty(), task.instant != nullptr);
    // At its first image it is not known whether the vehicle stands.
    EXPECT_EQ(task.instant != nullptr, task.reference.stamp == stampOf(0));
  }
}

TEST(RangeMapperTest, ReportsAStandingVehicle) {
  Recorder recorder;
  RangeMapper mapper(makeRig(), smallOptions(), recorder.callback());
  drive(&mapper, 10, 0.2);
  const size_t moving = recorder.tasks.size();
  for (int i = 10; i < 40; ++i) {
    mapper.addOdometry(odometryAt(stampOf(i), 9 * 0.2 + 0.0001 * (i % 2)));
    mapper.addImage(0, stampOf(i), blankImage());
    mapper.addImage(1, stampOf(i), blankImage());
  }
  EXPECT_EQ(recorder.tasks.size(), moving);
  for (const RangeMapperStatus& status : mapper.status()) {
    EXPECT_EQ(status.state, RangeMapperState::kStanding);
    EXPECT_EQ(status.standing, 30u);
  }
}

TEST(RangeMapperTest, ReportsACameraThatStops) {
  Recorder recorder;
  RangeMapper mapper(makeRig(), smallOptions(), recorder.callback());
  drive(&mapper, 10, 0.2);
  const auto driveLeftOnly = [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      mapper.addOdometry(odometryAt(stampOf(i), i * 0.2));
      mapper.addImage(0, stampOf(i), blankImage());
    }
  };
  driveLeftOnly(10, 30);
  EXPECT_EQ(mapper.status()[0].state, RangeMapperState::kMapping);
  EXPECT_EQ(mapper.status()[1].state, RangeMapperState::kNoImages);
  EXPECT_NE(mapper.status()[1].message.find("no image since"), std::string::npos);
  for (int i = 30; i < 34; ++i) {
    mapper.addOdometry(odometryAt(stampOf(i), i * 0.2));
    mapper.addImage(1, stampOf(i), blankImage());
  }
  EXPECT_EQ(mapper.status()[1].state, RangeMapperState::kMapping);  // recovered
}

TEST(RangeMapperTest, RestartsWhenStampsJumpBack) {
  Recorder recorder;
  RangeMapper mapper(makeRig(), smallOptions(), recorder.callback());
  drive(&mapper, 20, 0.2, 200);
  const size_t first = recorder.tasks.size();
  drive(&mapper, 20, 0.2, 100);  // like a replay of the bag
  EXPECT_EQ(recorder.tasks.size(), 2 * first);
  for (size_t i = first; i < recorder.tasks.size(); ++i) {
    for (const SweepImage& neighbour : recorder.tasks[i].neighbours) {
      EXPECT_LT(neighbour.stamp, stampOf(0, 150));  // not from the first pass
    }
  }
  EXPECT_GE(mapper.status()[0].resets, 1u);
}

TEST(RangeMapperTest, DoesNotMatchAcrossAGapOfTheOdometry) {
  Recorder recorder;
  RangeMapper mapper(makeRig(), smallOptions(), recorder.callback());
  for (int i = 0; i < 40; ++i) {
    if (i < 15 || i >= 25) {
      mapper.addOdometry(odometryAt(stampOf(i), i * 0.2));
    }
    mapper.addImage(0, stampOf(i), blankImage());
  }
  EXPECT_EQ(mapper.status()[0].state, RangeMapperState::kMapping);
  EXPECT_EQ(mapper.status()[0].without_pose, 10u);
  EXPECT_EQ(mapper.status()[0].resets, 1u);
  for (const RangeTask& task : recorder.tasks) {
    for (const SweepImage& neighbour : task.neighbours) {
      EXPECT_EQ(neighbour.stamp < stampOf(20), task.reference.stamp < stampOf(20));
    }
  }
}

TEST(RangeMapperTest, WaitsForOdometryAndReportsIt) {
  Recorder recorder;
  RangeMapper mapper(makeRig(), smallOptions(), recorder.callback());
  for (int i = 0; i < 5; ++i) {
    mapper.addImage(0, stampOf(i), blankImage());
  }
  EXPECT_EQ(mapper.status()[0].state, RangeMapperState::kNoPose);
  for (int i = 0; i < 5; ++i) {
    mapper.addOdometry(odometryAt(stampOf(i), i * 0.2));
  }
  EXPECT_EQ(mapper.status()[0].state, RangeMapperState::kMapping);
  EXPECT_EQ(recorder.tasks.size(), 4u);
}

TEST(RangeMapperTest, UsesPosesOfATrajectory) {
  Recorder recorder;
  RangeMapper mapper(makeRig(), smallOptions(), recorder.callback());
  Trajectory trajectory;
  for (int i = 0; i < 10; ++i) {
    trajectory.push_back({stampOf(i), RigidTransform::planar(0.0, 0.3 * i, 0.0)});
  }
  mapper.setTrajectory(trajectory);
  drive(&mapper, 10, 0.2);  // this odometry must not be used
  ASSERT_FALSE(recorder.tasks.empty());
  const Eigen::Vector3d motion = recorder.tasks.back().reference.world_from_camera.translation() -
                                 recorder.tasks.back().neighbours.back().world_from_camera.translation();
  EXPECT_NEAR(std::abs(motion.x()), 0.0, 1e-9);
  EXPECT_GT(motion.y(), 0.2);
}

TEST(RangeMapperTest, MeasuresASceneThroughTheWholePath) {
  const auto rig = makeRig();
  const AnalyticScene scene({{{0, 0, 0}, {0, 0, 1}}, {{0, 5, 0}, {0, -1, 0}}}, 8);
  const RigCamera& camera = rig->cameras[0];
  const MeiCamera& model = std::get<MeiCamera>(camera.model.variant());
  Recorder recorder;
  RangeMapperOptions options = smallOptions();
  options.cameras = {"left"};
  RangeMapper mapper(rig, options, recorder.callback());
  for (int i = 0; i < 6; ++i) {
    const VehicleOdometry odometry = odometryAt(stampOf(i), i * 0.2);
    mapper.addOdometry(odometry);
    const cv::Mat pixels =
        scene.render(model, camera.image_size_px, odometry.odom_from_vehicle * *camera.vehicle_from_camera);
    mapper.addImage(0, stampOf(i), Image{pixels, nullptr});
  }
  ASSERT_FALSE(recorder.tasks.empty());
  const RangeTask& task = recorder.tasks.back();
  const RangeMap map = mapper.sweep(task);
  EXPECT_EQ(map.camera_name, "left");
  EXPECT_EQ(map.frame_id, "camera_left_optical");
  EXPECT_EQ(map.stamp, stampOf(5));
  const cv::Mat truth = scene.range(model, camera.image_size_px, task.reference.world_from_camera);
  int known = 0, right = 0;
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 128; ++x) {
      const double error = map.range_m.at<float>(y, x) - truth.at<double>(y, x);
      known += std::isnan(error) ? 0 : 1;
      right += std::abs(error) <= 0.05 * truth.at<double>(y, x) ? 1 : 0;
    }
  }
  EXPECT_GT(known, 128 * 80 / 2);
  EXPECT_GE(right, 0.9 * known);
}

TEST(RangeMapperTest, MeasuresTheSameSceneAtAnyFocalScale) {
  // A lens with distortion; the focal scale determines whether its border is cropped or kept.
  MeiCamera::Parameters parameters;
  parameters << 1.158, 224.0, 223.5, 162.0, 99.5, -0.33, 0.0865, -0.00067, -0.00004;
  const MeiCamera lens(parameters);
  const cv::Size size(320, 200);
  auto rig = std::make_shared<CameraRig>(*makeRig());
  rig->cameras.pop_back();
  rig->cameras[0].model = lens;
  rig->cameras[0].image_size_px = size;
  const AnalyticScene scene({{{0, 0, 0}, {0, 0, 1}}, {{0, 5, 0}, {0, -1, 0}}}, 8);
  for (const double focal_scale : {1.0, 0.5}) {
    SCOPED_TRACE(focal_scale);
    Recorder recorder;
    RangeMapperOptions options = smallOptions();
    options.working_camera.focal_scale = focal_scale;
    RangeMapper mapper(rig, options, recorder.callback());
    for (int i = 0; i < 6; ++i) {
      const VehicleOdometry odometry = odometryAt(stampOf(i), i * 0.2);
      const RigidTransform pose = odometry.odom_from_vehicle * *rig->cameras[0].vehicle_from_camera;
      mapper.addOdometry(odometry);
      mapper.addImage(0, stampOf(i), Image{scene.render(lens, size, pose), nullptr});
    }
    ASSERT_FALSE(recorder.tasks.empty());
    const RangeTask& task = recorder.tasks.back();
    const RangeMap map = mapper.sweep(task);
    EXPECT_DOUBLE_EQ(map.camera.gamma1(), focal_scale * lens.gamma1());
    const cv::Mat truth = scene.range(map.camera, size, task.reference.world_from_camera);
    int known = 0, right = 0;
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const double error = map.range_m.at<float>(y, x) - truth.at<double>(y, x);
        known += std::isnan(error) ? 0 : 1;
        right += std::abs(error) <= 0.05 * truth.at<double>(y, x) ? 1 : 0;
      }
    }
    EXPECT_GT(known, size.area() / 4);
    EXPECT_GE(right, 0.9 * known);
  }
}

TEST(RangeMapperTest, RejectsARigItCannotUse) {
  CameraRig bare = *makeRig();
  bare.cameras[1].vehicle_from_camera.reset();
  const auto rig = std::make_shared<const CameraRig>(bare);
  Recorder recorder;
  EXPECT_THROW(RangeMapper(rig, smallOptions(), recorder.callback()), InputError);
  RangeMapperOptions options = smallOptions();
  options.cameras = {"left"};
  EXPECT_NO_THROW(RangeMapper(rig, options, recorder.callback()));
  options.cameras = {"roof"};
  EXPECT_THROW(RangeMapper(rig, options, recorder.callback()), InputError);
  options.cameras.clear();
  options.neighbours.num_neighbours = 0;
  EXPECT_THROW(RangeMapper(rig, options, recorder.callback()), std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
