// Range maps of cameras that expose their lines one after the other while the vehicle moves. Truth: the same
// scenes seen at the images' stamps.
#include "vcharge_dense/exposure.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "exposure/range_rectification.h"
#include "kernels/aligned_array.h"
#include "range_mapping/motion_refinement.h"
#include "reference/plane_sweep_test_support.h"
#include "sweep/sweep_input.h"
#include "vcharge_core/camera/ray_table.h"
#include "vcharge_dense/range_mapper.h"

namespace vcharge {
namespace {

constexpr double kReadout_s = 0.025, kPeriod_s = 0.08;
constexpr VehicleRates kRates{4.0, 0.5};

RigCamera rigCamera(const CameraModel& model, ReadoutDirection direction, double clock_offset_s,
                    cv::Size size = kSize, const RigidTransform& vehicle_from_camera = kFront) {
  RigCamera camera{"front",   "camera_front_optical", size,        model, 3.2, "",
                   cv::Mat(), vehicle_from_camera,    std::nullopt};
  camera.timing = {kReadout_s, direction, clock_offset_s};
  return camera;
}

/// Pixels have the size of the sensor's.
WorkingCamera workingCamera(const RigCamera& camera) {
  WorkingCameraOptions options;
  options.image_scale = 1.0;
  return WorkingCamera(camera.model, camera.image_size_px, camera.field_of_view_rad, camera.mask, options);
}

ExposureTimes timesOf(const RigCamera& camera) {
  return ExposureTimes::of(camera, workingCamera(camera));
}

RigidTransform vehicleAt(double time_s) {
  return kRates.motionAfter(time_s);
}

AnalyticScene::PoseOfRow poseOfRow(const RigCamera& camera, double stamp_s) {
  return [camera, stamp_s](int row) {
    return vehicleAt(stamp_s + camera.exposedAt({0.0, row})) * *camera.vehicle_from_camera;
  };
}

TEST(ExposureTest, TimesAreThoseOfTheSensorsLines) {
  const MeiCamera::Parameters of_mei =
      (MeiCamera::Parameters() << 1.158, 224.0, 223.5, 162.0, 99.5, -0.33, 0.0865, -0.0007, 0.0001)
          .finished();
  const KannalaBrandtCamera::Parameters of_kannala_brandt =
      (KannalaBrandtCamera::Parameters() << 95.0, 94.0, 161.0, 98.0, 0.02, -0.004, 0.001, 0.0).finished();
  for (const CameraModel& model :
       {CameraModel(MeiCamera(of_mei)), CameraModel(KannalaBrandtCamera(of_kannala_brandt))}) {
    for (const ReadoutDirection direction : {ReadoutDirection::kDown, ReadoutDirection::kUp,
                                             ReadoutDirection::kRight, ReadoutDirection::kLeft}) {
      const RigCamera camera = rigCamera(model, direction, 0.004);
      const WorkingCamera working = workingCamera(camera);
      const ExposureTimes times = timesOf(camera);
      double worst_s = 0.0;
      for (int y = 0; y < kSize.height; ++y) {
        for (int x = 0; x < kSize.width; ++x) {
          const cv::Vec2f& sensor_px = working.sensorPixels().at<cv::Vec2f>(y, x);
          if (sensor_px[0] >= 0.0F) {
            const Eigen::Vector2d point = imagePoint(working.model(), Eigen::Vector2d(x, y));
            worst_s =
                std::max(worst_s, std::abs(times.at(point) - camera.exposedAt({sensor_px[0], sensor_px[1]})));
          }
        }
      }
      EXPECT_LT(worst_s, 1e-4) << model.name() << " " << static_cast<int>(direction);
    }
  }
}

TEST(ExposureTest, WithoutReadoutAndOffsetNothingMoves) {
  RigCamera camera = rigCamera(CameraModel(kCamera), ReadoutDirection::kDown, 0.0);
  EXPECT_TRUE(Exposure::of(timesOf(camera), kFront, {kRates}).moves());
  EXPECT_FALSE(Exposure::of(timesOf(camera), kFront, ImageMotion()).moves());
  camera.timing.readout_s = 0.0;
  EXPECT_FALSE(Exposure::of(timesOf(camera), kFront, {kRates}).moves());
  camera.timing.clock_offset_s = 0.004;
  EXPECT_TRUE(Exposure::of(timesOf(camera), kFront, {kRates}).moves());
}

TEST(ExposureTest, KernelsProjectBetweenLinesOfTwoCameras) {
  const RigCamera front = rigCamera(CameraModel(kCamera), ReadoutDirection::kDown, 0.003);
  RigCamera left = rigCamera(CameraModel(kCamera), ReadoutDirection::kRight, 0.0, kSize, kLeft);
  // From the left camera's image to the front camera's, three images earlier.
  const double stamp_s = -3.0 * kPeriod_s;
  const RigidTransform neighbour_from_reference = (vehicleAt(stamp_s) * kFront).inverse() * kLeft;
  const SweepNeighbour neighbour{PackedImage(cv::Mat(kSize, CV_8UC1, cv::Scalar(100)), allValid()),
                                 kCamera,
                                 neighbour_from_reference.rotationMatrix().cast<float>(),
                                 neighbour_from_reference.translation().cast<float>(),
                                 false,
                                 {},
                                 {},
                                 Exposure::of(timesOf(front), kFront, {kRates}),
                                 Exposure::of(timesOf(left), kLeft, {kRates}),
                                 kCamera.xi()};
  const Projection projection = neighbour.projection();
  AlignedArray<float> x, y, z, base, weight, u, v;
  std::vector<Eigen::Vector2d> expected;
  for (int i = 0; i < 512; ++i) {
    const int column = i % 16, row = i / 16;
    const Eigen::Vector2d pixel(160.0 + column * 9.0, 20.0 + row * 5.0);
    const double inverse_range = 0.05 + 0.05 * (i % 7);
    Eigen::Vector3d ray;
    ASSERT_TRUE(kCamera.unproject(pixel, &ray));
    const Eigen::Vector3d in_world =
        vehicleAt(left.exposedAt(pixel)) * kLeft * (ray.normalized() / inverse_range);
    Eigen::Vector2d seen(160.0, 100.0);
    bool is_seen = true;
    for (int iteration = 0; iteration < 10 && is_seen; ++iteration) {
      const RigidTransform pose = vehicleAt(stamp_s + front.exposedAt(seen)) * kFront;
      is_seen = kCamera.project(pose.inverse() * in_world, &seen);
    }
    if (!is_seen || seen.x() < 8.0 || seen.y() < 8.0 || seen.x() > 311.0 || seen.y() > 191.0) {
      continue;
    }
    expected.push_back(seen);
    const size_t at = expected.size() - 1;
    for (AlignedArray<float>* array : {&x, &y, &z, &base, &weight}) {
      if (array->size() == 0) {
        array->assign(512, 0.0f);
      }
    }
    x[at] = static_cast<float>(ray.normalized().x());
    y[at] = static_cast<float>(ray.normalized().y());
    z[at] = static_cast<float>(ray.normalized().z());
    base[at] = static_cast<float>(inverse_range);
  }
  ASSERT_GT(expected.size(), 50u);
  u.resize(512);
  v.resize(512);
  onEveryTarget([&] {
    sweepKernels().project(projection, {x.data(), y.data(), z.data(), base.data(), weight.data(), 0.0f}, 512,
                           u.data(), v.data());
    double worst_px = 0.0;
    for (size_t i = 0; i < expected.size(); ++i) {
      const Eigen::Vector2d found(u[i] - PackedImage::kMargin, v[i] - PackedImage::kMargin);
      worst_px = std::max(worst_px, (found - expected[i]).norm());
    }
    EXPECT_LT(worst_px, 0.15);  // the lines' motion is up to 12 pixels
  });
}

TEST(ExposureTest, RangesMoveToWhereTheyWouldBeAtTheStamp) {
  const AnalyticScene scene = lotScene(3);
  for (const RigidTransform& vehicle_from_camera : {kFront, kLeft}) {
    const RigCamera camera =
        rigCamera(CameraModel(kCamera), ReadoutDirection::kDown, 0.0, kSize, vehicle_from_camera);
    const cv::Mat truth = scene.range(kCamera, kSize, vehicle_from_camera);
    RangeMap map{Timestamp(), "", "", kCamera, {}, {}, cv::Mat(kSize, CV_32FC1, cv::Scalar(1.0)), {}};
    scene.range(kCamera, kSize, poseOfRow(camera, 0.0)).convertTo(map.range_m, CV_32F);
    map.standard_deviation_m = 0.01 * map.range_m;
    map.reference = scene.render(kCamera, kSize, poseOfRow(camera, 0.0));
    const RayTable rays(CameraModel(kCamera), kSize, 6.2);
    const RangeMap moved = rectified(map, rays, Exposure::of(timesOf(camera), vehicle_from_camera, {kRates}));
    const int before = countRight(map, truth, 0.003, 8), after = countRight(moved, truth, 0.003, 8);
    EXPECT_GT(after, 0.97 * (kSize.width - 16) * (kSize.height - 16));
    EXPECT_LT(before, 0.9 * after);
    const cv::Mat at_stamp = scene.render(kCamera, kSize, vehicle_from_camera);
    const cv::Rect inside(20, 20, kSize.width - 40, kSize.height - 40);
    EXPECT_LT(cv::norm(moved.reference(inside), at_stamp(inside), cv::NORM_L1),
              0.4 * cv::norm(map.reference(inside), at_stamp(inside), cv::NORM_L1));
  }
}

/// Images every 80 ms with the given exposure; image 0 is the reference.
Sequence sequenceOf(const AnalyticScene& scene, const RigCamera& camera, const Exposure& exposure) {
  const RigidTransform& vehicle_from_camera = *camera.vehicle_from_camera;
  Sequence sequence;
  for (int i = -4; i <= 0; ++i) {
    SweepImage image{
        Timestamp::fromNanoseconds(1000000000 + i * 80000000),
        scene.render(kCamera, kSize, poseOfRow(camera, i * kPeriod_s), 1.0, static_cast<uint32_t>(100 + i)),
        vehicleAt(i * kPeriod_s) * vehicle_from_camera,
        nullptr,
        {},
        exposure};
    (i == 0 ? sequence.reference : sequence.neighbours.emplace_back()) = image;
  }
  sequence.truth = scene.range(kCamera, kSize, vehicle_from_camera);
  sequence.ground = groundInCamera(vehicle_from_camera);
  return sequence;
}

TEST(ExposureTest, SweepsOfRollingShuttersAreAsRightAsThoseOfGlobalOnes) {
  const AnalyticScene scene = lotScene(1);
  for (const RigidTransform& vehicle_from_camera : {kFront, kLeft}) {
    RigCamera camera =
        rigCamera(CameraModel(kCamera), ReadoutDirection::kDown, 0.0, kSize, vehicle_from_camera);
    const Exposure exposure = Exposure::of(timesOf(camera), vehicle_from_camera, {kRates});
    // Towards the front points move across the lines, towards the side along them.
    const bool is_front = vehicle_from_camera.translation().y() == 0.0;
    const PlaneSweepOptions options;
    const auto right = [&](const Sequence& sequence) {
      return countRight(sweepOf(sequence, options), sequence.truth, 0.03, 8);
    };
    const int rolling = right(sequenceOf(scene, camera, exposure));
    const int ignored = right(sequenceOf(scene, camera, Exposure()));
    camera.timing.readout_s = 0.0;
    const int global = right(sequenceOf(scene, camera, Exposure()));
    RecordProperty(is_front ? "front" : "left",
                   std::to_string(global) + " " + std::to_string(rolling) + " " + std::to_string(ignored));
    EXPECT_GT(rolling, 0.97 * global);
    EXPECT_LT(ignored, (is_front ? 0.9 : 1.0) * global);
  }
}

/// A front and a left camera, whose lines are read out in opposite directions.
CameraRig rigOfTwo(double readout_s) {
  CameraRig rig;
  rig.cameras = {rigCamera(CameraModel(kCamera), ReadoutDirection::kDown, 0.002),
                 rigCamera(CameraModel(kCamera), ReadoutDirection::kUp, 0.0, kSize, kLeft)};
  rig.cameras[1].name = "left";
  for (RigCamera& camera : rig.cameras) {
    camera.timing = readout_s == 0.0 ? ImageTiming() : camera.timing;
    camera.timing.readout_s = readout_s;
  }
  return rig;
}

/// Pixels of the last range map of each camera that are within 1 % of the truth.
int countRightOnDrive(const AnalyticScene& scene, const CameraRig& true_rig, const CameraRig& told_rig) {
  RangeMapperOptions options;
  options.working_camera.image_scale = 1.0;
  options.plane_sweep.pose_noise = {0.0, 0.001, 0.0, 0.0002, 0.0};  // poses are true
  std::vector<RangeTask> tasks;
  RangeMapper mapper(std::make_shared<CameraRig>(told_rig), options,
                     [&](RangeTask task) { tasks.push_back(std::move(task)); });
  for (int i = -8; i <= 0; ++i) {
    const Timestamp stamp = Timestamp::fromNanoseconds(1000000000 + i * 80000000);
    VehicleOdometry odometry;
    odometry.stamp = stamp;
    odometry.odom_from_vehicle = vehicleAt(i * kPeriod_s);
    odometry.forward_speed_m_per_s = kRates.forward_speed_m_per_s;
    odometry.yaw_rate_rad_per_s = kRates.yaw_rate_rad_per_s;
    mapper.addOdometry(odometry);
    for (size_t camera = 0; camera < 2; ++camera) {
      const auto pose = poseOfRow(true_rig.cameras[camera], i * kPeriod_s);
      mapper.addImage(camera, stamp, {scene.render(kCamera, kSize, pose), nullptr});
    }
  }
  mapper.finish();
  int right = 0;
  for (size_t i = tasks.size() - 2; i < tasks.size(); ++i) {
    const cv::Mat truth = scene.range(kCamera, kSize, tasks[i].reference.world_from_camera);
    right += countRight(mapper.sweep(tasks[i]), truth, 0.01);
  }
  return right;
}

TEST(ExposureTest, TheWholeOfRangeMappingKnowsTheRigsTiming) {
  const AnalyticScene scene = lotScene(2);
  const CameraRig global = rigOfTwo(0.0), rolling = rigOfTwo(kReadout_s);
  const int at_once = countRightOnDrive(scene, global, global);
  const int told = countRightOnDrive(scene, rolling, rolling);
  const int not_told = countRightOnDrive(scene, rolling, global);
  RecordProperty("right",
                 std::to_string(at_once) + " " + std::to_string(told) + " " + std::to_string(not_told));
  EXPECT_GT(told, 0.97 * at_once);
  EXPECT_LT(not_told, 0.75 * at_once);
}

/// Rotation that is found for a motion that was given without an error, over many images.
double rotationFound(const AnalyticScene& scene, const CameraRig& true_rig, const CameraRig& told_rig) {
  std::vector<std::optional<MotionRefinement::Camera>> cameras;
  for (const RigCamera& camera : told_rig.cameras) {
    cameras.push_back(
        MotionRefinement::Camera{kCamera, allValid(), *camera.vehicle_from_camera, timesOf(camera)});
  }
  MotionRefinement refinement(cameras, PoseNoiseOptions());
  const auto stampOf = [](int i) { return Timestamp::fromSeconds(1.0 + i * kPeriod_s); };
  for (int i = 0; i < 5; ++i) {
    std::vector<cv::Mat> images;
    for (const RigCamera& camera : true_rig.cameras) {
      images.push_back(scene.render(kCamera, kSize, poseOfRow(camera, i * kPeriod_s)));
    }
    refinement.addFrame(stampOf(i), images, vehicleAt(i * kPeriod_s), {kRates});
  }
  const RigidTransform motion = vehicleAt(4 * kPeriod_s);
  const MotionRefinement::Result result = refinement.refine(stampOf(0), stampOf(4), motion);
  EXPECT_TRUE(result.is_refined);
  return result.neighbour_from_reference.rotation().angularDistance(motion.rotation());
}

TEST(ExposureTest, LinesDoNotLookLikeAMotionOfTheVehicle) {
  const CameraRig global = rigOfTwo(0.0), rolling = rigOfTwo(0.05);
  double at_once = 0.0, told = 0.0, not_told = 0.0;
  for (const uint32_t seed : {1, 2, 3}) {
    const AnalyticScene scene = lotScene(seed);
    at_once += rotationFound(scene, global, global);
    told += rotationFound(scene, rolling, rolling);
    not_told += rotationFound(scene, rolling, global);
  }
  RecordProperty("rotation_rad",
                 std::to_string(at_once) + " " + std::to_string(told) + " " + std::to_string(not_told));
  // Most of it is the same for a line in both images.
  EXPECT_LT(told, 1.3 * at_once);
  EXPECT_LT(told, not_told);
}

}  // namespace
}  // namespace vcharge
